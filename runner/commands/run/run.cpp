#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "data/base/checksum.h"
#include "data/base/text.h"
#include "data/store/store.h"
#include "data/store/task_text.h"
#include "protocols/event_codes.h"
#include "protocols/session_plan.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/texts.h"
#include "runner/commands/run/settings.h"
#include "runner/commands/shared/command.h"
#include "runner/participants/keyboard.h"
#include "runner/participants/response_box.h"
#include "runner/safety/fault_signals.h"
#include "runner/session/device_check.h"
#include "runner/session/live_session.h"
#include "runner/session/markers.h"
#include "runner/session/preflight.h"
#include "runner/session/recorded_outcome.h"
#include "runner/session/sample_stream.h"
#include "runner/session/socket_advisor.h"
#include "runner/session/station.h"
#include "runner/station/admission.h"
#include "runner/station/lag_check.h"
#include "runner/station/opening.h"

// `palpate run`: a live session with a person and a device. Opens the station, runs the session in
// a thread of its own beside the display's loop, and reports. The path to a force continues in
// live_session.cpp, session.cpp (the trial loop), servo_thread.cpp, servo.cpp (the tick),
// rendering.

namespace palpate::runner::commands {
namespace {

/// \param simulated  whether the device is simulated
void print_participant(const data::Participant& participant, int session, int sessions,
                       bool simulated) {
  std::printf("participant %s has number %d; session %d of %d\n", participant.code.c_str(),
              participant.number, session, sessions);
  std::fflush(stdout);
  if (participant.enrolled_number != participant.number)
    std::fprintf(stderr,
                 "renumbered when databases were merged: the trials are those of number %d\n",
                 participant.enrolled_number);
  if (participant.id == 0)
    std::fprintf(stderr,
                 "the participant is enrolled, and the number taken, with the first answer, note "
                 "or trial\n");
  if (simulated) std::fprintf(stderr, "SIMULATED device: the data are labelled so\n");
}

/// \param elapsed  s, since the servo thread began
void print_servo_health(const servo::ServoHealth& health, double elapsed) {
  std::fprintf(stderr,
               "servo: %llu ticks in %.3f s, %llu missed, longest period %.2f ms, lateness p99.9 "
               "%.0f us\n",
               static_cast<unsigned long long>(health.ticks()), elapsed,
               static_cast<unsigned long long>(health.missed_ticks()),
               static_cast<double>(health.longest_period_ns()) * 1e-6,
               static_cast<double>(health.lateness().quantile(0.999)) * 1e-3);
}

/// \param who  as stored now
void print_outcome(const session::LiveStation& station, const data::Participant& who,
                   const session::LiveSession::Outcome& outcome) {
  const std::string number = who.id == 0 ? "not enrolled" : "number " + std::to_string(who.number);
  std::printf("%s, participant %s (%s), session %d: %zu of %zu trials on record; %s\n",
              station.protocol.name.c_str(), who.code.c_str(), number.c_str(),
              station.record.session(), outcome.recorded, outcome.trials,
              data::to_string(outcome.end));
  if (!outcome.reason.empty())
    std::fprintf(stderr, "%s\n", printable_lines(outcome.reason).c_str());
  if (outcome.end == data::RunEnd::paused || outcome.end == data::RunEnd::aborted)
    std::fprintf(stderr, "the same command resumes from here\n");
}

/// Facts known before the session, for its record or the console.
struct Beforehand {
  const station::RunSettings& settings;
  const station::Admission& admission;
  const std::vector<session::LimitedMaterial>& limited;
  const data::SessionProgress& progress;  ///< what is on record of this session
  std::int64_t servo_began_ns;            ///< session clock
  std::vector<std::string> news;          ///< shown first on the console
};

/// While it lives, signals turn these forces off.
template <class Forces>
class ZeroOnSignal {
 public:
  ZeroOnSignal(safety::FaultSignals& signals, Forces* forces) : signals_(signals) {
    signals_.watch(forces);
  }
  ZeroOnSignal(const ZeroOnSignal&) = delete;
  ZeroOnSignal& operator=(const ZeroOnSignal&) = delete;
  ~ZeroOnSignal() { signals_.watch(static_cast<Forces*>(nullptr)); }

