// palpate: a psychophysics experiment runner for touch. The table of its commands.
// From here to a force in a live session:
//
//   commands/run/run.cpp          opens the station (session/station.h): record, device, displays
//   session/live_session.cpp      the experimenter's commands, pauses and faults around the trials
//   session/session.cpp           the trial loop, the same for simulated participants
//   servo/servo_thread.cpp        the thread of the servo loop
//   servo/servo.cpp               one tick: read the device, render, limit, command
//   rendering/renderer.cpp        point or ray; rendering/tick.h, rendering/facet_walk.cpp

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <system_error>
#include <vector>

#include "data/base/text.h"
#include "data/store/store.h"
#include "protocols/parse.h"
#include "runner/commands/shared/command.h"
#include "stimuli/convex_mesh.h"

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace {

struct Command {
  const char* name;
  const char* summary;
  int (*run)(const std::vector<std::string>&);
};

constexpr Command kCommands[] = {
    {"accuracy", "error of the renderers against run time; which tessellation to choose",
     palpate::runner::commands::accuracy_command},
    {"analyze", "per-shape speed-ups with inference, from a database or a CSV file",
     palpate::runner::commands::analyze_command},
    {"bench", "run time of the renderers' ticks on this machine",
     palpate::runner::commands::bench_command},
    {"bundle", "data, registration, check and analysis as one folder to deposit",
     palpate::runner::commands::bundle_command},
    {"check", "whether a study was run as it was registered",
     palpate::runner::commands::check_command},
    {"cluster", "a sweep, a study or a plan as one array job on Slurm",
     palpate::runner::commands::cluster_command},
    {"design", "a page to write, look at and rehearse a protocol",
     palpate::runner::commands::design_command},
    {"devices", "connected devices and their limits; timing of this machine; calibration",
     palpate::runner::commands::devices_command},
    {"explore", "a window to touch a scene; pictures of it",
     palpate::runner::commands::explore_command},
    {"export", "a database's trials as CSV, BIDS or Psych-DS",
     palpate::runner::commands::export_command},
    {"forget", "remove a participant who has withdrawn", palpate::runner::commands::forget_command},
    {"merge", "merge the databases of several stations", palpate::runner::commands::merge_command},
    {"plan", "how many participants and trials find a wanted effect",
     palpate::runner::commands::plan_command},
    {"register", "a registration of a study before its first session",
     palpate::runner::commands::register_command},
    {"render", "forces along a recorded path, offline", palpate::runner::commands::render_command},
    {"replay", "render a stored trial again", palpate::runner::commands::replay_command},
    {"run", "a live session with a person and a device", palpate::runner::commands::run_command},
    {"schedule", "the order of trials that a participant will get",
     palpate::runner::commands::schedule_command},
    {"serve", "a safe haptic server for other programs", palpate::runner::commands::serve_command},
    {"simulate", "the whole study with simulated participants",
     palpate::runner::commands::simulate_command},
    {"stability", "at what stiffness a loop of hand, device and renderer buzzes",
     palpate::runner::commands::stability_command},
    {"sweep", "simulated studies over a space of settings",
     palpate::runner::commands::sweep_command},
    {"unmask", "tell the groups of a study whose groups are masked",
     palpate::runner::commands::unmask_command},
    {"validate", "check a protocol and list all its faults",
     palpate::runner::commands::validate_command},
    {"watch", "a page that shows a stored trial", palpate::runner::commands::watch_command},
};

void print_help(std::ostream& out) {
  out << "palpate " PALPATE_VERSION
         ": a psychophysics experiment runner for touch\n\n"
         "Usage: palpate COMMAND [OPTIONS]\n\nCommands:\n";
  for (const auto& command : kCommands) {
    std::string name = command.name;
    name.resize(12, ' ');
    out << "  " << name << command.summary << "\n";
  }
  out << "\n'palpate COMMAND --help' or 'palpate help COMMAND' shows a command's options with "
         "examples;\n'palpate --version' the version.\nExit status: 0 done, 1 failed while "
         "running, 2 wrong usage or bad input.\n";
}

/// If standard input, output or error is closed, the next file to be opened would get its
/// descriptor, and messages would be written into it.
void occupy_standard_descriptors() {
  int descriptor = 0;
  while (descriptor >= 0 && descriptor <= STDERR_FILENO) descriptor = ::open("/dev/null", O_RDONLY);
  if (descriptor > STDERR_FILENO) ::close(descriptor);
}

/// \throws UsageError: there is none.
const Command& command_named(const std::string& name) {
  std::vector<std::string> names;
  for (const Command& command : kCommands) {
    if (name == command.name) return command;
    names.emplace_back(command.name);
  }
  constexpr std::size_t kLongest = 40;  // of what may be a misspelt command
  const std::string meant = name.size() > kLongest ? "" : palpate::nearest_word(name, names);
  throw palpate::runner::UsageError("no command '" + name + "'; " +
                                    (meant.empty() ? "" : "did you mean '" + meant + "'? ") +
                                    "'palpate --help' lists them");
}

int run(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.empty()) {
    print_help(std::cerr);
    return 2;
  }
  if (words[0] == "--version") {
    std::cout << "palpate " PALPATE_VERSION "\n";
    return 0;
  }
  if (words.size() == 1 && (words[0] == "--help" || words[0] == "-h" || words[0] == "help")) {
    print_help(std::cout);
    return 0;
  }
  const bool asks_for_help = words[0] == "help" || words[0] == "--help" || words[0] == "-h";
  if (asks_for_help) return command_named(words[1]).run({"--help"});
  return command_named(words[0]).run({words.begin() + 1, words.end()});
}

}  // namespace

