#pragma once
// Dialog with the experimenter during a guided procedure. It never blocks: the devices need a tick
// every millisecond while a question waits for its answer.

#include <cstdint>
#include <stdexcept>
#include <string>

namespace palpate::runner::devices::falcon {

/// Shows texts and questions, and polls for answers.
class Guide {
 public:
  virtual ~Guide() = default;
  virtual void say(const std::string& text) = 0;
  /// Shows a request, to be confirmed with ENTER.
  virtual void ask(const std::string& text) = 0;
  enum class Answer : std::uint8_t { none, go_on, stop };
  /// The answer to the last request, if there is one yet; never blocks.
  virtual Answer answer() = 0;
};

/// A guided procedure gave no result; what() gives the reason and the remedy.
class GuideError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace palpate::runner::devices::falcon
