#include "runner/station/admission.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "data/base/text.h"
#include "data/base/words.h"
#include "data/files/utc.h"
#include "data/record.h"
#include "data/store/store.h"
#include "protocols/difference.h"
#include "protocols/groups.h"
#include "protocols/parse.h"
#include "runner/build_info.h"
#include "runner/session/device_check.h"
#include "runner/session/run_record.h"
#include "runner/station/group_choice.h"
#include "runner/station/protocol_choice.h"
#include "runner/station/run_settings.h"
#include "runner/terminal.h"
#include "runner/usage_error.h"

namespace palpate::runner::station {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Removes easily misread differences: case, O and 0, I and l and 1, leading zeros of a number.
std::string read_alike(const std::string& code) {
  std::string all;
  for (const char c : lower_case(code)) {
    all += c == 'o' ? '0' : c == 'i' || c == 'l' ? '1' : c;
  }
  std::string out;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool number_begins = out.empty() || !is_digit(out.back());
    const bool more = i + 1 < all.size() && is_digit(all[i + 1]);
    if (all[i] != '0' || !number_begins || !more) out += all[i];
  }
  return out;
}

struct CodeParts {
  std::string letters, digits;
};

CodeParts parts_of(const std::string& code) {
  CodeParts parts;
  for (const char c : lower_case(code)) (is_digit(c) ? parts.digits : parts.letters) += c;
  return parts;
}

bool one_left_out(const std::string& longer, const std::string& shorter) {
  if (longer.size() != shorter.size() + 1) return false;
  const auto [at, same] = std::mismatch(shorter.begin(), shorter.end(), longer.begin());
  return std::equal(at, shorter.end(), same + 1);
}

bool one_changed_or_two_swapped(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  const auto [x, y] = std::mismatch(a.begin(), a.end(), b.begin());
  if (x == a.end()) return false;
  if (std::equal(x + 1, a.end(), y + 1)) return true;
  return x + 1 != a.end() && x[0] == y[1] && x[1] == y[0] && std::equal(x + 2, a.end(), y + 2);
}

bool a_letter_away(const std::string& a, const std::string& b) {
  // Short codes may differ by one letter on purpose: A1 and B1, initials of three letters.
  constexpr std::size_t kTelling = 4;
  const CodeParts x = parts_of(a), y = parts_of(b);
  if (x.digits != y.digits) return false;
  const std::size_t letters = std::max(x.letters.size(), y.letters.size());
  if ((!x.digits.empty() || letters >= kTelling) &&
      (one_left_out(x.letters, y.letters) || one_left_out(y.letters, x.letters))) {
    return true;
  }
  return letters >= kTelling && one_changed_or_two_swapped(x.letters, y.letters);
}

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::string_view kEndNote = "ended: ";  // of the run, with the reason, at that moment

