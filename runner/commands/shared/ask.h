#pragma once
// Questions to whoever sits at the terminal that a command was started from.

#include <optional>
#include <string>
#include <vector>

namespace palpate::runner {

/// Somebody can be asked: standard input and standard error are a terminal.
bool on_a_terminal();

/// A line of standard input, without its end and the spaces around it. What follows is left there
/// for others. None: the input has ended. \throws UsageError: a line of more than 200 bytes.
std::optional<std::string> read_line();

/// Says `question` on standard error and reads the answer; without a terminal reads only.
std::optional<std::string> ask(const std::string& question);

/// `given`, or what stands on standard input where that is "-": other users of the computer see
/// every command line. \param what "participant code". \throws UsageError: nothing stands there.
std::string given_or_asked(const std::string& given, const std::string& what);

/// "P01", "P01 and P02", "P01, P02 and P03"
std::string in_words(const std::vector<std::string>& names);

}  // namespace palpate::runner
