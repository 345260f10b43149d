#pragma once
// Parses terminal input: single keys are answers, a line that begins with ':' is a command, Escape
// and F12 are emergency keys, and so is Alt with any key.

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "runner/display/display.h"

namespace palpate::runner {

/// The list of commands of the text console.
const char* text_commands_help();

/// The text to type for a command, without the colon.
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
  /// The command line being typed, with its colon; empty: none.
  const std::string& line() const { return line_; }

 private:
  std::size_t escape(std::string_view rest, std::int64_t time_ns, std::vector<Event>& out);
  void letter(const std::string& text, std::int64_t time_ns, std::vector<Event>& out);
  void end_line(std::int64_t time_ns, std::vector<Event>& out);

  std::string line_;
  std::string partial_;  ///< a UTF-8 sequence that has not come whole
};

}  // namespace palpate::runner
