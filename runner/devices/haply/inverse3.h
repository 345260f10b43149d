#pragma once
// A Haply Inverse3, Inverse3x or Minverse, with or without a Verse Grip, through the JSON of the
// maker's Inverse Service (3.1 to 3.5), WebSocket on port 10001, according to its documentation and
// public clients. Every received message is answered by one. Not tested on hardware:
// runner/README.md lists the uncertainties.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "runner/devices/haply/link.h"
#include "runner/servo/device.h"
#include "runner/servo/shared_value.h"
#include "runner/servo/triple_buffer.h"
#include "stimuli/vec.h"

namespace palpate::runner::devices::haply {

/// The key under which a service expects a force. The service ignores unknown keys without an
/// error.
enum class Dialect { values, vector };

struct ServiceVersion {
  int major = 0, minor = 0;
  std::string text;
};

/// From the reply to GET /version, bare or wrapped in {"ok": true, "data": ...}.
/// \throws std::runtime_error if it has no version, or one below 3.1
ServiceVersion parse_version(std::string_view reply);
/// 3.5 and newer have "vector".
Dialect dialect_of(const ServiceVersion& version);
/// From the reply to GET /settings/devices/force_scale; none: the service does not report it.
std::optional<double> parse_force_scale(std::string_view reply);

/// How a service expects a preset: 3.5 documents an object; older ones may take the name alone. An
/// unknown form is ignored without an error.
enum class PresetForm { object, name };
inline constexpr const char* kPreset = "arm_front_centered";  ///< origin in the middle of the reach

/// One arm or grip in a full state.
struct Listed {
  std::string id;
  std::string preset;   ///< of an arm; empty: not told
  std::string changed;  ///< of an arm: how positions or forces are changed; empty: not
  std::string gravity;  ///< of an arm: why its weight is not compensated; empty: it is
  bool in_use = false, calibrated = true;
  std::string filters;  ///< of an arm: the service's filters of forces as JSON; for the record
};
struct Inventory {
  std::vector<Listed> arms, grips;
};
/// \throws std::runtime_error with the expectation
Inventory parse_inventory(std::string_view message);

/// One arm and the grip on it, from a message. The frame is the world's: x right, y forward, z up.
struct State {
  Vec3 position;        ///< m
  Vec3 force;           ///< N, applied by the service; NaN: not reported
  Vec3 axis{0, -1, 0};  ///< unit, from the grip's centre to the tail; needs a grip
  std::uint8_t buttons = 0;
  bool has_arm = false, has_grip = false;
  bool calibrated = true, powered = true;
  bool changed = false;  ///< another program has changed the arm's preset, axes or damping
};
/// The newest state of the arm and, unless `grip` is empty, the grip. Values missing from the
/// message are missing from the result. \throws std::runtime_error if it is not such a message
State parse_state(std::string_view message, const std::string& arm, const std::string& grip);

/// A command with a force on the hand, N. \param full  asks for the full state
std::string command(const std::string& arm, const Vec3& force, Dialect dialect, bool full);
/// Names the session, sets the preset, and asks for the full state.
std::string configuration(const std::string& arm, PresetForm form);

inline constexpr const char* kService = "127.0.0.1:10001";

/// Exchanges one message with the service every 250 us, in its own thread: sends the newest force
/// and receives the newest state. With one exchange a tick, every force would be a tick late.
class Pump {
 public:
  struct Settings {
    std::string arm, grip;  ///< ids; no grip: empty
    Dialect dialect = Dialect::vector;
    double silence = 0.005;  ///< s; an older force becomes zero
  };
  struct Newest {
    State state;
    std::int64_t asked_ns = 0, time_ns = 0;  ///< CLOCK_MONOTONIC, of its arrival; 0: none yet
    servo::DeviceTrouble trouble = servo::DeviceTrouble::none;
  };

