#include "protocols/session_plan.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "protocols/factors.h"
#include "protocols/groups.h"
#include "protocols/procedures/recovery.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/block_tracks.h"
#include "protocols/tasks/block_trials.h"

namespace palpate::protocols {
namespace {

/// The session's trials of the study of shapes, by their blocks.
std::vector<std::vector<Trial>> shapes_of_session(const Protocol& protocol, int participant_number,
                                                  int session) {
  std::vector<std::vector<Trial>> out;
  int block = 0;
  for (Trial& trial : schedule(protocol, participant_number)) {
    if (trial.session != session) continue;
    if (trial.block != block) out.emplace_back();
    block = trial.block;
    out.back().push_back(std::move(trial));
  }
  return out;
}

}  // namespace

std::vector<SessionPlan::Sequence> SessionPlan::sequences_of(const Protocol& protocol,
                                                             int participant_number, int session) {
  std::vector<Sequence> out;
  if (const std::optional<int> shapes = study_of_shapes(protocol)) {
    for (std::vector<Trial>& trials : shapes_of_session(protocol, participant_number, session))
      out.push_back({*shapes, std::move(trials)});
    return out;
  }
  for (const int block : blocks_in_order(protocol, participant_number, session))
    out.push_back({block});
  return out;
}

SessionPlan::SessionPlan(const Protocol& protocol, int participant_number, int session)
    : protocol_(&protocol_of(protocol, participant_number)),
      participant_number_(participant_number),
      session_(session),
      sequences_(sequences_of(*protocol_, participant_number, session)) {
  if (!sequences_.empty() && !sequence().trials.empty()) {
    first_block_ = sequence().trials.front().block;
  } else {
    first_block_ += static_cast<int>(std::ranges::count_if(
        protocol_->blocks, [session](const TaskBlock& block) { return block.session < session; }));
  }
  if (!sequences_.empty()) begin_sequence();
  find_next();
}

const TaskBlock& SessionPlan::block() const { return protocol_->blocks[block_index()]; }

void SessionPlan::begin_sequence() {
  shown_ = unanswered_ = 0;
  ended_ = false;
  rounds_ = 0;
  right_.clear();
  fixed_.clear();
  tracks_.reset();
  criterion_ = block().criterion;
  if (!sequence().trials.empty()) return begin_shapes();
  if (!is_adaptive(block())) return add_round();
  std::vector<ProcedureSpec> specs;
  for (const BlockTrack& track : tracks_of(block())) specs.push_back(*track.procedure);
  tracks_.emplace(
      specs,
      task_stream(protocol_->seed, participant_number_, stream_of(block()), kTaskTracks).next());
}

void SessionPlan::begin_shapes() {
  fixed_ = sequence().trials;
  rounds_ = 1;
  const bool warm_up = session_ > 1 && protocol_->sessions.warm_up_trials > 0 && at_ == 0;
  const Protocol::Practice& practice = protocol_->practice;
  if (!fixed_.front().practice || warm_up || !practice.criterion) return;
  const auto trials = static_cast<int>(fixed_.size());
  criterion_ = {static_cast<int>(std::ceil(*practice.criterion * trials)), trials,
                practice.max_rounds * trials, true};
}

void SessionPlan::add_round() {
  const auto round = static_cast<int>(rounds_++);  // from 0
  const std::vector<Trial> more =
      sequence().trials.empty()
          ? trials_of_block(*protocol_, participant_number_, sequence().block,
                            static_cast<std::uint64_t>(round))
          : practice_round(*protocol_, participant_number_, fixed_.back().renderer, round + 1);
  fixed_.insert(fixed_.end(), more.begin(), more.end());
}

bool SessionPlan::sequence_continues() {
  if (tracks_)
    return !ended_ && tracks_->next().has_value() && unanswered_ < most_unanswered(block());
  const bool round_ends = shown_ == fixed_.size();
  if (!criterion_ || (criterion_->by_round && !round_ends)) return !round_ends;
  if (shown_ >= static_cast<std::size_t>(criterion_->most_trials) || criterion_met()) return false;
  if (round_ends) add_round();
  return true;
}

bool SessionPlan::criterion_met() const {
  const auto of = static_cast<std::size_t>(criterion_->of);
  if (right_.size() < of) return false;
  return std::count(right_.end() - static_cast<std::ptrdiff_t>(of), right_.end(), true) >=
         criterion_->correct;
}

int SessionPlan::stimulus_of_shared(std::size_t track) const {
  const std::size_t cells = cells_of(block()), answered = tracks_->tracks()[track].history().size();
  return cells_in_round(block(), protocol_->seed, participant_number_, track,
                        answered / cells)[answered % cells];
}

Trial SessionPlan::adaptive_trial() const {
  const TrackLevel wanted = *tracks_->next();
  const BlockTrack track = tracks_of(block())[wanted.track];
  Trial trial;
  trial.stimulus = block().cells_share_tracks ? stimulus_of_shared(wanted.track) : track.stimulus;
  trial.renderer = track.renderer;
  trial.track = first_track(block()) + static_cast<int>(wanted.track);
  if (wanted.point.empty()) trial.level = wanted.level;
  trial.point = wanted.point;
  const DrawnTrial drawn = drawn_trial(*protocol_, participant_number_, sequence().block, shown_);
  trial.catch_trial = drawn.catch_trial;
  set_intervals(block(), drawn.position, trial);
  return trial;
}

void SessionPlan::find_next() {
  next_.reset();
  while (at_ < sequences_.size()) {
    if (sequence_continues()) break;
    if (++at_ < sequences_.size()) begin_sequence();
  }
  if (at_ >= sequences_.size()) return;
  Trial trial = tracks_ ? adaptive_trial() : fixed_[shown_];
  trial.session = session_;
  trial.block = first_block_ + static_cast<int>(at_);
  trial.trial = static_cast<int>(done_) + 1;
  trial.practice |= block().practice;
  trial.task_block = sequence().block;
  if (!has_order_of_shapes(block()))
    trial.orientation =
        orientation_in_block(*protocol_, participant_number_, block_index(), shown_);
  next_ = std::move(trial);
}

void SessionPlan::propose(double level) {
  next_->level = level;
  for (Interval& interval : next_->intervals) {
    if (!interval.standard) interval.level = level;
  }
}

void SessionPlan::propose(const LevelPoint& point) {
  next_->point = point;
  for (Interval& interval : next_->intervals) {
    if (!interval.point.empty()) interval.point = point;
  }
}

void SessionPlan::end_block() {
  ended_ = true;
  find_next();
}

void SessionPlan::choose(const TrialChoice& choice) {
  next_->stimulus = choice.stimulus;
  next_->renderer = choice.renderer;
  next_->level = choice.level;
  if (choice.orientation) next_->orientation = *choice.orientation;
  const std::vector<BlockTrack> tracks = tracks_of(block());
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (tracks[i].stimulus == choice.stimulus && tracks[i].renderer == choice.renderer)
      next_->track = static_cast<int>(i) + 1;
  }
  set_intervals(block(), 0, *next_);
  if (!choice.intervals.empty()) next_->intervals = choice.intervals;
}

