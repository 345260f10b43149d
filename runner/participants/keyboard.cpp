#include "runner/participants/keyboard.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <iterator>
#include <utility>

#include "data/base/utf8.h"
#include "data/base/words.h"
#include "protocols/answer_keys.h"
#include "protocols/tasks/levels.h"
#include "runner/participants/seen_trial.h"
#include "runner/scene_builder.h"

namespace palpate::runner::participants {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kPause_ns = 5'000'000;
constexpr std::int64_t kFeedback_ns = 1'000'000'000;
constexpr std::int64_t kReply_ns = 2'000'000'000;
constexpr std::int64_t kSteady_ns = 150'000'000;  // debounces the cue at the edge of the home zone

using protocols::TaskKind;

constexpr std::int64_t kAskPause_ns = 5'000'000;
constexpr std::int64_t kPicture_ns = 16'000'000;
constexpr std::size_t kMostTyped = 200;          // bytes
constexpr std::int64_t kBurst_ns = 400'000'000;  // keys of one number follow each other faster

using NamedKeys = std::vector<std::pair<std::string, std::string>>;

/// Home and target as the screen shows them.
display::ReachPicture picture_of(const protocols::ReachingSpec& reaching,
                                 const protocols::Trial& trial) {
  const auto farthest = [&](int axis) {
    double most = 0;
    for (const Vec3& target : reaching.targets)
      most = std::max(most, std::abs(target[axis] - reaching.home[axis]));
    return most;
  };
  display::ReachPicture out;
  out.up = farthest(2) > farthest(1) ? 2 : 1;
  out.home = reaching.home;
  out.target = reaching.targets.at(static_cast<std::size_t>(*trial.level) - 1);
  out.tip = reaching.home;
  out.home_radius = reaching.home_radius;
  out.target_radius = reaching.target_radius;
  for (const Vec3& target : reaching.targets)
    out.extent = std::max(out.extent, glm::length(target - reaching.home));
  out.extent += reaching.target_radius;
  return out;
}

/// Keys of a page: 1, 2, ..., 9, 0, then letters, each with its text.
NamedKeys numbered(const std::vector<std::string>& texts) {
  NamedKeys keys;
  keys.reserve(texts.size());
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const std::string key = i < 9    ? std::to_string(i + 1)
                            : i == 9 ? "0"
                                     : std::string(1, static_cast<char>('a' + i - 10));
    keys.emplace_back(key, texts[i]);
  }
  return keys;
}

std::vector<ReadScreen> screens_of_text(const std::string& text) {
  std::vector<ReadScreen> screens(1);
  for (const char c : text) {
    if (c == '\f') {
      screens.emplace_back();
    } else {
      screens.back().text += c;
    }
  }
  return screens;
}

/// "(18 \u2013 120)", "(\u2265 0)"; in any language.
std::string range_text(std::optional<double> least, std::optional<double> most) {
  const auto text = [](double number) { return protocols::level_text(number); };
  if (least && most) return " (" + text(*least) + " \u2013 " + text(*most) + ")";
  if (least) return " (\u2265 " + text(*least) + ")";
  return most ? " (\u2264 " + text(*most) + ")" : "";
}

std::optional<double> number_in(const std::string& typed, std::optional<double> least,
                                std::optional<double> most) {
  double number = 0;
  const char* const end = typed.data() + typed.size();
  const auto [at, error] = std::from_chars(typed.data(), end, number);
  if (error != std::errc{} || at != end || !std::isfinite(number)) return std::nullopt;
  if ((least && number < *least) || (most && number > *most)) return std::nullopt;
  return number + 0.0;  // -0 is 0
}

bool is_turn(const protocols::TaskBlock& block, const Answer& answer) {
  if (block.task != TaskKind::adjust) return false;
  const std::string& act = block.answers[static_cast<std::size_t>(answer.stimulus)].name;
  return act == "up" || act == "down";
}

}  // namespace

