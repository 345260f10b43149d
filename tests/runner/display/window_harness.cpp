// Windows without a session, for windows_test.py and one_monitor_test.py. Lines on standard input
// are commands; standard output reports presses.
//   page KIND TEXT      text, neutral, go, feedback, message, break or checklist; the keys are
//                       those of the paper
//   state SHAPE FAULTS [WORD]  a console in a trial, or in the state that the word says; "tool": a
//                       trial with a tool of three segments on the cube
//   where               answers "tip x y z axis x y z" of the mouse's stylus
//   ping                answers "pong"
//   settled             answers "settled" once the windows are in their places, or were tried
//   places              answers "places" and where the windows have been put
//   end
//   end slowly          answers "over", and takes everything down after another line

#include <algorithm>
#include <atomic>
#include <chrono>
#include <glm/geometric.hpp>
#include <iostream>
#include <mutex>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "runner/display/window.h"

namespace palpate::runner::display {
namespace {

class SteadyClock final : public servo::Clock {
 public:
  std::int64_t now_ns() noexcept override {
    return std::chrono::steady_clock::now().time_since_epoch().count();
  }
  void wait_until(std::int64_t when_ns) noexcept override {
    std::this_thread::sleep_for(std::chrono::nanoseconds(when_ns - now_ns()));
  }
};

Checklist some_checklist() {
  using State = Checklist::Step::State;
  return {{{"Home the device", State::done},
           {"Feel a weak push to the right", State::now},
           {"Move to every side", State::left_out},
           {"Press the buttons", State::to_do}},
          "limits: forces of up to 2.5 N at each end (the device's own limit: 2.5 N), 0.5 N of "
          "change a tick; hold the grip: a push of 1.0 N to the right comes for a second",
          {{ConsoleCommand::Kind::resume, "push"},
           {ConsoleCommand::Kind::repeat_trial, "once more"},
           {ConsoleCommand::Kind::quit, "no"}}};
}

Page page_of(std::istringstream& words) {
  Page page;
  std::string kind;
  words >> kind >> std::ws;
  std::getline(words, page.text);
  if (kind == "text") page.kind = Page::Kind::text;
  if (kind == "neutral") page.kind = Page::Kind::neutral;
  if (kind == "feedback") page.kind = Page::Kind::feedback;
  if (kind == "go") {
    page.kind = Page::Kind::neutral;
    page.go = true;
  }
  if (kind == "checklist") {
    page.kind = Page::Kind::checklist;
    page.checklist = some_checklist();
    return page;
  }
  if (kind == "break") page.seconds_left = 25;
  if (kind == "break" || kind == "text" || kind == "message") {
    page.done = 12;
    page.trials = 24;
  }
  if (kind == "reply") {
    page.kind = Page::Kind::neutral;
    page.reply = page.text;
    page.text = "Go";
    page.go = true;
  }
  if (page.kind != Page::Kind::neutral) return page;
  page.keys = {{"1", "sphere"}, {"2", "cone"}, {"3", "cylinder"}, {"4", "cube"}};
  return page;
}

ConsoleState state_of(std::istringstream& words, const rendering::LineProbe& stylus) {
  ConsoleState state;
  words >> state.shape >> state.sample.faults;
  state.study = "ho2000";
  state.participant = "P03";
  state.state = "trial";
  state.renderer = "ray";
  state.session = state.block = state.trial = 1;
  state.blocks = 8;
  state.trials = 608;
  state.times = {12.5, 9.25, 14, 8.5};
  std::string word;
  if (words >> word) state.state = word;
  state.practice = true;
  state.answer = "cylinder, wrong";
  state.scores = {{"sphere", 5, 6}, {"cone", 3, 6}, {"cylinder", 0, 5}, {"cube", 0, 0}};
  if (word == "rest") state.seconds_left = 25;
  if (word == "homing") state.sample.waiting = servo::Waiting::for_distance;
  if (word == "pre-flight") state.checklist = some_checklist();
  state.messages = {"10:02:11  session 1 began", "10:04:40  " + state.shape};
  stimuli::ObjectSpec object;
  object.shape = state.shape == "cone"       ? stimuli::ShapeKind::cone
                 : state.shape == "cylinder" ? stimuli::ShapeKind::cylinder
                 : state.shape == "cube"     ? stimuli::ShapeKind::cube
                                             : stimuli::ShapeKind::sphere;
  state.objects = std::make_shared<const std::vector<stimuli::ObjectSpec>>(1, object);
  state.sample.probe = stylus;
  state.sample.phase = servo::Phase::feeling;
  if (word == "tool") {
    state.state = "trial";
    state.tool.segments = {
        {{0, 0, 0}, {0, 0, 0.12}}, {{-0.04, 0, 0}, {0.04, 0, 0}}, {{0.04, 0, 0}, {0.04, 0, -0.03}}};
    state.sample.rendering.ideal_side = Vec3(1, 0, 0);
    state.sample.probe = {{0, 0, 0.058}, {0, 0.03, 0.17}};
    state.sample.rendering.contacts = 1;
    state.sample.rendering.ideal = {{0, 0, 0.062}, {0, 0.03, 0.174}};
    state.sample.rendering.deepest.point = {0.04, 0, 0.032};
    state.sample.device1 = {0, 0, 2};
  }
  return state;
}

/// Acts as a session's thread.
class Talk {
 public:
  Talk(DisplayLoop& windows, devices::MouseStylus& mouse) : windows_(windows), mouse_(mouse) {}

