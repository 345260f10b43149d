#pragma once
// Studies simulated from a plan before there are data, to rehearse the analysis and the hypotheses:
// with the planned effect, and with none.

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "runner/registration/registration.h"

namespace palpate::runner::registration {

class PlannedStudies {
 public:
  virtual ~PlannedStudies() = default;

  /// Writes study 0 as 'palpate export' writes data.
  /// \param folder  for a database, which is removed again \param csv  the file
  /// \param codebook  the file; "": none
  virtual void write(const std::string& folder, const std::string& csv, const std::string& codebook,
                     bool with_effect) const = 0;
  /// The analysis of a file of write(), as JSON. \param name  of the file there
  virtual std::string analyzed(const std::string& csv, const std::string& name) = 0;
  /// The analysis of study 0, 1, ..., as JSON. Several threads may call it after analyzed().
  virtual std::string analyzed(std::size_t study, bool with_effect) const = 0;
  /// Studies that are simulated with the effect, and as many with none, unless the lab says.
  virtual std::size_t usual_studies() const = 0;
};

/// \param made  with protocol, plan, number of participants, seed and settings; must outlive it
/// \throws UsageError: its tasks cannot be simulated
std::unique_ptr<PlannedStudies> planned_tasks(const Registration& made);
/// The study of shapes, drawn from the plan's model.
std::unique_ptr<PlannedStudies> planned_identification(const Registration& made);

/// s; the plan has only ratios of times, so this is the geometric middle between the limit of too
/// fast answers and the time-out, to lose the fewest trials at either end. 0: nothing is
/// identified.
double typical_time(const protocols::Protocol& protocol, double too_fast);

/// Verdicts on the hypotheses in studies with the planned effect and in as many without; the first
/// of each are those of write(). The result does not depend on `jobs`.
/// \param progress  called with the share that is done
std::vector<Rehearsal> rehearse(const PlannedStudies& planned, const Registration& made,
                                std::size_t studies, std::size_t jobs,
                                const std::function<void(double)>& progress);

}  // namespace palpate::runner::registration
