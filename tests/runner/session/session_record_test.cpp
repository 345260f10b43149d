// The record of a trial, and the texts of faults.

#include <gtest/gtest.h>

#include <array>
#include <set>
#include <string>

#include "tests/runner/session/session_case.h"

namespace palpate::runner::session {
namespace {

/// A servo whose trials end with given figures.
class Judging final : public servo::TickSource {
 public:
  explicit Judging(servo::Servo& servo) : servo_(servo) {}
  void prepare(const rendering::Scene& scene, const rendering::Renderer& renderer,
               const servo::HomeZone& home) override {
    servo_.prepare(scene, renderer, home);
  }
  const servo::Sample& next() noexcept override { return servo_.next(); }
  servo::ServoQuality stop() noexcept override {
    servo_.stop();
    return verdict;
  }
  servo::ServoQuality verdict;

 private:
  servo::Servo& servo_;
};

TEST(Session, TheServosVerdictIsInTheTrialsRecord) {
  for (const std::uint32_t faults :
       {rendering::render_fault::kStartedInside, rendering::render_fault::kWalkCapped, 0u}) {
    SessionBench bench;
    Judging servo(bench.servo);
    servo.verdict.ticks = 411;
    servo.verdict.missed_ticks = 7;
    servo.verdict.longest_period_ns = 1'234'567;
    servo.verdict.max_force = 3.5;
    servo.verdict.faults = faults;
    ScriptedRespondent respondent({});
    Session session =
        bench.session(respondent, protocols::SessionPlan(bench.protocol, 1, 1), servo);
    run(session);
    for (const data::TrialRecord& record : bench.log.finished) {
      EXPECT_EQ(record.started_inside, faults == rendering::render_fault::kStartedInside);
      EXPECT_EQ(record.faults, faults);
      EXPECT_EQ(record.ticks, 411u);
      EXPECT_EQ(record.missed_ticks, 7u);
      EXPECT_EQ(record.longest_period_ns, 1'234'567);
      EXPECT_EQ(record.max_force, 3.5);
    }
  }
}

/// Ticks with all numbers distinct; contact from the fifth on.
class Numbered final : public servo::TickSource {
 public:
  void prepare(const rendering::Scene&, const rendering::Renderer&,
               const servo::HomeZone&) override {
    tick_ = -3;
  }
  const servo::Sample& next() noexcept override {
    double number = 0.001 * ++tick_;
    const auto vector = [&number] {
      const Vec3 v(number + 0.1, number + 0.2, number + 0.3);
      number += 1;
      return v;
    };
    sample_ = {};
    sample_.phase = tick_ < 0 ? servo::Phase::homing : servo::Phase::feeling;
    sample_.tick = static_cast<std::uint32_t>(std::max(tick_, 0));
    sample_.time_ns = time_ns_ += 1'000'000;
    sample_.period_ns = 1'000'000 + tick_;
    sample_.lateness_ns = 2000 + tick_;
    sample_.compute_ns = 3000 + tick_;
    sample_.probe = {vector(), vector()};
    sample_.rendering.force = vector();
    sample_.rendering.torque = vector();
    sample_.rendering.deepest.depth = vector().x;
    sample_.rendering.deepest.type = rendering::ContactType::segment_edge;
    sample_.rendering.contacts = tick_ < 5 ? 0 : 3;
    sample_.device1 = vector();
    sample_.device2 = vector();
    sample_.buttons = static_cast<std::uint8_t>(tick_ % 4);
    sample_.faults = tick_ == 7 ? servo::servo_fault::kForceLimited : 0;
    if (tick_ >= 0) shown.push_back(sample_);
    return sample_;
  }
  servo::ServoQuality stop() noexcept override { return {}; }
  std::vector<servo::Sample> shown;

