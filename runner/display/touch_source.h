#pragma once
// Where the moments come from that a window shows.

#include <string>
#include <vector>

#include "runner/display/scene/scene_drawing.h"
#include "stimuli/shapes.h"

namespace palpate::runner {

/// All functions are called by the display's thread, return at once and never make a servo wait.
class TouchSource {
 public:
  virtual ~TouchSource() = default;
  /// Whether a hand touches the scene now; else a path is shown that was recorded.
  virtual bool live() const = 0;
  /// Appends what has happened since the last call, in order; of a long time the last minute.
  virtual void take(std::vector<SceneMoment>& out) = 0;
  /// While it is held nothing is felt and nothing happens; then it goes on from where it stood.
  virtual void hold(bool held) = 0;
  /// So many ticks more while it is held, without force on the hand. Of a recorded path none.
  virtual void step(int /*ticks*/) {}
  /// m, that the stylus is away from where it was when it was held: it goes on once that is small.
  virtual double away() const { return 0; }
  /// Touches these from now on, from the beginning: the same shapes, of other materials.
  virtual void show(const std::vector<stimuli::ObjectSpec>& objects) = 0;
  /// Draws an object that moves, until the next call; where nothing is live, nothing happens.
  virtual void pull(const rendering::BodyPull& /*by*/) noexcept {}
  /// Zero force at once and until clear_fault().
  virtual void emergency_zero() noexcept = 0;
  virtual void clear_fault() noexcept = 0;
  /// Why the scene could not be touched, empty: it can.
  virtual std::string trouble() const = 0;
};

}  // namespace palpate::runner
