#include "runner/display/text_display.h"

#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <deque>
#include <string_view>
#include <utility>

#include "data/base/text.h"
#include "data/base/utf8.h"
#include "data/base/words.h"
#include "runner/display/console_words.h"

namespace palpate::runner::display {
namespace {

using Kind = ConsoleCommand::Kind;

struct CommandText {
  std::string_view line;
  Kind kind;
};

constexpr CommandText kCommands[] = {
    {"pause", Kind::pause},
    {"go", Kind::resume},
    {"repeat", Kind::repeat_trial},
    {"stop", Kind::stop_after_trial},
    {"stop block", Kind::stop_after_block},
    {"zero", Kind::emergency_zero},
    {"clear", Kind::clear_fault},
    {"quit", Kind::quit},
    {"answer", Kind::answer},
    {"correct", Kind::correct},
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

constexpr Page::Kind kShownText = Page::Kind::text;

std::string text_of(const Page& page) {
  std::string text = printable_lines(page.text);
  if (page.kind == Page::Kind::neutral && !page.go) return text;
  if (page.seconds_left > 0) text += "\n[" + std::to_string(page.seconds_left) + " s]";
  if (page.done > 0 && page.kind != Page::Kind::feedback)
    text += "\n[" + std::to_string(page.done) + " of " + std::to_string(page.trials) + "]";
  if (page.parts > 1)
    text += "\n[" + std::to_string(page.part) + " / " + std::to_string(page.parts) + "]";
  if (page.picture) text += "\n[a picture, which the window shows]";
  if (page.kind == kShownText && page.keys.empty()) text += "\n[space bar: go on]";
  if (page.kind == Page::Kind::message && page.parts == 0 && page.typing == Page::Typing::none)
    return text;  // nothing to answer now
  if (!page.keys.empty() && page.kind != Page::Kind::neutral) text += "\n";
  if (page.typing != Page::Typing::none) text += "\n> " + printable(page.typed);
  for (const auto& [key, answer] : page.keys) {
    text += text.empty() ? "" : "   ";
    if (key == page.chosen) text += '*';
    text += printable(key);
    text += ' ';
    text += printable(answer);
  }
  if (page.back) text += "\n[left arrow: back]";
  return text;
}

/// The text to type for a command, without the colon.
std::string_view text_command(Kind kind) {
  for (const CommandText& word : kCommands) {
    if (kind == word.kind) return word.line;
  }
  return "note";
}

std::string checklist_text(const Checklist& list) {
  std::size_t due = 0;
  while (due < list.steps.size() && list.steps[due].state != Checklist::Step::State::now) ++due;
  std::string text = "* step " + std::to_string(due + 1) + " of " +
                     std::to_string(list.steps.size()) + ": " + printable(list.instruction);
  std::string choices;
  for (const auto& [kind, meaning] : list.choices) {
    choices += choices.empty() ? " (" : "; ";
    choices += "':" + std::string(text_command(kind)) + "': " + meaning;
  }
  return text + choices + (choices.empty() ? "\n" : ")\n");
}

std::string status(const ConsoleState& state) {
  std::string text = "[" + state.state;
  if (state.practice && (state.state == "trial" || state.state == "homing")) text += ", practice";
  if (state.trial > 0) {
    text += ", block " + std::to_string(state.block) + " of " + std::to_string(state.blocks) +
            ", trial " + trial_of(state);
  }
  if (state.remaining > 60)
    text += ", " + std::to_string(static_cast<int>(state.remaining / 60)) + " min left";
  if (state.missed_ticks > 0)
    text += ", " + std::to_string(state.missed_ticks) +
            (state.missed_ticks == 1 ? " tick missed" : " ticks missed");
  if (!state.held_by.empty()) text += ": " + printable(state.held_by);
  return text + "]\n";
}

using std::chrono::steady_clock;

constexpr std::size_t kMaxWrite = 256;  // bytes; poll() promises that a terminal takes these
constexpr auto kFlushTime = std::chrono::milliseconds(300);  // for the remaining text at the end

/// The list of commands of the text console.
const char* text_commands_help() {
  return "commands, each ended by Enter:\n"
         "  :pause       before the next trial       :go          go on\n"
         "  :repeat      show this trial again       :note TEXT   a note with its time\n"
         "  :stop        end after this trial        :stop block  end after this block\n"
         "               (repeat the command to cancel)\n"
         "  :zero, Esc   emergency: forces off       :clear       allow forces again\n"
         "  :quit        end at once                 :quit withdrawn  the participant withdraws\n"
         "  :answer X    the participant's answer, spoken; without X: on to the next\n"
         "  :correct PAGE QUESTION ANSWER  another answer to a question of a page\n";
}

class TextDisplay final : public DisplayLoop {
 public:
  explicit TextDisplay(const TextSettings& settings) : settings_(settings) {
    print(std::string("Text display: keys answer; ") + text_commands_help());
  }

  ParticipantScreen& participant() override { return screen_; }
  ExperimenterConsole& console() override { return console_; }

  void run() override {
    try {
      while (!ended_.load()) step(-1);
    } catch (...) {
      screen_.close();
      throw;
    }
    const auto deadline = steady_clock::now() + kFlushTime;
    collect();
    while (!pending_.empty() && steady_clock::now() < deadline) step(20);
  }

  void end() noexcept override {
    ended_ = true;
    wake_.signal();
  }

 private:
  void print(const std::string& text) { out_.add({STDERR_FILENO, text}); }

  void collect() {
    for (Output& output : out_.take()) {
      if (output.text.front() != '\r') {
        output.text = wrapped(output.text, columns_of(output.file));
        // Write a command that is being typed again below the new text.
        if (terminal_.on() && !input_.line().empty())
          output.text = "\r\x1b[K" + output.text + printable(input_.line());
      }
      pending_.push_back(std::move(output));
    }
  }

  /// Waits for a key, for text to write, or until the output accepts it.
  void step(int timeout_ms) {
    collect();
    std::array<pollfd, 3> files = {{{wake_.file(), POLLIN, 0},
                                    {input_ended_ ? -1 : STDIN_FILENO, POLLIN, 0},
                                    {pending_.empty() ? -1 : pending_.front().file, POLLOUT, 0}}};
    if (poll(files.data(), files.size(), timeout_ms) < 0) return;  // a signal
    if (files[0].revents != 0) wake_.clear();
    if (files[1].revents != 0) read_input();
    if (files[2].revents != 0) write_output();
  }

  void read_input() {
    std::array<char, 512> bytes{};
    const ssize_t got = read(STDIN_FILENO, bytes.data(), bytes.size());
    const std::int64_t now = settings_.clock->now_ns();
    if (got < 0 && (errno == EINTR || errno == EAGAIN)) return;
    if (got <= 0) {
      input_ended_ = true;
      screen_.close();
      return;
    }
    const std::string before = input_.line();
    for (const TextInput::Event& event :
         input_.feed({bytes.data(), static_cast<std::size_t>(got)}, now)) {
      dispatch(event);
    }
    if (terminal_.on() && input_.line() != before) {
      print("\r\x1b[K" + printable(input_.line()) + (input_.line().empty() ? "\n" : ""));
    }
  }

  void dispatch(const TextInput::Event& event) {
    if (const auto* press = std::get_if<KeyPress>(&event)) {
      screen_.press(*press);
    } else if (const auto* command = std::get_if<ConsoleCommand>(&event)) {
      if (command->kind == ConsoleCommand::Kind::emergency_zero && settings_.emergency)
        settings_.emergency();
      console_.add_command(*command);
    } else {
      print(text_commands_help());
    }
  }

  void write_output() {
    Output& output = pending_.front();
    const std::string_view now = std::string_view(output.text).substr(0, kMaxWrite);
    const ssize_t written = write(output.file, now.data(), now.size());
    if (written < 0 && (errno == EINTR || errno == EAGAIN)) return;
    // Drop the text on an error (closed pipe).
    output.text.erase(0, written < 0 ? output.text.size() : static_cast<std::size_t>(written));
    if (output.text.empty()) pending_.pop_front();
  }

  const TextSettings settings_;
  RawTerminal terminal_;
  WakeEvent wake_;
  EventQueue<Output> out_;
  std::deque<Output> pending_;
  TextScreen screen_{out_, wake_};
  TextConsole console_{out_, wake_};
  TextInput input_;
  bool input_ended_ = false;
  std::atomic<bool> ended_{false};
};

/// "pause", "note TEXT", ... without the colon. Unknown: kind note with an empty text.
ConsoleCommand parse_text_command(std::string_view line, std::int64_t time_ns) {
  line = trimmed(line);
  const std::string said = lower_case(line);  // commands are not case-sensitive
  for (const CommandText& word : kCommands) {
    if (said != word.line) continue;
    return {word.kind, word.kind == Kind::emergency_zero ? ":zero" : "", time_ns};
  }
  for (const auto& [word, kind] : {std::pair(std::string_view("note "), Kind::note),
                                   std::pair(std::string_view("answer "), Kind::answer),
                                   std::pair(std::string_view("correct "), Kind::correct),
                                   std::pair(std::string_view("quit "), Kind::quit)}) {
    if (said.rfind(word, 0) == 0)
      return {kind, std::string(trimmed(line.substr(word.size()))), time_ns};
  }
  return {Kind::note, "", time_ns};
}

}  // namespace

std::string wrapped(const std::string& text, std::size_t columns) {
  if (columns < 20) return text;
  std::string out = text;
  std::size_t start = 0, space = 0, column = 0;  // of the line; the last space; letters so far
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (continues_character(out[i])) continue;
    if (out[i] == '\n') {
      start = i + 1;
      column = 0;
      continue;
    }
    if (out[i] == ' ') space = i;
    if (++column <= columns || space <= start) continue;
    out[space] = '\n';
    start = space + 1;
    column = 0;
    i = space;
  }
  return out;
}

std::size_t columns_of(int file) {
  winsize size{};
  return ioctl(file, TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
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

/// \return number of bytes consumed of `rest`, which begins with Escape
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
  // Terminals send Alt and a key as Escape followed by the key. Distinguishing that from Escape
  // alone would need a wait, so it is an emergency too.
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
    if (length == 0) {  // not UTF-8
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

void TextScreen::show(const Page& page) {
  const Page before = std::exchange(last_, page);
  std::string text;
  if (page.kind != before.kind || page.text != before.text || page.go != before.go ||
      page.typing != before.typing || page.keys != before.keys ||
      (page.keys.empty() && page.seconds_left > before.seconds_left) || page.kind == kShownText) {
    text = text_of(page);
  } else if (page.typed != before.typed) {
    text = "> " + printable(page.typed);
  }
  if (page.reply != before.reply && !page.reply.empty())
    text += (text.empty() ? "" : "\n") + printable(page.reply);
  if (text.empty()) return;
  out_.add({STDOUT_FILENO, text + "\n"});
  wake_.signal();
}
void TextConsole::show(const ConsoleState& state) {
  std::string text;
  for (messages_shown_ = std::max(messages_shown_, state.older_messages);
       messages_shown_ < state.older_messages + state.messages.size(); ++messages_shown_) {
    text += "* ";
    text += printable_lines(state.messages[messages_shown_ - state.older_messages]);
    text += '\n';
  }
  if (state.checklist.instruction != instruction_) {
    instruction_ = state.checklist.instruction;
    if (!instruction_.empty()) text += checklist_text(state.checklist);
  }
  if (!state.state.empty() &&
      (state.state != state_ || state.trial != trial_ || state.held_by != held_by_)) {
    state_ = state.state;
    held_by_ = state.held_by;
    trial_ = state.trial;
    text += status(state);
  }
  if (text.empty()) return;
  out_.add({STDERR_FILENO, text});
  wake_.signal();
}
std::string TextConsole::name_of(ConsoleCommand::Kind kind) const {
  return "':" + std::string(text_command(kind)) + "'";
}

std::unique_ptr<DisplayLoop> make_text_display(const TextSettings& settings) {
  return std::make_unique<TextDisplay>(settings);
}

}  // namespace palpate::runner::display
