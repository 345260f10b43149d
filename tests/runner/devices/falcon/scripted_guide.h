#pragma once
// A scripted experimenter who does each request and answers at once.

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "runner/devices/falcon/calibration.h"

namespace palpate::runner::devices::falcon::testing {

class ScriptedGuide final : public Guide {
 public:
  /// \param act  action on the n-th question (from 0); false: stop there.
  explicit ScriptedGuide(std::function<bool(int)> act) : act_(std::move(act)) {}

  void say(const std::string& text) override { said.push_back(text); }
  void ask(const std::string& text) override {
    asked.push_back(text);
    going_on_ = act_(static_cast<int>(asked.size()) - 1);
    patience_ = kThinking;
  }
  Answer answer() override {
    if (--patience_ > 0) return Answer::none;  // ticks continue
    return going_on_ ? Answer::proceed : Answer::stop;
  }

  std::vector<std::string> said, asked;

 private:
  static constexpr int kThinking = 1500;  // ticks
  std::function<bool(int)> act_;
  bool going_on_ = true;
  int patience_ = 0;
};

}  // namespace palpate::runner::devices::falcon::testing
