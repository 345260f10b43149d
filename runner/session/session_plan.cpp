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
  if (interval.level) {
    const auto& block = protocol.blocks[static_cast<std::size_t>(trial.task_block)];
    return protocols::at_level(protocol, block, interval.stimulus, *interval.level);
  }
  return protocol.stimuli[static_cast<std::size_t>(interval.stimulus)];
}

}  // namespace

LevelScenes::LevelScenes(const protocols::Protocol& protocol)
    : protocol_(protocol), one_(protocol) {
  one_.stimuli.clear();
  one_.stimulus_texts.clear();
  one_.source_text.clear();
  one_.blocks.clear();
}

const StimulusLibrary& LevelScenes::library(const protocols::Trial& trial,
                                            const protocols::Interval& interval) {
  auto key = std::make_tuple(trial.task_block, interval.stimulus, interval.level);
  if (const auto found = known_.find(key); found != known_.end()) return *found->second;
  if (known_.size() >= kMostKnown) known_.clear();
  one_.stimuli.clear();
  if (interval.stimulus >= 0) one_.stimuli.push_back(shown_stimulus(protocol_, trial, interval));
  return *known_.emplace(std::move(key), std::make_unique<const StimulusLibrary>(one_))
              .first->second;
}

rendering::Scene LevelScenes::scene(const protocols::Trial& trial,
                                    const protocols::Interval& interval) {
  const StimulusLibrary& shown = library(trial, interval);
  if (interval.stimulus < 0) return shown.empty_scene(interval.renderer);
  protocols::Trial one;
  one.renderer = interval.renderer;
  one.orientation = trial.orientation;
  return shown.scene(one);
}

const SharpEdges& LevelScenes::edges(const protocols::Trial& trial,
                                     const protocols::Interval& interval) {
  static const SharpEdges kNone;
  return interval.stimulus < 0 ? kNone : library(trial, interval).edges(0);
}

stimuli::ObjectSpec shown_object(const protocols::Protocol& protocol, const protocols::Trial& trial,
                                 const protocols::Interval& interval) {
  stimuli::ObjectSpec object = shown_stimulus(protocol, trial, interval).object;
  object.pose = stimuli::compose({Vec3(0), trial.orientation}, object.pose);
  return object;
}

SessionPlan::SessionPlan(const protocols::Protocol& protocol, int participant_number, int session)
    : protocol_(&protocol), participant_number_(participant_number) {
  if (protocol.version == 2) {
    tasks_.emplace(protocol, participant_number, session);
    return;
  }
  const std::vector<protocols::Trial> all = protocols::schedule(protocol, participant_number);
  std::copy_if(all.begin(), all.end(), std::back_inserter(trials_),
               [session](const protocols::Trial& trial) { return trial.session == session; });
  const bool warms_up = session > 1 && protocol.sessions.warm_up_trials > 0;
  if (!trials_.empty()) first_practice_block_ = trials_.front().block + (warms_up ? 1 : 0);
}

const protocols::TaskBlock* SessionPlan::next_block() const {
  if (finished() || next().task_block < 0) return nullptr;
  return &protocol_->blocks[static_cast<std::size_t>(next().task_block)];
}

bool SessionPlan::block_begins() const {
  if (tasks_) return tasks_->block_begins();
  return next_ == 0 || trials_[next_].block != trials_[next_ - 1].block;
}

protocols::TrialOutcome outcome_of(const data::TrialRecord& record) {
  if (!record.task) return {record.correct, record.correct, !record.timed_out};
  return {record.correct, record.task->success, !record.timed_out, record.task->level};
}

void SessionPlan::answered(const protocols::TrialOutcome& outcome) {
  after_practice_ = next().practice;
  go_on(outcome);
  done_in_block_ = finished() || block_begins() ? 0 : done_in_block_ + 1;
}

void SessionPlan::go_on(const protocols::TrialOutcome& outcome) {
  if (tasks_) return tasks_->answered(outcome);
  const protocols::Trial& trial = trials_[next_++];
  if (!trial.practice || trial.block < first_practice_block_) return;
  ++shown_;
  correct_ += outcome.correct ? 1 : 0;
  if (finished() || trials_[next_].block != trial.block) judge_practice();
}

void SessionPlan::judge_practice() {
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

}  // namespace palpate::runner::session
