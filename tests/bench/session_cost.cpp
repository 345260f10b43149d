// One trial of a session with or without the samples kept, or with a loop that knows of no samples,
// for callgrind to count the instructions of; feature_cost.py runs them.
//
// Usage: session_cost off|on|least TICKS

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "protocols/parse.h"
#include "runner/evidence/verification/surface_stroke.h"
#include "runner/session/session.h"
#include "tests/bench/unlogged_trial.h"

namespace palpate::bench {
namespace {

std::string protocol_text(bool samples) {
  return std::string(R"({"version": 1, "name": "one", "renderers": ["ray"],
    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.03, "subdivisions": 0},
                {"name": "box", "shape": "cube", "edge_m": 0.04}],
    "repetitions": 1, "response": {"keys": {"1": "ball", "2": "box"}, "time_out_s": 100},
    "samples": )") +
         (samples ? "true" : "false") + "}";
}

/// The renderer along a stroke, without a device.
class Stroke final : public runner::servo::TickSource {
 public:
  Stroke(const rendering::Scene& scene, const rendering::Renderer& renderer, std::uint32_t ticks)
      : poses_(ticks + 1) {
    runner::evidence::SurfaceStroke hand{runner::evidence::SurfaceStrokeSettings{}};
    rendering::RenderState state = scene.initial_state();
    double depth = 0;
    for (rendering::LineProbe& pose : poses_) {
      pose = hand.next(depth);
      depth = renderer.tick(scene, state, pose, 1e-3).deepest.depth;
    }
  }
  void prepare(const rendering::Scene& scene, const rendering::Renderer& renderer,
               const runner::servo::HomeZone&) override {
    scene_ = scene;
    renderer_ = &renderer;
    state_ = scene_->initial_state();
    sample_.phase = runner::servo::Phase::feeling;
  }
  const runner::servo::Sample& next() noexcept override {
    sample_.tick = next_;
    sample_.time_ns += sample_.period_ns = 1'000'000;
    sample_.probe = poses_[next_++];
    sample_.rendering = renderer_->tick(*scene_, state_, sample_.probe, 1e-3);
    return sample_;
  }
  runner::servo::ServoQuality stop() noexcept override { return {}; }

 private:
  std::vector<rendering::LineProbe> poses_;
  std::optional<rendering::Scene> scene_;
  const rendering::Renderer* renderer_ = nullptr;
  rendering::RenderState state_;
  runner::servo::Sample sample_;
  std::uint32_t next_ = 0;
};

/// Answers after so many ticks.
class Patient final : public runner::participants::Respondent {
 public:
  explicit Patient(std::uint32_t ticks) : ticks_(ticks) {}
  void read(const std::string&) override {}
  void feedback(bool) override {}
  void begin_trial(const protocols::Trial&) override {}
  std::optional<runner::participants::Answer> step(const runner::servo::Sample& sample) override {
    if (sample.tick < ticks_) return std::nullopt;
    return runner::participants::Answer{0, sample.time_ns};
  }

 private:
  std::uint32_t ticks_;
};

class NoLog final : public runner::session::TrialLog {
 public:
  int begin(const data::TrialRecord&, std::int64_t) override { return 1; }
  void finish(const data::TrialRecord& record) override { kept = record.samples.size(); }
  void cut_off(const std::string&) override {}
  std::size_t kept = 0;
};

}  // namespace

[[gnu::noinline]] void measured_trial(runner::session::Session& session) { session.step(); }
[[gnu::noinline]] void measured_unlogged_trial(UnloggedTrial& trial) { trial.run(); }

namespace {

std::size_t run(const std::string& which, std::uint32_t ticks) {
  const protocols::Protocol protocol =
      protocols::parse_protocol_text(protocol_text(which == "on"), "one.json");
  const runner::StimulusLibrary library(protocol);
  Patient participant(ticks);
  runner::servo::VirtualClock clock;
  NoLog log;
  protocols::SessionPlan plan(protocol, 1, 1);
  const rendering::Scene scene = library.scene(plan.next());
  Stroke stroke(scene, rendering::ray_renderer(), ticks);
  if (which == "least") {
    stroke.prepare(scene, rendering::ray_renderer(), {});
    const protocols::Trial& next = plan.next();
    UnloggedTrial trial(stroke, participant, library.edges(next.stimulus), next.orientation,
                        std::int64_t{100} * 1'000'000'000);
    measured_unlogged_trial(trial);
    return 0;
  }
  runner::session::Session session({protocol, library, plan, stroke, clock, {0, 0}, log},
                                   participant);
  while (session.state() != runner::session::Session::State::trial) session.step();
  measured_trial(session);
  session.step();
  return log.kept;
}

int main_with(int argc, char** argv) {
  std::uint32_t ticks = 0;
  const bool known =
      argc == 3 && (std::strcmp(argv[1], "off") == 0 || std::strcmp(argv[1], "on") == 0 ||
                    std::strcmp(argv[1], "least") == 0);
  if (!known || std::from_chars(argv[2], argv[2] + std::strlen(argv[2]), ticks).ec != std::errc{}) {
    std::fprintf(stderr, "usage: session_cost off|on|least TICKS\n");
    return 2;
  }
  std::printf("%zu samples kept\n", run(argv[1], ticks));
  return 0;
}

}  // namespace
}  // namespace palpate::bench

int main(int argc, char** argv) {
  try {
    return palpate::bench::main_with(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "session_cost: %s\n", error.what());
    return 1;
  }
}
