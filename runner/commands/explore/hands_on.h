#pragma once
// The window of `palpate explore`.

#include <string>

#include "protocols/parse.h"
#include "rendering/renderer.h"

namespace palpate::runner {

struct HandsOnSettings {
  std::string scene_path, trajectory, device;  ///< a path or a device
  std::string pictures;                        ///< folder for those that are kept; empty: none
  std::string calibration;                     ///< file of calibrations; empty: the usual one
  bool without_calibration = false, labels = false;
};

/// Touches the scene in a window until that is closed. \return exit status
/// \throws UsageError, DisplayError, InputError, MeshError; std::runtime_error: no such device
int explore_hands_on(const protocols::SceneSpec& spec, const rendering::Renderer& renderer,
                     const HandsOnSettings& settings);

}  // namespace palpate::runner
