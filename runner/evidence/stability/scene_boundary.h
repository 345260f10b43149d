#pragma once
// Where a scene buzzes: its places of contact, and the damping that each needs at every rate and
// delay. For studies, not for the servo.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "protocols/parse.h"
#include "rendering/renderer.h"
#include "runner/evidence/stability/boundary.h"

namespace palpate::runner::evidence {

inline constexpr double kSceneRates[] = {100, 200, 500, 1000, 2000, 5000, 10000};  // Hz
inline constexpr int kSceneDelays = 4;  ///< 0 to 3 ticks from a reading to its force

/// One point of the map of a place.
struct DampingNeeded {
  double rate = 0;    ///< Hz
  int delay = 0;      ///< ticks
  double needed = 0;  ///< N s/m of each end, by simulation; infinity: none is enough
  double theory = 0;  ///< N s/m, passive with any hand
};

/// A place where the stylus touches, of one kind: object, type and number of contacts.
struct BuzzingPlace {
  int object = 0;
  std::string type;  ///< "segment-edge"
  int contacts = 0;
  Vec3 point{0};         ///< m, in the scene
  double stiffness = 0;  ///< N/m, of the contact, at the ends of the real stylus
  std::vector<DampingNeeded> map;
  /// Whether it does on the given device: with its rate, delay, damping, friction and resolution.
  std::optional<bool> buzzes = std::nullopt;
};

struct SceneBoundary {
  std::vector<BuzzingPlace> places;
  std::vector<std::string> notes;  ///< what was left out, and why
};

/// Presses the stylus at places that a hand finds as it strokes each object, up to eight kinds of
/// contact, and closes the loop there: ends of 0.1 kg, no hand.
/// \param device    the ends of a device, for BuzzingPlace::buzzes; null: none
/// \param threads   for the loops
/// \param progress  called with the fraction done
/// \throws stimuli::MeshError
SceneBoundary scene_boundary(const std::string& name, const protocols::SceneSpec& spec,
                             const rendering::Renderer& renderer, const LoopSettings* device,
                             int threads, const std::function<void(double)>& progress);

}  // namespace palpate::runner::evidence
