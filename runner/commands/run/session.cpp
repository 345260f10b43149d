#include "runner/commands/run/session.h"

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>

#include "data/files/utc.h"
#include "runner/build_info.h"
#include "runner/commands/run/preflight.h"
#include "runner/commands/run/resumption.h"
#include "runner/commands/shared/command.h"

namespace palpate::runner {
namespace {

data::ClockStamp stamp_now(Clock& clock) {
  const std::int64_t before = clock.now_ns();
  const std::int64_t utc =
      std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
  return {utc, before + (clock.now_ns() - before) / 2};
}

data::RunInfo describe(const RunSettings& settings, const DeviceCapabilities& device, int session,
                       const data::ClockStamp& stamp) {
  data::RunInfo info;
  info.session = session;
  info.clock = stamp;
  info.program_version = PALPATE_VERSION;
  info.build = build_description();
  info.device = settings.device;
  info.device_calibration = device.calibration;
  if (!device.serial.empty()) info.device_calibration += " (serial " + device.serial + ")";
  info.response_device = settings.buttons ? "device buttons" : "keyboard";
  info.response_latency = settings.response_latency;
  info.consent_version = settings.consent;
  if (!settings.consent.empty()) info.consent_utc_ns = stamp.utc_ns;
  info.hand = settings.hand;
  info.after_withdrawal = settings.after_withdrawal;
  return info;
}

SessionPlan plan_of(const RunParts& at, const data::SessionProgress& before) {
  SessionPlan plan(at.protocol, at.participant.enrolled_number, at.session);
  for (const data::TrialRecord& record : before.completed) plan.answered(record.correct);
  return plan;
}

/// What the experimenter should know before anything else.
std::vector<std::string> news(const RunParts& at, const SessionPlan& plan) {
  std::vector<std::string> out;
  const std::string resumed = resumption(at.store, at.participant, at.session, plan);
  if (!resumed.empty()) out.push_back(resumed);
  const std::string unreadable = at.display.unreadable();
  if (!unreadable.empty()) out.push_back("WARNING: " + unreadable);
  return out;
}

/// Before the first trial. Only what must not be lost begins a run: that somebody withdrew, and
/// notes on somebody who has a number already.
LiveSession::Outcome ended_early(const RunParts& at, RunRecord& record, const SessionPlan& plan,
                                 const EndOfSession& end) {
  LiveSession::Outcome outcome{end.end, end.what(), plan.done(), plan.size(), end.failed};
  if (end.end == data::RunEnd::withdrawn || (at.participant.id != 0 && !record.waiting().empty()))
    record.begin();
  outcome.unkept = record.waiting();
  const std::int64_t now = at.clock.now_ns();
  if (record.begun()) record.note(now, "ended: " + outcome.reason);
  record.end(end.end, now);
  return outcome;
}

/// As choose_session, but for withdrawals.
int session_due(data::Store& store, const data::Participant& participant,
                const protocols::Protocol& protocol, const RunSettings& settings, Clock& clock) {
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
    throw UsageError("participant " + participant.code + " has done every session");
  const std::string day = data::format_utc(before.clock.utc_ns).substr(0, 10);
  if (session > 1 && day == data::format_utc(stamp_now(clock).utc_ns).substr(0, 10))
    std::fprintf(stderr, "session %d was today as well\n", session - 1);
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

int choose_session(data::Store& store, const data::Participant& participant,
                   const protocols::Protocol& protocol, const RunSettings& settings, Clock& clock) {
  const int session = session_due(store, participant, protocol, settings, clock);
  check_withdrawal(store, participant, session, settings);
  return session;
}

LiveSession::Outcome run_session(const RunParts& at) {
  const data::ClockStamp stamp = stamp_now(at.clock);
  const data::ProtocolInfo shown = info_of(at.protocol);
  const bool other_texts = shown.sha256 != at.admission.enrolled.sha256;
  RunRecord record(at.store, at.admission.enrolled, at.participant,
                   describe(at.settings, at.device, at.session, stamp),
                   other_texts ? std::optional(shown) : std::nullopt);
  const data::SessionProgress before = at.store.progress(at.participant, at.session);
  const SessionPlan plan = plan_of(at, before);
  PreflightRecord preflight;
  try {
    preflight = go_through_preflight(at, record, news(at, plan));
  } catch (const EndOfSession& end) {
    return ended_early(at, record, plan, end);
  }
  if (at.participant.id != 0) record.begin();  // it is no news that takes a number
  if (at.settings.after_withdrawal)
    record.note(stamp.monotonic_ns, "begun again after a withdrawal");
  LiveSession session(
      {at.protocol, at.library, at.servo, at.guard, at.clock, record, at.display.participant(),
       at.display.console(), at.markers, at.settings.buttons ? AnswerBy::buttons : AnswerBy::keys,
       [&at] { return at.signals.end_requested(); }, at.noise},
      stamp, plan);
  for (const data::TrialRecord& trial : before.completed) session.count(trial);
  for (const std::string& warning : at.admission.warnings) session.say(warning);
  for (const std::string& note : at.admission.notes) record.note(stamp.monotonic_ns, note);
  for (const std::string& message : preflight.messages) session.say(message);  // it shows on
  if (at.kind.has_force_feedback) {
    std::string text = "pre-flight: ";
    for (const std::string& finding : preflight.findings) text += finding + "; ";
    record.note(
        stamp.monotonic_ns,
        text + (at.settings.without_calibration ? "WITHOUT calibration" : "calibration stored"));
  }
  if (!at.limited.empty()) {
    record.note(stamp.monotonic_ns, to_json_text(at.limited, at.device, at.protocol.servo_rate));
  }
  if (at.protocol.masking_noise && at.noise == nullptr) {
    session.say("WITHOUT the protocol's masking noise");
    record.note(stamp.monotonic_ns, R"({"masking_noise":"left out"})");
  }
  const std::string& missing = at.servo.rights().missing;
  if (!missing.empty()) session.say(missing);
  return session.run();
}

}  // namespace palpate::runner