std::int64_t utc_now() {
  return std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

/// s of an ISO 8601 time in UTC, in ns.
std::int64_t utc_of(const std::string& iso) {
  std::tm time{};
  strptime(iso.c_str(), "%Y-%m-%dT%H:%M:%S", &time);
  return timegm(&time) * kSecond_ns;
}

std::tm local(std::int64_t utc_ns) {
  const std::time_t seconds = utc_ns / kSecond_ns;
  std::tm out{};
  localtime_r(&seconds, &out);
  return out;
}

std::string in_format(const std::tm& time, const char* format) {
  char text[40] = "";
  std::strftime(text, sizeof text, format, &time);
  return text;
}

/// The newest run that `wanted` accepts.
template <class Wanted>
std::optional<data::StoredRun> newest_run(data::Store& store, Wanted wanted) {
  std::optional<data::StoredRun> newest;
  for (const data::StoredRun& run : store.runs()) {
    if (wanted(run) && (!newest || run.info.clock.utc_ns >= newest->info.clock.utc_ns))
      newest = run;
  }
  return newest;
}

/// Like choose_session, but ignores withdrawals.
int session_due(data::Store& store, const data::Participant& participant,
                const protocols::Protocol& protocol, const RunSettings& settings) {
  const int count = protocol.sessions.count;
  if (settings.session && *settings.session > count)
    throw UsageError("--session: the protocol has " + std::to_string(count));
  int session = 1;
  data::SessionProgress before;
  for (; session <= count; ++session) {
    const data::SessionProgress progress = store.progress(participant, session);
    if (progress.last_end != data::RunEnd::done) break;
    before = progress;
  }
  if (settings.session) {
    if (*settings.session > session)
      std::fprintf(stderr, "session %d is not finished; session %d was asked for\n", session,
                   *settings.session);
    return *settings.session;
  }
  if (session > count)
    throw UsageError("participant " + participant.code + " has completed every session");
  const std::string day = data::format_utc(before.clock.utc_ns).substr(0, 10);
  if (session > 1 && day == data::format_utc(utc_now()).substr(0, 10))
    std::fprintf(stderr, "session %d was also today\n", session - 1);
  return session;
}

/// \param when  in words; empty: not stated
[[noreturn]] void throw_withdrawn(const std::string& code, const std::string& when) {
  throw UsageError("participant " + code + " has withdrawn" +
                   (when.empty() ? "" : " (" + when + ")") +
                   " and cannot resume. If the participant asks to take part again, add "
                   "--after-withdrawal; 'palpate forget' removes the data on record");
}

/// \throws UsageError: the participant has withdrawn, and no option acknowledges it.
void check_withdrawal(data::Store& store, const data::Participant& participant, int session,
                      const RunSettings& settings) {
  const std::string& code = participant.code;
  const std::string when = withdrawn_when(store, code);
  const bool here = store.progress(participant, session).last_end == data::RunEnd::withdrawn;
  if (!here && when.empty()) {
    if (settings.after_withdrawal)
      throw UsageError("--after-withdrawal: participant " + code +
                       " has not withdrawn; leave the option out");
  } else if (!settings.after_withdrawal) {
    throw_withdrawn(code, when);
  }
}

namespace fs = std::filesystem;

/// The facts that the database holds.
struct Known {
  std::vector<std::string> codes;          ///< in the order they came
  bool enrolled = false;                   ///< the code, in this protocol
  bool unmasked = false;                   ///< masked groups have their names
  std::optional<EarlierProtocol> earlier;  ///< of the code, where it is not enrolled in this one
  std::vector<std::string> others;  ///< differences from protocols of the same name, in words
  std::optional<int> number;        ///< for a new participant, if texts changed
  std::optional<std::int64_t> newest_ns;
  GroupFacts groups;
  std::map<std::string, int> numbers;  ///< of the code, by the protocol's SHA-256
};

/// Other texts, the same trials: one counterbalancing, so its numbers continue.
void count_on(data::Store& store, const protocols::Protocol& protocol, const RunSettings& settings,
              Known& known) {
  std::set<int> taken;
  for (const data::ProtocolInfo& info : store.protocols()) {
    if (info.name != protocol.name) continue;
    const bool same = info.sha256 == protocol.sha256;
    const protocols::ProtocolDifference differs =
        protocols::difference(info.text, protocol.source_text);
    const std::vector<data::Participant> people = store.participants(info.sha256);
    if (!same && !people.empty()) known.others.push_back(protocols::in_words(differs));
    if (!differs.only_texts()) continue;
    for (const data::Participant& one : people) {
      taken.insert(one.number);
      if (settings.number == one.number && !same)
        throw UsageError("--number: " + std::to_string(one.number) + " is taken by participant " +
                         one.code + ", with other texts of the same protocol");
    }
  }
  if (known.others.empty()) return;
  int next = 1;
  while (taken.contains(next)) ++next;
  known.number = settings.number.value_or(next);
}

/// Whether every session of the participant is done.
bool has_completed(data::Store& store, const protocols::Protocol& protocol,
                   const data::Participant& one) {
  const int sessions = protocols::protocol_of(protocol, one.enrolled_number).sessions.count;
  for (int session = 1; session <= sessions; ++session) {
    if (store.progress(one, session).last_end != data::RunEnd::done) return false;
  }
  return true;
}

GroupFacts facts_of_groups(data::Store& store, const protocols::Protocol& protocol) {
  GroupFacts facts;
  facts.completed.resize(protocol.groups.names.size());
  for (const data::ProtocolInfo& info : store.protocols()) {
    if (info.name != protocol.name ||
        !protocols::difference(info.text, protocol.source_text).only_texts())
      continue;
    for (const data::Participant& one : store.participants(info.sha256)) {
      facts.taken.insert(one.number);
      if (has_completed(store, protocol, one))
        ++facts.completed[protocol.groups.group(one.enrolled_number)];
    }
  }
  return facts;
}

/// Refuses a code whose newest run, in any protocol, ended with a withdrawal. \throws UsageError
void refuse_withdrawn(data::Store& store, const std::string& code) {
  const std::string when = withdrawn_when(store, code);
  if (!when.empty()) throw_withdrawn(code, when);
}

/// Reads the database briefly: it is closed again before a question is asked or a guard is forked.
Known look_into(const RunSettings& settings, const protocols::Protocol& protocol,
                const std::string& code) {
  Known known;
  std::error_code error;
  if (!fs::exists(settings.database, error)) return known;
  data::Store store = data::Store::open(settings.database, data::Store::Mode::write_or_create);
  if (!settings.after_withdrawal) refuse_withdrawn(store, code);
  known.codes = store.codes();
  for (const data::Participant& one : store.participants(protocol.sha256))
    known.enrolled = known.enrolled || one.code == code;
  known.newest_ns = store.latest_recorded_time();
  if (protocol.groups.any()) known.groups = facts_of_groups(store, protocol);
  known.unmasked = !store.unmaskings().empty();
  for (const data::ProtocolInfo& info : store.protocols()) {
    for (const data::Participant& one : store.participants(info.sha256)) {
      if (one.code == code) known.numbers[info.sha256] = one.enrolled_number;
    }
  }
  if (known.enrolled) return known;
  known.earlier = earlier_protocol(store, protocol, code);
  if (known.earlier) return known;
  count_on(store, protocol, settings, known);
  // Report an impossible code or number before asking any question.
  store.look_up(session::info_of(protocol), code, known.number ? known.number : settings.number);
  return known;
}

/// The last codes, so that a participant can recognise their own.
std::string latest(const std::vector<std::string>& codes) {
  constexpr std::size_t kShown = 5;
  const std::size_t shown = std::min(kShown, codes.size());
  const std::vector<std::string> last(codes.end() - static_cast<std::ptrdiff_t>(shown),
                                      codes.end());
  const std::string all = codes.size() > shown ? std::to_string(codes.size()) + ", the last: " : "";
  return all + join_names(last);
}

void confirm_new(const RunSettings& settings, const std::string& code,
                 const std::vector<std::string>& codes) {
  const std::vector<std::string> near = near_codes(code, codes);
  const std::string alike = join_names(near) + (near.size() == 1 ? " is" : " are");
  if (settings.new_participant) return;
  if (!on_a_terminal()) {
    if (!near.empty()) {
      throw UsageError("--participant " + code + ": is not in " + settings.database + ", but " +
                       alike + " there: correct the code, or add --new-participant if " + code +
                       " is a new participant");
    }
    say(code + " is new in " + settings.database);
    return;
  }
  std::string question = codes.empty() ? settings.database + " holds no participants yet.\n"
                                       : settings.database + " does not hold " + code +
                                             ", but others (" + latest(codes) + ").\n";
  if (!near.empty()) question += alike + " there: a typing error?\n";
  const auto answer = ask(printable_lines(question) + "Is " + code + " a new participant? [y/N] ");
  if (answer != "y" && answer != "Y" && answer != "yes")
    throw UsageError(
        "no participant was enrolled, no session was started; the same command asks again");
}

void confirm_participant(const RunSettings& settings, const std::string& code, const Known& known) {
  if (known.enrolled || known.earlier) {
    if (!settings.new_participant) return;
    throw UsageError("--new-participant: " + code + " is in " + settings.database +
                     " already; leave the option out to resume " + code +
                     ", or give the new participant another code");
  }
  if (std::find(known.codes.begin(), known.codes.end(), code) == known.codes.end()) {
    confirm_new(settings, code, known.codes);
  } else {
    say(code + " is known from another protocol in " + settings.database);
  }
  for (const std::string& difference : known.others)
    say("others were enrolled with another text of this protocol (" + difference + ")" +
        (known.number ? "; if only texts differ, participant numbers continue" : ""));
}

std::optional<std::int64_t> written_ns(const std::string& file) {
  std::error_code error;
  const fs::file_time_type time = fs::last_write_time(file, error);
  if (error) return std::nullopt;
  return std::chrono::file_clock::to_sys(time).time_since_epoch() / std::chrono::nanoseconds(1);
}

void check_clock(const RunSettings& settings, const Known& known, Admission& admission) {
  session::ClockEvidence evidence;
  evidence.now_ns =
      std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
  evidence.newest_record_ns = known.newest_ns;
  evidence.newest_file_ns = std::max(written_ns(settings.protocol), written_ns("/proc/self/exe"));
  const std::string doubt = session::clock_warning(evidence);
  if (doubt.empty()) return;
  say("CLOCK: " + doubt);
  admission.warnings.push_back("CLOCK: " + doubt);
  admission.notes.push_back(nlohmann::json{{"clock_warning", doubt}}.dump());
}

/// Gives a new participant a number of the group, and admits to the group's own protocol.
void join_group(const RunSettings& settings, const Known& known, Admission& admission) {
  admission.shown = session::info_of(admission.protocol);
  GroupFacts facts = known.groups;
  if (known.unmasked) admission.protocol.groups = admission.protocol.groups.unmasked();
  const GroupAssignment& groups = admission.protocol.groups;
  facts.completed.resize(groups.names.size());
  if (const auto number = known.numbers.find(admission.enrolled.sha256);
      number != known.numbers.end())
    facts.enrolled = number->second;
  if (const std::optional<int> number = number_in_group(settings, admission.protocol, facts))
    admission.number = number;
  if (!groups.any()) return;
  if (!admission.number && !facts.enrolled) {
    int next = 1;
    while (facts.taken.contains(next)) ++next;
    admission.number = next;
  }
  const int number = facts.enrolled ? *facts.enrolled : *admission.number;
  if (settings.fill && !facts.enrolled) {
    nlohmann::ordered_json completed;
    for (std::size_t i = 0; i < groups.names.size(); ++i)
      completed[groups.names[i]] = facts.completed[i];
    admission.notes.push_back(nlohmann::ordered_json{
        {"group_filled", {{"group", groups.name(number)}, {"completed", completed}}}}
                                  .dump());
  }
  say("group " + groups.name(number));
  admission.group = groups.group(number);
  admission.of_all = std::move(admission.protocol);
  admission.protocol = protocols::protocol_of(admission.of_all, number);
}

std::string ask_new_code() {
  const auto code = ask("The new code: ");
  if (!code || !data::is_participant_code(*code))
    throw UsageError("the code must be a pseudonym of 1 to 32 letters and digits");
  return *code;
}

}  // namespace

