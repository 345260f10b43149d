// Nothing on the participant's screen tells which stimulus is felt: its pixels are the same for
// every shape, in every state of a trial, in every task and language, unless the stimulus is to be
// seen.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "data/base/checksum.h"
#include "protocols/parse.h"
#include "runner/display/participant_window.h"
#include "runner/participants/keyboard.h"

namespace palpate::runner::display {
namespace {

constexpr const char* kStimuli = R"([
  {"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 2},
  {"name": "cone", "shape": "cone", "radius_m": 0.02, "height_m": 0.05},
  {"name": "tube", "shape": "cylinder", "radius_m": 0.01, "height_m": 0.08},
  {"name": "box", "shape": "cube", "edge_m": 0.03},
  {"name": "hard", "shape": "cube", "edge_m": 0.06, "stiffness_n_per_m": 1500},
  {"name": "layered", "shape": "sphere", "radius_m": 0.03, "layers": [
    {"depth_m": 0.004, "stiffness_n_per_m": 1500}]},
  {"name": "rough", "shape": "box", "size_m": [0.06, 0.06, 0.02], "texture": {"kind": "sine", "period_m": 0.002, "depth_m": 0.0002}},
  {"name": "two", "shape": "compound", "parts": [
    {"shape": "cube", "edge_m": 0.03}, {"shape": "cube", "edge_m": 0.03, "position_m": [0.02, 0, 0]}]},
  {"name": "push", "shape": "none", "fields": [{"kind": "constant", "force_n": [0.5, 0, 0]}]},
  {"name": "loud", "shape": "cube", "edge_m": 0.03, "sound": {"kind": "modal",
    "modes": [{"frequency_hz": 500, "decay_per_s": 50}]}}
])";

constexpr const char* kAll =
    R"(["ball", "cone", "tube", "box", "hard", "layered", "rough", "two", "push", "loud"])";

/// One block that asks about all of them.
std::string block_of(const std::string& task) {
  const std::string all = kAll;
  if (task == "identify")
    return R"({"name": "b", "task": "identify", "repetitions": 1, "stimuli": )" + all + "}";
  if (task == "scale")
    return R"({"name": "b", "task": "rate", "repetitions": 1, "scale": [{"label": "soft"}, {"label": "hard"}], "stimuli": )" +
           all + "}";
  if (task == "number")
    return R"({"name": "b", "task": "rate", "repetitions": 1, "min": 0, "max": 50, "stimuli": )" +
           all + "}";
  if (task == "detect")
    return R"({"name": "b", "task": "detect", "repetitions": 1, "catch_trials": 0.5, "stimuli": )" +
           all + "}";
  const std::string level = R"(, "stimuli": )" + all +
                            R"(, "standard": "ball", "level": {"path": "/stiffness_n_per_m"}, )";
  if (task == "adjust")
    return R"({"name": "b", "task": "adjust")" + level +
           R"("min": 100, "max": 500, "turn": 50, "starts": [200]})";
  return R"({"name": "b", "task": "compare")" + level +
         R"("procedure": {"kind": "constant", "levels": [300, 500], "repetitions": 1}})";
}

/// Keeps what the participant sees, as a picture's checksum.
class Seen final : public ParticipantScreen {
 public:
  void show(const Page& page) override { pages.push_back(page); }
  std::vector<KeyPress> keys() override { return std::exchange(pressed, {}); }
  bool open() const override { return true; }
  void see(const std::shared_ptr<const SeenTrial>& trial) override { drawn |= trial != nullptr; }
  std::vector<Page> pages;
  std::vector<KeyPress> pressed;
  bool drawn = false;
};

class Alone final : public participants::Attendant {
 public:
  void attend() override {}
  void sound(participants::SoundCue) override {}
};

std::string picture_of(const Page& page) {
  const Image image = draw_page(page, 480, 300);
  return checksum_hex({reinterpret_cast<const char*>(image.pixels.data()),
                       image.pixels.size() * sizeof(image.pixels[0])});
}

/// A trial from the way home to the answer, as a session goes through it. The hand feels the
/// stimulus: contacts and forces differ from one to the next.
class Trial {
 public:
  Trial(const protocols::Protocol& protocol, int stimulus)
      : protocol_(protocol),
        stimulus_(stimulus),
        person_(protocol, seen_, alone_, clock_, participants::AnswerBy::keys) {}

  std::vector<Page> pages() {
    const protocols::TaskBlock& block = protocol_.blocks.front();
    protocols::Trial trial;
    trial.stimulus = stimulus_;
    trial.level = block.level ? std::optional(300.0 + stimulus_) : std::nullopt;
    person_.begin_trial(trial);
    const int intervals = block.task == protocols::TaskKind::compare ? 2 : 1;
    for (int i = 1; i <= intervals; ++i) {
      const protocols::Interval shown{stimulus_, protocols::RendererKind::point, trial.level};
      const bool last = i == intervals;
      person_.begin_interval(trial, {i, intervals, last, true, &shown});
      go_home();
      feel();
      press("x");  // which means nothing
      press(last ? "1" : "space");
      press("enter");
    }
    EXPECT_FALSE(seen_.drawn);
    return seen_.pages;
  }

