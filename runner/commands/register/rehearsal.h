#pragma once
// Studies simulated from a plan's model before there are data, to rehearse the analysis and the
// hypotheses.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/statistics/power.h"
#include "protocols/protocol.h"
#include "protocols/schedule.h"
#include "runner/commands/register/registration.h"

namespace palpate::runner::commands {

class PlannedStudies {
 public:
  /// The shapes of the model are those of the protocol, which has two renderers.
  PlannedStudies(const protocols::Protocol& protocol, const analysis::StudyModel& model,
                 std::size_t participants, std::uint64_t seed);

  /// s; the plan has only ratios of times, so this is the geometric middle between the limit of too
  /// fast answers and the time-out, to lose the fewest trials at either end.
  static double typical_time(const protocols::Protocol& protocol, double too_fast);

  /// Writes a study with the planned effect, or none, as 'palpate export' writes data.
  /// \param folder  for a database, which is removed again \param csv  the file
  /// \param codebook  the file; "": none
  void write(const std::string& folder, const std::string& csv, const std::string& codebook,
             bool with_effect, double typical_time) const;

  /// Verdicts on hypotheses in studies with the planned effect and in as many without; the first of
  /// each are those of write(). The result does not depend on `jobs`.
  /// \param first  the trials of the first study \param progress  called with the finished studies
  std::vector<Rehearsal> rehearse(const analysis::TrialTable& first,
                                  const Registration& registration, std::size_t studies,
                                  std::size_t jobs,
                                  const std::function<void(std::size_t)>& progress) const;

 private:
  struct Outcome {
    bool correct = false, timed_out = false;
    std::size_t answer = 0;  ///< shape of the model
    double time = 0;         ///< s
  };
  /// Of all trials of a participant, practice included.
  std::vector<Outcome> outcomes(std::size_t participant, std::size_t study, bool with_effect,
                                double typical_time) const;
  analysis::TrialTable table(const analysis::TrialTable& like, std::size_t study, bool with_effect,
                             double typical_time) const;

  const protocols::Protocol& protocol_;
  analysis::StudyModel model_, no_effect_;
  std::uint64_t seed_;
  std::vector<std::vector<protocols::Trial>> schedules_;  ///< by participant
  std::vector<std::size_t> shape_of_stimulus_;            ///< index into the model's
};

}  // namespace palpate::runner::commands
