// Windows without a session, for windows_test.py. Standard input says what to show, a line each;
// standard output says what was pressed.
//   page KIND TEXT      text, neutral, feedback or message; the keys are those of the paper
//   state SHAPE FAULTS  a console in a trial
//   where               answers "tip x y z axis x y z" of the mouse's stylus
//   ping                answers "pong"
//   end
//   end slowly          answers "over", and takes everything down after another line

#include <algorithm>
#include <atomic>
#include <chrono>
#include <glm/geometric.hpp>
#include <iostream>
#include <mutex>
#include <sstream>
#include <thread>

#include "runner/display/window.h"

namespace palpate {
namespace {

class SteadyClock final : public Clock {
 public:
  std::int64_t now_ns() noexcept override {
    return std::chrono::steady_clock::now().time_since_epoch().count();
  }
  void wait_until(std::int64_t when_ns) noexcept override {
    std::this_thread::sleep_for(std::chrono::nanoseconds(when_ns - now_ns()));
  }
};

Page page_of(std::istringstream& words) {
  Page page;
  std::string kind;
  words >> kind >> std::ws;
  std::getline(words, page.text);
  if (kind == "text") page.kind = Page::Kind::text;
  if (kind == "neutral") page.kind = Page::Kind::neutral;
  if (kind == "feedback") page.kind = Page::Kind::feedback;
  page.keys = {{"1", "sphere"}, {"2", "cone"}, {"3", "cylinder"}, {"4", "cube"}};
  return page;
}

ConsoleState state_of(std::istringstream& words, const LineProbe& stylus) {
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
  state.messages = {"10:02:11  session 1 began", "10:04:40  " + state.shape};
  ObjectSpec object;
  object.shape = state.shape == "cone"       ? ShapeKind::cone
                 : state.shape == "cylinder" ? ShapeKind::cylinder
                 : state.shape == "cube"     ? ShapeKind::cube
                                             : ShapeKind::sphere;
  state.objects = std::make_shared<const std::vector<ObjectSpec>>(1, object);
  state.sample.probe = stylus;
  state.sample.phase = Phase::feeling;
  return state;
}

/// What a session's thread would do.
class Talk {
 public:
  Talk(DisplayLoop& windows, MouseStylus& mouse) : windows_(windows), mouse_(mouse) {}

  void say(const std::string& line) {
    const std::lock_guard lock(mutex_);
    std::cout << line << std::endl;  // at once
  }
  void report() {
    for (const KeyPress& key : windows_.participant().keys()) say("key " + key.key);
    for (const ConsoleCommand& command : windows_.console().commands()) {
      say("command " + std::to_string(static_cast<int>(command.kind)) + " " + command.text);
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
    if (verb == "state") windows_.console().show(state_of(words, stylus_));
    if (verb == "ping") say("pong");
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
  MouseStylus& mouse_;
  std::mutex mutex_;
  LineProbe stylus_;
  bool closed_ = false;
};

int show() {
  SteadyClock clock;
  MouseStylus mouse(0.12, 1000);
  WindowSettings settings;
  settings.title = "harness";
  settings.clock = &clock;
  settings.mouse = &mouse;
  settings.texts = {"Kugel", "球"};
  settings.emergency = [] { std::cout << "emergency" << std::endl; };  // at once
  const std::unique_ptr<DisplayLoop> windows = make_windows(settings);
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
}  // namespace palpate

int main() {
  try {
    return palpate::show();
  } catch (const palpate::DisplayError& fault) {
    std::cout << fault.what() << std::endl;  // with what was said before
    return 3;
  }
}
