#pragma once
// An emulated Falcon: the USB-serial chip, the boot ROM, the running firmware, and a grip with mass
// that motors and a hand move. Time is an argument, so it runs on a real or a virtual clock.
// Written from the protocol's description, not from the driver.

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::runner::devices::falcon::testing {

/// Faults to inject. Counts start when they are set; 0: never.
struct EmulatorFaults {
  int lost_echoes = 0;      ///< number of next uploads that lose a byte's echo
  int wrong_echoes = 0;     ///< number of next uploads that echo a wrong byte
  bool stray_byte = false;  ///< a zero before the monitor's answer
  int deaf_probes = 0;      ///< number of probes that the monitor ignores
  int short_every = 0;      ///< every n-th reply has 14 bytes
  int split_every = 0;      ///< every n-th reply arrives in two parts, 1.5 ms apart
  int late_every = 0;       ///< every n-th reply is late by late_ns
  std::int64_t late_ns = 5'000'000;
  bool silent = false;  ///< no replies at all
};

/// Everything in the Falcon's own frame: m, N, s.
struct EmulatorPlant {
  double counts_per_torque = -1e4;               ///< 1/(N m): the true scale, unknown to the driver
  double mass = 0.15;                            ///< kg, of the grip
  Vec3 load{0, 0, 0};                            ///< N, e.g. a weight that hangs at the grip
  double friction = 0;                           ///< N, Coulomb
  double hand_stiffness = 80, hand_damping = 6;  ///< N/m, N s/m
  /// The hand's target for the grip at a time (s); by default at rest at the centre.
  std::function<Vec3(double)> hand;
};

class Emulator {
 public:
  enum class Mode : std::uint8_t { idle, monitor, boot, run };

  EmulatorFaults faults;
  EmulatorPlant plant;
  std::uint8_t buttons = 0;

  /// As after a session with it: firmware loaded, perhaps homed too.
  void preload(bool homed);
  void power_cycle();
  void lose_homing();
  /// Puts the grip there, at rest.
  void place(const Vec3& position);

  // Its commands, and its state.
  Mode mode() const { return mode_; }
  const std::vector<std::uint8_t>& image() const { return image_; }
  int uploads() const { return uploads_; }
  std::uint64_t packets() const { return packets_; }
  std::uint64_t malformed() const { return malformed_; }
  const std::array<int, 3>& motors() const { return motors_; }
  bool torque_is_zero() const { return motors_ == std::array<int, 3>{}; }
  /// Time of the last command other than zero, ns; -1: never.
  std::int64_t last_torque_ns() const { return last_torque_ns_; }
  /// Time at which a zero command last ended a torque, ns; -1: never.
  std::int64_t zeroed_ns() const { return zeroed_ns_; }
  int largest_count() const { return largest_count_; }
  /// The newest packets, oldest first; none are lost within a minute at 1 kHz.
  struct Heard {
    std::int64_t time_ns;
    std::array<int, 3> motors;
  };
  const std::deque<Heard>& record() const { return record_; }
  bool torque_before_homing() const { return torque_before_homing_; }
  unsigned homed() const { return homed_; }
  unsigned leds() const { return leds_; }
  int latency_ms() const { return latency_ms_; }
  const Vec3& position() const { return position_; }
  const Vec3& force() const { return force_; }

  // The wires.
  /// A request without data; false: it is refused (stall).
  bool control_out(std::uint8_t request, std::uint16_t value);
  /// A request for data; nullopt: refused.
  std::optional<std::vector<std::uint8_t>> control_in(std::uint8_t request) const;
  void host_sends(const std::vector<std::uint8_t>& bytes, std::int64_t now_ns);
  /// An IN packet of at most `size` bytes when one is due, with its two status bytes.
  std::optional<std::vector<std::uint8_t>> in_packet(std::int64_t now_ns, std::size_t size);

 private:
  struct TimedByte {
    std::uint8_t byte;
    std::int64_t due_ns;
  };
  void answer(const std::vector<std::uint8_t>& bytes, std::int64_t due_ns);
  void monitor_takes(std::uint8_t byte, std::int64_t now_ns);
  void boot_takes(std::uint8_t byte, std::int64_t now_ns);
  void firmware_takes(std::uint8_t byte, std::int64_t now_ns);
  void obey(std::int64_t now_ns);
  bool image_is_whole() const;
  void move_to(std::int64_t now_ns);
  void pass_indices(const Vec3& counts);
  Vec3 counts() const;

  Mode mode_ = Mode::idle;
  std::deque<TimedByte> out_;
  std::vector<std::uint8_t> heard_, image_;
  std::uint16_t baud_ = 0;
  int latency_ms_ = 16, event_ = -1;
  bool dtr_ = false, dtr_fell_ = false;
  std::int64_t last_in_ns_ = 0, wire_free_ns_ = 0;
  int uploads_ = 0;

  std::uint64_t packets_ = 0, malformed_ = 0;
  std::deque<Heard> record_;
  std::array<int, 3> motors_{};
  std::int64_t last_torque_ns_ = -1, zeroed_ns_ = -1;
  int largest_count_ = 0;
  bool torque_before_homing_ = false;
  bool homing_ = false;
  unsigned homed_ = 0, leds_ = 0;

  std::int64_t moved_ns_ = -1;
  double time_ = 0;
  Vec3 position_{0, 0, 0.125}, velocity_, force_, last_counts_;
};

/// A well-formed boot stream with meaningless content: tests need no vendor's firmware.
std::vector<std::uint8_t> synthetic_image(std::size_t words);

}  // namespace palpate::runner::devices::falcon::testing