std::vector<std::string> near_codes(const std::string& code,
                                    const std::vector<std::string>& known) {
  std::vector<std::string> near;
  for (const std::string& other : known) {
    if (other == code) continue;
    if (read_alike(other) == read_alike(code) || a_letter_away(other, code)) near.push_back(other);
  }
  return near;
}

std::string spoken_time(std::int64_t utc_ns, std::int64_t now_utc_ns) {
  const std::tm then = local(utc_ns), today = local(now_utc_ns);
  std::tm before = today;  // the day, whatever the hour and however long a day is
  before.tm_mday -= 1;
  before.tm_hour = 12;
  before.tm_isdst = -1;
  std::mktime(&before);
  const std::string day = in_format(then, "%Y-%m-%d"), clock = in_format(then, " %H:%M");
  if (day == in_format(today, "%Y-%m-%d")) return "today" + clock;
  if (day == in_format(before, "%Y-%m-%d")) return "yesterday" + clock;
  return day + clock;
}

std::string resumption(data::Store& store, const data::Participant& participant, int session,
                       const protocols::SessionPlan& plan) {
  const std::optional<data::StoredRun> last = newest_run(store, [&](const data::StoredRun& run) {
    return run.participant.id == participant.id && run.info.session == session;
  });
  if (participant.id == 0 || !last) return "";
  std::string text = std::to_string(plan.done()) + " of " + std::to_string(plan.size()) +
                     " trials done, last run " + spoken_time(last->info.clock.utc_ns, utc_now()) +
                     " (" + data::to_string(last->end) + ")";
  if (!plan.finished()) text += ", continues with trial " + std::to_string(plan.next().trial);
  return text;
}

