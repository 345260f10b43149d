#pragma once
// Talking with the experimenter while the devices stay under control: a question may stand for
// minutes, and every millisecond of it is a tick.

#include <cstdint>
#include <stdexcept>
#include <string>

namespace palpate::runner::falcon {

class Guide {
 public:
  virtual ~Guide() = default;
  virtual void say(const std::string& text) = 0;
  /// Puts a question that is answered by going on (ENTER).
  virtual void ask(const std::string& text) = 0;
  enum class Answer : std::uint8_t { none, go_on, stop };
  /// Never waits.
  virtual Answer answer() = 0;
};

/// A guided procedure came to no result; what() says why and what to do.
class GuideError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace palpate::runner::falcon
