#pragma once
// Why forces of a server are off, for programs and for people, and who may bring them back.

#include <cstdint>
#include <mutex>
#include <set>
#include <string>

#include "runner/servo/device.h"

namespace palpate::runner::serve {

struct WhyOff {
  std::string code;   ///< for programs, such as "service-gone"
  std::string words;  ///< for people
};

/// From the first tick without forces.
WhyOff why_off(std::uint32_t faults, servo::DeviceTrouble trouble);

/// Whoever has asked for zero force. Only they take it back, or a person at the server. All
/// functions may be called from any thread.
class Emergencies {
 public:
  /// The person at the server, beside the clients' numbers.
  static constexpr std::uint64_t kHere = 0;

  /// \return false: the client had asked before
  bool raise(std::uint64_t client);
  bool any() const;
  bool raised_by(std::uint64_t client) const;
  /// Takes the client's own request back; kHere takes all back. \return those taken back, for
  /// restore(). \throws MessageRefused: another client's is in effect
  std::set<std::uint64_t> lift(std::uint64_t client);
  void restore(const std::set<std::uint64_t>& lifted);
  /// For refusals and events.
  WhyOff why() const;

 private:
  mutable std::mutex mutex_;
  std::set<std::uint64_t> by_;
};

}  // namespace palpate::runner::serve