 private:
  int tick_ = 0;
  std::int64_t time_ns_ = 5'000'000'000;
  servo::Sample sample_;
};

TEST(Session, ATrialKeepsEverySampleAndItsInitialFacts) {
  SessionBench bench;
  bench.protocol.samples = true;
  Numbered servo;
  ScriptedRespondent respondent({});
  Session session = bench.session(respondent, protocols::SessionPlan(bench.protocol, 1, 1), servo);
  while (bench.log.finished.empty()) session.step();
  const data::TrialRecord& record = bench.log.finished[0];
  ASSERT_EQ(record.samples.size(), 301u);  // answered at tick 300
  ASSERT_EQ(servo.shown.size(), 301u);
  const auto same = [](const std::array<double, 3>& kept, const Vec3& shown) {
    return Vec3(kept[0], kept[1], kept[2]) == shown;
  };
  for (std::size_t i = 0; i < record.samples.size(); ++i) {
    const data::SampleRecord& kept = record.samples[i];
    const servo::Sample& shown = servo.shown[i];
    EXPECT_EQ(kept.tick, shown.tick);
    EXPECT_EQ(kept.period_ns, shown.period_ns);
    EXPECT_EQ(kept.lateness_ns, shown.lateness_ns);
    EXPECT_EQ(kept.compute_ns, shown.compute_ns);
    EXPECT_TRUE(same(kept.tip, shown.probe.tip));
    EXPECT_TRUE(same(kept.tail, shown.probe.tail));
    EXPECT_TRUE(same(kept.force, shown.rendering.force));
    EXPECT_TRUE(same(kept.torque, shown.rendering.torque));
    EXPECT_TRUE(same(kept.device1, shown.device1));
    EXPECT_TRUE(same(kept.device2, shown.device2));
    EXPECT_EQ(kept.depth, shown.rendering.deepest.depth);
    EXPECT_EQ(kept.contacts, shown.rendering.contacts);
    EXPECT_EQ(kept.contact_type, static_cast<std::uint8_t>(shown.rendering.deepest.type));
    EXPECT_EQ(kept.buttons, shown.buttons);
    EXPECT_EQ(kept.faults, shown.faults);
  }
  const servo::Sample& first = servo.shown[0];
  EXPECT_TRUE(same(record.start_tip, first.probe.tip));
  EXPECT_TRUE(same(record.start_tail, first.probe.tail));
  EXPECT_EQ(record.onset_ns, first.time_ns);
  EXPECT_EQ(record.response_ns, servo.shown[300].time_ns);
  EXPECT_DOUBLE_EQ(record.first_contact_time.value_or(-1), 0.005);
  EXPECT_EQ(record.renderer, "point");
  const protocols::Trial trial = protocols::schedule(bench.protocol, 1)[0];
  EXPECT_EQ(record.shape, bench.protocol.stimuli[static_cast<std::size_t>(trial.stimulus)].name);
  const Quat& q = trial.orientation;
  EXPECT_EQ(record.orientation_wxyz, (std::array<double, 4>{q.w, q.x, q.y, q.z}));
}

// Only the machine's lateness passes by itself; faults of stylus or device and requests for zero
// force need the experimenter.
TEST(SessionFault, IsTransientIfOnlyTheMachineWasLate) {
  using namespace servo::servo_fault;
  const auto transient = [](std::uint32_t faults,
                            servo::DeviceTrouble trouble = servo::DeviceTrouble::none) {
    return SessionFault("", "", faults | kTripped, trouble).is_transient();
  };
  EXPECT_TRUE(transient(kMissedTicks));
  EXPECT_TRUE(transient(kStalled));
  EXPECT_FALSE(transient(0));
  EXPECT_FALSE(transient(kEmergency));
  EXPECT_FALSE(transient(kEmergency | kMissedTicks));
  EXPECT_FALSE(transient(rendering::render_fault::kNonFinite));
  EXPECT_FALSE(transient(rendering::render_fault::kNonFinite | kStalled));
  for (const servo::DeviceTrouble trouble :
       {servo::DeviceTrouble::unplugged, servo::DeviceTrouble::silent,
        servo::DeviceTrouble::not_homed, servo::DeviceTrouble::implausible,
        servo::DeviceTrouble::apart, servo::DeviceTrouble::guard_lost}) {
    EXPECT_FALSE(transient(kDeviceLost, trouble));
    EXPECT_FALSE(transient(kDeviceLost | kMissedTicks, trouble));
  }
  EXPECT_TRUE(transient(kDeviceLost, servo::DeviceTrouble::guard_late));
  EXPECT_TRUE(transient(kDeviceLost, servo::DeviceTrouble::guarded));
}

TEST(SessionFault, TheReasonIsTheWorstFaultWithItsRemedy) {
  using namespace servo::servo_fault;
  const auto reason = [](std::uint32_t faults,
                         servo::DeviceTrouble trouble = servo::DeviceTrouble::none) {
    return trip_reason(faults | kTripped, trouble);
  };
  const std::uint32_t non_finite = rendering::render_fault::kNonFinite;
  EXPECT_EQ(reason(kEmergency | kDeviceLost | kMissedTicks, servo::DeviceTrouble::silent),
            reason(kEmergency));
  EXPECT_EQ(reason(kStalled | kMissedTicks), reason(kStalled));
  EXPECT_EQ(reason(kDeviceLost | kMissedTicks | non_finite, servo::DeviceTrouble::silent),
            reason(kDeviceLost, servo::DeviceTrouble::silent));
  std::set<std::string> all;
  for (const std::uint32_t bit : {kEmergency, kStalled, kDeviceLost, kMissedTicks, non_finite,
                                  rendering::render_fault::kSoftStalled, 0u})
    all.insert(reason(bit));
  EXPECT_EQ(all.size(), 7u) << "each has its own words";
  for (const servo::DeviceTrouble trouble :
       {servo::DeviceTrouble::unplugged, servo::DeviceTrouble::guard_late,
        servo::DeviceTrouble::guarded, servo::DeviceTrouble::apart}) {
    EXPECT_NE(reason(kDeviceLost, trouble).find(servo::advice(trouble)), std::string::npos);
  }
  // If the guard was late the device is not lost: its own advice suffices.
  EXPECT_EQ(reason(kDeviceLost, servo::DeviceTrouble::guard_late),
            servo::advice(servo::DeviceTrouble::guard_late));
  EXPECT_NE(reason(kDeviceLost, servo::DeviceTrouble::unplugged),
            servo::advice(servo::DeviceTrouble::unplugged));
}

}  // namespace
}  // namespace palpate::runner::session
