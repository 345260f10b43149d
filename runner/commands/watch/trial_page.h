#pragma once
// A page that shows trials: objects, tool, contact and force in time.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "runner/session/replay.h"
#include "stimuli/shapes.h"

namespace palpate::runner {

// The surface of an object as a page shows it: corners that triangles share.

struct PictureMesh {
  std::vector<Vec3> corners;  ///< m, the object's own frame
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::size_t all_triangles = 0;  ///< of the object; more than are here: it was made coarser
};

/// \param most  triangles; where there are more, corners that are near to each other become one,
/// for the picture alone. \throws MeshError, std::runtime_error where a file is no mesh
PictureMesh picture_mesh(const stimuli::ObjectSpec& object, std::size_t most);

struct WatchedTrial {
  std::string name;  ///< "P03/1/12"
  RecordedTrial trial;
};

struct TrialPage {
  std::string html;
  std::size_t ticks = 0;           ///< that it shows; a comparison has them twice
  std::vector<std::string> notes;  ///< what differs from the record or the object, in sentences
};

/// Self-contained: nothing is loaded, and no script runs but its own.
/// \param compare  after each trial, what the other renderer makes of its path
/// \throws std::invalid_argument where protocol and record do not agree
TrialPage trial_page(const std::vector<WatchedTrial>& trials, bool compare);

std::string_view watch_css();  ///< watch.css, embedded by the build
std::string_view watch_js();

}  // namespace palpate::runner
