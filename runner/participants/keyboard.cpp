#include "runner/participants/keyboard.h"

#include <algorithm>
#include <iterator>

namespace palpate {
namespace {

constexpr std::int64_t kPause_ns = 5'000'000;
constexpr std::int64_t kFeedback_ns = 1'000'000'000;

}  // namespace

KeyboardRespondent::KeyboardRespondent(const Protocol& protocol, ParticipantScreen& screen,
                                       Attendant& attendant, Clock& clock, AnswerBy by)
    : protocol_(protocol), screen_(screen), attendant_(attendant), clock_(clock), by_(by) {
  for (const auto& [key, name] : protocol.response.keys) {
    const auto stimulus =
        std::find_if(protocol.stimuli.begin(), protocol.stimuli.end(),
                     [&wanted = name](const StimulusSpec& s) { return s.name == wanted; });
    stimuli_.push_back(static_cast<int>(std::distance(protocol.stimuli.begin(), stimulus)));
    keys_.emplace_back(by == AnswerBy::keys ? key : "button " + std::to_string(keys_.size() + 1),
                       name);
  }
}

void KeyboardRespondent::show_message(const std::string& text) {
  screen_.show({Page::Kind::message, text, {}});
}

void KeyboardRespondent::wait_until(std::int64_t when_ns) {
  while (clock_.now_ns() < when_ns) {
    attendant_.attend();
    clock_.wait_until(std::min(when_ns, clock_.now_ns() + kPause_ns));
  }
}

void KeyboardRespondent::wait_for_space(std::int64_t since_ns) {
  while (true) {
    for (const KeyPress& press : screen_.keys()) {
      if (press.time_ns >= since_ns && (press.key == "space" || press.key == "enter")) return;
    }
    attendant_.attend();
    clock_.wait_until(clock_.now_ns() + kPause_ns);
  }
}

void KeyboardRespondent::read(const std::string& text) {
  if (text.empty()) return;
  // Before it shows: whoever is quick answers before this thread goes on.
  const std::int64_t before_ns = clock_.now_ns();
  screen_.show({Page::Kind::text, text, {}});
  wait_for_space(before_ns);
}

void KeyboardRespondent::rest(const std::string& text, std::int64_t until_ns) {
  if (clock_.now_ns() < until_ns) {
    show_message(text);
    wait_until(until_ns);
  }
  read(text);
}

void KeyboardRespondent::feedback(bool correct) {
  screen_.show({Page::Kind::feedback, correct ? "\u2713" : "\u2717", {}});
  wait_until(clock_.now_ns() + kFeedback_ns);
}

void KeyboardRespondent::begin_trial(const Trial&) {
  screen_.show({Page::Kind::neutral, "", keys_});
  screen_.keys();
  onset_ns_ = 0;
  buttons_ = 0xFF;  // a button that is held down from before does not answer
  pending_.reset();
}

std::optional<int> KeyboardRespondent::meaning(const std::string& key) const {
  if (by_ != AnswerBy::keys) return std::nullopt;
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    if (keys_[i].first == key) return stimuli_[i];
  }
  return std::nullopt;
}

void KeyboardRespondent::listen(const Sample& sample) {
  for (const KeyPress& press : screen_.keys()) {
    const std::optional<int> stimulus = meaning(press.key);
    if (!pending_ && stimulus && onset_ns_ > 0 && press.time_ns >= onset_ns_)
      pending_ = Answer{*stimulus, press.time_ns};
  }
  const unsigned pressed = sample.buttons & ~static_cast<unsigned>(buttons_);
  buttons_ = sample.buttons;
  if (by_ != AnswerBy::buttons || pending_ || onset_ns_ == 0) return;
  for (std::size_t i = 0; i < stimuli_.size() && i < 8; ++i) {
    if ((pressed >> i & 1U) != 0) {
      pending_ = Answer{stimuli_[i], sample.time_ns};
      return;
    }
  }
}

std::optional<Answer> KeyboardRespondent::step(const Sample& sample) {
  if (sample.phase == Phase::feeling && onset_ns_ == 0) onset_ns_ = sample.time_ns;
  listen(sample);
  if (pending_ && sample.time_ns >= pending_->time_ns) return pending_;
  attendant_.attend();
  return std::nullopt;
}

}  // namespace palpate
