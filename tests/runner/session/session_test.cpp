// The session as a state machine, with a scripted respondent on a fake device.

#include "runner/session/session.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <filesystem>
#include <limits>
#include <set>

#include "protocols/parse.h"
#include "runner/session/run_record.h"
#include "tests/runner/fake_device.h"

namespace palpate::runner {
namespace {

using testing::FakeDevice;

constexpr const char* kTwoShapes = R"({"version": 1, "name": "two", "renderers": ["point"],
  "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1},
              {"name": "box", "shape": "cube", "edge_m": 0.04}],
  "repetitions": 2, "blocks_per_renderer": 2,
  "practice": {"repetitions": 1, "criterion": 1.0, "max_rounds": 3},
  "breaks": {"every_trials": 3, "min_seconds": 20},
  "texts": {"instructions": "hello", "practice": "try", "break": "rest", "end": "bye"},
  "response": {"keys": {"1": "ball", "2": "box"}, "time_out_s": 2}})";

/// Answers after 0.3 s, right or wrong as told; -1: never.
class Scripted final : public Respondent {
 public:
  explicit Scripted(std::deque<int> right) : right_(std::move(right)) {}
  void read(const std::string& text) override { pages += text + ";"; }
  void feedback(bool correct) override { pages += correct ? "right;" : "wrong;"; }
  void begin_trial(const protocols::Trial& trial) override {
    right_now_ = right_.empty() ? 1 : right_.front();
    if (!right_.empty()) right_.pop_front();
    answer_ = right_now_ == 1 ? trial.stimulus : 1 - trial.stimulus;
  }
  std::optional<Answer> step(const Sample& sample) override {
    if (right_now_ < 0 || sample.phase != Phase::feeling || sample.tick < 300) return std::nullopt;
    return Answer{answer_, sample.time_ns};
  }
  std::string pages;

 private:
  std::deque<int> right_;
  int right_now_ = 1, answer_ = 0;
};

class MemoryLog final : public TrialLog {
 public:
  int begin(const data::TrialRecord& planned, std::int64_t) override {
    began.push_back(planned.trial);
    return 1;
  }
  void finish(const data::TrialRecord& record) override { finished.push_back(record); }
  void cut_off(const std::string& reason) override { cut.push_back(reason); }
  std::vector<int> began;
  std::vector<data::TrialRecord> finished;
  std::vector<std::string> cut;
};

struct Bench {
  protocols::Protocol protocol = protocols::parse_protocol_text(kTwoShapes, "two.json");
  StimulusLibrary library{protocol};
  FakeDevice device{[](int) { return DeviceReading{{{0, 0, 0.1}, {0, 0, 0.22}}, 0, false}; }};
  VirtualClock clock;
  Servo servo{device, clock, protocol.servo_rate, ForceLimits{}};
  MemoryLog log;

  Session session(Respondent& respondent, SessionPlan plan) {
    return session(respondent, std::move(plan), servo);
  }
  Session session(Respondent& respondent, SessionPlan plan, TickSource& another_servo) {
    return {{protocol, library, std::move(plan), another_servo, clock, {0, 0}, log}, respondent};
  }
};

void run(Session& session) {
  while (session.state() != Session::State::end) session.step();
}