  void say(const std::string& line) {
    const std::lock_guard lock(mutex_);
    std::cout << line << std::endl;  // at once
  }
  void report() {
    for (const KeyPress& key : windows_.participant().keys()) say("key " + key.key);
    for (const ConsoleCommand& command : windows_.console().commands()) {
      say("command " + std::to_string(static_cast<int>(command.kind)) + " " + command.text);
    }
    if (const std::lock_guard lock(state_mutex_); state_)
      windows_.console().show(*state_);  // repeatedly, like a session
    if (std::string now = windows_.participant().misplaced(); now != misplaced_) {
      misplaced_ = std::move(now);
      say("misplaced " + misplaced_);
    }
    if (!windows_.participant().open() && !closed_) {
      closed_ = true;
      say("closed");
    }
  }
  void obey(const std::string& line) {
    std::istringstream words(line);
    std::string verb;
    words >> verb;
    for (int i = 0; i < 1000; ++i) stylus_ = mouse_.read().stylus;
    if (verb == "page") windows_.participant().show(page_of(words));
    if (verb == "state") {
      const std::lock_guard lock(state_mutex_);
      state_ = state_of(words, stylus_);
    }
    if (verb == "ping") say("pong");
    if (verb == "settled") {
      while (!windows_.participant().settled())
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      say("settled");
    }
    if (verb == "places") say("places " + windows_.console().places());
    if (verb == "where") {
      const Vec3 axis = glm::normalize(stylus_.tail - stylus_.tip);
      std::ostringstream out;
      out << "tip " << stylus_.tip.x << ' ' << stylus_.tip.y << ' ' << stylus_.tip.z << " axis "
          << axis.x << ' ' << axis.y << ' ' << axis.z;
      say(out.str());
    }
  }

 private:
  DisplayLoop& windows_;
  devices::MouseStylus& mouse_;
  std::mutex mutex_;
  rendering::LineProbe stylus_;
  std::mutex state_mutex_;
  std::optional<ConsoleState> state_;
  bool closed_ = false;
  std::string misplaced_;
};

int show(const std::vector<std::string>& args) {
  const auto asked = [&](const char* what) {
    return std::count(args.begin(), args.end(), what) > 0;
  };
  SteadyClock clock;
  devices::MouseStylus mouse(0.12, 1000);
  WindowSettings settings;
  settings.title = "harness";
  settings.clock = &clock;
  if (!asked("--no-mouse")) settings.mouse = &mouse;
  settings.full_screen = asked("--full-screen");
  if (asked("--ui-scale")) settings.ui_scale = 1.5;
  const auto places = std::find(args.begin(), args.end(), "--places");
  if (places != args.end() && places + 1 != args.end()) settings.places = window_places(places[1]);
  settings.texts = {"Kugel", "球"};
  settings.emergency = [] { std::cout << "emergency" << std::endl; };  // at once
  const std::unique_ptr<DisplayLoop> windows = make_windows(settings);
  if (!windows->warning().empty()) std::cout << "warning " << windows->warning() << std::endl;
  Talk talk(*windows, mouse);
  std::atomic<bool> over{false};
  bool slowly = false;
  std::thread listener([&] {
    while (!over.load()) {
      talk.report();
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  });
  std::thread session([&] {
    std::string line;
    while (std::getline(std::cin, line) && line.rfind("end", 0) != 0) talk.obey(line);
    slowly = line == "end slowly";
    windows->end();
  });
  talk.say("ready");
  windows->run();
  session.join();
  over.store(true);
  listener.join();
  talk.report();
  if (slowly) {
    talk.say("over");
    std::string line;
    std::getline(std::cin, line);
  }
  return 0;
}

}  // namespace
}  // namespace palpate::runner::display

int main(int count, char** args) {
  try {
    return palpate::runner::display::show({args + 1, args + count});
  } catch (const palpate::runner::display::DisplayError& fault) {
    std::cout << fault.what() << std::endl;  // with the earlier output
    return 3;
  }
}
