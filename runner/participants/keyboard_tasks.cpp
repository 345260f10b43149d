// The part of KeyboardRespondent that version 2 has: intervals, typed numbers, confidence, pages.

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <utility>

#include "runner/participants/keyboard.h"

namespace palpate::runner {
namespace {

constexpr std::int64_t kAskPause_ns = 5'000'000;
constexpr std::size_t kMostTyped = 200;

/// "1", "2", ... with the texts, as keys of a page.
std::vector<std::pair<std::string, std::string>> numbered(const std::vector<std::string>& texts) {
  std::vector<std::pair<std::string, std::string>> keys;
  keys.reserve(texts.size());
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const std::string key =
        i < 9 ? std::to_string(i + 1) : std::string(1, static_cast<char>('a' + i - 9));
    keys.emplace_back(key, texts[i]);
  }
  return keys;
}

}  // namespace

const protocols::TaskBlock* KeyboardRespondent::task() const {
  return task_block_ < 0 ? nullptr : &protocol_.blocks[static_cast<std::size_t>(task_block_)];
}

void KeyboardRespondent::begin_interval(const protocols::Trial&, const IntervalView& view) {
  view_ = view;
  keys_.clear();
  typed_.clear();
  if (view.answers) {
    for (const protocols::TaskAnswer& answer : task()->answers) {
      const std::string button = "button " + std::to_string(keys_.size() + 1);
      keys_.emplace_back(by_ == AnswerBy::keys ? answer.key : button, answer.label);
    }
  }
  Page page;
  page.kind = Page::Kind::neutral;
  page.keys = keys_;
  if (!view.felt) page.text = interval_text();
  show(std::move(page));
  screen_.keys();
  cue_ = Cue::none;
  cue_since_ns_ = 0;
  onset_ns_ = 0;
  buttons_ = 0xFF;
  pending_.reset();
}

/// What is read while an interval is felt: which one it is, what is asked, what was typed.
std::string KeyboardRespondent::interval_text() const {
  const auto& texts = protocol_.texts;
  std::string text;
  if (view_.intervals > 1 && view_.felt)
    text = std::to_string(view_.interval) + " / " + std::to_string(view_.intervals) + "\n";
  if (!view_.answers) return text + texts.next_interval;
  const protocols::TaskBlock& asked = *task();
  text += asked.question.empty() ? texts.answer_now : asked.question;
  if (asked.answers.empty()) text += "\n" + (typed_.empty() ? texts.type_number : typed_ + "_");
  return text;
}

/// Letters, digits and the space bar; for numbers digits, point, comma and minus.
bool KeyboardRespondent::type(const std::string& key, bool text) {
  if (key == "backspace") {
    // A character of UTF-8 goes as a whole.
    while (!typed_.empty() && (static_cast<unsigned char>(typed_.back()) & 0xC0U) == 0x80U)
      typed_.pop_back();
    if (!typed_.empty()) typed_.pop_back();
    return true;
  }
  const bool digit = key.size() == 1 && key.find_first_of("0123456789.,-") == 0;
  const bool letter = text && (key == "space" || key.size() <= 4) && key != "up" && key != "down" &&
                      key != "tab" && key != "left";
  if (!(digit || letter) || typed_.size() + key.size() > kMostTyped) return false;
  typed_ += key == "space" ? " " : !text && key == "," ? "." : key;
  return true;
}

std::optional<double> KeyboardRespondent::typed_number(std::optional<double> least,
                                                       std::optional<double> most) const {
  double number = 0;
  const char* const end = typed_.data() + typed_.size();
  const auto [at, error] = std::from_chars(typed_.data(), end, number);
  if (error != std::errc{} || at != end) return std::nullopt;
  if ((least && number < *least) || (most && number > *most)) return std::nullopt;
  return number;
}

