#include "runner/session/session_end.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "runner/safety/fault_signals.h"
#include "runner/servo/servo.h"

namespace palpate::runner::session {
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

bool SessionFault::is_transient() const {
  if (faults & (servo::servo_fault::kEmergency | rendering::render_fault::kNonFinite)) return false;
  if (faults & servo::servo_fault::kDeviceLost)
    return trouble == servo::DeviceTrouble::guard_late || trouble == servo::DeviceTrouble::guarded;
  return (faults & (servo::servo_fault::kMissedTicks | servo::servo_fault::kStalled)) != 0;
}

std::string trip_reason(std::uint32_t faults, servo::DeviceTrouble trouble) {
  using namespace servo::servo_fault;
  for (const std::uint32_t bit :
       {kEmergency, kStalled, kDeviceLost, kMissedTicks, rendering::render_fault::kNonFinite,
        rendering::render_fault::kSoftStalled}) {
    if ((faults & bit) == 0) continue;
    std::string why = bit == kDeviceLost ? servo::advice(trouble) : "";
    if (trouble == servo::DeviceTrouble::guard_late || trouble == servo::DeviceTrouble::guarded) {
      if (!why.empty()) return why;
    }
    return safety::fault_row(bit).why + (why.empty() ? why : ": " + why);
  }
  return safety::fault_row(kTripped).why;
}

}  // namespace palpate::runner::session
