#pragma once
// A simulated participant for the tasks of version 2. It identifies shapes as SimulatedParticipant
// does, percept by percept. In all other tasks it explores likewise for a while and judges levels
// from contact (task_judgement.h) if contact reveals them; the model is given the other levels.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runner/participants/respondent.h"
#include "runner/participants/simulated.h"
#include "runner/participants/task_judgement.h"

namespace palpate::runner::participants {

/// Hypotheses for each block of a protocol; null: nothing to identify, or stimuli of one shape.
using BlockHypotheses = std::vector<std::shared_ptr<const ShapeHypotheses>>;
/// \throws MeshError
BlockHypotheses block_hypotheses(const protocols::Protocol& protocol);

class TaskParticipant final : public Respondent {
 public:
  /// As SimulatedParticipant. \param hypotheses  for exploration. \param of_blocks  for
  /// identification; must outlive it, too
  TaskParticipant(const SimulatedSettings& own, const ShapeHypotheses& hypotheses,
                  const BlockHypotheses& of_blocks, devices::SimulatedStylus& stylus,
                  const protocols::Protocol& protocol, std::uint64_t seed, int number);

  void read(const std::string&) override {}
  void feedback(bool) override {}
  void begin_trial(const protocols::Trial& trial) override;
  void begin_interval(const protocols::Trial& trial, const IntervalView& view) override;
  std::optional<Answer> step(const servo::Sample& sample) override;
  std::optional<Answer> confidence(const protocols::ConfidenceSpec& asked) override;
  std::string ask(const protocols::PageSpec& page, const protocols::PageItem& item) override;

 private:
  Answer answer(std::int64_t time_ns);
  const protocols::TaskBlock& block() const;
  std::optional<Answer> identify(const servo::Sample& sample);

  const protocols::Protocol& protocol_;
  SimulatedParticipant hand_;
  /// Participants by the hypotheses that they identify.
  std::map<const ShapeHypotheses*, SimulatedParticipant> identifiers_;
  const BlockHypotheses& of_blocks_;
  SimulatedParticipant* identifier_ = nullptr;  ///< of this trial
  TaskJudgement judgement_;
  LevelPercept percept_;
  std::uint64_t seed_;
  int number_;
  protocols::Trial trial_;
  IntervalView view_;
  int felt_ = 0;  ///< intervals of the trial so far
  double period_;
  std::int64_t answered_ns_ = 0;
  bool judged_ = false;   ///< in this interval
  double look_ = 0;       ///< s of exploration in it
  bool limited_ = false;  ///< it ends by itself
};

}  // namespace palpate::runner::participants
