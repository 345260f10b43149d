#pragma once
// One point of a sweep: a study in memory, and its figures as `analyze` defines them.

#include <atomic>
#include <cstdint>
#include <optional>

#include "data/sweep_record.h"
#include "runner/sweep/design.h"
#include "runner/sweep/swept_study.h"

namespace palpate::runner {

/// What a point follows from.
struct Sweep {
  const SweptStudy& study;
  const Design& design;
  const data::SweepPlan& plan;
};

/// The point's study, not run.
PointStudy study_of_point(const Sweep& sweep, std::int64_t point);

/// Runs it. Whatever it throws is the reason why the point failed. \return none: it was stopped
/// before its end
std::optional<data::SweepRow> run_point(const Sweep& sweep, std::int64_t point,
                                        const std::atomic<bool>& stop);

}  // namespace palpate::runner