  Pump(std::unique_ptr<Link> link, const Settings& settings);
  /// Sends zero force and ends.
  ~Pump();
  Pump(const Pump&) = delete;
  Pump& operator=(const Pump&) = delete;

  void push(const Vec3& force) noexcept;  ///< N, on the hand
  const Newest& newest() noexcept;        ///< for one thread
  /// When the newest push was sent, ns; 0: none yet. From any thread.
  std::int64_t force_ns() const noexcept { return force_ns_.load(); }
  /// Whether the service seemed not to understand forces in this dialect.
  bool misunderstood() const noexcept { return misunderstood_.load(); }

 private:
  struct Wanted {
    double x = 0, y = 0, z = 0;
    std::int64_t time_ns = 0;
  };
  struct Reply {
    State state;
    std::size_t hash = 0;  ///< of the message
  };
  void run() noexcept;
  void give_up(servo::DeviceTrouble trouble) noexcept;
  void exchange(bool last = false);
  void send(const Vec3& force, bool full = false);
  /// The reply to the last command; none: the pump ends. Sends zeros while it does not arrive.
  std::optional<Reply> receive();
  void watch(const Vec3& sent, std::size_t hash) noexcept;

  std::unique_ptr<Link> link_;
  const Settings settings_;
  servo::SharedValue<Wanted> wanted_;
  servo::TripleBuffer<Newest> newest_;
  Newest seen_;  ///< the reader's
  std::atomic<bool> quit_{false}, misunderstood_{false};
  std::atomic<std::int64_t> force_ns_{0};  ///< DeviceTimes
  // Used by the thread only.
  Newest last_;
  Vec3 sent_;
  std::int64_t sent_wanted_ns_ = 0;  ///< Wanted::time_ns of sent_
  std::size_t last_message_ = 0;     ///< hash
  std::int64_t changed_ns_ = 0;      ///< time of the last message that differed from the one before
  bool sent_changed_ = false;        ///< since changed_ns_
  std::int64_t asked_full_ns_ = 0;   ///< time of the last request for the full state
  std::int64_t unanswered_ns_ = 0;   ///< start of sending a force that the service does not report
  std::thread thread_;
};

class Inverse3Device final : public servo::Device {
 public:
  /// \throws std::runtime_error with the obstacle
  /// \param grip  whether to sense the axis of a Verse Grip, if there is one
  explicit Inverse3Device(const servo::DeviceConfig& config, bool grip = true);

  const servo::DeviceCapabilities& capabilities() const override { return capabilities_; }
  /// Never waits. The stylus has its tip at the arm's cursor; without a grip tip and tail are one.
  servo::DeviceReading read() noexcept override;
  void write(const Vec3& device1, const Vec3& device2) noexcept override;
  void reopen() override;
  servo::DeviceTimes times() const noexcept override {
    return {pose_ns_, pump_ ? pump_->force_ns() : 0};
  }

 private:
  void open();
  bool plausible(const Pump::Newest& newest) noexcept;

  servo::DeviceConfig config_;
  servo::DeviceCapabilities capabilities_;
  bool other_dialect_ = false;  ///< use the dialect that the version does not suggest
  bool may_have_grip_, has_grip_ = false;
  double period_ns_;
  Vec3 tip_, tail_;            ///< m, of the last good reading
  std::int64_t asked_ns_ = 0;  ///< time of asking for it; 0: none
  std::int64_t pose_ns_ = 0;   ///< DeviceTimes
  bool lost_ = true;
  std::unique_ptr<Pump> pump_;
};

/// See DeviceKind.
void check(const servo::DeviceConfig& config);
servo::DeviceCapabilities nominal(const servo::DeviceConfig& config);
std::vector<servo::ConnectedDevice> connected(const servo::DeviceConfig& config);
std::unique_ptr<servo::Device> open(const servo::DeviceConfig& config);
/// Opens it without the axis of a grip.
std::unique_ptr<servo::Device> open_point(const servo::DeviceConfig& config);

}  // namespace palpate::runner::devices::haply
