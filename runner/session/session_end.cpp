#include "runner/session/session_end.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace palpate::runner {
namespace {

constexpr std::array<std::string_view, 5> kWithdrawals = {"withdrawn", "withdraws", "withdraw",
                                                          "withdrew", "withdrawal"};

bool is_letter(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }

bool says_withdrawn(const std::string& word) {
  std::string lower;
  for (const char c : word) lower += static_cast<char>(c | 0x20);  // a letter
  return std::find(kWithdrawals.begin(), kWithdrawals.end(), lower) != kWithdrawals.end();
}

}  // namespace

EndOfSession end_by_experimenter(const std::string& words) {
  for (auto begin = words.begin(), end = begin; begin != words.end(); begin = end) {
    begin = std::find_if(begin, words.end(), is_letter);
    end = std::find_if_not(begin, words.end(), is_letter);
    const std::string word(begin, end);
    if (!says_withdrawn(word)) continue;
    return {data::RunEnd::withdrawn,
            "the participant withdrew" + (word == words ? "" : ": " + words)};
  }
  return {data::RunEnd::aborted, "ended by the experimenter" + (words.empty() ? "" : ": " + words)};
}

}  // namespace palpate::runner