std::string withdrawn_when(data::Store& store, const std::string& code) {
  const std::optional<data::StoredRun> last = newest_run(
      store, [&code](const data::StoredRun& run) { return run.participant.code == code; });
  if (!last || last->end != data::RunEnd::withdrawn) return "";
  std::int64_t when_ns = last->info.clock.utc_ns;
  for (const data::StoredNote& note : store.notes()) {
    const bool of_that_run =
        note.participant.code == code && note.run_clock.utc_ns == last->info.clock.utc_ns;
    if (of_that_run && note.text.starts_with(kEndNote)) when_ns = utc_of(note.utc);
  }
  return spoken_time(when_ns, utc_now());
}

int choose_session(data::Store& store, const data::Participant& participant,
                   const protocols::Protocol& protocol, const RunSettings& settings) {
  const int session = session_due(store, participant, protocol, settings);
  check_withdrawal(store, participant, session, settings);
  return session;
}

data::ClockStamp stamp_now(servo::Clock& clock) {
  const std::int64_t before = clock.now_ns();
  const std::int64_t utc =
      std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
  return {utc, before + (clock.now_ns() - before) / 2};
}

data::RunInfo run_info(const RunSettings& settings, const servo::DeviceCapabilities& device,
                       int session, const data::ClockStamp& began, bool joystick) {
  data::RunInfo info;
  info.session = session;
  info.clock = began;
  info.program_version = PALPATE_VERSION;
  info.build = build_description();
  info.device = settings.device;
  info.device_calibration = device.calibration;
  if (!device.serial.empty()) info.device_calibration += " (serial " + device.serial + ")";
  info.response_device = settings.spoken    ? "spoken, typed by the experimenter"
                         : settings.buttons ? "device buttons"
                                            : "keyboard";
  if (!settings.response_box.empty()) info.response_device += ", serial response box";
  if (joystick) info.response_device += ", joystick";
  info.response_latency = settings.response_latency;
  info.consent_version = settings.consent;
  if (!settings.consent.empty()) info.consent_utc_ns = began.utc_ns;
  info.hand = settings.hand;
  info.after_withdrawal = settings.after_withdrawal;
  return info;
}

