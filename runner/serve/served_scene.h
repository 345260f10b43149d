#pragma once
// A scene that another program puts before the hand. Scenes and parameters come in as messages;
// forces are the servo's, limited and guarded as in every other command.

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "protocols/parse.h"
#include "runner/safety/guarded_device.h"
#include "runner/serve/messages.h"
#include "runner/servo/ring.h"
#include "runner/servo/servo_thread.h"
#include "runner/session/live_forces.h"

namespace palpate::runner {

/// A scene as a protocol of one stimulus for each object: what is known of protocols and devices
/// goes for it, too.
protocols::Protocol protocol_of(const protocols::SceneSpec& spec,
                                const rendering::Renderer& renderer);

/// What a stream tells of a tick.
struct StreamSample {
  std::int64_t time_ns = 0, lateness_ns = 0;
  std::uint32_t tick = 0, faults = 0;
  int object = -1;
  Vec3 tip, tail;    ///< m, virtual stylus
  Vec3 force;        ///< N, commanded to the hand, after the limits
  Vec3 rendered;     ///< N, before them
  Vec3 contact;      ///< m, the deepest; zero in free space
  double depth = 0;  ///< m
};

/// Where what a scene says goes to.
class ServeOutput {
 public:
  virtual ~ServeOutput() = default;
  /// To the client that asked. From any thread; never waits.
  virtual void reply(std::uint64_t client, std::string text) = 0;
  /// To all. From any thread; never waits.
  virtual void tell(std::string text) = 0;
};

/// All functions belong to one thread, the session's, but those that say otherwise.
class ServedScene {
 public:
  struct Settings {
    std::string scene_path;  ///< its folder has the meshes; faults name it
    std::string scene;       ///< JSON; empty: none yet
    ServoSettings servo;
  };

  /// \param guard  may be none. \throws InputError, MeshError, MessageRefused: the first scene
  /// cannot be shown on this device
  ServedScene(Device& device, GuardedDevice* guard, Clock& clock, Settings settings);
  ~ServedScene();  ///< zero force
  ServedScene(const ServedScene&) = delete;
  ServedScene& operator=(const ServedScene&) = delete;

  /// Where replies go; before the first obey().
  void answer_through(ServeOutput& output) { output_ = &output; }
  void obey(std::uint64_t client, const Message& message);
  /// The controller has left: nothing is felt any more.
  void controller_left();
  /// Takes what the servo gave since the last call. Call it every few milliseconds.
  void attend();
  /// While true, clear() and what waits for the device gives up.
  void give_up_when(std::function<bool()> stop) { stop_ = std::move(stop); }

  /// Zero force at once, until `clear`. From any thread.
  void emergency_zero() noexcept;
  /// The same, because the controller says nothing any more. From any thread.
  void controller_is_silent() noexcept {
    silent_.store(true);
    emergency_zero();
  }
  /// From any thread.
  bool forces_are_on() const noexcept { return !servo_.forces_are_off(); }
  /// Ticks for the network's thread, in order; false where there is none.
  bool next_of_stream(StreamSample& out) noexcept { return stream_.pop(out); }
  /// Ticks that the stream had no room for. From any thread.
  std::uint64_t lost() const noexcept { return lost_.load(); }
  /// The scene of now; null without one. From any thread.
  nlohmann::json scene() const;
  ServoThread& servo() { return servo_; }  ///< for signal handlers

 private:
  struct Trial {
    std::int64_t asked_ns = 0;
    std::uint64_t client = 0;
    std::int64_t id = 0;
    std::optional<std::int64_t> number;
    bool holds = false;  ///< forces are on: `start` was answered
    std::int64_t zero_ns = 0, first_contact_ns = 0, tick_ns = 0;
    int without_contact = 0;  ///< ticks
    bool in_contact = false, told_off = false;
  };
  protocols::SceneSpec read(const std::string& text, const rendering::Renderer& renderer) const;
  void load(nlohmann::json scene);
  void keep(nlohmann::json scene);
  void start(std::uint64_t client, const Message& message);
  void set(std::uint64_t client, const Message& message);
  void show(const protocols::SceneSpec& spec, const rendering::Renderer& renderer);
  nlohmann::ordered_json end_trial();
  void clear(std::uint64_t client, const Message& message);
  void take(const Sample& sample);
  void take_first(const Sample& sample);
  std::string why_off(const Sample& sample);
  void drop_pending(const std::string& code, const std::string& why);
  void tell(const std::string& name, std::int64_t t_ns,
            const nlohmann::ordered_json& more = nlohmann::ordered_json::object());

  const DeviceCapabilities device_;
  GuardedDevice* guard_;
  Clock& clock_;
  const Settings settings_;
  ServeOutput* output_ = nullptr;
  std::function<bool()> stop_ = [] { return false; };
  mutable std::mutex mutex_;  ///< of the next one: written by this thread, read by others
  nlohmann::json scene_;      ///< null: none
  const rendering::Renderer* renderer_ = nullptr;  ///< of the trial
  std::optional<Trial> trial_;
  std::int64_t last_ns_ = 0;  ///< of the newest sample that was taken
  std::string held_by_;       ///< why forces were taken off, until `clear`
  Ring<StreamSample> stream_{4096};
  std::atomic<std::uint64_t> lost_{0};
  std::atomic<bool> silent_{false};
  Patience patience_;
  ServoThread servo_;
  LiveForces forces_;
};

}  // namespace palpate::runner
