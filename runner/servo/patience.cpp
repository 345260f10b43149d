#include "runner/servo/patience.h"

#include <algorithm>

namespace palpate::runner::servo {
namespace {

using std::chrono::steady_clock;

constexpr auto kPatience = std::chrono::seconds(1);
constexpr auto kPatienceWithoutMotors = std::chrono::seconds(10);
constexpr auto kLongestWait =
    std::chrono::milliseconds(50);  // between calls; after more the program stood still

}  // namespace

void Patience::begin() noexcept {
  heard_ = asked_ = steady_clock::now();
  waited_ = {};
}

bool Patience::is_over() noexcept {
  const Time now = steady_clock::now();
  if (has_motors_) return now - heard_ >= kPatience;
  waited_ += std::min<std::chrono::nanoseconds>(now - asked_, kLongestWait);
  asked_ = now;
  return waited_ >= kPatienceWithoutMotors;
}

}  // namespace palpate::runner::servo