KeyboardRespondent::KeyboardRespondent(const protocols::Protocol& protocol,
                                       display::ParticipantScreen& screen, Attendant& attendant,
                                       servo::Clock& clock, AnswerBy by)
    : protocol_(protocol), screen_(screen), attendant_(attendant), clock_(clock), by_(by) {
  for (const auto& [key, name] : protocol.response.keys) {
    const auto stimulus = std::find_if(
        protocol.stimuli.begin(), protocol.stimuli.end(),
        [&wanted = name](const protocols::StimulusSpec& s) { return s.name == wanted; });
    answers_.emplace_back(key, static_cast<int>(std::distance(protocol.stimuli.begin(), stimulus)));
    keys_.emplace_back(by != AnswerBy::buttons ? key : "button " + std::to_string(keys_.size() + 1),
                       protocols::answer_label(protocol, name));
  }
}

void KeyboardRespondent::set_progress(std::size_t done, std::size_t trials) {
  done_ = static_cast<int>(done);
  trials_ = static_cast<int>(trials);
}

void KeyboardRespondent::show(display::Page page) {
  page_ = std::move(page);
  reply_until_ns_ = 0;
  early_ = false;
  if (page_.kind != display::Page::Kind::neutral) see({}, nullptr);
  screen_.show(page_);
}

void KeyboardRespondent::reply() { reply_with(protocol_.texts.other_key); }

void KeyboardRespondent::reply_with(const std::string& text) {
  reply_until_ns_ = clock_.now_ns() + kReply_ns;
  if (page_.reply == text) return;
  page_.reply = text;
  screen_.show(page_);
}

