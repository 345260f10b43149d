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

/// \param trials  of a round of practice
std::optional<PracticeCriterion> practice_criterion(const Protocol& protocol, int trials) {
  const Protocol::Practice& practice = protocol.practice;
  if (!practice.criterion) return std::nullopt;
  return PracticeCriterion{static_cast<int>(std::ceil(*practice.criterion * trials)), trials,
                           practice.max_rounds * trials, true};
}

class OrderOfShapes final : public OrderRule {
 public:
  SessionSequences sequences(const Protocol& protocol, int participant_number,
                             int session) const override {
    SessionSequences out;
    for (std::vector<Trial>& trials : shapes_of_session(protocol, participant_number, session)) {
      TrialSequence one;
      one.expected_trials = [size = static_cast<long long>(trials.size())] { return size; };
      const bool warm_up = session > 1 && protocol.sessions.warm_up_trials > 0 && out.all.empty();
      if (trials.front().practice && !warm_up)
        one.criterion = practice_criterion(protocol, static_cast<int>(trials.size()));
      if (out.all.empty()) out.first_block = trials.front().block;
      one.round = [&protocol, participant_number, first = std::move(trials)](std::uint64_t round) {
        if (round == 0) return first;
        return practice_round(protocol, participant_number, first.front().renderer,
                              static_cast<int>(round) + 1);
      };
      out.all.push_back(std::move(one));
    }
    return out;
  }
  const char* conditions_in_words() const override { return "renderers"; }
  std::vector<std::string> conditions(const Protocol& protocol,
                                      int participant_number) const override {
    std::vector<std::string> names;
    for (const Trial& trial : schedule(protocol, participant_number))
      names.emplace_back(to_string(trial.renderer));
    return names;
  }
  std::string condition_of(const std::string& renderer, const std::string&) const override {
    return renderer;
  }
};

class OrderOfBlocks final : public OrderRule {
 public:
  SessionSequences sequences(const Protocol& protocol, int participant_number,
                             int session) const override {
    const auto is_before = [session](const TaskBlock& block) { return block.session < session; };
    SessionSequences out{1 + static_cast<int>(std::ranges::count_if(protocol.blocks, is_before))};
    for (const int index : blocks_in_order(protocol, participant_number, session)) {
      const TaskBlock& block = protocol.blocks[static_cast<std::size_t>(index)];
      const auto round = [&protocol, participant_number, index](std::uint64_t number) {
        return trials_of_block(protocol, participant_number, index, number);
      };
      const auto expected = [&block] { return expected_trials_of(block); };
      out.all.push_back({index, round, block.criterion, expected, most_trials_of(block)});
    }
    return out;
  }
  const char* conditions_in_words() const override { return "blocks"; }
  std::vector<std::string> conditions(const Protocol& protocol,
                                      int participant_number) const override {
    std::vector<std::string> names;
    for (int session = 1; session <= protocol.sessions.count; ++session) {
      for (const int index : blocks_in_order(protocol, participant_number, session)) {
        const TaskBlock& block = protocol.blocks[static_cast<std::size_t>(index)];
        if (!block.practice) names.push_back(block.name);
      }
    }
    return names;
  }
  std::string condition_of(const std::string&, const std::string& block) const override {
    return block;
  }
};

}  // namespace

const OrderRule& order_of_shapes() {
  static const OrderOfShapes rule;
  return rule;
}

const OrderRule& order_of_blocks() {
  static const OrderOfBlocks rule;
  return rule;
}

std::vector<const TaskBlock*> listed_blocks(const Protocol& protocol) {
  std::vector<const TaskBlock*> out;
  for (const TaskBlock& block : protocol.blocks) {
    if (!block.name.empty()) out.push_back(&block);
  }
  return out;
}

std::vector<TrialCounts> trial_counts(const Protocol& protocol) {
  std::vector<TrialCounts> out(protocol.blocks.size());
  for (int session = 1; session <= protocol.sessions.count; ++session) {
    for (const TrialSequence& one : protocol.order_rule->sequences(protocol, 1, session).all) {
      TrialCounts& counts = out[static_cast<std::size_t>(one.block)];
      const long long expected = one.expected_trials();
      counts.expected += expected;
      counts.most += one.most_trials.value_or(expected);
    }
  }
  return out;
}

SessionPlan::SessionPlan(const Protocol& protocol, int participant_number, int session)
    : protocol_(&protocol_of(protocol, participant_number)),
      participant_number_(participant_number),
      session_(session),
      sequences_(protocol_->order_rule->sequences(*protocol_, participant_number, session)) {
  if (!sequences_.all.empty()) begin_sequence();
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
  criterion_ = sequence().criterion;
  if (!is_adaptive(block())) return add_round();
  std::vector<ProcedureSpec> specs;
  for (const BlockTrack& track : tracks_of(block())) specs.push_back(*track.procedure);
  tracks_.emplace(
      specs,
      task_stream(protocol_->seed, participant_number_, stream_of(block()), kTaskTracks).next());
}

void SessionPlan::add_round() {
  const std::vector<Trial> more = sequence().round(rounds_++);
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
  trial.orientation = drawn.orientation;
  set_intervals(block(), drawn.position, trial);
  return trial;
}

void SessionPlan::find_next() {
  next_.reset();
  while (at_ < sequences_.all.size()) {
    if (sequence_continues()) break;
    if (++at_ < sequences_.all.size()) begin_sequence();
  }
  if (at_ >= sequences_.all.size()) return;
  Trial trial = tracks_ ? adaptive_trial() : fixed_[shown_];
  trial.session = session_;
  trial.block = sequences_.first_block + static_cast<int>(at_);
  trial.trial = static_cast<int>(done_) + 1;
  trial.practice |= block().practice;
  trial.task_block = sequence().block;
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
  return sequence().most_trials.value_or(static_cast<long long>(fixed_.size()));
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
  for (std::size_t i = at_ + 1; i < sequences_.all.size(); ++i)
    left += sequences_.all[i].expected_trials();
  return done_ + static_cast<std::size_t>(std::max(1LL, left));
}

std::size_t SessionPlan::size() const {
  if (finished()) return done_;
  long long left = most_in_sequence() - static_cast<long long>(shown_ - unanswered_);
  for (std::size_t i = at_ + 1; i < sequences_.all.size(); ++i) {
    const TrialSequence& later = sequences_.all[i];
    left += later.most_trials ? *later.most_trials : later.expected_trials();
  }
  return done_ + static_cast<std::size_t>(std::max(1LL, left));
}

}  // namespace palpate::protocols
