#include "runner/display/terminal.h"

#include <sys/ioctl.h>

#include "data/base/text.h"

namespace palpate::runner {

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

}  // namespace palpate::runner
