#include "runner/participants/keyboard.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "protocols/answer_keys.h"

namespace palpate::runner {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kPause_ns = 5'000'000;
constexpr std::int64_t kFeedback_ns = 1'000'000'000;
constexpr std::int64_t kReply_ns = 2'000'000'000;
constexpr std::int64_t kSteady_ns = 150'000'000;  // debounces the cue at the edge of the home zone

}  // namespace

KeyboardRespondent::KeyboardRespondent(const protocols::Protocol& protocol,
                                       ParticipantScreen& screen, Attendant& attendant,
                                       Clock& clock, AnswerBy by)
    : protocol_(protocol), screen_(screen), attendant_(attendant), clock_(clock), by_(by) {
  for (const auto& [key, name] : protocol.response.keys) {
    const auto stimulus = std::find_if(
        protocol.stimuli.begin(), protocol.stimuli.end(),
        [&wanted = name](const protocols::StimulusSpec& s) { return s.name == wanted; });
    stimuli_.push_back(static_cast<int>(std::distance(protocol.stimuli.begin(), stimulus)));
    keys_.emplace_back(by != AnswerBy::buttons ? key : "button " + std::to_string(keys_.size() + 1),
                       protocols::answer_label(protocol, name));
  }
}

void KeyboardRespondent::set_progress(std::size_t done, std::size_t trials) {
  done_ = static_cast<int>(done);
  trials_ = static_cast<int>(trials);
}

void KeyboardRespondent::show(Page page) {
  page_ = std::move(page);
  reply_until_ns_ = 0;
  early_ = false;
  screen_.show(page_);
}

void KeyboardRespondent::reply() { reply_with(protocol_.texts.other_key); }

void KeyboardRespondent::reply_with(const std::string& text) {
  reply_until_ns_ = clock_.now_ns() + kReply_ns;
  if (page_.reply == text) return;
  page_.reply = text;
  screen_.show(page_);
}

std::vector<KeyPress> KeyboardRespondent::take_keys() {
  std::vector<KeyPress> keys = std::exchange(spoken_, {});  // came before the others
  std::vector<KeyPress> pressed = screen_.keys();
  if (by_ == AnswerBy::experimenter) {
    // Nobody answers beside the one who types; pages are read by the participant.
    std::erase_if(pressed, [](const KeyPress& press) {
      return press.key != "space" && press.key != "enter" && press.key != "left" &&
             press.key != "right";
    });
    if (page_.typing != Page::Typing::none) pressed.clear();
  }
  keys.insert(keys.end(), pressed.begin(), pressed.end());
  return keys;
}

void KeyboardRespondent::end_reply() {
  if (reply_until_ns_ == 0 || clock_.now_ns() < reply_until_ns_) return;
  reply_until_ns_ = 0;
  page_.reply.clear();
  screen_.show(page_);
}

void KeyboardRespondent::tend() {
  if (!take_keys().empty()) reply();
  end_reply();
}

Page KeyboardRespondent::between_trials(Page::Kind kind, const std::string& text) const {
  Page page;
  page.kind = kind;
  page.text = text;
  page.done = done_;
  page.trials = trials_;
  return page;
}

void KeyboardRespondent::show_message(const std::string& text) {
  show(between_trials(Page::Kind::message, text));
}

void KeyboardRespondent::wait_until(std::int64_t when_ns) {
  while (clock_.now_ns() < when_ns) {
    tend();
    attendant_.attend();
    clock_.wait_until(std::min(when_ns, clock_.now_ns() + kPause_ns));
  }
}

void KeyboardRespondent::wait_for_space(std::int64_t since_ns) {
  while (true) {
    for (const KeyPress& press : take_keys()) {
      if (press.time_ns < since_ns) continue;
      if (press.key == "space" || press.key == "enter") return;
      reply();
    }
    end_reply();
    attendant_.attend();
    clock_.wait_until(clock_.now_ns() + kPause_ns);
  }
}

void KeyboardRespondent::read(const std::string& text) {
  if (text.empty()) return;
  // Taken before the page is shown, so that a very early key press counts.
  const std::int64_t before_ns = clock_.now_ns();
  Page page = between_trials(Page::Kind::text, text);
  // The end page is shown before set_progress() has been told of the last trial.
  if (&text == &protocol_.texts.end) page.done = page.trials;
  show(std::move(page));
  wait_for_space(before_ns);
}

