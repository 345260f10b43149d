#include "runner/commands/run/resumption.h"

#include <chrono>
#include <cstdint>
#include <ctime>
#include <optional>
#include <string_view>

#include "data/files/utc.h"
#include "runner/commands/shared/command.h"

namespace palpate::runner {
namespace {

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

/// The newest that `wanted` is true of.
template <class Wanted>
std::optional<data::StoredRun> newest_run(data::Store& store, Wanted wanted) {
  std::optional<data::StoredRun> newest;
  for (const data::StoredRun& run : store.runs()) {
    if (wanted(run) && (!newest || run.info.clock.utc_ns >= newest->info.clock.utc_ns))
      newest = run;
  }
  return newest;
}

/// As choose_session, but for withdrawals.
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

/// \throws UsageError: the participant has withdrawn, and nobody said that this is known.
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

}  // namespace

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
                       const SessionPlan& plan) {
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

void throw_withdrawn(const std::string& code, const std::string& when) {
  throw UsageError(
      "participant " + code + " has withdrawn" + (when.empty() ? "" : " (" + when + ")") +
      " and is not started again: add --after-withdrawal where the participant asks to "
      "take part again; 'palpate forget' removes what is on record");
}

void refuse_withdrawn(data::Store& store, const std::string& code) {
  const std::string when = withdrawn_when(store, code);
  if (!when.empty()) throw_withdrawn(code, when);
}

int choose_session(data::Store& store, const data::Participant& participant,
                   const protocols::Protocol& protocol, const RunSettings& settings) {
  const int session = session_due(store, participant, protocol, settings);
  check_withdrawal(store, participant, session, settings);
  return session;
}

}  // namespace palpate::runner
