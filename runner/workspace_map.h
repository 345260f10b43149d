#pragma once
// From the device's frame to the virtual world and back.

#include <optional>

#include "rendering/reach.h"

namespace palpate::runner {

/// Where the virtual world stands in the device's frame: virtual = scale * (device - centre); and
/// how far the virtual stylus reaches beyond the real one.
struct WorkspaceMap {
  Vec3 centre;       ///< m, device frame
  double scale = 1;  ///< virtual metres per device metre
  std::optional<rendering::Reach> reach = std::nullopt;

  Vec3 to_virtual(const Vec3& device) const { return scale * (device - centre); }
  Vec3 to_device(const Vec3& virtual_point) const { return virtual_point / scale + centre; }

  /// Virtual metres by which the virtual stylus is shifted when the real one is, by a metre.
  double shift_gain() const { return scale * (reach && reach->in_world ? reach->factor : 1); }

  /// The virtual stylus to that in the device's frame. m.
  rendering::LineProbe to_virtual(const rendering::LineProbe& device) const {
    const rendering::LineProbe real{to_virtual(device.tip), to_virtual(device.tail)};
    return reach ? rendering::stretched(*reach, real) : real;
  }
  rendering::LineProbe to_device(const rendering::LineProbe& virtual_probe) const {
    const rendering::LineProbe real =
        reach ? rendering::unstretched(*reach, virtual_probe) : virtual_probe;
    return {to_device(real.tip), to_device(real.tail)};
  }
};

}  // namespace palpate::runner
