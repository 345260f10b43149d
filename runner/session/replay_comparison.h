#pragma once
// Comparison of a recorded trial with the present renderers along its path.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "data/record.h"
#include "protocols/protocol.h"
#include "stimuli/vec.h"

namespace palpate::runner::session {

/// One renderer's forces along the path.
struct ForceSummary {
  std::string renderer;
  double time_in_contact = 0;           ///< fraction of the ticks
  std::optional<double> first_contact;  ///< s from time zero; none: no contact
  double rms_force = 0, max_force = 0;  ///< N
  double max_depth = 0;                 ///< m, penetration
};

struct RenderedForce {
  Vec3 force, torque;  ///< N, N m, on the hand
  double depth = 0;    ///< m
};

struct ReplayedTick {
  double time = 0;           ///< s from the interval's time zero
  std::size_t interval = 1;  ///< from 1
  const data::SampleRecord* recorded;
  RenderedForce again;  ///< by the recorded renderer
  RenderedForce other;  ///< by the other one, if requested
};

/// An interval as replayed. A trial of version 1 has one.
struct ReplayedInterval {
  std::string stimulus, renderer;  ///< as recorded; no stimulus: no object
  std::optional<double> level = std::nullopt;
  bool standard = false;
  std::size_t ticks = 0, equal_ticks = 0;
};

struct ReplayComparison {
  std::size_t equal_ticks = 0;                    ///< to the bit
  std::optional<std::uint32_t> first_difference;  ///< tick
  std::size_t differing_interval = 1;             ///< its interval
  bool periods_known = true;  ///< the record holds the ticks' periods, on which damping depends
  ForceSummary recorded;
  std::optional<ForceSummary> other;
  double rms_difference = 0, max_difference = 0;  ///< N, of the two renderers' forces
  std::vector<ReplayedTick> ticks;                ///< all, in order
  std::vector<ReplayedInterval> intervals;        ///< all, in order
};

/// \param record         with samples; must outlive the result
/// \param compare_other  whether to run the other renderer along the same path
/// \throws std::invalid_argument where protocol and record do not agree
ReplayComparison compare_with_record(const protocols::Protocol& protocol,
                                     const data::TrialRecord& record, bool compare_other);

}  // namespace palpate::runner::session
