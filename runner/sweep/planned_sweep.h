#pragma once
// A sweep as it was asked for: its plan, and its points.

#include <atomic>
#include <cstdint>
#include <optional>
#include <ostream>
#include <string>

#include "data/sweep_record.h"
#include "protocols/protocol.h"
#include "runner/sweep/design.h"
#include "runner/sweep/swept_study.h"

namespace palpate::runner::sweep {

struct SweepSettings {
  std::string protocol, space, design;
  std::string patch;  ///< file of a JSON merge patch on the participant's settings; "": none
  std::int64_t points = 0;
  std::uint64_t seed = 1;
  int version = 0;                        ///< of the simulated participant; 0: not given
  int participants = 7, repetitions = 0;  ///< repetitions 0: the protocol's
};

struct PlannedSweep {
  /// \param settings  with a version. \throws UsageError; protocols::InputError with every fault of
  /// protocol or space
  /// \param notes  gets a line for each setting that could not be kept
  PlannedSweep(const SweepSettings& settings, std::ostream& notes);

  protocols::Protocol protocol;  ///< as in its file
  SweptStudy study;
  Design design;
  data::SweepPlan plan;
};

/// The inputs of a point of a sweep, which is a study in memory.
struct Sweep {
  const SweptStudy& study;
  const Design& design;
  const data::SweepPlan& plan;
};

/// The point's study, not yet run.
PointStudy study_of_point(const Sweep& sweep, std::int64_t point);

/// Runs a point; its figures are as `analyze` defines them. An exception is the reason why the
/// point failed.
/// \return none: it was stopped
std::optional<data::SweepRow> run_point(const Sweep& sweep, std::int64_t point,
                                        const std::atomic<bool>& stop);

}  // namespace palpate::runner::sweep
