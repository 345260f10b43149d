#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <vector>

#include "data/base/text.h"
#include "data/store/store.h"
#include "runner/commands/shared/command.h"
#include "runner/design/design_page.h"
#include "runner/design/protocol_file.h"
#include "runner/design/rehearsal.h"
#include "runner/serve/loopback.h"
#include "runner/serve/page_server.h"

namespace palpate::runner::commands {
namespace {

namespace po = boost::program_options;

bool has_display() {
  const char *const x = std::getenv("DISPLAY"), *const wayland = std::getenv("WAYLAND_DISPLAY");
  return (x != nullptr && *x != '\0') || (wayland != nullptr && *wayland != '\0');
}

/// Opens a page in the user's browser by a file that leads there: other users of the computer can
/// read a command line, but not this file. Whoever has no browser reads the address on the
/// terminal.
void open_browser(const std::string& address, const design::TemporaryFolder& folder) {
  const std::string path = folder.path() + "/open.html";
  std::ofstream file(path);  // 0600, in a folder of this user
  file << "<!DOCTYPE html><meta charset=\"utf-8\"><title>palpate design</title>\n"
          "<meta http-equiv=\"refresh\" content=\"0; url="
       << address << "\"><a href=\"" << address << "\">palpate design</a>\n";
  file.close();
  const pid_t child = ::fork();
  if (child != 0) return;
  const int nothing = ::open("/dev/null", O_RDWR);
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    ::dup2(nothing, descriptor);
  ::close_range(STDERR_FILENO + 1, ~0U, 0);  // the server's sockets
  ::setsid();
  ::execlp("xdg-open", "xdg-open", path.c_str(), nullptr);
  ::_exit(127);
}

}  // namespace

int design_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage = "palpate design [PROTOCOL.json] [--db FILE] [--port N] [--no-browser]";
  line.summary =
      "A page in the browser of this computer to write, look at and rehearse a protocol: its\n"
      "faults while you type, its stimuli at true scale beside the stylus, the order of each\n"
      "participant, which devices can run it and why not, and a rehearsal with simulated\n"
      "participants. A file that does not exist begins with a template. Only Save writes it,\n"
      "and never over a change that somebody else has made. Ctrl+C ends the server.";
  line.example =
      "  palpate design stiffness.json\n"
      "  palpate design                    the next free study.json here\n"
      "  palpate design stiffness.json --no-browser --port 8123\n"
      "      (on a computer that you reach with: ssh -L 8123:127.0.0.1:8123)";
  line.options.add_options()  //
      ("port", po::value<int>()->default_value(0)->value_name("N"),
       "of 127.0.0.1; 0: one that is free")                        //
      ("no-browser", po::bool_switch(), "only print the address")  //
      ("protocol", po::value<std::string>()->value_name("PROTOCOL.json"),
       "the file; default: the next free study.json here")  //
      ("db", po::value<std::vector<std::string>>()->composing()->value_name("FILE"),
       "a database that may hold data of the study, besides those beside the protocol: the page\n"
       "warns before its protocol becomes another one; can be given several times");
  line.positional.add("protocol", 1);
  const auto values = line.parse(args);
  if (!values) return 0;
  const int port = (*values)["port"].as<int>();
  if (port < 0 || port > 65535) throw UsageError("--port: expected a number from 0 to 65535");

  std::string path = text_of(*values, "protocol");
  if (path.empty()) path = design::free_name("study.json");
  const design::ProtocolFile file(path);
  std::vector<std::string> databases;
  if (values->count("db")) databases = (*values)["db"].as<std::vector<std::string>>();
  for (const std::string& one : databases)
    data::Store::open(one, data::Store::Mode::read_only);  // refuses what is none
  if (::nice(10) < 0) {
    // Only politeness towards a session on this computer is lost.
  }
  const design::TemporaryFolder folder;
  const std::string token = serve::make_token();
  serve::PageServer server(static_cast<std::uint16_t>(port), token, design::kMostMessage);
  design::DesignPage page(file, folder, databases);
  const std::string address = "http://127.0.0.1:" + std::to_string(server.port()) + "/#" + token;
  std::cout << address << std::endl;
  if (!std::cout) throw std::runtime_error("standard output could not be written");
  std::cerr << "palpate design: " << printable(file.path()) << " is at this address until Ctrl+C\n";
  if (!(*values)["no-browser"].as<bool>() && has_display()) open_browser(address, folder);
  server.run({.get = [&page](const std::string& target) { return page.get(target); },
              .post = [&page](const std::string& target,
                              const std::string& body) { return page.post(target, body); },
              .is_slow = design::DesignPage::is_slow});
  return 0;
}

}  // namespace palpate::runner::commands
