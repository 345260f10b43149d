#pragma once
// A scene presented by another program, which sends scenes and parameters as messages. Forces come
// from the servo, limited and guarded as in every other command.

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
#include "runner/serve/outlets.h"
#include "runner/serve/why_off.h"
#include "runner/servo/servo_thread.h"
#include "runner/session/live_forces.h"
#include "runner/session/markers.h"
#include "runner/session/sample_stream.h"
#include "stimuli/polygon_soup.h"

namespace palpate::runner::serve {

/// A scene as a protocol with one stimulus for each object, so that checks of protocols against
/// devices apply.
protocols::Protocol protocol_of(const protocols::SceneSpec& spec,
                                const rendering::Renderer& renderer);

/// Call all functions in one thread, the session's, unless stated otherwise.
class ServedScene {
 public:
  struct Settings {
    std::string scene_path;  ///< its folder has the meshes; faults name this path
    std::string scene;       ///< JSON; empty: none yet
    servo::ServoSettings servo;
    PictureOf picture;
    session::Markers* markers = nullptr;      ///< each `start` is a trial; null: none
    session::SampleStream* stream = nullptr;  ///< of the ticks of trials; null: none
  };

  /// \param guard  may be null. \throws InputError, MeshError, MessageRefused: the first scene
  /// cannot be shown on this device
  ServedScene(servo::Device& device, safety::GuardedDevice* guard, servo::Clock& clock,
              Settings settings);
  ~ServedScene();  ///< zero force
  ServedScene(const ServedScene&) = delete;
  ServedScene& operator=(const ServedScene&) = delete;

  /// Sets the receiver of replies; call it before the first obey().
  void answer_through(ServeOutput& output) { output_ = &output; }
  void obey(std::uint64_t client, const Message& message);
  /// The controller has left: ends forces.
  void controller_left();
  /// Processes the servo's samples since the last call. Call it every few milliseconds.
  /// \throws EndOfSession: the guard process has ended; forces are zero for good
  void attend();
  /// While `stop` returns true, clear() and other waits for the device give up.
  void give_up_when(std::function<bool()> stop) { stop_ = std::move(stop); }

  /// Commands zero force at once, until `clear`. From any thread.
  void emergency_zero() noexcept;
  /// The same, until this client takes it back. From any thread. \return false: it had asked before
  bool emergency(std::uint64_t client);
  const Emergencies& emergencies() const noexcept { return emergencies_; }
  /// The same by the ramp, because the controller is silent. From any thread.
  void controller_is_silent() noexcept {
    silent_.store(true);
    forces_.fade();
  }
  /// From any thread.
  bool forces_are_on() const noexcept { return !servo_.forces_are_off(); }
  /// Whether they are on, or a scene is shown in which they may come. From any thread.
  bool forces_may_come() const noexcept { return shown_.load() || forces_are_on(); }
  /// From any thread.
  std::uint32_t times_off() const noexcept { return forces_.times_off(); }
  /// Ticks, for the network's thread.
  TickStream& ticks() noexcept { return ticks_; }
  /// Members of the answer to hello: the current scene, or null. From any thread.
  nlohmann::json state() const;
  /// Members of the answer to `picture`. From any thread.
  std::string picture() const;
  servo::ServoThread& servo() { return servo_; }  ///< for signal handlers

 private:
  struct Trial {
    std::int64_t asked_ns = 0;
    std::uint64_t client = 0;
    std::int64_t id = 0;
    std::optional<std::int64_t> number;
    bool holds = false;  ///< forces are on, and `start` was answered
    std::int64_t zero_ns = 0, first_contact_ns = 0, tick_ns = 0;
    int without_contact = 0;  ///< ticks
    bool in_contact = false, forces_off_sent = false;
  };
  protocols::SceneSpec read(const std::string& text, const rendering::Renderer& renderer) const;
  void load(nlohmann::json scene);
  void keep(nlohmann::json scene, const protocols::SceneSpec& spec);
  void start(std::uint64_t client, const Message& message);
  void set(std::uint64_t client, const Message& message);
  void show(const protocols::SceneSpec& spec, const rendering::Renderer& renderer);
  nlohmann::ordered_json end_trial();
  void clear(std::uint64_t client, const Message& message);
  void take(const servo::Sample& sample);
  void take_first(const servo::Sample& sample);
  WhyOff reason_of(const servo::Sample& sample);
  MessageRefused forces_off() const;
  void mark(session::Marker::Kind kind, std::int64_t t_ns, const std::string& response = "",
            int code = 0);
  void drop_pending(const std::string& code, const std::string& why);
  void tell(const std::string& name, std::int64_t t_ns,
            const nlohmann::ordered_json& more = nlohmann::ordered_json::object());

  const servo::DeviceCapabilities device_;
  safety::GuardedDevice* guard_;
  servo::Clock& clock_;
  const Settings settings_;
  ServeOutput* output_ = nullptr;
  std::function<bool()> stop_ = [] { return false; };
  mutable std::mutex mutex_;  ///< guards the next two: this thread writes, others read
  nlohmann::json scene_;      ///< null: none
  std::string picture_ = R"("objects":[])";
  const rendering::Renderer* renderer_ = nullptr;  ///< of the trial
  std::optional<Trial> trial_;
  session::Marker marker_;         ///< of the trial, or of the one before
  std::int64_t last_ns_ = 0;       ///< of the newest processed sample
  std::optional<WhyOff> held_by_;  ///< reason why forces are off, until `clear`
  Emergencies emergencies_;
  TickStream ticks_;
  std::atomic<bool> silent_{false};
  std::atomic<bool> shown_{false};  ///< from `start` until its end, or until forces are off
  servo::Patience patience_;
  servo::ServoThread servo_;
  session::LiveForces forces_;
};

}  // namespace palpate::runner::serve