 private:
  safety::FaultSignals& signals_;
};

servo::ForceLimits limits_of(const servo::ServoSettings& settings,
                             const servo::DeviceCapabilities& device) {
  servo::ForceLimits limits = settings.limits;
  limits.max_force = std::min(limits.max_force, device.max_force);
  return limits;
}

/// Ends before the first trial. Begins a run only for a withdrawal.
session::LiveSession::Outcome end_before_trials(const session::LiveStation& station,
                                                const session::EndOfSession& end) {
  session::RunRecord& record = station.record;
  session::LiveSession::Outcome outcome{end.end, end.what(), station.plan.done(),
                                        station.plan.size(), end.failed};
  if (end.end == data::RunEnd::withdrawn) record.begin();
  const std::int64_t now = station.clock.now_ns();
  if (record.begun()) record.note(now, "ended: " + outcome.reason);
  record.end(end.end, now);
  return outcome;
}

/// Puts the known facts onto the console and into the record, before the first trial.
void tell(session::LiveSession& session, const session::LiveStation& station,
          const Beforehand& known, const session::PreflightResult& preflight) {
  const std::int64_t began_ns = station.utc.monotonic_ns;
  session::RunRecord& record = station.record;
  if (known.settings.after_withdrawal) record.note(began_ns, "begun again after a withdrawal");
  for (const data::TrialRecord& trial : known.progress.completed) session.count(trial);
  for (const std::string& warning : known.admission.warnings) session.say(warning);
  for (const std::string& note : known.admission.notes) record.note(began_ns, note);
  for (const std::string& message : preflight.messages) session.say(message);  // it shows on
  if (station.guard != nullptr) {
    std::string text = "pre-flight: ";
    for (const std::string& finding : preflight.findings) text += finding + "; ";
    const bool calibrated = !known.settings.without_calibration;
    record.note(began_ns, text + (calibrated ? "calibration stored" : "WITHOUT calibration"));
  }
  if (!known.limited.empty())
    record.note(began_ns,
                session::to_json_text(known.limited, station.device, station.protocol.servo_rate));
  const auto& renderers = station.protocol.renderers;
  const bool side_contact = std::any_of(renderers.begin(), renderers.end(), [](auto kind) {
    return renderer_for(kind).side_contact();
  });
  if (side_contact && session::torque_is_left_out(station.device)) {
    session.say("torque is left out: this device drives force alone");
    record.note(began_ns, data::kTorqueLeftOutNote);
  }
  if ((station.protocol.sounds || station::has_contact_sound(station.protocol)) &&
      station.sound == nullptr)
    session.say("WITHOUT the protocol's sounds");
  if (station.protocol.masking_noise && station.sound == nullptr)
    session.say("WITHOUT the protocol's masking noise");
  for (const std::string& note :
       station::notes_on_outlets(known.settings, station.protocol, station.sound))
    record.note(began_ns, note);
  const std::string& missing = station.servo_thread.rights().missing;
  if (!missing.empty()) session.say(missing);
}

/// The windows must stand before anything is felt.
void wait_for_windows(const session::LiveStation& station) {
  constexpr std::int64_t kNap_ns = 4'000'000;
  while (!station.screen.settled() && station.screen.open() && station.end_requested() == 0)
    station.clock.wait_until(station.clock.now_ns() + kNap_ns);
}

/// Runs the pre-flight, then the unrecorded trials, in the session's own thread.
/// \throws as LiveSession::run
session::LiveSession::Outcome run_session(const session::LiveStation& station,
                                          const Beforehand& known) {
  wait_for_windows(station);
  std::vector<std::string> news = known.news;
  if (const std::string misplaced = station.screen.misplaced(); !misplaced.empty())
    news.push_back("WARNING: " + misplaced);
  session::PreflightResult preflight;
  try {
    preflight = session::run_preflight(station, news);
  } catch (const session::EndOfSession& end) {
    return end_before_trials(station, end);
  }
  if (station.record.participant().id != 0) station.record.begin();  // takes no number
  session::LiveSession session(station);
  tell(session, station, known, preflight);
  return session.run();
}

/// Runs the session in its own thread and the display's loop in this one, until both have ended. On
/// an exception from either: zero force first.
session::LiveSession::Outcome run_beside_display(const session::LiveStation& station,
                                                 const Beforehand& known,
                                                 display::DisplayLoop& display,
                                                 const std::function<void()>& emergency) {
  session::LiveSession::Outcome outcome;
  std::exception_ptr failure, display_failure;
  std::jthread session_thread([&] {
    try {
      outcome = run_session(station, known);
    } catch (...) {
      emergency();
      failure = std::current_exception();
    }
    display.end();
  });
  try {
    display.run();
  } catch (...) {  // the session ends by itself: its display is gone
    emergency();
    display_failure = std::current_exception();
  }
  session_thread.join();
  const std::int64_t elapsed_ns = station.clock.now_ns() - known.servo_began_ns;
  print_servo_health(station.servo_thread.health(), static_cast<double>(elapsed_ns) * 1e-9);
  if (failure) std::rethrow_exception(failure);
  if (display_failure) std::rethrow_exception(display_failure);
  return outcome;
}

/// The most important messages for the experimenter.
std::vector<std::string> news(const std::string& resumed, const display::DisplayLoop& display,
                              const std::vector<session::LimitedMaterial>& limited) {
  std::vector<std::string> out;
  if (!resumed.empty()) out.push_back(resumed);
  const std::string unreadable = display.unreadable();
  if (!unreadable.empty()) out.push_back("WARNING: " + unreadable);
  for (const session::LimitedMaterial& one : limited) out.push_back(one.text);
  return out;
}

participants::AnswerBy answer_by(const station::RunSettings& settings) {
  if (settings.spoken) return participants::AnswerBy::experimenter;
  return settings.buttons ? participants::AnswerBy::buttons : participants::AnswerBy::keys;
}

bool asks_for_consent(const protocols::Protocol& protocol) {
  return std::any_of(protocol.pages.begin(), protocol.pages.end(), [](const auto& page) {
    return page.kind == protocols::PageSpec::Kind::consent;
  });
}

/// \throws UsageError: a text display cannot show what the participant is to see
void require_sight(const station::RunSettings& settings, const protocols::Protocol& protocol) {
  if (!settings.no_window) return;
  std::string seen;
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli) {
    if (stimulus.seen && stimulus.seen->anything())
      seen += (seen.empty() ? "'" : ", '") + printable(stimulus.name) + "'";
  }
  if (!seen.empty())
    throw UsageError("--no-window: the participant would not see " + seen +
                     ", as the protocol has it");
}

bool has_joystick(const station::RunSettings& settings, const protocols::Protocol& protocol) {
  return !protocol.responses.joystick.empty() && !settings.no_window;
}

/// Replaces the texts by a translation; the shown texts are recorded whole.
void translate_texts(const station::RunSettings& settings, station::Admission& admission) {
  protocols::Protocol& protocol = admission.protocol;
  if (has_joystick(settings, protocol) != !protocol.responses.joystick.empty())
    admission.warnings.emplace_back("a gamepad or pedal is looked at in a window only");
  if (settings.language.empty()) return;
  if (protocol.groups.any()) {
    // A translation has the texts of all groups.
    const std::size_t group = admission.group;
    protocols::translate(admission.of_all, settings.protocol, settings.language);
    protocol = *admission.of_all.group_protocols[group];
  } else {
    protocols::translate(protocol, settings.protocol, settings.language);
  }
  admission.notes.push_back(nlohmann::ordered_json{
      {"language", settings.language},
      {"texts_sha256", checksum_hex(protocol.translation)},
      {"texts",
       protocol.translation}}.dump());
}

}  // namespace