int main(int argc, char** argv) {
#if defined(__GLIBC__)
  // Large arrays go back to the system when they are freed: glibc otherwise learns to keep them.
  mallopt(M_MMAP_THRESHOLD, 4 << 20);
  // Small pieces stay: a fit that frees and asks for 128 kB at a time would otherwise call the
  // system each time.
  mallopt(M_TRIM_THRESHOLD, 16 << 20);
#endif
  ::umask(0077);  // all that is written is the user's alone, folders as well
  occupy_standard_descriptors();
  // Beyond a limit on the size of files, writing fails with EFBIG instead of ending the program.
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    const int status = run(argc, argv);
    std::cout.flush();
    if (!std::cout)
      throw std::runtime_error("standard output could not be written (disk full or pipe closed)");
    return status;
  } catch (const palpate::runner::UsageError& error) {
    std::cerr << "palpate: " << palpate::printable_lines(error.what()) << "\n";
    return 2;
  } catch (const palpate::protocols::InputError& error) {
    std::cerr << palpate::printable_lines(error.what()) << "\n";
    return 2;
  } catch (const palpate::stimuli::MeshError& error) {
    std::cerr << palpate::printable_lines(error.what()) << "\n";
    return 2;
  } catch (const palpate::data::StoreRefused& error) {
    std::cerr << "palpate: " << palpate::printable_lines(error.what()) << "\n";
    return 2;
  } catch (const std::bad_alloc&) {
    std::cerr << "palpate: out of memory: this command needs more than the machine or its limit "
                 "gives. Close other programs, raise the limit (ulimit -v, or --mem of a batch "
                 "system), or give it fewer --jobs or less data\n";
    return 1;
  } catch (const std::system_error& error) {
    std::cerr << "palpate: " << palpate::printable_lines(error.what());
    if (error.code() == std::errc::resource_unavailable_try_again)
      std::cerr << ": a thread could not be started; raise the limit on memory or processes "
                   "(ulimit -v, ulimit -u), or give fewer --jobs";
    std::cerr << "\n";
    return 1;
  } catch (const std::exception& error) {
    std::cerr << "palpate: " << palpate::printable_lines(error.what()) << "\n";
    return 1;
  }
}
