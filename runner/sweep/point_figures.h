#pragma once
// The figures of a sweep's points, as `analyze` defines them.

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "data/record.h"
#include "data/sweep_record.h"
#include "protocols/protocol.h"

namespace palpate::runner::sweep {

/// The figures of a point, from its trials.
class PointFigures {
 public:
  virtual ~PointFigures() = default;
  virtual void add(int participant, const data::TrialRecord& record,
                   std::uint64_t contact_ticks) = 0;
  /// In the order of figure_columns().
  virtual std::vector<std::optional<double>> figures() const = 0;
};

/// The figures that a sweep computes for a kind of study.
class SweptKind {
 public:
  virtual ~SweptKind() = default;
  /// Puts what the columns of figures are named by, beside the protocol.
  virtual void name_columns(const protocols::Protocol& protocol, data::SweepPlan& plan) const = 0;
  /// \param plan  must outlive them
  virtual std::unique_ptr<PointFigures> figures(const protocols::Protocol& protocol,
                                                const data::SweepPlan& plan) const = 0;
};
const SweptKind& swept_kind(const protocols::Protocol& protocol);

}  // namespace palpate::runner::sweep