void SessionPlan::continue_in(int block) {
  while (next_ && next_->block < block && tracks_) end_block();
}

void SessionPlan::answered(const TrialOutcome& outcome) {
  continue_in(outcome.block);
  after_practice_ = next_->practice;
  if (tracks_ && !outcome.answered) ++unanswered_;
  if (tracks_ && outcome.answered && !next_->catch_trial)
    tracks_->record({outcome.level.value_or(next_->level.value_or(0)), outcome.success,
                     outcome.point.empty() ? next_->point : outcome.point});
  right_.push_back(outcome.answered && outcome.correct);
  ++shown_;
  ++done_;
  find_next();
}

long long SessionPlan::most_in_sequence() const {
  return sequence().trials.empty() ? most_trials_of(block())
                                   : static_cast<long long>(fixed_.size());
}

long long SessionPlan::trials_after(long long (*trials_of)(const TaskBlock&)) const {
  long long trials = 0;
  for (std::size_t i = at_ + 1; i < sequences_.size(); ++i) {
    const Sequence& later = sequences_[i];
    trials += later.trials.empty()
                  ? trials_of(protocol_->blocks[static_cast<std::size_t>(later.block)])
                  : static_cast<long long>(later.trials.size());
  }
  return trials;
}

std::size_t SessionPlan::expected_size() const {
  if (finished()) return done_;
  long long left = 0;
  if (tracks_) {
    double trials = 0;
    const std::vector<BlockTrack> all = tracks_of(block());
    for (std::size_t i = 0; i < all.size(); ++i)
      trials += expected_trials(*all[i].procedure, tracks_->tracks()[i]);
    left = with_catch_trials(block(), std::llround(trials));
  } else {
    left = most_in_sequence() - static_cast<long long>(shown_);
  }
  left += trials_after(expected_trials_of);
  return done_ + static_cast<std::size_t>(std::max(1LL, left));
}

std::size_t SessionPlan::size() const {
  if (finished()) return done_;
  long long left = most_in_sequence() - static_cast<long long>(shown_ - unanswered_);
  left += trials_after(most_trials_of);
  return done_ + static_cast<std::size_t>(std::max(1LL, left));
}

}  // namespace palpate::protocols
