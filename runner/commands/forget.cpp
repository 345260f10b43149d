#include <unistd.h>

#include <filesystem>
#include <iostream>
#include <string>

#include "data/base/text.h"
#include "data/files/utc.h"
#include "data/store/store.h"
#include "runner/commands/shared/command.h"

namespace palpate::runner::commands {
namespace {

namespace po = boost::program_options;

/// \param database  paths of exports are relative to its folder
void list_exports(const data::ParticipantSummary& holdings, const std::string& database,
                  std::ostream& out) {
  if (holdings.exports.empty()) return;
  out << "These exports hold the participant; delete them and their copies, or export again:\n";
  for (const data::ExportRecord& one : holdings.exports) {
    std::error_code error;
    const std::string place = data::export_location(database, one.path);
    const std::string path = place.empty() ? one.path : place;
    out << "  " << printable(path) << " (" << one.format << ", "
        << data::format_utc(one.made_utc_ns)
        << (place.empty() || std::filesystem::exists(path, error) ? ")" : "; no longer there)")
        << "\n";
  }
}

/// The participant's data in the database and its exports.
void print(const data::ParticipantSummary& holdings, const std::string& code,
           const std::string& database) {
  if (holdings.protocols > 0) {
    std::cout << printable(code) << ": " << holdings.sessions << " sessions, " << holdings.trials
              << " trials and " << holdings.cut_off << " attempts that were cut off\n";
  } else {
    std::cout << printable(code) << " has withdrawn before; what may be left is cleared\n";
  }
  list_exports(holdings, database, std::cout);
  if (!holdings.remaining_copies.empty()) {
    std::cout << "These lie beside the database or its exports and hold " << code
              << ", or may; they are not changed: delete them, or give the command for each "
                 "database:\n";
    for (const std::string& path : holdings.remaining_copies) {
      std::cout << "  " << printable(path) << "\n";
    }
  }
  if (holdings.mentions > 0) {
    std::cout << "Notes on other participants that say " << printable(code) << ": "
              << holdings.mentions << "; they are not changed\n";
  }
}

bool confirmed(const std::string& code) {
  std::cerr << "This cannot be undone. Type the code again to remove it, anything else to keep "
               "everything: "
            << std::flush;
  std::string answer;
  std::getline(std::cin, answer);
  return answer == code;
}

/// \return false where a backup could not be deleted
bool remove(data::Store& store, const std::string& code, const std::string& database) {
  const data::Withdrawal done = store.forget(code);
  std::cout << "Removed from " << printable(database) << "\n";
  for (const std::string& backup : done.backups_removed)
    std::cout << "Deleted " << printable(backup) << "\n";
  for (const std::string& backup : done.backups_left) {
    std::cerr << printable(backup) << ": could not be read or deleted; delete it, it may hold "
              << printable(code) << "\n";
  }
  return done.backups_left.empty();
}

}  // namespace

int forget_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage = "palpate forget --db FILE --participant CODE [--yes]";
  line.summary =
      "Withdrawal: removes everything of a participant from a database, from its log and from\n"
      "the backups beside it, and lists the exports that hold the participant. What stays is\n"
      "a salted hash of the code, so that run and merge never add the participant again. If\n"
      "interrupted, the same command finishes the removal. Copies and merged databases need\n"
      "the same command.";
  line.example =
      "  palpate forget --db study.db --participant P07         shows what is stored, and asks\n"
      "  palpate forget --db study.db --participant P07 --yes   does not ask";
  std::string database, code;
  auto add = line.options.add_options();
  add("db", po::value(&database)->required()->value_name("FILE"), "the study's database");
  add("participant", po::value(&code)->required()->value_name("CODE"),
      "who has withdrawn; -: asked for, or read from standard input");
  add("yes", po::bool_switch(), "remove without asking");
  const auto values = line.parse(args);
  if (!values) return 0;
  code = given_or_asked(code, "participant code");
  const bool ask = !(*values)["yes"].as<bool>();
  if (ask && isatty(STDIN_FILENO) != 1) {
    throw UsageError("expected --yes, as there is no terminal to ask on\nUsage: " + line.usage);
  }
  if (!std::filesystem::exists(database)) throw UsageError(database + ": there is no such file");

  data::Store store = data::Store::open(database, data::Store::Mode::write_or_create);
  warn_of_exposure(database);
  const data::ParticipantSummary holdings = store.participant_summary(code);
  if (holdings.protocols == 0 && !holdings.withdrawn_before) {
    throw UsageError(database + ": there is no participant " + code + " here");
  }
  print(holdings, code, database);
  std::cout << std::flush;
  if (ask && holdings.protocols > 0 && !confirmed(code)) {
    std::cerr << "nothing was removed\n";
    return 1;
  }
  return remove(store, code, database) ? 0 : 1;
}

}  // namespace palpate::runner::commands
