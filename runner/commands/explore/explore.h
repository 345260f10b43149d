#pragma once
// The values of explore's options: size, interval and view.

#include <string>

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

}  // namespace palpate::runner::commands