TEST(Session, GoesThroughPracticeBlocksBreaksAndEnd) {
  Bench bench;
  Scripted respondent({});
  Session session = bench.session(respondent, SessionPlan(bench.protocol, 1, 1));
  run(session);
  // Practice of 2, then blocks of 2: pages at the beginning of each, rest after every third trial.
  EXPECT_EQ(respondent.pages, "hello;try;right;right;rest;rest;rest;bye;");
  ASSERT_EQ(bench.log.finished.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    const data::TrialRecord& record = bench.log.finished[i];
    EXPECT_EQ(record.trial, static_cast<int>(i) + 1);
    EXPECT_EQ(record.practice, i < 2);
    EXPECT_TRUE(record.correct);
    EXPECT_EQ(record.response, record.shape);
    EXPECT_DOUBLE_EQ(record.response_time, 0.3);
    EXPECT_EQ(record.onset_utc.substr(0, 11), "1970-01-01T");
  }
  EXPECT_GE(bench.log.finished[3].onset_ns - bench.log.finished[2].response_ns, 20'000'000'000);
}

TEST(Session, TimeOutIsWrongWithTheLimitAsItsTime) {
  Bench bench;
  Scripted respondent({1, 1, -1});
  Session session = bench.session(respondent, SessionPlan(bench.protocol, 1, 1));
  run(session);
  const data::TrialRecord& record = bench.log.finished[2];
  EXPECT_TRUE(record.timed_out);
  EXPECT_FALSE(record.correct);
  EXPECT_EQ(record.response, "");
  EXPECT_EQ(record.response_time, 2);
}

/// A servo whose trials end with a verdict of their own.
class Judging final : public TickSource {
 public:
  explicit Judging(Servo& servo) : servo_(servo) {}
  void prepare(const rendering::Scene& scene, const rendering::Renderer& renderer,
               const HomeZone& home) override {
    servo_.prepare(scene, renderer, home);
  }
  const Sample& next() noexcept override { return servo_.next(); }
  ServoQuality stop() noexcept override {
    servo_.stop();
    return verdict;
  }
  ServoQuality verdict;

 private:
  Servo& servo_;
};

TEST(Session, WhatTheServoSaysOfATrialIsOnItsRecord) {
  for (const std::uint32_t faults :
       {rendering::render_fault::kStartedInside, rendering::render_fault::kWalkCapped, 0u}) {
    Bench bench;
    Judging servo(bench.servo);
    servo.verdict.ticks = 411;
    servo.verdict.missed_ticks = 7;
    servo.verdict.longest_period_ns = 1'234'567;
    servo.verdict.max_force = 3.5;
    servo.verdict.faults = faults;
    Scripted respondent({});
    Session session = bench.session(respondent, SessionPlan(bench.protocol, 1, 1), servo);
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

/// Ticks of which no two numbers are alike; contact from the fifth on.
class Numbered final : public TickSource {
 public:
  void prepare(const rendering::Scene&, const rendering::Renderer&, const HomeZone&) override {
    tick_ = -3;
  }
  const Sample& next() noexcept override {
    double number = 0.001 * ++tick_;
    const auto vector = [&number] {
      const Vec3 v(number + 0.1, number + 0.2, number + 0.3);
      number += 1;
      return v;
    };
    sample_ = {};
    sample_.phase = tick_ < 0 ? Phase::homing : Phase::feeling;
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
    sample_.faults = tick_ == 7 ? servo_fault::kForceLimited : 0;
    if (tick_ >= 0) shown.push_back(sample_);
    return sample_;
  }
  ServoQuality stop() noexcept override { return {}; }
  std::vector<Sample> shown;

 private:
  int tick_ = 0;
  std::int64_t time_ns_ = 5'000'000'000;
  Sample sample_;
};

TEST(Session, ATrialKeepsEverySampleAndWhatItBeganWith) {
  Bench bench;
  bench.protocol.samples = true;
  Numbered servo;
  Scripted respondent({});
  Session session = bench.session(respondent, SessionPlan(bench.protocol, 1, 1), servo);
  while (bench.log.finished.empty()) session.step();
  const data::TrialRecord& record = bench.log.finished[0];
  ASSERT_EQ(record.samples.size(), 301u);  // answered at tick 300
  ASSERT_EQ(servo.shown.size(), 301u);
  const auto same = [](const std::array<double, 3>& kept, const Vec3& shown) {
    return Vec3(kept[0], kept[1], kept[2]) == shown;
  };
  for (std::size_t i = 0; i < record.samples.size(); ++i) {
    const data::SampleRecord& kept = record.samples[i];
    const Sample& shown = servo.shown[i];
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
  const Sample& first = servo.shown[0];
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

// What passes by itself is the machine's lateness alone; stylus, device and whoever asked for zero
// force need somebody who looks.
TEST(SessionFault, IsTransientWhereOnlyTheMachineWasLate) {
  using namespace servo_fault;
  const auto transient = [](std::uint32_t faults, DeviceTrouble trouble = DeviceTrouble::none) {
    return SessionFault("", "", faults | kTripped, trouble).is_transient();
  };
  EXPECT_TRUE(transient(kMissedTicks));
  EXPECT_TRUE(transient(kStalled));
  EXPECT_FALSE(transient(0));
  EXPECT_FALSE(transient(kEmergency));
  EXPECT_FALSE(transient(kEmergency | kMissedTicks));
  EXPECT_FALSE(transient(rendering::render_fault::kNonFinite));
  EXPECT_FALSE(transient(rendering::render_fault::kNonFinite | kStalled));
  for (const DeviceTrouble trouble :
       {DeviceTrouble::unplugged, DeviceTrouble::silent, DeviceTrouble::not_homed,
        DeviceTrouble::implausible, DeviceTrouble::apart, DeviceTrouble::guard_lost}) {
    EXPECT_FALSE(transient(kDeviceLost, trouble));
    EXPECT_FALSE(transient(kDeviceLost | kMissedTicks, trouble));
  }
  EXPECT_TRUE(transient(kDeviceLost, DeviceTrouble::guard_late));
  EXPECT_TRUE(transient(kDeviceLost, DeviceTrouble::guarded));
}

TEST(SessionFault, TheReasonIsTheWorstAndSaysWhatToDo) {
  using namespace servo_fault;
  const auto reason = [](std::uint32_t faults, DeviceTrouble trouble = DeviceTrouble::none) {
    return trip_reason(faults | kTripped, trouble);
  };
  const std::uint32_t non_finite = rendering::render_fault::kNonFinite;
  EXPECT_EQ(reason(kEmergency | kDeviceLost | kMissedTicks, DeviceTrouble::silent),
            reason(kEmergency));
  EXPECT_EQ(reason(kStalled | kMissedTicks), reason(kStalled));
  EXPECT_EQ(reason(kDeviceLost | kMissedTicks | non_finite, DeviceTrouble::silent),
            reason(kDeviceLost, DeviceTrouble::silent));
  std::set<std::string> all;
  for (const std::uint32_t bit : {kEmergency, kStalled, kDeviceLost, kMissedTicks, non_finite, 0u})
    all.insert(reason(bit));
  EXPECT_EQ(all.size(), 6u) << "each has its own words";
  for (const DeviceTrouble trouble : {DeviceTrouble::unplugged, DeviceTrouble::guard_late,
                                      DeviceTrouble::guarded, DeviceTrouble::apart}) {
    EXPECT_NE(reason(kDeviceLost, trouble).find(advice(trouble)), std::string::npos);
  }
  // Where the guard was late the device is not lost: its advice says it all.
  EXPECT_EQ(reason(kDeviceLost, DeviceTrouble::guard_late), advice(DeviceTrouble::guard_late));
  EXPECT_NE(reason(kDeviceLost, DeviceTrouble::unplugged), advice(DeviceTrouble::unplugged));
}

TEST(Session, PracticeIsRepeatedUntilTheCriterionOrTheLastRound) {
  const struct {
    std::deque<int> right;
    std::size_t trials;
  } cases[] = {{{}, 6}, {{0}, 8}, {{0, 1, 1, 0}, 10}, {{0, 0, 0, 0, 0, 0}, 10}};
  for (const auto& [right, trials] : cases) {
    Bench bench;
    Scripted respondent(right);
    Session session = bench.session(respondent, SessionPlan(bench.protocol, 1, 1));
    run(session);
    ASSERT_EQ(bench.log.finished.size(), trials);
    for (std::size_t i = 0; i < trials; ++i) {
      EXPECT_EQ(bench.log.finished[i].trial, static_cast<int>(i) + 1);
      EXPECT_EQ(bench.log.finished[i].practice, i + 4 < trials);
    }
  }
}

TEST(Session, ResumesAtTheFirstTrialWithoutARecordWhereverItStopped) {
  const std::deque<int> script = {0, 1, 1, 1, 0, -1, 1, 0};
  Bench whole;
  Scripted respondent(script);
  Session session = whole.session(respondent, SessionPlan(whole.protocol, 1, 1));
  run(session);
  const auto& expected = whole.log.finished;
  for (std::size_t stop = 0; stop <= expected.size(); ++stop) {
    Bench bench;
    SessionPlan plan(bench.protocol, 1, 1);
    for (std::size_t i = 0; i < stop; ++i) plan.answered(expected[i].correct);
    Scripted rest({script.begin() + static_cast<std::ptrdiff_t>(std::min(stop, script.size())),
                   script.end()});
    Session resumed = bench.session(rest, plan);
    run(resumed);
    ASSERT_EQ(bench.log.finished.size(), expected.size() - stop);
    for (std::size_t i = stop; i < expected.size(); ++i) {
      const data::TrialRecord& record = bench.log.finished[i - stop];
      EXPECT_EQ(record.trial, expected[i].trial);
      EXPECT_EQ(record.shape, expected[i].shape);
      EXPECT_EQ(record.orientation_wxyz, expected[i].orientation_wxyz);
    }
  }
}

TEST(Session, AFaultCutsTheTrialOffWithZeroForce) {
  Bench bench;
  FakeDevice failing([](int tick) {
    const double z = tick == 700 ? std::numeric_limits<double>::quiet_NaN() : 0.1;
    return DeviceReading{{{0, 0, z}, {0, 0, 0.22}}, 0, false};
  });
  Servo servo(failing, bench.clock, 1000, ForceLimits{});
  Scripted respondent({-1});
  Session session = bench.session(respondent, SessionPlan(bench.protocol, 1, 1), servo);
  EXPECT_THROW(run(session), SessionFault);
  EXPECT_EQ(failing.force, Vec3(0));
  EXPECT_EQ(bench.log.began.size(), 1u);
  EXPECT_TRUE(bench.log.finished.empty());
  ASSERT_EQ(bench.log.cut.size(), 1u);
  EXPECT_NE(bench.log.cut[0].find("not finite"), std::string::npos);
}

// The way of a live session into the store: begun on disk, cut off by a fault, shown again.
TEST(Session, ACutOffTrialIsShownAgainAndBothAttemptsAreOnRecord) {
  std::string pattern = ::testing::TempDir() + "session-XXXXXX";
  const std::filesystem::path folder = mkdtemp(pattern.data());
  {
    Bench bench;
    const protocols::Protocol& protocol = bench.protocol;
    data::Store store = data::Store::open(folder / "live.db", data::Store::Mode::write_or_create);
    const data::Participant participant = store.enrol(info_of(protocol), "P01");
    data::RunInfo info;
    info.program_version = "0.0.0";
    info.device = "fake";
    FakeDevice failing([](int tick) {
      return DeviceReading{{{0, 0, 0.1}, {0, 0, 0.22}}, 0, tick == 2000};  // in the third trial
    });
    Servo servo(failing, bench.clock, 1000, ForceLimits{});
    RunRecord log(store, info_of(protocol), participant, info);
    Scripted respondent({});
    Session session({protocol,
                     bench.library,
                     SessionPlan(protocol, participant.number, 1),
                     servo,
                     bench.clock,
                     {0, 0},
                     log},
                    respondent);
    EXPECT_THROW(run(session), SessionFault);
    EXPECT_EQ(failing.force, Vec3(0));
    log.end(data::RunEnd::aborted, bench.clock.now_ns());

    const data::SessionProgress before = store.progress(participant, 1);
    EXPECT_EQ(before.completed.size(), 2u);
    EXPECT_EQ(before.cut_off, 1);
    SessionPlan plan(protocol, participant.number, 1);
    for (const data::TrialRecord& record : before.completed) plan.answered(record.correct);
    RunRecord again(store, info_of(protocol), participant, info);
    Session resumed({protocol, bench.library, plan, bench.servo, bench.clock, {0, 0}, again},
                    respondent);
    run(resumed);
    again.end(data::RunEnd::done, bench.clock.now_ns());
    const data::SessionProgress after = store.progress(participant, 1);
    ASSERT_EQ(after.completed.size(), 6u);
    for (const data::TrialRecord& record : after.completed) {
      EXPECT_EQ(record.attempt, record.trial == 3 ? 2 : 1);
    }
  }
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace palpate::runner
