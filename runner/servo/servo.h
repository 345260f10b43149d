#pragma once
// The servo loop's tick: device.read -> renderer -> force limits -> device.write. The same code for
// a simulated participant (as fast as the processor allows) and a live one (paced by the clock).

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "rendering/bodies/soft/soft_scene.h"
#include "rendering/renderer.h"
#include "runner/servo/device.h"
#include "runner/servo/feel_ramp.h"
#include "runner/servo/force_limiter.h"
#include "runner/servo/passivity.h"
#include "runner/servo/ring.h"
#include "runner/servo/sample.h"
#include "runner/servo/tick_source.h"
#include "runner/workspace_map.h"

namespace palpate::runner::servo {

/// The scene of one trial with its renderer and the renderer's state.
struct TrialScene {
  /// \param ticks  capacity of queued ticks, poses of moving objects included
  TrialScene(const rendering::Scene& what, const rendering::Renderer& how, const HomeZone& where,
             std::size_t ticks = 1)
      : scene(what), renderer(&how), state(scene.initial_state()), home(where) {
    rendering::pace_by_tick(state);
    // A soft body's shadow would be a second body with its own steps.
    if (rendering::soft_objects(scene).empty()) shadow.emplace(scene.initial_state());
    constexpr std::size_t kMostBodyPoses = 1 << 18;  // 50 MB; many bodies: fewer ticks
    constexpr std::size_t kLeastTicks = 2048;
    const std::size_t bodies = state.motion.bodies().size();
    if (bodies == 0) return;
    const std::size_t kept = std::max(kLeastTicks, kMostBodyPoses / bodies);
    poses = std::make_unique<Ring<rendering::BodyPose>>(std::min(ticks, kept) * bodies);
  }

  rendering::Scene scene;
  const rendering::Renderer* renderer;
  FeelRamp* ramp = nullptr;      ///< of the scene's materials; used only by the servo. Null: none
  rendering::RenderState state;  ///< used only by the servo while the scene is shown
  std::optional<rendering::RenderState> shadow;  ///< likewise; one tick behind, for keep_warm()
  HomeZone home;
  /// Poses of moving objects, tick by tick, from a servo's thread to the session's. Null if none
  /// moves.
  std::unique_ptr<Ring<rendering::BodyPose>> poses;
};

class Servo final : public TickSource {
 public:
  Servo(Device& device, Clock& clock, double rate, const ForceLimits& limits,
        const WorkspaceMap& workspace = {});

  void prepare(const rendering::Scene& scene, const rendering::Renderer& renderer,
               const HomeZone& home) override;
  /// Waits for the tick's time, then does one tick. Never throws, allocates or locks, and does no
  /// I/O except the device's own transfer.
  const Sample& tick() noexcept;
  const Sample& next() noexcept override { return tick(); }
  std::span<const rendering::BodyPose> bodies() const noexcept override;
  /// Pulls an object of the scene until the next call.
  void pull(const rendering::BodyPull& by) noexcept;
  /// Poses of the scene shown; null: nothing in it moves.
  Ring<rendering::BodyPose>* poses() noexcept {
    return shown_ != nullptr ? shown_->poses.get() : nullptr;
  }
  ServoQuality stop() noexcept override;

  /// As prepare, but does not allocate and does not restart the ticks' times. `shown` must live
  /// until the next begin(), prepare() or stop().
  void begin(TrialScene& shown) noexcept;
  /// Holds the steps of soft objects that are due in the next tick, as in the recording being
  /// replayed.
  void hold_steps(bool held) noexcept {
    if (shown_ != nullptr) rendering::hold_steps(shown_->state, held);
  }
  /// Commands zero force from the current tick on, until clear_fault(). Call it from any thread or
  /// signal handler.
  void emergency_zero() noexcept { emergency_.store(true); }
  /// The same, but ramps down: from full force in ForceLimits::ramp. For cases without urgency.
  void fade_out() noexcept { fade_.store(true); }
  /// Allows forces again. Call it from any thread.
  void clear_fault() noexcept;
  /// The same, but requests for zero force stay in effect.
  void clear_trip() noexcept { clear_.store(true); }

  /// Turns on the passivity controller, which dissipates the energy that sampling feeds to the
  /// hand. Before start().
  void control_passivity() {
    constexpr double kLightestEnd = 0.1;  // kg, of a stylus at its tip
    passivity_.emplace(PassivitySettings{0.5 * kLightestEnd / period_}, period_);
  }

  /// Before it reads the device, each tick renders the last one again and discards the result: the
  /// scene is then in the processor's caches, from which other programs may have displaced it, and
  /// the command follows the reading sooner. For ticks with sleep between them. Before start().
  void keep_warm() noexcept { warm_ = true; }

  /// The next tick is due within a period. All ticks are a quarter to three quarters of a period
  /// (at random) after its multiples, because the kernel has timer ticks at multiples (Linux 6.4
  /// and later), and a servo tick that begins just before one is interrupted for some 30 us every
  /// time.
  void start() noexcept;

  /// Null before the first and after stop().
  const TrialScene* shown() const noexcept { return shown_; }
  double period() const { return period_; }  ///< s
  std::int64_t period_ns() const { return period_ns_; }

 private:
  bool at_home(const rendering::LineProbe& probe) noexcept;
  void keep_time() noexcept;
  void warm_up() noexcept;
  void check(const DeviceReading& reading) noexcept;
  void command(Vec3 device1, Vec3 device2) noexcept;
  DeviceForces kept_passive(const Vec3& device1, const Vec3& device2) noexcept;

  static constexpr int kMissedInARow = 5;  ///< missed ticks at which the forces of motors go off

  Device& device_;
  const bool has_motors_;
  Clock& clock_;
  const double period_;
  const std::int64_t period_ns_;
  std::int64_t due_ns_;
  std::int64_t read_ns_ = 0;  ///< when the device had been read
  ForceLimiter limiter_;
  WorkspaceMap workspace_;
  bool drives_force_alone_;  ///< one grip, no torque
  /// N, N m, of one grip that drives torque; 0: of none. Force and
  /// torque are scaled together, before the limiter, which knows ends of a stylus only.
  double grip_force_ = 0, grip_torque_ = 0;
  std::optional<PassivityController> passivity_;
  std::unique_ptr<TrialScene> own_;  ///< of prepare()
  TrialScene* shown_ = nullptr;
  Vec3 rest_tip_;
  bool warm_ = false;
  int rested_ = 0;  ///< ticks
  int late_in_a_row_ = 0;
  Sample sample_;
  ServoQuality quality_;
  double strongest2_ = 0;  ///< N^2, of the forces on the hand: its root is quality_'s, in the end
  std::atomic<bool> emergency_{false}, fade_{false}, clear_{false};
  static_assert(std::atomic<bool>::is_always_lock_free);  // set from signal handlers
};

}  // namespace palpate::runner::servo
