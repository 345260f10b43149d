#pragma once

#include <string>
#include <vector>

#include "runner/device.h"
#include "runner/scene_builder.h"

namespace palpate {

/// Why a protocol cannot be run on a device, one sentence each with what would help; empty: it can.
std::vector<std::string> misfits(const Protocol& protocol, const StimulusLibrary& library,
                                 const DeviceCapabilities& device);

/// What of a material a device can show at a rate without feeding energy to the hand.
struct ShowableMaterial {
  double share = 1;    ///< of its stiffness and damping together; 1: all, 0: nothing
  std::string reason;  ///< what is in the way; empty: nothing
};

/// Sampled spring and damper: K T / 2 + |B| <= b (Colgate & Schenkel 1997), K <= 2 f_c / Delta
/// (Abbott & Okamura 2005), as far as the device's damping, friction and resolution are known, and
/// the stiffness that its maker gives for its highest rate, in proportion to the rate. Bounds of
/// passivity: no hand can make it buzz. The passivity controller makes up for kPassivityExtension
/// times what the device's own damping does.
/// \param scale  virtual metres per device metre: the device shows so many times the stiffness
ShowableMaterial showable(const Material& material, const DeviceCapabilities& device, double rate,
                          double scale, bool passivity_controller);

/// `palpate stability` measures far more than this on every scene, as long as a force is written in
/// the tick of its reading; a tick late leaves 1.5 (and K T / 2 is no bound any more).
inline constexpr double kPassivityExtension = 2;

/// Where the protocol asks for limits (servo.material_limit), scales down what the device cannot
/// show; to be called before its stimuli are made. A sentence for each material that was.
std::vector<std::string> limit_materials(Protocol& protocol, const DeviceCapabilities& device);

}  // namespace palpate