void KeyboardRespondent::rest(const std::string& text, std::int64_t until_ns) {
  page_.reply.clear();
  reply_until_ns_ = 0;
  for (std::int64_t now = clock_.now_ns(); now < until_ns; now = clock_.now_ns()) {
    Page page = between_trials(Page::Kind::message, text);
    page.seconds_left = static_cast<int>((until_ns - now + kSecond_ns - 1) / kSecond_ns);
    page.reply = page_.reply;
    std::swap(page, page_);
    screen_.show(page_);
    wait_until(until_ns - (page_.seconds_left - 1) * kSecond_ns);
  }
  page_.seconds_left = 0;
  read(text);
}

void KeyboardRespondent::feedback(bool correct) {
  Page page;
  page.kind = Page::Kind::feedback;
  page.text = correct ? "\u2713" : "\u2717";
  show(std::move(page));
  attendant_.sound(correct ? SoundCue::right : SoundCue::wrong);
  screen_.keys();
  wait_until(clock_.now_ns() + kFeedback_ns);
}

void KeyboardRespondent::begin_trial(const protocols::Trial& trial) {
  task_block_ = trial.task_block;
  Page page;
  page.kind = Page::Kind::neutral;
  page.keys = keys_;
  show(std::move(page));
  early_ = true;
  screen_.keys();
  cue_ = Cue::none;
  cue_since_ns_ = 0;
  onset_ns_ = 0;
  buttons_ = 0xFF;  // a button held down since before the trial is not an answer
  pending_.reset();
}

void KeyboardRespondent::show_cue(const Sample& sample) {
  const auto& texts = protocol_.texts;
  Cue cue = cue_;
  if (sample.phase == Phase::feeling) cue = Cue::go;
  if (sample.waiting == Waiting::for_rest) cue = Cue::ready;
  if (sample.waiting == Waiting::for_distance) cue = Cue::move_away;
  if (cue == cue_ || (cue != Cue::go && sample.time_ns - cue_since_ns_ < kSteady_ns)) return;
  cue_ = cue;
  cue_since_ns_ = sample.time_ns;
  page_.kind = cue == Cue::move_away ? Page::Kind::message : Page::Kind::neutral;
  page_.go = cue == Cue::go;
  page_.text = cue == Cue::go ? texts.go : cue == Cue::ready ? texts.ready : texts.move_away;
  if (cue == Cue::ready) attendant_.sound(SoundCue::ready);
  if (task() != nullptr) {
    if (cue == Cue::go) page_.text = interval_text();
    const bool types = cue == Cue::go && view_.answers && task()->answers.empty();
    page_.typing = types ? Page::Typing::number : Page::Typing::none;
    least_ = task()->least;
    most_ = task()->most;
    page_.wheel =
        cue == Cue::go && task()->task == protocols::TaskKind::adjust && by_ == AnswerBy::keys;
  }
  screen_.show(page_);
}

std::optional<int> KeyboardRespondent::meaning(const std::string& key) const {
  if (by_ == AnswerBy::buttons) return std::nullopt;
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    if (protocols::one_key(keys_[i].first) == protocols::one_key(key)) return stimuli_[i];
  }
  return std::nullopt;
}

void KeyboardRespondent::listen(const Sample& sample) {
  const std::vector<KeyPress> presses = take_keys();
  for (std::size_t i = 0; i < presses.size(); ++i) {
    const KeyPress& press = presses[i];
    if (task() != nullptr) {
      if (listen_to_task(press)) continue;
      spoken_.assign(presses.begin() + static_cast<std::ptrdiff_t>(i), presses.end());
      break;
    }
    if (pending_) continue;
    const std::optional<int> stimulus = meaning(press.key);
    if (stimulus && onset_ns_ > 0 && press.time_ns >= onset_ns_) {
      pending_ = Answer{*stimulus, press.time_ns};
    } else {
      reply();
    }
  }
  end_reply();
  const unsigned pressed = sample.buttons & ~static_cast<unsigned>(buttons_);
  buttons_ = sample.buttons;
  if (by_ != AnswerBy::buttons || pending_ || onset_ns_ == 0) return;
  if (task() != nullptr) {
    listen_to_buttons(pressed, sample.time_ns);
    return;
  }
  for (std::size_t i = 0; i < stimuli_.size() && i < 8; ++i) {
    if ((pressed >> i & 1U) != 0) {
      pending_ = Answer{stimuli_[i], sample.time_ns};
      return;
    }
  }
}

std::optional<Answer> KeyboardRespondent::step(const Sample& sample) {
  if (sample.phase == Phase::feeling && onset_ns_ == 0) {
    onset_ns_ = sample.time_ns;
    early_ = false;
  }
  show_cue(sample);
  listen(sample);
  if (pending_ && onset_ns_ > 0 && sample.time_ns >= pending_->time_ns) return pending_;
  attendant_.attend();
  return std::nullopt;
}

}  // namespace palpate::runner
