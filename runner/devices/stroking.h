#pragma once
// The simulated device of `run --device simulated`: its hand rests outside the workspace, strokes
// through it and back, and repeats this without feedback.

#include "runner/devices/simulated.h"

namespace palpate::runner::devices {

struct StrokeSettings {
  double distance = 0.1;  ///< m, from the centre of the workspace, at rest
  double rest = 1.0;      ///< s, between strokes, so that a trial can begin
  double stroke = 1.5;    ///< s, forth and back
};

class StrokingStylus final : public servo::Device {
 public:
  /// \param rate  Hz, of the servo
  StrokingStylus(double length, double grip, double rate, const StrokeSettings& settings = {});

  const servo::DeviceCapabilities& capabilities() const override { return stylus_.capabilities(); }
  servo::DeviceReading read() noexcept override;
  void write(const Vec3& device1, const Vec3& device2) noexcept override {
    stylus_.write(device1, device2);
  }

 private:
  HandTarget target_at(double time) const;  ///< \param time  s, since a rest began

  StrokeSettings settings_;
  double grip_, tick_;
  double time_ = 0;
  SimulatedStylus stylus_;
};

}  // namespace palpate::runner::devices