std::vector<display::KeyPress> KeyboardRespondent::take_keys() {
  std::vector<display::KeyPress> keys =
      std::exchange(spoken_, {});  // these arrived before the others
  std::vector<display::KeyPress> pressed = screen_.keys();
  if (by_ == AnswerBy::experimenter) {
    // Only the experimenter answers; the participant's keys turn pages.
    std::erase_if(pressed, [](const display::KeyPress& press) {
      return press.key != "space" && press.key != "enter" && press.key != "left" &&
             press.key != "right";
    });
    if (page_.typing != display::Page::Typing::none) pressed.clear();
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

display::Page KeyboardRespondent::between_trials(display::Page::Kind kind,
                                                 const std::string& text) const {
  display::Page page;
  page.kind = kind;
  page.text = text;
  page.done = done_;
  page.trials = trials_;
  return page;
}

void KeyboardRespondent::show_message(const std::string& text) {
  show(between_trials(display::Page::Kind::message, text));
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
    for (const display::KeyPress& press : take_keys()) {
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
  // Read the clock before showing the page, so that a very early key press counts.
  const std::int64_t before_ns = clock_.now_ns();
  display::Page page = between_trials(display::Page::Kind::text, text);
  // The end page is shown before set_progress() counts the last trial.
  if (&text == &protocol_.texts.end) page.done = page.trials;
  show(std::move(page));
  wait_for_space(before_ns);
}

void KeyboardRespondent::rest(const std::string& text, std::int64_t until_ns) {
  page_.reply.clear();
  reply_until_ns_ = 0;
  for (std::int64_t now = clock_.now_ns(); now < until_ns; now = clock_.now_ns()) {
    display::Page page = between_trials(display::Page::Kind::message, text);
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
  display::Page page;
  page.kind = display::Page::Kind::feedback;
  page.text = correct ? "\u2713" : "\u2717";
  show(std::move(page));
  attendant_.sound(correct ? SoundCue::right : SoundCue::wrong);
  screen_.keys();
  wait_until(clock_.now_ns() + kFeedback_ns);
}

void KeyboardRespondent::begin_trial(const protocols::Trial& trial) {
  screen_.frames();  // of a trial that was cut off
  block_ = &protocols::block_of(protocol_, trial);
  display::Page page;
  page.kind = display::Page::Kind::neutral;
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

void KeyboardRespondent::show_cue(const servo::Sample& sample) {
  const auto& texts = protocol_.texts;
  Cue cue = cue_;
  if (sample.phase == servo::Phase::feeling) cue = Cue::go;
  if (sample.waiting == servo::Waiting::for_rest) cue = Cue::ready;
  if (sample.waiting == servo::Waiting::for_distance) cue = Cue::move_away;
  if (sample.waiting == servo::Waiting::for_return) cue = Cue::go_home;
  if (cue == cue_ || (cue != Cue::go && sample.time_ns - cue_since_ns_ < kSteady_ns)) return;
  cue_ = cue;
  cue_since_ns_ = sample.time_ns;
  const bool away = cue == Cue::move_away || cue == Cue::go_home;
  page_.kind = away ? display::Page::Kind::message : display::Page::Kind::neutral;
  page_.go = cue == Cue::go;
  page_.text = cue == Cue::go        ? interval_text()
               : cue == Cue::ready   ? texts.ready
               : cue == Cue::go_home ? texts.go_home
                                     : texts.move_away;
  if (cue == Cue::ready) attendant_.sound(SoundCue::ready);
  const bool types = cue == Cue::go && view_.answers && block_->answers.empty();
  page_.typing = types ? display::Page::Typing::number : display::Page::Typing::none;
  least_ = block_->least;
  most_ = block_->most;
  page_.wheel =
      cue == Cue::go && block_->task == protocols::TaskKind::adjust && by_ == AnswerBy::keys;
  screen_.show(page_);
}

/// Shows where the tip is on its way from home to the target.
void KeyboardRespondent::show_way(const servo::Sample& sample) {
  if (!page_.reach || sample.time_ns - way_shown_ns_ < kPicture_ns) return;
  way_shown_ns_ = sample.time_ns;
  page_.reach->tip = sample.probe.tip;
  screen_.show(page_);
}

void KeyboardRespondent::listen(const servo::Sample& sample) {
  const std::vector<display::KeyPress> presses = take_keys();
  for (std::size_t i = 0; i < presses.size(); ++i) {
    if (listen_to(presses[i])) continue;
    spoken_.assign(presses.begin() + static_cast<std::ptrdiff_t>(i), presses.end());
    break;
  }
  end_reply();
  const unsigned pressed = sample.buttons & ~static_cast<unsigned>(buttons_);
  buttons_ = sample.buttons;
  if (by_ == AnswerBy::buttons && !pending_ && onset_ns_ != 0)
    listen_to_buttons(pressed, sample.time_ns);
}

std::optional<Answer> KeyboardRespondent::step(const servo::Sample& sample) {
  if (sample.phase == servo::Phase::feeling && onset_ns_ == 0) {
    onset_ns_ = sample.time_ns;
    early_ = false;
  }
  if (sees_) screen_.follow(sample);
  show_cue(sample);
  show_way(sample);
  listen(sample);
  if (pending_ && onset_ns_ > 0 && sample.time_ns >= pending_->time_ns) return pending_;
  attendant_.attend();
  return std::nullopt;
}

std::optional<std::string> accepted_answer(const protocols::PageItem& item,
                                           const std::string& typed) {
  using Kind = protocols::PageItem::Kind;
  const bool blank = typed.find_first_not_of(' ') == std::string::npos;
  if (item.kind == Kind::number || item.kind == Kind::text) {
    if (blank) return item.required ? std::nullopt : std::optional<std::string>("");
    if (item.kind == Kind::number && !number_in(typed, item.least, item.most)) return std::nullopt;
    return typed;
  }
  for (std::size_t i = 0; i < item.choices.size(); ++i) {
    const std::string& shown = i < item.shown.size() ? item.shown[i] : item.choices[i];
    if (lower_case(typed) == lower_case(item.choices[i]) || lower_case(typed) == lower_case(shown))
      return item.choices[i];
  }
  return std::nullopt;
}

/// \param interval  null: nothing is felt or seen now
void KeyboardRespondent::see(const protocols::Trial& trial, const protocols::Interval* interval) {
  std::shared_ptr<const display::SeenTrial> seen;
  if (interval != nullptr) seen = seen_trial_of(protocol_, trial, *interval);
  if (seen == nullptr && !sees_) return;
  sees_ = seen != nullptr;
  screen_.see(seen);
}

std::vector<data::FrameRecord> KeyboardRespondent::frames() {
  std::vector<data::FrameRecord> out;
  for (const display::SeenFrame& frame : screen_.frames())
    out.push_back({frame.swap_ns, frame.pose_ns, frame.delay_ns});
  return out;
}

void KeyboardRespondent::begin_interval(const protocols::Trial& trial, const IntervalView& view) {
  view_ = view;
  see(trial, view.felt ? view.shown : nullptr);
  onset_ns_ = 0;
  buttons_ = 0xFF;
  pending_.reset();
  if (view.continues) return;  // the page stays, and no key press is lost
  keys_.clear();
  answers_.clear();
  if (view.answers && !block_->reaching) {
    for (const protocols::TaskAnswer& answer : block_->answers) {
      answers_.emplace_back(answer.key, static_cast<int>(answers_.size()));
      const std::string button = "button " + std::to_string(keys_.size() + 1);
      keys_.emplace_back(by_ == AnswerBy::buttons ? button : answer.key, answer.label);
    }
  }
  display::Page page;
  page.kind = display::Page::Kind::neutral;
  page.keys = keys_;
  if (block_->reaching) page.reach = picture_of(*block_->reaching, trial);
  way_shown_ns_ = 0;
  if (!view.felt) page.text = interval_text();
  show(std::move(page));
  early_ = true;
  take_keys();
  cue_ = Cue::none;
  cue_since_ns_ = 0;
}

/// The text shown during an interval: its number and the question.
std::string KeyboardRespondent::interval_text() const {
  const auto& texts = protocol_.texts;
  if (!block_->announced) return texts.go;
  std::string text;
  if (view_.intervals > 1 && view_.felt)
    text = std::to_string(view_.interval) + " / " + std::to_string(view_.intervals) + "\n";
  if (!view_.answers) return text + texts.next_interval;
  const protocols::TaskBlock& asked = *block_;
  if (asked.reaching) return asked.question;
  text += asked.question.empty() ? texts.answer_now : asked.question;
  if (asked.answers.empty()) text += "\n" + texts.type_number + range_text(asked.least, asked.most);
  return text;
}

bool KeyboardRespondent::listen_to(const display::KeyPress& press) {
  const bool in_time = view_.continues || (onset_ns_ > 0 && press.time_ns >= onset_ns_);
  if (!in_time) {
    reply();
    return true;
  }
  const bool turning = pending_ && is_turn(*block_, *pending_);
  if (pending_ && !turning) return true;
  const std::optional<Answer> meant = meaning_in_interval(press.key);
  if (!meant) return true;
  if (!pending_) {
    pending_ = meant;
    pending_->time_ns = press.time_ns;
    return true;
  }
  if (meant->stimulus != pending_->stimulus) return false;
  ++pending_->times;  // turned again before the last turn was presented
  return true;
}

/// Takes a character of a typed answer. Numbers have digits, a point or comma and a minus.
bool KeyboardRespondent::type(const std::string& key) {
  const bool text = page_.typing == display::Page::Typing::text;
  std::string& typed = page_.typed;
  if (key == "backspace") {
    remove_last_character(typed);
    screen_.show(page_);
    return true;
  }
  const bool digit = key.size() == 1 && key.find_first_of("0123456789.,-") == 0;
  constexpr std::array kNames = {"up", "down", "left", "tab"};  // no other names are so short
  const bool name = std::find(kNames.begin(), kNames.end(), key) != kNames.end();
  const bool letter = text && !name && (key == "space" || key.size() <= 4);
  if (!(digit || letter) || typed.size() + key.size() > kMostTyped) return false;
  typed += key == "space" ? " " : !text && key == "," ? "." : key;
  screen_.show(page_);
  return true;
}

/// Says which numbers are accepted, and keeps the typed text.
void KeyboardRespondent::refuse_number(std::optional<double> least, std::optional<double> most) {
  const auto& texts = protocol_.texts;
  reply_with((page_.typed.empty() ? texts.answer_first : texts.other_number) +
             range_text(least, most));
}

std::optional<Answer> KeyboardRespondent::typed_answer(const std::string& key) {
  const protocols::TaskBlock& asked = *block_;
  if (key != "enter") {
    if (!type(key)) reply();
    return std::nullopt;
  }
  const auto number = number_in(page_.typed, asked.least, asked.most);
  if (!number) {
    refuse_number(asked.least, asked.most);
    return std::nullopt;
  }
  Answer answer;
  answer.number = *number;
  return answer;
}

std::optional<Answer> KeyboardRespondent::meaning_in_interval(const std::string& key) {
  Answer answer;
  if (!view_.answers) {
    answer.continues = true;
    if (key == "space" || key == "enter") return answer;
    reply();
    return std::nullopt;
  }
  const protocols::TaskBlock& asked = *block_;
  if (asked.reaching) {  // the movement answers
    reply();
    return std::nullopt;
  }
  if (asked.answers.empty()) return typed_answer(key);
  const bool adjusts = asked.task == TaskKind::adjust;
  const char* const wheel = key == "wheel up" ? "up" : key == "wheel down" ? "down" : "";
  for (std::size_t i = 0; i < answers_.size() && by_ != AnswerBy::buttons; ++i) {
    const bool turned = adjusts && asked.answers[i].name == wheel;
    if (protocols::one_key(answers_[i].first) != protocols::one_key(key) && !turned) continue;
    answer.stimulus = answers_[i].second;
    if (view_.interval == 2 && is_turn(asked, answer)) break;  // the standard is not turned
    return answer;
  }
  reply();
  return std::nullopt;
}

/// Any button continues; button n stands for the n-th answer.
void KeyboardRespondent::listen_to_buttons(unsigned pressed, std::int64_t time_ns) {
  if (pressed == 0 || block_->reaching) return;
  Answer answer;
  answer.time_ns = time_ns;
  answer.continues = !view_.answers;
  const std::size_t count = view_.answers ? answers_.size() : 8;
  for (std::size_t i = 0; i < count && i < 8; ++i) {
    if ((pressed >> i & 1U) == 0) continue;
    answer.stimulus = view_.answers ? answers_[i].second : static_cast<int>(i);
    if (view_.answers && view_.interval == 2 && is_turn(*block_, answer)) return reply();
    pending_ = answer;
    return;
  }
}

void KeyboardRespondent::look_at_buttons(const servo::Sample& newest) {
  const unsigned pressed = newest.buttons & ~static_cast<unsigned>(buttons_);
  buttons_ = newest.buttons;
  if (by_ != AnswerBy::buttons || pressed == 0 || page_.typing != display::Page::Typing::none)
    return;
  const auto button = static_cast<std::size_t>(std::countr_zero(pressed));
  if (page_.keys.empty()) {
    spoken_.push_back({"space", newest.time_ns});
  } else if (button < page_.keys.size()) {
    spoken_.push_back({page_.keys[button].first, newest.time_ns});
  } else {
    reply();
  }
}

bool KeyboardRespondent::spoken(const std::string& answer, std::int64_t time_ns) {
  if (early_) return false;
  if (answer.empty()) {
    spoken_.push_back({"space", time_ns});
    return true;
  }
  if (page_.typing == display::Page::Typing::number) {
    std::string number = answer;
    std::replace(number.begin(), number.end(), ',', '.');
    if (!number_in(number, least_, most_)) return false;
  }
  if (page_.typing != display::Page::Typing::none) {
    while (!page_.typed.empty()) type("backspace");
    std::string character;
    for (const char c : answer) {
      const bool begins = !continues_character(c);
      if (begins && !character.empty()) spoken_.push_back({std::exchange(character, {}), time_ns});
      if (c == ' ') spoken_.push_back({"space", time_ns});
      if (c != ' ') character += c;
    }
    if (!character.empty()) spoken_.push_back({character, time_ns});
    spoken_.push_back({"enter", time_ns});
    return true;
  }
  for (std::size_t i = 0; i < page_.keys.size(); ++i) {
    const auto& [key, label] = page_.keys[i];
    if (lower_case(answer) != lower_case(key) && lower_case(answer) != lower_case(label)) continue;
    spoken_.push_back({key, time_ns});
    return true;
  }
  return false;
}

display::KeyPress KeyboardRespondent::wait_for_key(std::int64_t since_ns, bool whole_bursts) {
  while (true) {
    std::vector<display::KeyPress> keys = take_keys();
    for (std::size_t i = 0; i < keys.size(); ++i) {
      if (keys[i].time_ns < since_ns) {
        if (whole_bursts) since_ns = std::max(since_ns, keys[i].time_ns + kBurst_ns);
        continue;
      }
      // Keep the others for the next call: keys may arrive faster than they are polled.
      spoken_.assign(keys.begin() + static_cast<std::ptrdiff_t>(i) + 1, keys.end());
      return keys[i];
    }
    end_reply();
    attendant_.attend();
    clock_.wait_until(clock_.now_ns() + kAskPause_ns);
  }
}

int KeyboardRespondent::page_through(const std::vector<ReadScreen>& screens, const Keys& keys,
                                     display::Page::Kind kind, std::int64_t& time_ns) {
  std::size_t at = 0;
  while (true) {
    const bool last = at + 1 == screens.size();
    const std::int64_t since_ns = clock_.now_ns();
    display::Page page = kind == display::Page::Kind::text ? between_trials(kind, screens[at].text)
                                                           : display::Page{};
    page.kind = kind;
    page.text = screens[at].text;
    page.picture = screens[at].picture;
    page.part = static_cast<int>(at) + 1;
    page.parts = static_cast<int>(screens.size());
    if (last) page.keys = keys;
    show(std::move(page));
    for (const std::size_t shown = at; at == shown;) {
      const display::KeyPress press = wait_for_key(since_ns);
      time_ns = press.time_ns;
      const auto key = std::find_if(keys.begin(), keys.end(), [&press](const auto& entry) {
        return protocols::one_key(entry.first) == protocols::one_key(press.key);
      });
      const bool forward = press.key == "space" || press.key == "enter" || press.key == "right";
      const bool back = press.key == "left" || press.key == "backspace";
      if (last && key != keys.end()) return static_cast<int>(key - keys.begin());
      if (last && forward && press.key != "right" && keys.empty()) return -1;
      if (forward && !last) {
        ++at;
      } else if (back && at > 0) {
        --at;
      } else {
        reply();
      }
    }
  }
}

void KeyboardRespondent::read_screens(const std::vector<ReadScreen>& screens) {
  std::vector<ReadScreen> shown;
  for (const ReadScreen& screen : screens) {
    if (!screen.text.empty() || screen.picture) shown.push_back(screen);
  }
  std::int64_t time_ns = 0;
  if (!shown.empty()) page_through(shown, {}, display::Page::Kind::text, time_ns);
}

std::optional<Answer> KeyboardRespondent::confidence(const protocols::ConfidenceSpec& asked) {
  std::vector<std::string> labels;
  labels.reserve(asked.scale.size());
  for (const protocols::ScaleStep& step : asked.scale) labels.push_back(step.label);
  Answer answer;
  answer.stimulus = page_through({{asked.question, nullptr}}, numbered(labels),
                                 display::Page::Kind::message, answer.time_ns);
  return answer;
}

display::Page KeyboardRespondent::question_page(const protocols::PageItem& item,
                                                display::Page::Kind kind, const Asking& how) const {
  display::Page page = between_trials(kind, item.question);
  page.back = how.can_go_back;
  return page;
}

std::optional<std::string> KeyboardRespondent::ask_typed(const protocols::PageItem& item,
                                                         const Asking& how) {
  const std::int64_t since_ns = clock_.now_ns();
  const bool text = item.kind == protocols::PageItem::Kind::text;
  display::Page page = question_page(item, display::Page::Kind::message, how);
  page.typing = text ? display::Page::Typing::text : display::Page::Typing::number;
  page.typed = how.given.value_or("");
  if (const std::string range = range_text(item.least, item.most); !text && !range.empty())
    page.text += "\n" + range.substr(1);
  least_ = item.least;
  most_ = item.most;
  show(std::move(page));
  std::int64_t erased_ns = since_ns - kBurst_ns;
  while (true) {
    const display::KeyPress press = wait_for_key(since_ns, !text);
    const bool erases = press.key == "backspace";
    // A Backspace that is held down to erase the answer must not go on to the question before.
    const bool anew = erases && page_.typed.empty() && press.time_ns - erased_ns >= kBurst_ns;
    if (how.can_go_back && (press.key == "left" || anew)) return std::nullopt;
    if (erases) erased_ns = press.time_ns;
    if (press.key != "enter") {
      if (!type(press.key)) reply();
    } else if (auto answer = accepted_answer(item, page_.typed)) {
      return answer;
    } else if (text) {
      reply_with(protocol_.texts.answer_first);
    } else {
      refuse_number(item.least, item.most);
    }
  }
}

bool KeyboardRespondent::number_begins(const display::KeyPress& digit) {
  const auto of_number = [](const std::string& key) {
    return key == "enter" || (key.size() == 1 && key.find_first_of("0123456789.,-") == 0);
  };
  bool begins = false;
  std::vector<display::KeyPress> others;
  for (std::int64_t until_ns = digit.time_ns + kBurst_ns; clock_.now_ns() < until_ns;) {
    for (const display::KeyPress& press : take_keys()) {
      const bool more = of_number(press.key) && (begins || press.key != "enter");
      if (more && press.time_ns < until_ns) {
        begins = true;
        until_ns = press.time_ns + kBurst_ns;
      } else {
        others.push_back(press);
      }
    }
    attendant_.attend();
    clock_.wait_until(clock_.now_ns() + kAskPause_ns);
  }
  spoken_.insert(spoken_.begin(), others.begin(), others.end());
  return begins;
}

std::optional<std::string> KeyboardRespondent::ask_choice(const protocols::PageItem& item,
                                                          const Asking& how) {
  const std::int64_t since_ns = clock_.now_ns();
  const Keys keys = numbered(item.shown);
  display::Page page = question_page(item, display::Page::Kind::text, how);
  page.part = page.parts = 1;
  page.keys = keys;
  const auto given = std::find(item.choices.begin(), item.choices.end(), how.given.value_or(""));
  if (how.given && given != item.choices.end())
    page.chosen = keys[static_cast<std::size_t>(given - item.choices.begin())].first;
  show(std::move(page));
  while (true) {
    const display::KeyPress press = wait_for_key(since_ns);
    const bool forward = press.key == "space" || press.key == "enter" || press.key == "right";
    const bool back = press.key == "left" || press.key == "backspace";
    if (how.can_go_back && back) return std::nullopt;
    if (how.given && forward) return how.given;
    const auto key = std::find_if(keys.begin(), keys.end(), [&press](const auto& entry) {
      return protocols::one_key(entry.first) == protocols::one_key(press.key);
    });
    const bool digit = press.key.size() == 1 && press.key[0] >= '0' && press.key[0] <= '9';
    if (key != keys.end() && !(how.number_follows && digit && number_begins(press)))
      return item.choices[static_cast<std::size_t>(key - keys.begin())];
    reply();
  }
}

std::optional<std::string> KeyboardRespondent::ask(const protocols::PageSpec& page,
                                                   const protocols::PageItem& item,
                                                   const Asking& how) {
  using Kind = protocols::PageItem::Kind;
  if (page.kind == protocols::PageSpec::Kind::consent) {
    std::int64_t time_ns = 0;
    const Keys keys = numbered({protocol_.texts.agree, protocol_.texts.disagree});
    const int at =
        page_through(screens_of_text(page.text), keys, display::Page::Kind::text, time_ns);
    return at == 0 ? "agree" : "disagree";
  }
  const bool choice = item.kind == Kind::choice || item.kind == Kind::scale;
  return choice ? ask_choice(item, how) : ask_typed(item, how);
}

}  // namespace palpate::runner::participants
