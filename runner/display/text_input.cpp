#include "runner/display/text_input.h"

#include <algorithm>
#include <array>
#include <utility>

#include "data/base/text.h"

namespace palpate::runner {
namespace {

using Kind = ConsoleCommand::Kind;

struct CommandText {
  std::string_view line;
  Kind kind;
};

constexpr CommandText kCommands[] = {
    {"pause", Kind::pause},
    {"go", Kind::go_on},
    {"repeat", Kind::repeat_trial},
    {"stop", Kind::stop_after_trial},
    {"stop block", Kind::stop_after_block},
    {"zero", Kind::emergency_zero},
    {"clear", Kind::clear_fault},
    {"quit", Kind::quit},
    {"answer", Kind::answer},
};

constexpr char kEscape = '\x1b';
constexpr char kDelete = '\x7f';
constexpr char kClearLine = '\x15';  // Ctrl-U
constexpr std::size_t kLongestLine = 4000;

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

/// Commands are not case-sensitive.
std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c + ('a' - 'A')) : c;
  return out;
}

}  // namespace

const char* text_commands_help() {
  return "commands, each ended by Enter:\n"
         "  :pause       before the next trial       :go          go on\n"
         "  :repeat      show this trial again       :note TEXT   a note with its time\n"
         "  :stop        end after this trial        :stop block  end after this block\n"
         "               (repeat the command to cancel)\n"
         "  :zero, Esc   emergency: forces off       :clear       allow forces again\n"
         "  :quit        end at once                 :quit withdrawn  the participant withdraws\n"
         "  :answer X    the participant's answer, spoken; without X: on to the next\n";
}

std::string_view text_command(Kind kind) {
  for (const CommandText& word : kCommands) {
    if (kind == word.kind) return word.line;
  }
  return "note";
}

ConsoleCommand parse_text_command(std::string_view line, std::int64_t time_ns) {
  line = trimmed(line);
  const std::string said = lower(line);
  for (const CommandText& word : kCommands) {
    if (said != word.line) continue;
    return {word.kind, word.kind == Kind::emergency_zero ? ":zero" : "", time_ns};
  }
  for (const auto& [word, kind] : {std::pair(std::string_view("note "), Kind::note),
                                   std::pair(std::string_view("answer "), Kind::answer),
                                   std::pair(std::string_view("quit "), Kind::quit)}) {
    if (said.rfind(word, 0) == 0)
      return {kind, std::string(trimmed(line.substr(word.size()))), time_ns};
  }
  return {Kind::note, "", time_ns};
}

void TextInput::end_line(std::int64_t time_ns, std::vector<Event>& out) {
  const std::string line = std::exchange(line_, {});
  const ConsoleCommand command = parse_text_command(std::string_view(line).substr(1), time_ns);
  if (command.kind == Kind::note && command.text.empty()) {
    out.emplace_back(Unknown{line});
  } else {
    out.emplace_back(command);
  }
}

void TextInput::letter(const std::string& text, std::int64_t time_ns, std::vector<Event>& out) {
  const bool enter = text == "\n" || text == "\r";
  if (!line_.empty()) {
    if (enter) {
      end_line(time_ns, out);
    } else if (text[0] == kDelete || text[0] == '\b') {
      while (continues_character(line_.back())) line_.pop_back();
      line_.pop_back();
    } else if (text[0] == kClearLine) {
      line_.clear();
    } else if (static_cast<unsigned char>(text[0]) >= ' ' && line_.size() < kLongestLine) {
      line_ += text;
    }
    return;
  }
  if (text == ":") {
    line_ = text;
  } else if (text[0] == kDelete || text[0] == '\b') {
    out.emplace_back(KeyPress{"backspace", time_ns});
  } else if (enter) {
    out.emplace_back(KeyPress{"enter", time_ns});
  } else if (text == " " || text == "\t") {
    out.emplace_back(KeyPress{text == " " ? "space" : "tab", time_ns});
  } else if (static_cast<unsigned char>(text[0]) > ' ' && text[0] != kDelete) {
    out.emplace_back(KeyPress{text, time_ns});
  }
}

/// \return how many bytes of `rest`, which begins with Escape, it took
std::size_t TextInput::escape(std::string_view rest, std::int64_t time_ns,
                              std::vector<Event>& out) {
  const auto emergency = [time_ns](const std::string& key) {
    return ConsoleCommand{Kind::emergency_zero, "the key " + key, time_ns};
  };
  if (rest.size() >= 3 && rest[1] == 'O') {  // keypad in its application mode
    if (rest[2] >= 'p' && rest[2] <= 'y')
      out.emplace_back(KeyPress{std::string(1, static_cast<char>('0' + rest[2] - 'p')), time_ns});
    if (rest[2] == 'M') out.emplace_back(KeyPress{"enter", time_ns});
    return 3;
  }
  if (rest.size() >= 3 && rest[1] == '[') {
    std::size_t end = 2;
    while (end < rest.size() && (rest[end] < '@' || rest[end] > '~')) ++end;
    if (rest.substr(2, end - 2) == "24" && end < rest.size() && rest[end] == '~')
      out.emplace_back(emergency("F12"));
    constexpr std::array kArrows = {"up", "down", "right", "left"};
    if (end == 2 && line_.empty() && rest[2] >= 'A' && rest[2] <= 'D')
      out.emplace_back(KeyPress{kArrows[static_cast<std::size_t>(rest[2] - 'A')], time_ns});
    return std::min(end + 1, rest.size());
  }
  // Terminals send Alt and a key as Escape followed by the key. That cannot be told from Escape
  // alone without waiting, so it is an emergency too.
  const std::string_view key = rest.substr(1);
  if (!key.empty() && static_cast<unsigned char>(key[0]) > ' ' && key[0] != kDelete &&
      utf8_size(key[0]) == key.size()) {
    out.emplace_back(emergency("Alt+" + std::string(key)));
    return rest.size();  // the key is not an answer
  }
  out.emplace_back(emergency("Escape"));
  return 1;
}

std::vector<TextInput::Event> TextInput::feed(std::string_view bytes, std::int64_t time_ns) {
  std::vector<Event> out;
  const std::string all = std::exchange(partial_, {}) + std::string(bytes);
  const std::string_view rest = all;
  for (std::size_t at = 0; at < rest.size();) {
    if (rest[at] == kEscape) {
      at += escape(rest.substr(at), time_ns, out);
      continue;
    }
    const std::size_t length = utf8_size(rest[at]);
    if (length == 0) {  // no UTF-8
      ++at;
      continue;
    }
    std::size_t whole = 1;
    while (whole < length && at + whole < rest.size() && continues_character(rest[at + whole]))
      ++whole;
    if (whole < length && at + whole == rest.size()) {
      partial_ = rest.substr(at);
      break;
    }
    if (whole == length) letter(std::string(rest.substr(at, length)), time_ns, out);
    at += whole;
  }
  return out;
}

}  // namespace palpate::runner
