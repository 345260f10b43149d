#pragma once
// The user's terminal and shell: questions, lists of names, quoted words.

#include <optional>
#include <string>
#include <vector>

namespace palpate::runner {

/// Whether the user can be asked: standard input and standard error are a terminal.
bool on_a_terminal();

/// A line of standard input without its end and surrounding spaces; later input is left unread.
/// nullopt: the input has ended. \throws UsageError if the line is longer than 200 bytes.
std::optional<std::string> read_line();

/// Prints `question` on standard error, if there is a terminal, and reads the answer.
std::optional<std::string> ask(const std::string& question);

/// `given`, or a line of standard input if that is "-", because other users of the computer can see
/// command lines. \param what  "participant code". \throws UsageError if standard input is empty.
std::string given_or_asked(const std::string& given, const std::string& what);

/// Prints lines on standard error; control characters are shown, not sent.
void say(const std::string& text);

/// "P01", "P01 and P02", "P01, P02 and P03"
std::string join_names(const std::vector<std::string>& names);

/// A word of a shell's command line, in quotes if it needs them.
std::string shell_quoted(const std::string& text);

}  // namespace palpate::runner
