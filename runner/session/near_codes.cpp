#include "runner/session/near_codes.h"

#include <algorithm>
#include <cstddef>

namespace palpate::runner::session {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// Removes easily misread differences: case, O and 0, I and l and 1, leading zeros of a number.
std::string read_alike(const std::string& code) {
  std::string all;
  for (char c : code) {
    c = lower(c);
    all += c == 'o' ? '0' : c == 'i' || c == 'l' ? '1' : c;
  }
  std::string out;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool number_begins = out.empty() || !is_digit(out.back());
    const bool more = i + 1 < all.size() && is_digit(all[i + 1]);
    if (all[i] != '0' || !number_begins || !more) out += all[i];
  }
  return out;
}

struct CodeParts {
  std::string letters, digits;
};

CodeParts parts_of(const std::string& code) {
  CodeParts parts;
  for (const char c : code) (is_digit(c) ? parts.digits : parts.letters) += lower(c);
  return parts;
}

bool one_left_out(const std::string& longer, const std::string& shorter) {
  if (longer.size() != shorter.size() + 1) return false;
  const auto [at, same] = std::mismatch(shorter.begin(), shorter.end(), longer.begin());
  return std::equal(at, shorter.end(), same + 1);
}

bool one_changed_or_two_swapped(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  const auto [x, y] = std::mismatch(a.begin(), a.end(), b.begin());
  if (x == a.end()) return false;
  if (std::equal(x + 1, a.end(), y + 1)) return true;
  return x + 1 != a.end() && x[0] == y[1] && x[1] == y[0] && std::equal(x + 2, a.end(), y + 2);
}

bool a_letter_away(const std::string& a, const std::string& b) {
  // Short codes may differ by one letter on purpose: A1 and B1, initials of three letters.
  constexpr std::size_t kTelling = 4;
  const CodeParts x = parts_of(a), y = parts_of(b);
  if (x.digits != y.digits) return false;
  const std::size_t letters = std::max(x.letters.size(), y.letters.size());
  if ((!x.digits.empty() || letters >= kTelling) &&
      (one_left_out(x.letters, y.letters) || one_left_out(y.letters, x.letters))) {
    return true;
  }
  return letters >= kTelling && one_changed_or_two_swapped(x.letters, y.letters);
}

}  // namespace

std::vector<std::string> near_codes(const std::string& code,
                                    const std::vector<std::string>& known) {
  std::vector<std::string> near;
  for (const std::string& other : known) {
    if (other == code) continue;
    if (read_alike(other) == read_alike(code) || a_letter_away(other, code)) near.push_back(other);
  }
  return near;
}

}  // namespace palpate::runner::session
