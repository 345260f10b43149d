#pragma once
// Changes materials of a scene while it is touched, gradually: the hand feels no step.

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "rendering/scene.h"

namespace palpate::runner::servo {

/// Made by the session's thread, then used by the servo's alone. Does not allocate there.
class FeelRamp {
 public:
  static constexpr double kDuration = 0.2;  ///< s, as forces take from zero to full

  struct Change {
    std::uint32_t part = 0;  ///< as in Scene::feel_of
    rendering::Feel to, from;
  };
  FeelRamp(std::uint64_t number, std::vector<Change> changes)
      : number_(number), changes_(std::move(changes)) {}

  std::uint64_t number() const noexcept { return number_; }
  /// From what the scene has now.
  void begin(const rendering::Scene& scene) noexcept {
    for (Change& change : changes_) change.from = scene.feel_of(change.part);
  }
  /// \return false: it has ended
  bool advance(rendering::Scene& scene, double seconds) noexcept {
    share_ = std::min(1.0, share_ + seconds / kDuration);
    const auto mixed = [this](double from, double to) {
      return share_ < 1 ? from + share_ * (to - from) : to;
    };
    for (const Change& change : changes_) {
      scene.set_feel(change.part,
                     {mixed(change.from.stiffness, change.to.stiffness),
                      mixed(change.from.damping, change.to.damping),
                      mixed(change.from.friction_static, change.to.friction_static),
                      mixed(change.from.friction_dynamic, change.to.friction_dynamic)});
    }
    return share_ < 1;
  }

 private:
  std::uint64_t number_;
  std::vector<Change> changes_;
  double share_ = 0;
};

}  // namespace palpate::runner::servo
