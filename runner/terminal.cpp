#include "runner/terminal.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <iostream>
#include <string_view>

#include "data/base/text.h"
#include "runner/usage_error.h"

namespace palpate::runner {

bool on_a_terminal() { return isatty(STDIN_FILENO) == 1 && isatty(STDERR_FILENO) == 1; }

std::optional<std::string> read_line() {
  constexpr std::size_t kLongest = 200;
  std::string line;
  while (true) {
    char c = 0;
    const ssize_t got = read(STDIN_FILENO, &c, 1);  // byte by byte, to leave later input unread
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0 && line.empty()) return std::nullopt;
    if (got <= 0 || c == '\n') break;
    if (line.size() == kLongest)
      throw UsageError("standard input: a line must have at most 200 bytes");
    line += c;
  }
  const std::size_t begin = line.find_first_not_of(" \t\r");
  if (begin == std::string::npos) return "";
  return line.substr(begin, line.find_last_not_of(" \t\r") - begin + 1);
}

std::optional<std::string> ask(const std::string& question) {
  if (on_a_terminal()) std::cerr << question << std::flush;
  return read_line();
}

std::string given_or_asked(const std::string& given, const std::string& what) {
  if (given != "-") return given;
  const auto answer = ask(what + ": ");
  if (!answer) throw UsageError("-: standard input must hold a " + what);
  return *answer;
}

void say(const std::string& text) { std::fprintf(stderr, "%s\n", printable_lines(text).c_str()); }

std::string join_names(const std::vector<std::string>& names) {
  std::string words;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) words += i + 1 == names.size() ? " and " : ", ";
    words += names[i];
  }
  return words;
}

std::string shell_quoted(const std::string& text) {
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("/._-+=:,@%").find(c) != std::string_view::npos;
  };
  if (!text.empty() && std::ranges::all_of(text, is_plain)) return text;
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

}  // namespace palpate::runner
