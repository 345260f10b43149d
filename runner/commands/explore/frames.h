#pragma once
// Pictures of a scene along a recorded path.

#include <string>
#include <vector>

#include "protocols/parse.h"
#include "rendering/renderer.h"
#include "runner/commands/render/forces.h"

namespace palpate::runner::commands {

struct PictureSize {
  int width = 1280, height = 720;  ///< px
};

struct ViewAngles {
  float yaw = 0.5F, pitch = 0.4F;  ///< rad
  float closer = 1;                ///< above 1: larger
};

/// "1280x720". \throws UsageError naming --size
PictureSize parse_size(const std::string& text);

/// "16ms" or "0.5s", in s. \throws UsageError naming --every
double parse_every(const std::string& text);

/// "30,20" or "30,20,1.5": degrees to the right and up, and the magnification. \throws UsageError
/// naming --view
ViewAngles parse_view(const std::string& text);

struct FrameSettings {
  PictureSize size;
  double every = 0.016;  ///< s, between pictures
  ViewAngles view;
  bool labels = false;
  std::string folder;        ///< of PNG files; empty: none
  bool animate = false;      ///< as a WebP as well
  bool may_replace = false;  ///< pictures in the folder
};

inline constexpr std::size_t kMostFrames = 100'000;

/// Refuses a folder of frames before any work: what exists is empty, or with `may_replace` holds
/// nothing but frames. \throws UsageError
void check_frames_folder(const std::string& folder, bool may_replace);

struct DrawnFrames {
  std::size_t pictures = 0;
  std::string animation;                       ///< WebP; empty: none
  double seconds = 0;                          ///< of the path
  std::vector<std::string> notes;              ///< features of the scene that are left out
  double tick_median_ns = 0, tick_p99_ns = 0;  ///< cost of a row's tick here, by the clock
};

/// \param scene_path  that faults name. \throws UsageError, DisplayError, MeshError, StoreError
DrawnFrames draw_frames(const std::string& scene_path, const protocols::SceneSpec& spec,
                        const rendering::Renderer& renderer, const std::vector<TimedPose>& poses,
                        const FrameSettings& settings);

}  // namespace palpate::runner::commands
