#pragma once
// An emulated Inverse Service: Haply's messages over WebSocket and HTTP, one arm with a grip, held
// by an elastic hand. Written from the public documentation.

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace palpate::runner::devices::testing {

/// State set and read by a test.
struct EmulatedArm {
  std::string id = "049D", version = "3.5.0.0", basis = "XYZ";
  std::string preset = "defaults";  ///< stays when its client has gone
  enum class Takes { object, name, both, nothing } takes = Takes::object;  ///< form of a preset
  bool vector = true;  ///< the key under which it takes forces; else "values"
  bool tells_preset = true;
  double force_scale = 1;
  double workspace_scale = 1;              ///< of "transform", left behind by another program
  double workspace_y = 0;                  ///< m, of the same
  double mount_scale = 1;                  ///< of a mount that no preset replaces
  double damping = 0;                      ///< N s/m, left behind by another program
  bool gravity = true;                     ///< compensated
  std::uint64_t full_states = 0;           ///< asked for
  std::array<double, 3> hand{0, 0, 0};     ///< m, about the middle of its reach
  double hand_stiffness = 400;             ///< N/m; 0: rigid
  std::array<double, 4> grip{1, 0, 0, 0};  ///< w, x, y, z
  bool has_grip = true, awake = true, present = true, in_use = false, calibrated = true,
       powered = true, button = false, mute = false, frozen = false;
  double delay = 0;                      ///< s, of each reply
  std::string instead;                   ///< sent instead of a state; "": unused
  std::array<double, 3> force{0, 0, 0};  ///< N, of a real device
  std::uint64_t commands = 0;
};

class EmulatedService {
 public:
  explicit EmulatedService(int port = 0);  ///< 0: any free one. \throws std::exception
  ~EmulatedService();
  EmulatedService(const EmulatedService&) = delete;
  EmulatedService& operator=(const EmulatedService&) = delete;

  std::string address() const;  ///< HOST:PORT
  /// Ends all connections; new ones are refused until it is on again.
  void turn(bool on);
  /// \param which  1: the second arm, which exists once `present` is set
  template <class Change>
  void with(Change change, std::size_t which = 0) {
    const std::scoped_lock lock(mutex_);
    change(arms_.at(which));
  }
  EmulatedArm arm(std::size_t which = 0) {
    const std::scoped_lock lock(mutex_);
    return arms_.at(which);
  }

 private:
  struct Sockets;
  void accept();
  void talk(int connection);
  std::string inventory();
  std::string answer(const std::string& message, bool& mute, std::array<bool, 2>& commanded);

  std::mutex mutex_;
  std::array<EmulatedArm, 2> arms_;
  std::unique_ptr<Sockets> sockets_;
  std::atomic<bool> quit_{false}, on_{true};
  std::thread acceptor_;
};

}  // namespace palpate::runner::devices::testing
