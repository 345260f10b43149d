#pragma once
// Error against run time of every method that can show one scene, on one path. Not for the servo.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "protocols/parse.h"
#include "rendering/renderer.h"
#include "runner/touch/forces.h"

namespace palpate::runner::evidence {

/// A scene and the paths on which methods are compared. World frame.
struct StudiedScene {
  std::string name;  ///< of the scene, for tables
  protocols::SceneSpec spec;
  /// Of the real stylus, each from its own beginning. Empty: a hand strokes each object, up to four
  /// of them, 1 to 2 mm deep at 0.1 m/s.
  std::vector<std::vector<touch::TimedPose>> paths;
};

struct SceneStudySettings {
  bool ray = true;         ///< else point
  int ticks = 1500;        ///< of a stroke
  int rounds = 3;          ///< warm timings of a path
  std::size_t cold = 500;  ///< ticks timed cold
  std::uint64_t seed = 1;  ///< of strokes
};

/// Over the ticks that the reference knows, of which some touch. Undefined without any.
struct SceneErrors {
  double force_rms = 0, force_p999 = 0, force_max = 0;  ///< N, as a vector; 99.9 % within p999
  std::optional<double> torque_max;                     ///< N m; where the torque is defined
  std::optional<double> tip_max;      ///< m, of the ideal tip; methods without one have none
  std::size_t ticks = 0;              ///< compared
  std::size_t lost = 0, phantom = 0;  ///< contacts missed, and found where there is none
};

struct SceneRow {
  std::string method;       ///< "law", "law, a quarter", "hull", "bullet"
  std::string description;  ///< a line for a legend
  std::size_t triangles = 0;
  std::optional<SceneErrors> errors;  ///< none: nothing exact is known about this scene
  // ns, of ticks in contact if there are any, else of all.
  double median_ns = 0, p99_ns = 0, worst_ns = 0;  ///< warm
  double cold_median_ns = 0, cold_p99_ns = 0;      ///< near caches swept before each tick
  std::size_t timed = 0;                           ///< ticks of the warm times, in all rounds
  bool best = false;  ///< no other row is both quicker (median) and nearer (force, rms)
};

struct SceneStudy {
  std::string name, truth;  ///< truth: where the exact answer is from
  std::string renderer;
  std::size_t ticks = 0, touching = 0;
  std::size_t unknown = 0;  ///< ticks without an exact answer
  /// Of those at which the ideal tool of the reference was tried by winding number: found inside.
  std::size_t tried = 0, found_inside = 0;
  std::vector<SceneRow> rows;
  std::vector<std::string> notes;  ///< what was left out, and why; a sentence each
  std::string choose;              ///< a sentence: which to choose
};

/// m, finer than which no device resolves.
inline constexpr double kResolved = 3e-5;

/// \param now       a clock, ns
/// \param progress  called with the fraction done
/// \throws stimuli::MeshError, InputError
SceneStudy study_scene(StudiedScene scene, const SceneStudySettings& settings,
                       const std::function<void(double)>& progress);

/// Scenes of every kind: shapes, compounds, closed surfaces, layers, tools, moving and soft bodies.
std::vector<StudiedScene> study_scenes();

}  // namespace palpate::runner::evidence