int run_command(const std::vector<std::string>& args) {
  std::optional<station::RunSettings> given = parse_run_settings(args);
  if (!given) return 0;
  station::RunSettings& settings = *given;
  std::signal(SIGPIPE, SIG_IGN);  // a closed reader must not end a session

  // Who takes part, in which protocol.
  const devices::DeviceKind& kind = station::find_device_kind(settings.device);
  station::Admission admission = station::admit(settings);
  if (protocols::is_external(admission.protocol))
    throw UsageError(
        "this protocol has a block of the task 'external': palpate serve runs it, with the program "
        "that chooses the stimuli");
  if (const protocols::TaskBlock* const asks = protocols::block_that_asks(admission.protocol);
      asks != nullptr && settings.advisor.empty())
    throw UsageError("block '" + asks->name +
                     "' asks a program for its levels: expected --ask SOCKET");
  require_sight(settings, admission.protocol);
  settings.participant = admission.participant;
  protocols::Protocol& protocol = admission.protocol;
  translate_texts(settings, admission);

  // The device behind its watchdog, which is forked before markers and sound start their threads.
  auto marker_sinks = station::open_markers(settings);
  safety::FaultSignals signals;
  const station::OpenDevice open = station::open_device(kind, settings, protocol);
  const ZeroOnSignal guard_on_signal(signals, open.guard);
  session::Markers markers(std::move(marker_sinks), protocols::event_codes(protocol),
                           settings.sync);
  const auto stream = station::open_stream(settings, protocol.servo_rate);
  const servo::DeviceCapabilities& device = open.device->capabilities();
  const std::vector<session::LimitedMaterial> limited = session::limit_materials(protocol, device);
  const StimulusLibrary library(protocol);
  station::check_fitness(open, settings, protocol, library);
  servo::HeardTicks heard(station::kHeardTicks);
  const auto sound = station::open_sound(settings, protocol, heard);

  // The record. Data from a simulated device is labelled simulated, whoever answers.
  data::Store store = data::Store::open(settings.database, data::Store::Mode::write_or_create);
  warn_of_exposure(store.path());
  if (std::string note = station::check_seen_lag(store, protocol); !note.empty())
    admission.notes.push_back(std::move(note));
  if (std::string note = station::check_sound_lag(store, protocol, settings); !note.empty())
    admission.notes.push_back(std::move(note));
  servo::RealClock clock;
  const data::Participant participant =
      store.look_up(admission.enrolled, settings.participant, admission.number, device.simulated);
  const int session = station::choose_session(store, participant, protocol, settings);
  print_participant(participant, session, protocol.sessions.count, device.simulated);
  if (settings.consent.empty() && !asks_for_consent(protocol))
    std::fprintf(stderr, "no consent is recorded (--consent VERSION)\n");

  // The servo loop, without forces until the first trial; the displays, each of which can end them.
  servo::ServoSettings servo_settings = station::servo_settings_of(protocol);
  if (station::has_contact_sound(protocol)) servo_settings.heard = &heard;
  const session::ForceDirectionCheck direction_check(limits_of(servo_settings, device),
                                                     device.actuated_freedom);
  const std::int64_t servo_began_ns = clock.now_ns();
  servo::ServoThread servo(*open.device, clock, servo_settings);
  const ZeroOnSignal servo_on_signal(signals, &servo);
  const auto emergency = [&servo, guard = open.guard] {
    if (guard != nullptr) guard->emergency_zero();
    servo.emergency_zero();
  };
  const auto display =
      station::open_display(settings, protocol, store, clock, *open.device, emergency);
  const auto box = station::open_response_box(settings, protocol, clock, emergency);
  std::optional<participants::ScreenWithBox> box_screen;
  if (box) box_screen.emplace(display->participant(), *box);
  display::ParticipantScreen& screen =
      box_screen ? static_cast<display::ParticipantScreen&>(*box_screen) : display->participant();

  const data::ClockStamp began = station::stamp_now(clock);
  session::RunRecord record(
      store, admission.enrolled, participant,
      station::run_info(settings, device, session, began, has_joystick(settings, protocol)),
      station::other_texts(admission));
  const data::SessionProgress progress = store.progress(participant, session);
  protocols::SessionPlan plan(protocol, participant.enrolled_number, session);
  for (const data::TrialRecord& trial : progress.completed)
    plan.answered(session::outcome_of(trial));
  for (const data::StoredNote& note : store.notes())
    if (note.participant.id == participant.id && note.session == session)
      session::end_as_noted(plan, note.text);
  const std::string resumed = station::resumption(store, participant, session, plan);

  std::optional<session::SocketAdvisor> advisor;
  if (!settings.advisor.empty())
    advisor.emplace(protocol,
                    session::SocketAdvisor::Settings{settings.advisor, settings.advisor_time_out,
                                                     participant.enrolled_number, session, &device},
                    progress.completed);
  std::optional<session::StreamedServo> streamed;
  if (stream) streamed.emplace(servo, *stream);
  servo::TickSource& ticks = streamed ? static_cast<servo::TickSource&>(*streamed) : servo;
  const session::LiveStation station{{protocol, library, plan, ticks, clock, began, record,
                                      advisor ? &*advisor : nullptr, sound.get()},
                                     record,
                                     device,
                                     open.guard,
                                     servo,
                                     open.guard != nullptr ? &direction_check : nullptr,
                                     [&signals] { return signals.end_requested(); },
                                     screen,
                                     display->console(),
                                     answer_by(settings),
                                     markers};
  const Beforehand known{settings, admission,      limited,
                         progress, servo_began_ns, news(resumed, *display, limited)};
  const session::LiveSession::Outcome outcome =
      run_beside_display(station, known, *display, emergency);
  print_outcome(
      station,
      store.look_up(admission.enrolled, participant.code, std::nullopt, participant.simulated),
      outcome);
  station::print_dropped(markers, stream.get());
  return outcome.failed ? 1 : 0;
}

}  // namespace palpate::runner::commands
