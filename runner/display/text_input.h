#pragma once
// What is typed into a terminal or a pipe, as answers and commands: single keys answer, a line that
// begins with ':' is a command, Escape or F12 is the emergency key, and so is Alt with any other.

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "runner/display/display.h"

namespace palpate::runner {

/// The commands of the text console, a line each.
const char* text_commands_help();

/// How it is typed, without the colon.
std::string_view text_command(ConsoleCommand::Kind kind);

/// "pause", "note TEXT", ... without the colon. Unknown: kind note with an empty text.
ConsoleCommand parse_text_command(std::string_view line, std::int64_t time_ns);

class TextInput {
 public:
  struct Unknown {
    std::string line;
  };
  using Event = std::variant<KeyPress, ConsoleCommand, Unknown>;

  /// \param bytes  that arrived together at `time_ns`
  std::vector<Event> feed(std::string_view bytes, std::int64_t time_ns);
  /// The command being typed, with its colon; empty: none.
  const std::string& line() const { return line_; }

 private:
  std::size_t escape(std::string_view rest, std::int64_t time_ns, std::vector<Event>& out);
  void letter(const std::string& text, std::int64_t time_ns, std::vector<Event>& out);
  void end_line(std::int64_t time_ns, std::vector<Event>& out);

  std::string line_;
  std::string partial_;  ///< a UTF-8 sequence that has not come whole
};

}  // namespace palpate::runner
