#pragma once
// A page that shows trials: objects, tool, contact and force in time.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "runner/session/recorded_trial.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/shapes.h"

namespace palpate::runner::touch {

/// The surface of an object for a page: triangles with shared corners.
struct PictureMesh {
  std::vector<Vec3> corners;  ///< m, the object's own frame
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::size_t all_triangles = 0;  ///< of the object; if there are more than here, it was simplified
};

/// \param most  largest number of triangles; beyond it, near corners are merged, for the picture
/// only. \throws MeshError; std::runtime_error if a file is not a mesh
PictureMesh picture_mesh(const stimuli::ObjectSpec& object, std::size_t most);

struct WatchedTrial {
  std::string name;  ///< "P03/1/12"
  session::RecordedTrial trial;
};

struct TrialPage {
  std::string html;
  std::size_t ticks = 0;           ///< ticks shown; a comparison has them twice
  std::vector<std::string> notes;  ///< differences from the record or the object, in sentences
};

/// A self-contained page: it loads nothing and runs no script except its own.
/// \param compare  after each trial, also its path with the other renderer
/// \throws std::invalid_argument if protocol and record disagree
TrialPage trial_page(const std::vector<WatchedTrial>& trials, bool compare);

// Texts that the build embeds:
std::string_view watch_css();  ///< watch.css
std::string_view watch_js();   ///< drawing.js to watch.js
std::string_view live_page();  ///< the watchers' page of palpate serve: live.html with its script

}  // namespace palpate::runner::touch
