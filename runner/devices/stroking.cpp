#include "runner/devices/stroking.h"

#include <cmath>

namespace palpate::runner::devices {

StrokingStylus::StrokingStylus(double length, double grip, double rate,
                               const StrokeSettings& settings)
    : settings_(settings), grip_(grip), tick_(1 / rate), stylus_({}, {}, length, grip, 1 / rate) {
  stylus_.reset(target_at(0));
}

HandTarget StrokingStylus::target_at(double time) const {
  HandTarget target;
  target.grip = {0, -settings_.distance, grip_};
  if (time < settings_.rest) return target;
  const double turn = 2 * M_PI / settings_.stroke;
  const double phase = turn * (time - settings_.rest);
  const double half = settings_.distance / 2;
  target.grip.y += half * (1 - std::cos(phase));
  target.velocity.y = half * turn * std::sin(phase);
  return target;
}

servo::DeviceReading StrokingStylus::read() noexcept {
  time_ += tick_;
  if (time_ >= settings_.rest + settings_.stroke) time_ = 0;
  stylus_.set_target(target_at(time_));
  return stylus_.read();
}

}  // namespace palpate::runner::devices
