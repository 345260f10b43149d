#pragma once
// A simulated participant for the tasks of version 2: explores as SimulatedParticipant does, feels
// for a while, and judges levels (task_judgement.h). Stiffness is judged from force and depth as
// the hand met them; other levels are known to the model.

#include <cstdint>
#include <optional>
#include <string>

#include "runner/participants/respondent.h"
#include "runner/participants/simulated.h"
#include "runner/participants/task_judgement.h"

namespace palpate::runner {

class TaskParticipant final : public Respondent {
 public:
  /// As SimulatedParticipant.
  TaskParticipant(const SimulatedSettings& own, const ShapeHypotheses& hypotheses,
                  SimulatedStylus& stylus, const protocols::Protocol& protocol, std::uint64_t seed,
                  int number);

  void read(const std::string&) override {}
  void feedback(bool) override {}
  void begin_trial(const protocols::Trial& trial) override;
  void begin_interval(const protocols::Trial& trial, const IntervalView& view) override;
  std::optional<Answer> step(const Sample& sample) override;
  std::optional<Answer> confidence(const protocols::ConfidenceSpec& asked) override;
  std::string ask(const protocols::PageSpec& page, const protocols::PageItem& item) override;

 private:
  Answer answer(std::int64_t time_ns);

  const protocols::Protocol& protocol_;
  SimulatedParticipant hand_;
  TaskJudgement judgement_;
  std::uint64_t seed_;
  int number_;
  protocols::Trial trial_;
  IntervalView view_;
  int felt_ = 0;  ///< intervals of the trial so far
  double period_;
  double stiffness_sum_ = 0;  ///< N/m, over ticks with contact
  int contact_ticks_ = 0;
  std::int64_t answered_ns_ = 0;
};

}  // namespace palpate::runner
