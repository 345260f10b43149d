#include "runner/session/session_plan.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>

#include "protocols/tasks/levels.h"
#include "stimuli/shapes.h"

namespace palpate::runner::session {
namespace {

constexpr std::size_t kMostKnown = 32;  // a sphere with its trees takes a megabyte

protocols::StimulusSpec shown_stimulus(const protocols::Protocol& protocol,
                                       const protocols::Trial& trial,
                                       const protocols::Interval& interval) {
  if (interval.level)
    return protocols::at_level(protocol, *protocols::block_of(protocol, trial), interval.stimulus,
                               *interval.level);
  return protocol.stimuli[static_cast<std::size_t>(interval.stimulus)];
}

}  // namespace

SessionScenes::SessionScenes(const protocols::Protocol& protocol, const StimulusLibrary* library)
    : protocol_(protocol), library_(library), one_(protocol) {
  one_.stimuli.clear();
  one_.stimulus_texts.clear();
  one_.source_text.clear();
  one_.blocks.clear();
}

SessionScenes::Place SessionScenes::find(const protocols::Trial& trial,
                                         const protocols::Interval& interval) {
  if (library_ != nullptr && !interval.level) return {*library_, interval.stimulus};
  auto key = std::make_tuple(trial.task_block, interval.stimulus, interval.level);
  if (const auto found = known_.find(key); found != known_.end()) return {*found->second, 0};
  if (known_.size() >= kMostKnown) known_.clear();
  one_.stimuli.clear();
  if (interval.stimulus >= 0) one_.stimuli.push_back(shown_stimulus(protocol_, trial, interval));
  auto made = std::make_unique<const StimulusLibrary>(one_);
  return {*known_.emplace(std::move(key), std::move(made)).first->second, 0};
}

rendering::Scene SessionScenes::scene(const protocols::Trial& trial,
                                      const protocols::Interval& interval) {
  const Place place = find(trial, interval);
  if (interval.stimulus < 0) return place.library.empty_scene(interval.renderer);
  protocols::Trial one;
  one.stimulus = place.stimulus;
  one.renderer = interval.renderer;
  one.orientation = trial.orientation;
  return place.library.scene(one);
}

const SharpEdges& SessionScenes::edges(const protocols::Trial& trial,
                                       const protocols::Interval& interval) {
  static const SharpEdges kNone;
  if (interval.stimulus < 0) return kNone;
  const Place place = find(trial, interval);
  return place.library.edges(place.stimulus);
}

stimuli::ObjectSpec shown_object(const protocols::Protocol& protocol, const protocols::Trial& trial,
                                 const protocols::Interval& interval) {
  stimuli::ObjectSpec object = shown_stimulus(protocol, trial, interval).object;
  object.pose = stimuli::compose({Vec3(0), trial.orientation}, object.pose);
  return object;
}

IdentificationPlan::IdentificationPlan(const protocols::Protocol& protocol, int participant_number,
                                       int session)
    : protocol_(&protocol), participant_number_(participant_number) {
  const std::vector<protocols::Trial> all = protocols::schedule(protocol, participant_number);
  std::copy_if(all.begin(), all.end(), std::back_inserter(trials_),
               [session](const protocols::Trial& trial) { return trial.session == session; });
  const bool warms_up = session > 1 && protocol.sessions.warm_up_trials > 0;
  if (!trials_.empty()) first_practice_block_ = trials_.front().block + (warms_up ? 1 : 0);
}

void IdentificationPlan::answered(const protocols::TrialOutcome& outcome) {
  const protocols::Trial& trial = trials_[next_++];
  if (!trial.practice || trial.block < first_practice_block_) return;
  ++shown_;
  correct_ += outcome.correct ? 1 : 0;
  if (finished() || trials_[next_].block != trial.block) judge_practice();
}

void IdentificationPlan::judge_practice() {
  const auto& practice = protocol_->practice;
  const bool passed = !practice.criterion || correct_ >= *practice.criterion * shown_;
  correct_ = shown_ = 0;
  if (passed || round_ >= practice.max_rounds) {
    round_ = 1;
    return;
  }
  const protocols::Trial& last = trials_[next_ - 1];
  const int session = last.session, block = last.block;
  std::vector<protocols::Trial> again =
      protocols::practice_round(*protocol_, participant_number_, last.renderer, ++round_);
  for (protocols::Trial& trial : again) {
    trial.session = session;
    trial.block = block;
  }
  trials_.insert(trials_.begin() + static_cast<std::ptrdiff_t>(next_), again.begin(), again.end());
  for (std::size_t i = 0; i < trials_.size(); ++i) trials_[i].trial = static_cast<int>(i) + 1;
}

SessionPlan::SessionPlan(const protocols::Protocol& protocol, int participant_number, int session)
    : protocol_(&protocol),
      plan_(protocol.blocks.empty()
                ? Plan(IdentificationPlan(protocol, participant_number, session))
                : Plan(protocols::TaskPlan(protocol, participant_number, session))) {}

const protocols::TaskBlock* SessionPlan::next_block() const {
  return finished() ? nullptr : block_of(*protocol_, next());
}

void SessionPlan::answered(const protocols::TrialOutcome& outcome) {
  after_practice_ = next().practice;
  std::visit([&outcome](auto& plan) { plan.answered(outcome); }, plan_);
  done_in_block_ = finished() || block_begins() ? 0 : done_in_block_ + 1;
}

protocols::TrialOutcome outcome_of(const data::TrialRecord& record) {
  return {record.correct, record.task.success, !record.timed_out, record.task.level};
}

}  // namespace palpate::runner::session