std::optional<Answer> KeyboardRespondent::meaning_in_interval(const std::string& key) {
  Answer answer;
  if (!view_.answers) {
    answer.goes_on = true;
    if (key == "space" || key == "enter") return answer;
    reply();
    return std::nullopt;
  }
  const protocols::TaskBlock& asked = *task();
  if (asked.answers.empty()) {
    if (key == "enter") {
      const auto number = typed_number(asked.least, asked.most);
      if (number) answer.number = *number;
      if (number) return answer;
      reply();
      return std::nullopt;
    }
    if (!type(key, false)) reply();
    page_.text = interval_text();
    screen_.show(page_);
    return std::nullopt;
  }
  for (std::size_t i = 0; i < asked.answers.size() && by_ == AnswerBy::keys; ++i) {
    if (asked.answers[i].key != key) continue;
    answer.stimulus = static_cast<int>(i);
    return answer;
  }
  reply();
  return std::nullopt;
}

/// Any button goes on; button n stands for the n-th answer.
void KeyboardRespondent::listen_to_buttons(unsigned pressed, std::int64_t time_ns) {
  if (pressed == 0) return;
  Answer answer;
  answer.time_ns = time_ns;
  answer.goes_on = !view_.answers;
  const std::size_t count = view_.answers ? task()->answers.size() : 8;
  for (std::size_t i = 0; i < count && i < 8; ++i) {
    if ((pressed >> i & 1U) == 0) continue;
    answer.stimulus = static_cast<int>(i);
    pending_ = answer;
    return;
  }
}

KeyPress KeyboardRespondent::wait_for_key(std::int64_t since_ns) {
  while (true) {
    for (const KeyPress& press : screen_.keys()) {
      if (press.time_ns >= since_ns) return press;
    }
    end_reply();
    attendant_.attend();
    clock_.wait_until(clock_.now_ns() + kAskPause_ns);
  }
}

/// \return index into keys
int KeyboardRespondent::choose(const std::string& question, const Keys& keys,
                               std::int64_t& time_ns) {
  const std::int64_t since_ns = clock_.now_ns();
  Page page;
  page.kind = Page::Kind::message;
  page.text = question;
  page.keys = keys;
  show(std::move(page));
  while (true) {
    const KeyPress press = wait_for_key(since_ns);
    const auto at = std::find_if(keys.begin(), keys.end(),
                                 [&](const auto& key) { return key.first == press.key; });
    time_ns = press.time_ns;
    if (at != keys.end()) return static_cast<int>(at - keys.begin());
    reply();
  }
}

std::optional<Answer> KeyboardRespondent::confidence(const protocols::ConfidenceSpec& asked) {
  std::vector<std::string> labels;
  labels.reserve(asked.scale.size());
  for (const protocols::ScaleStep& step : asked.scale) labels.push_back(step.label);
  Answer answer;
  answer.stimulus = choose(asked.question, numbered(labels), answer.time_ns);
  return answer;
}

std::string KeyboardRespondent::ask_typed(const protocols::PageItem& item) {
  const std::int64_t since_ns = clock_.now_ns();
  const bool text = item.kind == protocols::PageItem::Kind::text;
  typed_.clear();
  show(between_trials(Page::Kind::message, item.question + "\n_"));
  while (true) {
    const KeyPress press = wait_for_key(since_ns);
    if (press.key == "enter") {
      const bool left_out = typed_.empty() && !item.required;
      const bool valid = text ? !typed_.empty() : typed_number(item.least, item.most).has_value();
      if (left_out || valid) return typed_;
      reply();
    } else if (!type(press.key, text)) {
      reply();
    } else {
      page_.text = item.question + "\n" + typed_ + "_";
      screen_.show(page_);
    }
  }
}

std::string KeyboardRespondent::ask(const protocols::PageSpec& page,
                                    const protocols::PageItem& item) {
  std::int64_t time_ns = 0;
  if (page.kind == protocols::PageSpec::Kind::consent) {
    const Keys keys = numbered({protocol_.texts.agree, protocol_.texts.disagree});
    return choose(page.text, keys, time_ns) == 0 ? "agree" : "disagree";
  }
  if (item.kind != protocols::PageItem::Kind::choice &&
      item.kind != protocols::PageItem::Kind::scale)
    return ask_typed(item);
  const int at = choose(item.question, numbered(item.choices), time_ns);
  return item.choices[static_cast<std::size_t>(at)];
}

}  // namespace palpate::runner
