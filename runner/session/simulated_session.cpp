#include "runner/session/simulated_session.h"

#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>

#include "runner/build_info.h"
#include "runner/session/session.h"
#include "runner/session/simulated_study.h"

namespace palpate::runner {
namespace {

/// \throws std::invalid_argument
const protocols::Protocol& checked(const protocols::Protocol& protocol,
                                   const StimulusLibrary& library,
                                   const SimulatedSettings& settings) {
  std::string reasons;
  for (const std::string& fault : simulation_faults(protocol, library, settings)) {
    reasons += (reasons.empty() ? "" : "\n") + fault;
  }
  if (!reasons.empty()) throw std::invalid_argument(reasons);
  return protocol;
}

class VisitingLog final : public TrialLog {
 public:
  explicit VisitingLog(std::function<void(const data::TrialRecord&)> visit)
      : visit_(std::move(visit)) {}
  int begin(const data::TrialRecord&, std::int64_t) override { return 1; }
  void finish(const data::TrialRecord& record) override { visit_(record); }
  void cut_off(const std::string& reason) override {
    throw std::runtime_error("a simulated trial was cut off: " + reason);
  }

 private:
  std::function<void(const data::TrialRecord&)> visit_;
};

}  // namespace

SimulatedStudy::SimulatedStudy(const protocols::Protocol& p, const SimulatedSettings& s,
                               std::uint64_t seed_)
    : protocol(p),
      settings(s),
      library(p),
      hypotheses(shapes_of(checked(p, library, s))),
      of_blocks(block_hypotheses(p)),
      seed(seed_) {}

void run_simulated_session(const SimulatedStudy& study, const SimulatedSession& session,
                           TrialLog& log, const std::function<bool()>& halting) {
  const protocols::Protocol& protocol = study.protocol;
  const SimulatedSettings own = individual(study.settings, study.seed, session.participant);
  SimulatedStylus stylus(own.device, own.hand, protocol.stylus.length, protocol.stylus.grip,
                         1 / protocol.servo_rate);
  VirtualClock clock(session.clock_ns);
  Servo servo(stylus, clock, protocol.servo_rate, ForceLimits{}, workspace_of(protocol));
  if (protocol.passivity_controller) servo.control_passivity();
  std::unique_ptr<Respondent> participant;
  if (protocol.version == 2) {
    participant = std::make_unique<TaskParticipant>(own, study.hypotheses, study.of_blocks, stylus,
                                                    protocol, study.seed, session.participant);
  } else {
    participant = std::make_unique<SimulatedParticipant>(own, study.hypotheses, stylus, protocol,
                                                         study.seed, session.participant);
  }
  const Station station{protocol, study.library, session.plan, servo,
                        clock,    session.utc,   log,          session.advisor};
  Session trials(station, *participant);
  // A trial that was shown is recorded, also when it is the last for now.
  while (trials.state() != Session::State::end &&
         (trials.state() == Session::State::response || !halting())) {
    trials.step();
  }
}

data::RunInfo simulated_run(const protocols::Protocol& protocol, const SimulatedSettings& settings,
                            int participant, int session) {
  constexpr std::int64_t kDay_ns = 86'400'000'000'000;
  constexpr std::int64_t kFirstMorning_ns = 946'717'200'000'000'000;  // 2000-01-01T09:00:00Z
  const std::int64_t day =
      (participant - 1) * static_cast<std::int64_t>(protocol.sessions.count) + session - 1;
  data::RunInfo info;
  info.session = session;
  info.clock = {kFirstMorning_ns + day * kDay_ns, 0};
  info.program_version = PALPATE_VERSION;
  info.build = build_description();
  info.device = "simulated";
  info.response_device = "simulated";
  info.response_latency = 0;
  info.observer_sha256 = settings.sha256;
  return info;
}

bool simulate_in_memory(
    const protocols::Protocol& protocol, const SimulatedSettings& settings, int participants,
    std::uint64_t seed, const std::atomic<bool>& stop,
    const std::function<void(int, const data::TrialRecord&, std::uint64_t)>& visit) {
  const SimulatedStudy study(protocol, settings, seed);
  for (int number = 1; number <= participants; ++number) {
    for (int session = 1; session <= protocol.sessions.count; ++session) {
      VisitingLog log([&](const data::TrialRecord& record) {
        const double ticks = *record.contact_share * static_cast<double>(record.ticks);
        visit(number, record, static_cast<std::uint64_t>(std::llround(ticks)));
      });
      run_simulated_session(study,
                            {number, SessionPlan(protocol, number, session), 0,
                             simulated_run(protocol, settings, number, session).clock},
                            log, [&stop] { return stop.load(); });
      if (stop) return false;
    }
  }
  return true;
}

}  // namespace palpate::runner