std::optional<data::ProtocolInfo> other_texts(const Admission& admission) {
  if (admission.shown.sha256 == admission.enrolled.sha256) return std::nullopt;
  return admission.shown;
}

Admission admit(const RunSettings& settings) {
  Admission admission;
  admission.protocol = protocols::parse_protocol(settings.protocol);
  admission.participant = settings.participant;
  admission.number = settings.number;
  Known known = look_into(settings, admission.protocol, admission.participant);
  check_clock(settings, known, admission);
  confirm_participant(settings, admission.participant, known);
  while (known.earlier) {
    const ChangedProtocol changed{*known.earlier, admission.protocol, settings.protocol,
                                  admission.participant, settings.changed_protocol};
    const ProtocolChoice choice = choose_protocol(changed);
    admission.notes.push_back(to_json_text(changed, choice));
    if (choice != ProtocolChoice::new_code) {
      protocols::StoredFiles files;
      for (const data::ProtocolFile& file : known.earlier->info.files)
        files.emplace(file.name, file.bytes);
      protocols::Protocol stored =
          protocols::parse_protocol_text(known.earlier->info.text, settings.protocol, files);
      admission.enrolled = session::info_of(stored);
      if (choice == ProtocolChoice::stored) admission.protocol = std::move(stored);
      join_group(settings, known, admission);
      return admission;
    }
    admission.participant = ask_new_code();
    known = look_into(settings, admission.protocol, admission.participant);
    confirm_participant(settings, admission.participant, known);
  }
  if (known.number) admission.number = known.number;
  admission.enrolled = session::info_of(admission.protocol);
  join_group(settings, known, admission);
  return admission;
}

}  // namespace palpate::runner::station
