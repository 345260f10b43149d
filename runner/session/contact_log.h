#pragma once
// How a trial's object was touched: what tells an active explorer from a passive one. Defined here,
// for live and simulated sessions alike.
//
//   contact share  ticks with contact (at least one contact place with force) over all ticks, from
//                  time zero to the last tick before the answer
//   edge dwell     ticks with contact on an edge, times the servo's period: the deepest contact's
//                  point is within kReach of a sharp edge or vertex (runner/sharp_edges.h)

#include <cstdint>
#include <optional>

#include "runner/servo/sample.h"
#include "runner/sharp_edges.h"
#include "stimuli/vec.h"

namespace palpate::runner {

class ContactLog {
 public:
  static constexpr double kReach = 0.003;  ///< m; a light touch goes 2 mm deep

  /// \param edges  of the trial's stimulus; must outlive the trial. \param orientation  of it
  void begin(const SharpEdges& edges, const Quat& orientation);
  /// A tick with forces on. Does not allocate.
  void add(const Sample& sample) noexcept;

  double contact_share() const;  ///< 0 where there was no tick
  /// s; none where the stimulus has too many edges (SharpEdges::kMost).
  std::optional<double> edge_dwell(double period) const;

 private:
  bool on_edge(const Vec3& point) noexcept;

  const SharpEdges* edges_ = nullptr;
  Quat to_object_{1, 0, 0, 0};
  std::uint64_t ticks_ = 0, contact_ticks_ = 0, edge_ticks_ = 0;
  // Moved by less than margin_ from here, a point stays on the same side of kReach.
  Vec3 known_;
  double margin_ = -1;  ///< m; negative: nothing is known yet
  bool known_on_edge_ = false;
};

}  // namespace palpate::runner
