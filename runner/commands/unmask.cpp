#include <pwd.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <iostream>
#include <map>
#include <sstream>
#include <string>

#include "data/base/text.h"
#include "data/files/utc.h"
#include "data/store/store.h"
#include "data/stored_protocol.h"
#include "runner/commands/shared/command.h"

namespace palpate::runner::commands {
namespace {

namespace po = boost::program_options;

std::string login_name() {
  const passwd* const user = getpwuid(getuid());
  return user != nullptr ? user->pw_name : "";
}

/// Which letter stood for which group, with the participants of each.
/// \return whether there are masked groups
bool print_names(data::Store& store, std::ostream& out) {
  bool any = false;
  for (const data::ProtocolInfo& protocol : store.protocols()) {
    const GroupAssignment groups = data::read_stored_protocol(protocol.text).groups;
    if (!groups.masked()) continue;
    any = true;
    std::map<std::string, int> participants;
    for (const data::Participant& one : store.participants(protocol.sha256))
      ++participants[groups.name(one.enrolled_number)];
    out << printable(protocol.name) << "\n";
    for (const std::string& mask : groups.listed())
      out << "  " << mask << "  " << groups.true_name(groups.find(mask)) << ", "
          << participants[mask] << (participants[mask] == 1 ? " participant\n" : " participants\n");
  }
  return any;
}

void print_earlier(const std::vector<data::Unmasking>& earlier, std::ostream& out) {
  for (const data::Unmasking& one : earlier)
    out << "unmasked on " << data::format_utc(one.utc_ns) << " by " << printable(one.person)
        << ", when " << one.participants
        << (one.participants == 1 ? " participant had trials\n" : " participants had trials\n");
}

}  // namespace

int unmask_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage = "palpate unmask --db FILE [--by NAME]";
  line.summary =
      "Says which letter stands for which group of a study with masked groups. From then on\n"
      "the session's console, exports and analyses of this database have the names. The date\n"
      "and the name of the person stay in the database, and 'palpate check' reports them.";
  line.example =
      "  palpate unmask --db study.db             by the name of your login\n"
      "  palpate unmask --db study.db --by 'M. Curie'";
  std::string database, person = login_name();
  auto add = line.options.add_options();
  add("db", po::value(&database)->required()->value_name("FILE"), "the study's database");
  add("by", po::value(&person)->value_name("NAME"), "who unmasks; default: the name of your login");
  const auto values = line.parse(args);
  if (!values) return 0;
  if (!std::filesystem::exists(database)) throw UsageError(database + ": there is no such file");

  data::Store store = data::Store::open(database, data::Store::Mode::write_or_create);
  std::ostringstream names;
  if (!print_names(store, names))
    throw UsageError(database + ": no protocol of it has masked groups");
  if (store.unmaskings().empty()) {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    store.unmask(person, PALPATE_VERSION,
                 std::chrono::duration_cast<std::chrono::nanoseconds>(now).count());
  }
  std::cout << names.str();
  print_earlier(store.unmaskings(), std::cout);
  return 0;
}

}  // namespace palpate::runner::commands
