#pragma once
// A response box on a serial port: each byte stands for a key of the keyboard.

#include <termios.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "runner/display/display.h"
#include "runner/display/mailbox.h"
#include "runner/servo/device.h"

namespace palpate::runner::participants {

class ResponseBox {
 public:
  /// \param name  "PATH" or "PATH:BAUD" (default 9600), 8N1. The path may contain colons
  /// (/dev/serial/by-path/...)
  /// \param keys  byte ("1", "0x05") -> name of a key; empty: printable characters stand for
  /// themselves. "escape" is the emergency key
  /// \param clock  time-stamps bytes on arrival; must outlive it
  /// \param emergency  called at once, in the box's own thread
  /// \throws std::invalid_argument: not a speed of a serial port; std::runtime_error: cannot be
  /// opened
  ResponseBox(const std::string& name, const std::map<std::string, std::string>& keys,
              servo::Clock& clock, std::function<void()> emergency);
  ~ResponseBox();
  ResponseBox(const ResponseBox&) = delete;
  ResponseBox& operator=(const ResponseBox&) = delete;

  /// Keys pressed since the last call, in order of arrival.
  std::vector<display::KeyPress> take() { return presses_.take(); }
  /// It was unplugged or its port failed; it sends no more keys.
  bool failed() const { return failed_.load(); }
  /// The first byte that stands for no key, line ends ignored. nullopt: there was none
  std::optional<unsigned char> unknown_byte() const;

 private:
  void listen() noexcept;

  std::map<unsigned char, std::string> keys_;
  servo::Clock& clock_;
  const std::function<void()> emergency_;
  int port_ = -1, wake_ = -1;
  termios before_{};
  display::EventQueue<display::KeyPress> presses_;
  std::atomic<bool> failed_{false};
  std::atomic<int> unknown_{-1};  ///< byte; -1: none
  std::jthread thread_;
};

/// The participant's screen with a box beside its keyboard.
class ScreenWithBox final : public display::ParticipantScreen {
 public:
  /// Both must outlive it.
  ScreenWithBox(display::ParticipantScreen& screen, ResponseBox& box)
      : screen_(screen), box_(box) {}
  void show(const display::Page& page) override { screen_.show(page); }
  void see(const std::shared_ptr<const display::SeenTrial>& trial) override { screen_.see(trial); }
  void follow(const servo::Sample& sample) override { screen_.follow(sample); }
  std::vector<display::SeenFrame> frames() override { return screen_.frames(); }
  std::vector<display::KeyPress> keys() override;
  bool open() const override { return screen_.open(); }
  bool settled() const override { return screen_.settled(); }
  std::string misplaced() const override { return screen_.misplaced(); }
  std::string trouble() const override;

 private:
  display::ParticipantScreen& screen_;
  ResponseBox& box_;
};

}  // namespace palpate::runner::participants
