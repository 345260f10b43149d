#pragma once
// Whether a device can show a protocol: degrees of freedom, rate, workspace, and stiffness without
// instability. Also the check of the force's direction before the first trial, the plausibility of
// the computer's clock, and the limiting of materials to the device.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "runner/scene_builder.h"
#include "runner/servo/device.h"
#include "runner/servo/force_limiter.h"
#include "runner/servo/tick_source.h"

namespace palpate::runner::session {

/// The check of the force's direction: a weak push to the right before the first trial. The
/// participant feels whether forces have the right direction, and the commands are checked against
/// the limits.
/// A constant force to the right: 1 N, or half of the largest force allowed where that is less.
class ForceDirectionCheck final : public rendering::Renderer {
 public:
  static constexpr double kSeconds = 1;  ///< of the push

  /// \param limits  in force: the smaller of the program's and the device's
  /// \param driven  degrees of freedom that the device drives. 5: push both ends of the stylus;
  ///                fewer: all of it at the grip, even where the device senses an axis
  ForceDirectionCheck(const servo::ForceLimits& limits, int driven);

  double force() const { return force_; }  ///< N, at each end
  bool both_ends() const { return both_ends_; }
  const servo::ForceLimits& limits() const { return limits_; }

  /// Pushes for kSeconds through the servo and its limits as in a trial, then takes the force off.
  /// Must outlive the servo, which may still use it after an unanswered stop().
  /// \param stop  asked at each tick; true ends it at once
  /// \return the fault of the commands; empty: none
  std::string push(servo::TickSource& servo, const std::function<bool()>& stop) const;

  const char* name() const override { return "push"; }
  bool side_contact() const override { return false; }
  rendering::Rendering tick(const rendering::Scene& scene, rendering::RenderState& state,
                            const rendering::LineProbe& probe, double dt) const noexcept override;

 private:
  servo::ForceLimits limits_;
  double force_;
  bool both_ends_;
};

/// For the plausibility of the computer's clock, the source of every date on record. ns since 1970,
/// UTC.
struct ClockEvidence {
  std::int64_t now_ns = 0;
  std::optional<std::int64_t> newest_record_ns;  ///< of the study
  std::optional<std::int64_t> newest_file_ns;    ///< when the protocol or the program was written
};

/// The reason to doubt the clock, in words; empty: none.
std::string clock_warning(const ClockEvidence& evidence);

/// The reasons that a protocol cannot be run on a device, a sentence each with a remedy; empty: it
/// can.
std::vector<std::string> incompatibilities(const protocols::Protocol& protocol,
                                           const StimulusLibrary& library,
                                           const servo::DeviceCapabilities& device);

/// Whether the device senses the axis of the stylus but drives force alone, so that a side contact
/// is felt without its torque.
bool torque_is_left_out(const servo::DeviceCapabilities& device);

/// The share of a material that a device can show at a rate without feeding energy to the hand.
struct ShowableMaterial {
  double fraction = 1;  ///< of its stiffness and damping together; 1: all, 0: nothing
  std::string reason;   ///< of the limit; empty: none
};

/// Sampled spring and damper: K T / 2 + |B| <= b (Colgate & Schenkel 1997), K <= 2 f_c / Delta
/// (Abbott & Okamura 2005), as far as the device's damping, friction and resolution are known, and
/// the stiffness that its maker gives for its highest rate, in proportion to the rate. Bounds of
/// passivity: no hand can make it buzz. The passivity controller adds kPassivityExtension times the
/// device's own damping. For a material with layers the sums count, because a deep press feels all
/// layers at once. For a compound the stiffest part counts for the surface and for each layer, and
/// then the sum of these.
/// \param gain  factor on stiffness and damping at the hand: felt_gain
ShowableMaterial showable(const stimuli::Material& material,
                          const servo::DeviceCapabilities& device, double rate, double gain,
                          bool passivity_controller);

/// The factor by which a stimulus's stiffness is multiplied at the ends of the stylus: virtual
/// metres in a metre of the device, times the square of the lever of a reach and of a tool that
/// extends beyond the stylus. The lever is the larger of the reach's factor (the hand turns about
/// the pivot) and the factor between a contact and the ends when each end moves alone.
double felt_gain(const protocols::Protocol& protocol);

/// `palpate stability` measures far more than this on every scene, if a force is written in the
/// tick of its reading; a delay of one tick leaves 1.5 (and K T / 2 is no longer a bound).
inline constexpr double kPassivityExtension = 2;

/// A material that was scaled down to what a device can show.
struct LimitedMaterial {
  std::string stimulus;
  int part = 0;         ///< of a compound: 0 itself, then its parts with theirs, in order
  double fraction = 1;  ///< of stiffness and damping that is left
  double stiffness = 0, damping = 0;  ///< N/m and N s/m, as the protocol asks
  std::string text;                   ///< a sentence
};

/// Where the protocol asks for limits (servo.material_limit), scales down the materials that the
/// device cannot show. Call before its stimuli are made. Returns the changes, in order.
std::vector<LimitedMaterial> limit_materials(protocols::Protocol& protocol,
                                             const servo::DeviceCapabilities& device);

/// An event for the session's record, one line of JSON: the materials as asked and as shown, the
/// device and the rate.
std::string to_json_text(const std::vector<LimitedMaterial>& limited,
                         const servo::DeviceCapabilities& device, double rate);

/// Repeats the limiting that an event of to_json_text describes, to the bit; false: the note is of
/// another kind. \throws std::invalid_argument: the event is of another protocol, or damaged
bool limit_as_recorded(protocols::Protocol& protocol, const std::string& event);

}  // namespace palpate::runner::session
