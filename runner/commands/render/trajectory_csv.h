#pragma once
// The path of a stylus as CSV, in, and the forces along it, out.

#include <cstdint>
#include <string>
#include <vector>

#include "rendering/renderer.h"

namespace palpate::runner {

inline constexpr const char* kTrajectoryHeader = "t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z";
inline constexpr std::size_t kMostPoses = 4'000'000;  // more than an hour at 1 kHz

struct TimedPose {
  double t = 0;  ///< s
  rendering::LineProbe probe;
  std::size_t line = 0;  ///< of the file
};

/// Coordinates that are not finite are let through: what the renderer makes of them is its answer.
/// \throws InputError with the faults, some of many
std::vector<TimedPose> read_trajectory(const std::string& path);

/// What goes out for a tick.
class ForceTable {
 public:
  ForceTable();
  void add(const TimedPose& pose, const rendering::Rendering& rendering);
  const std::string& text() const { return text_; }
  /// A line for each fault that ticks had: in how many of them, and where first. Empty: none had.
  std::string warnings(const std::string& path) const;

 private:
  struct Seen {
    std::size_t ticks = 0, first_line = 0;
  };

  std::string text_;
  std::size_t rows_ = 0;
  std::vector<Seen> seen_;  ///< as kRenderFaults
};

}  // namespace palpate::runner