 private:
  void tick(servo::Sample sample, int milliseconds) {
    for (int i = 0; i < milliseconds; i += 10) {
      sample.time_ns = clock_.now_ns();
      person_.step(sample);
      clock_.wait_until(clock_.now_ns() + 10'000'000);
    }
  }
  void go_home() {
    servo::Sample sample;
    sample.phase = servo::Phase::homing;
    for (const servo::Waiting waiting :
         {servo::Waiting::for_distance, servo::Waiting::for_return, servo::Waiting::for_rest}) {
      sample.waiting = waiting;
      tick(sample, 400);
    }
  }
  servo::Sample touching() const {
    servo::Sample sample;
    sample.phase = servo::Phase::feeling;
    sample.rendering.contacts = 1 + stimulus_ % 3;
    sample.rendering.force = {0.1 * stimulus_, 0.2, 1.0 / (1 + stimulus_)};
    sample.rendering.torque = {0.01 * stimulus_, 0, 0};
    sample.rendering.deepest.depth = 1e-4 * (1 + stimulus_);
    sample.rendering.deepest.type = rendering::ContactType::point_polygon;
    sample.rendering.object = 0;
    sample.probe.tip = {0.001 * stimulus_, 0, 0.01};
    sample.probe.tail = {0.001 * stimulus_, 0, 0.16};
    return sample;
  }
  void feel() {
    servo::Sample free;
    free.phase = servo::Phase::feeling;
    tick(free, 100);
    tick(touching(), 300);
    tick(free, 100);
    tick(touching(), 300);
  }
  void press(const std::string& key) {
    seen_.pressed.push_back({key, clock_.now_ns()});
    tick(touching(), 50);
  }

  const protocols::Protocol& protocol_;
  const int stimulus_;
  Seen seen_;
  Alone alone_;
  servo::VirtualClock clock_{1'000'000'000};
  participants::KeyboardRespondent person_;
};

protocols::Protocol protocol_of(const std::string& task, const std::string& texts,
                                const std::string& extra = "") {
  return protocols::parse_protocol_text(
      R"({"version": 2, "name": "p", "renderers": ["point"], "stimuli": )" + std::string(kStimuli) +
          R"(, "blocks": [)" + block_of(task) + R"(], "texts": )" + texts + extra + "}",
      "p.json");
}

TEST(NoLeak, PixelsAreTheSameForEveryShape) {
  const std::vector<std::string> languages = {
      "{}",
      R"({"move_away": "Bitte zur\u00fcck zum Anfang", "go": "Los", "other_key": "Diese Taste tut jetzt nichts."})",
      R"({"move_away": "\u0639\u062f \u0625\u0644\u0649 \u0627\u0644\u0628\u062f\u0627\u064a\u0629", "go": "\u0627\u0628\u062f\u0623"})",
      R"({"move_away": "\u306f\u3058\u3081\u306b\u623b\u3063\u3066\u304f\u3060\u3055\u3044", "go": "\u3069\u3046\u305e"})"};
  for (const std::string task : {"identify", "compare", "detect", "scale", "number", "adjust"}) {
    for (const std::string& texts : languages) {
      const protocols::Protocol protocol = protocol_of(task, texts);
      std::vector<std::string> first;
      std::set<std::string> states;
      const auto count = static_cast<int>(protocol.stimuli.size());
      for (int stimulus = 0; stimulus < count; ++stimulus) {
        std::vector<std::string> pictures;
        for (const Page& page : Trial(protocol, stimulus).pages())
          pictures.push_back(picture_of(page));
        if (stimulus == 0) {
          first = pictures;
          states.insert(pictures.begin(), pictures.end());
        }
        ASSERT_EQ(pictures, first)
            << task << ", " << protocol.stimuli[static_cast<std::size_t>(stimulus)].name << ", "
            << texts;
      }
      EXPECT_GE(states.size(), 4U) << task << ": it goes through several states";
    }
  }
}

// The test can fail: a shape that is to be seen is drawn.
TEST(NoLeak, DrawsSeenObjects) {
  const protocols::Protocol protocol = protocols::parse_protocol_text(
      R"({"version": 2, "name": "p", "renderers": ["point"], "view": {"screen_m":
      [[-0.2, 0.2, -0.1], [0.2, 0.2, -0.1], [-0.2, 0.2, 0.1]], "eye_m": [0, -0.3, 0]},
      "stimuli": [{"name": "a", "shape": "cube", "edge_m": 0.05, "seen": {"what": "object"}}],
      "blocks": [{"name": "b", "task": "rate", "stimuli": ["a"], "repetitions": 1}]})",
      "p.json");
  Seen seen;
  Alone alone;
  servo::VirtualClock clock{1};
  participants::KeyboardRespondent person(protocol, seen, alone, clock,
                                          participants::AnswerBy::keys);
  protocols::Trial trial;
  person.begin_trial(trial);
  const protocols::Interval shown{0, protocols::RendererKind::point};
  person.begin_interval(trial, {1, 1, true, true, &shown});
  EXPECT_TRUE(seen.drawn);
}

}  // namespace
}  // namespace palpate::runner::display
