#pragma once
// A session of two shapes on a fake device, with a scripted respondent.

#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "protocols/parse.h"
#include "runner/session/session.h"
#include "tests/runner/fake_device.h"

namespace palpate::runner::session {

inline constexpr const char* kTwoShapes = R"({"version": 1, "name": "two", "renderers": ["point"],
  "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1},
              {"name": "box", "shape": "cube", "edge_m": 0.04}],
  "repetitions": 2, "blocks_per_renderer": 2,
  "practice": {"repetitions": 1, "criterion": 1.0, "max_rounds": 3},
  "breaks": {"every_trials": 3, "min_seconds": 20},
  "texts": {"instructions": "hello", "practice": "try", "break": "rest", "end": "bye"},
  "response": {"keys": {"1": "ball", "2": "box"}, "time_out_s": 2}})";

/// Answers after 0.3 s, right or wrong as set; -1: never.
class ScriptedRespondent final : public participants::Respondent {
 public:
  explicit ScriptedRespondent(std::deque<int> right) : right_(std::move(right)) {}
  void read(const std::string& text) override { pages += text + ";"; }
  void feedback(bool correct) override { pages += correct ? "right;" : "wrong;"; }
  void begin_trial(const protocols::Trial& trial) override {
    right_now_ = right_.empty() ? 1 : right_.front();
    if (!right_.empty()) right_.pop_front();
    answer_ = right_now_ == 1 ? trial.stimulus : 1 - trial.stimulus;
  }
  std::optional<participants::Answer> step(const servo::Sample& sample) override {
    if (right_now_ < 0 || sample.phase != servo::Phase::feeling || sample.tick < 300)
      return std::nullopt;
    return participants::Answer{answer_, sample.time_ns};
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

struct SessionBench {
  protocols::Protocol protocol = protocols::parse_protocol_text(kTwoShapes, "two.json");
  StimulusLibrary library{protocol};
  runner::testing::FakeDevice device{[](int) {
    return servo::DeviceReading{{{0, 0, 0.1}, {0, 0, 0.22}}, 0, false};
  }};
  servo::VirtualClock clock;
  servo::Servo servo{device, clock, protocol.servo_rate, servo::ForceLimits{}};
  MemoryLog log;

  Session session(participants::Respondent& respondent, protocols::SessionPlan plan) {
    return session(respondent, std::move(plan), servo);
  }
  Session session(participants::Respondent& respondent, protocols::SessionPlan plan,
                  servo::TickSource& another_servo) {
    return {{protocol, library, std::move(plan), another_servo, clock, {0, 0}, log}, respondent};
  }
};

inline void run(Session& session) {
  while (session.state() != Session::State::end) session.step();
}

}  // namespace palpate::runner::session
