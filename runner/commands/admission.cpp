#include "runner/commands/admission.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "data/store.h"
#include "runner/clock_check.h"
#include "runner/commands/ask.h"
#include "runner/commands/command.h"
#include "runner/commands/run_parts.h"
#include "runner/near_codes.h"
#include "stimuli/printable.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

/// What the database holds already.
struct Known {
  std::vector<std::string> codes;  ///< in the order they came
  bool enrolled = false;           ///< the code, in this protocol
  std::optional<std::int64_t> newest_ns;
};

/// In a moment: nothing is held open while somebody thinks about a question, or a guard is forked.
Known look_into(const RunSettings& settings, const Protocol& protocol) {
  Known known;
  std::error_code error;
  if (!fs::exists(settings.database, error)) return known;
  Store store = Store::open(settings.database, Store::Mode::write_or_create);
  known.codes = store.codes();
  for (const Participant& one : store.participants(protocol.sha256))
    known.enrolled = known.enrolled || one.code == settings.participant;
  known.newest_ns = store.newest_record();
  // Whether the code and the number can be given is said before anything is asked.
  if (!known.enrolled) store.look_up(info_of(protocol), settings.participant, settings.number);
  return known;
}

/// The last ones, to recognise one's own among them.
std::string latest(const std::vector<std::string>& codes) {
  constexpr std::size_t kShown = 5;
  const std::size_t shown = std::min(kShown, codes.size());
  const std::vector<std::string> last(codes.end() - static_cast<std::ptrdiff_t>(shown),
                                      codes.end());
  const std::string all = codes.size() > shown ? std::to_string(codes.size()) + ", the last: " : "";
  return all + in_words(last);
}

void confirm_new(const RunSettings& settings, const std::vector<std::string>& codes) {
  const std::string& code = settings.participant;
  const std::vector<std::string> near = near_codes(code, codes);
  const std::string alike = in_words(near) + (near.size() == 1 ? " is" : " are");
  if (settings.new_participant) return;
  if (!on_a_terminal()) {
    if (!near.empty()) {
      throw UsageError("--participant " + code + ": is not in " + settings.database + ", but " +
                       alike + " there: give the code that was meant, or add --new-participant " +
                       "if " + code + " is somebody new");
    }
    std::fprintf(stderr, "%s is new in %s\n", code.c_str(), printable(settings.database).c_str());
    return;
  }
  std::string question = codes.empty() ? settings.database + " holds no participants yet.\n"
                                       : settings.database + " does not hold " + code +
                                             ", but others (" + latest(codes) + ").\n";
  if (!near.empty()) question += alike + " there: a slip of the hand?\n";
  const auto answer = ask(printable_lines(question) + "Is " + code + " a new participant? [y/N] ");
  if (answer != "y" && answer != "Y" && answer != "yes")
    throw UsageError("nobody was enrolled, nothing was begun; the same command asks again");
}

void confirm_participant(const RunSettings& settings, const Known& known) {
  const std::string& code = settings.participant;
  if (known.enrolled) {
    if (!settings.new_participant) return;
    throw UsageError("--new-participant: " + code + " is in " + settings.database +
                     " already; leave the option out to go on with " + code +
                     ", or give the new participant another code");
  }
  if (std::find(known.codes.begin(), known.codes.end(), code) == known.codes.end()) {
    confirm_new(settings, known.codes);
  } else {
    std::fprintf(stderr, "%s is known from another protocol in %s\n", code.c_str(),
                 printable(settings.database).c_str());
  }
}

std::optional<std::int64_t> written_ns(const std::string& file) {
  std::error_code error;
  const fs::file_time_type time = fs::last_write_time(file, error);
  if (error) return std::nullopt;
  return std::chrono::file_clock::to_sys(time).time_since_epoch() / std::chrono::nanoseconds(1);
}

void check_clock(const RunSettings& settings, const Known& known, Admission& admission) {
  ClockEvidence evidence;
  evidence.now_ns =
      std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
  evidence.newest_record_ns = known.newest_ns;
  evidence.newest_file_ns = std::max(written_ns(settings.protocol), written_ns("/proc/self/exe"));
  const std::string doubt = clock_doubt(evidence);
  if (doubt.empty()) return;
  std::fprintf(stderr, "CLOCK: %s\n", doubt.c_str());
  admission.warnings.push_back("CLOCK: " + doubt);
  admission.notes.push_back(nlohmann::json{{"clock_warning", doubt}}.dump());
}

}  // namespace

Admission admit(const RunSettings& settings, const Protocol& protocol) {
  Admission admission;
  const Known known = look_into(settings, protocol);
  check_clock(settings, known, admission);
  confirm_participant(settings, known);
  return admission;
}

}  // namespace palpate
