#pragma once
// CSV files: the path of a stylus, read, and the forces along it, written.

#include <cstdint>
#include <string>
#include <vector>

#include "rendering/renderer.h"

namespace palpate::runner {

inline constexpr const char* kTrajectoryHeader = "t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z";
inline constexpr const char* kSideHeader = ",side_x,side_y,side_z";  ///< may follow
inline constexpr std::size_t kMostPoses = 4'000'000;                 // more than an hour at 1 kHz

struct TimedPose {
  double t = 0;                ///< s
  rendering::LineProbe probe;  ///< as it is held
  Vec3 side{0, 0, 0};          ///< of the tool, its +x; zero: not measured
  std::size_t line = 0;        ///< of the file
};

/// Coordinates that are not finite are accepted: the renderer reports them in the faults column.
/// \throws InputError with the faults, the first of many
std::vector<TimedPose> read_trajectory(const std::string& path);

/// The forces as CSV: a row for each tick.
class ForceTable {
 public:
  /// \param tool  whether the stylus carries one: more columns
  explicit ForceTable(bool tool);
  void add(const TimedPose& pose, const rendering::Rendering& rendering);
  const std::string& text() const { return text_; }
  /// A line for each kind of fault: in how many ticks, and where first. Empty: no faults.
  std::string warnings(const std::string& path) const;

 private:
  struct Seen {
    std::size_t ticks = 0, first_line = 0;
  };

  bool tool_;
  std::string text_;
  std::size_t rows_ = 0;
  std::vector<Seen> seen_;  ///< as kRenderFaults
};

}  // namespace palpate::runner
