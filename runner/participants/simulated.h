#pragma once
// A simulated participant: explores, perceives with noise, decides, answers. observer.md's model;
// it stands in for no one, and whatever it produces is labelled simulated.

#include <memory>

#include "runner/participants/explorer.h"
#include "runner/participants/respondent.h"
#include "runner/participants/shape_observer.h"

namespace palpate::runner {

class SimulatedParticipant final : public Respondent {
 public:
  /// \param own  settings of this individual; \param number  its number, with `seed` the source of
  /// all its randomness: each trial draws from a stream of its own, so a trial is the same whatever
  /// ran before it. \param hypotheses, stylus  must outlive it
  SimulatedParticipant(const SimulatedSettings& own, const ShapeHypotheses& hypotheses,
                       SimulatedStylus& stylus, const protocols::Protocol& protocol,
                       std::uint64_t seed, int number);

  void read(const std::string&) override {}
  void feedback(bool) override {}  // it does not learn
  void begin_trial(const protocols::Trial& trial) override;
  std::optional<Answer> step(const Sample& sample) override;

 private:
  HandTarget in_device(HandTarget target) const;
  Felt feel(const Sample& sample);
  Percept perceive(const Sample& sample, const Felt& felt);

  SimulatedSettings settings_;
  SimulatedStylus& stylus_;
  double wall_stiffness_, period_, low_pass_;
  std::uint64_t seed_;
  int number_;
  WorkspaceMap workspace_;
  Explorer explorer_;
  ShapeObserver observer_;
  stimuli::Random random_{0};
  bool ray_ = false;
  Vec3 centre_error_;                ///< m; where the centre is believed to be
  Vec3 force_, torque_;              ///< low-passed: N on the hand, N m about the tip
  bool place_known_ = false;         ///< force and stylus are not parallel, so torque tells a place
  double next_percept_ = 0;          ///< s from time zero
  std::optional<double> answer_at_;  ///< s from time zero
};

}  // namespace palpate::runner
