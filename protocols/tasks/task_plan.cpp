#include "protocols/tasks/task_plan.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "protocols/latin_square.h"
#include "protocols/tasks/block_tracks.h"
#include "protocols/tasks/fixed_trials.h"
#include "stimuli/orientation.h"

namespace palpate::protocols {
namespace {

constexpr std::size_t kCatchWindow = 20;    // trials
constexpr long long kLeastUnanswered = 10;  // trials

Quat drawn_orientation(const Protocol& protocol, stimuli::Random random) {
  switch (protocol.orientation) {
    case OrientationKind::uniform:
      return stimuli::uniform_rotation(random);
    case OrientationKind::listed:
      return protocol.orientations[random.below(protocol.orientations.size())];
    case OrientationKind::fixed:
      break;
  }
  return Quat(1, 0, 0, 0);
}

/// Of the main trials of a block, which are drawn over all blocks of a participant.
void draw_orientations_of_version_1(const Protocol& protocol, int participant, int index,
                                    std::vector<Trial>& trials) {
  std::vector<std::vector<Trial>> others;
  std::vector<Trial*> all;
  for (int session = 1; session <= protocol.sessions.count; ++session) {
    for (const int other : blocks_in_order(protocol, participant, session)) {
      const TaskBlock& block = protocol.blocks[static_cast<std::size_t>(other)];
      if (block.practice || !has_order_of_version_1(block)) continue;
      if (other != index) others.push_back(trials_of_version_1(protocol, participant, other));
      for (Trial& trial : other == index ? trials : others.back()) all.push_back(&trial);
    }
  }
  draw_orientations(version_1_view(protocol, nullptr), participant, all);
}

/// Whether trial `shown` (from 0) of an adaptive block is a catch trial.
bool is_catch_trial(const Protocol& protocol, int participant, std::uint64_t block,
                    std::size_t shown) {
  const double share = protocol.blocks[static_cast<std::size_t>(block)].catch_trials;
  if (!(share > 0)) return false;
  const auto window = std::max(kCatchWindow, static_cast<std::size_t>(std::lround(1 / share)));
  const auto count = std::max(
      std::size_t{1}, static_cast<std::size_t>(std::lround(share * static_cast<double>(window))));
  std::vector<int> marks(window, 0);
  std::fill(marks.begin(), marks.begin() + static_cast<std::ptrdiff_t>(count), 1);
  stimuli::Random random =
      task_stream(protocol.seed, participant, block, kTaskCatch, shown / window);
  random.shuffle(marks);
  return marks[shown % window] == 1;
}

}  // namespace

bool is_adaptive(const TaskBlock& block) {
  return std::any_of(block.procedures.begin(), block.procedures.end(), [](const auto& spec) {
    return !std::holds_alternative<ConstantStimuli>(spec);
  });
}

long long most_trials_of(const TaskBlock& block) {
  if (block.criterion) return block.criterion->most_trials;
  if (block.task == TaskKind::external) return block.repetitions;
  long long trials = 0;
  for (const BlockTrack& track : tracks_of(block)) {
    trials += track.procedure == nullptr ? block.repetitions
                                         : static_cast<long long>(most_trials(*track.procedure));
  }
  return with_catch_trials(block, trials);
}

std::size_t most_unanswered(const TaskBlock& block) {
  return static_cast<std::size_t>(std::max(kLeastUnanswered, most_trials_of(block) / 4));
}

void check_order(const Protocol& protocol, int block) {
  const TaskBlock& checked = protocol.blocks[static_cast<std::size_t>(block)];
  if (has_order_of_version_1(checked)) {
    trials_of_version_1(protocol, 1, block);
  } else if (!is_adaptive(checked)) {
    fixed_trials(protocol, 1, block);
  }
}

bool is_external(const Protocol& protocol) {
  return std::ranges::any_of(
      protocol.blocks, [](const TaskBlock& block) { return block.task == TaskKind::external; });
}

std::vector<int> blocks_in_order(const Protocol& protocol, int participant_number, int session) {
  std::vector<std::vector<int>> units(1);  // each a block with the practice before it
  for (int i = 0; i < static_cast<int>(protocol.blocks.size()); ++i) {
    const TaskBlock& block = protocol.blocks[static_cast<std::size_t>(i)];
    if (block.session != session) continue;
    units.back().push_back(i);
    if (!block.practice) units.emplace_back();
  }
  const std::vector<int> last = std::move(units.back());  // practice after the last block
  units.pop_back();
  std::vector<int> order;
  const int count = static_cast<int>(units.size());
  const std::vector<int> row = protocol.blocks_counterbalanced && count > 1
                                   ? latin_square_row(count, participant_number)
                                   : std::vector<int>();
  for (int i = 0; i < count; ++i) {
    const int at = row.empty() ? i : row[static_cast<std::size_t>(i)];
    const auto& unit = units[static_cast<std::size_t>(at)];
    order.insert(order.end(), unit.begin(), unit.end());
  }
  order.insert(order.end(), last.begin(), last.end());
  return order;
}

TaskPlan::TaskPlan(const Protocol& protocol, int participant_number, int session)
    : protocol_(&protocol),
      participant_number_(participant_number),
      session_(session),
      order_(blocks_in_order(protocol, participant_number, session)) {
  first_block_ += static_cast<int>(
      std::count_if(protocol.blocks.begin(), protocol.blocks.end(),
                    [session](const TaskBlock& block) { return block.session < session; }));
  if (!order_.empty()) begin_block();
  find_next();
}

const TaskBlock& TaskPlan::block() const { return protocol_->blocks[block_index()]; }

void TaskPlan::begin_block() {
  shown_ = unanswered_ = 0;
  rounds_ = 0;
  right_.clear();
  fixed_.clear();
  tracks_.reset();
  if (!is_adaptive(block())) return add_round();
  std::vector<ProcedureSpec> specs;
  for (const BlockTrack& track : tracks_of(block())) specs.push_back(*track.procedure);
  tracks_.emplace(
      specs, task_stream(protocol_->seed, participant_number_, block_index(), kTaskTracks).next());
}

void TaskPlan::add_round() {
  const std::uint64_t round = rounds_++;
  std::vector<Trial> more;
  if (has_order_of_version_1(block())) {
    more =
        trials_of_version_1(*protocol_, participant_number_, order_[at_], static_cast<int>(round));
    if (!block().practice)
      draw_orientations_of_version_1(*protocol_, participant_number_, order_[at_], more);
  } else {
    more = fixed_trials(*protocol_, participant_number_, order_[at_], round);
  }
  fixed_.insert(fixed_.end(), more.begin(), more.end());
}

bool TaskPlan::block_goes_on() {
  if (tracks_) return tracks_->next().has_value() && unanswered_ < most_unanswered(block());
  const auto& criterion = block().criterion;
  if (!criterion) return shown_ < fixed_.size();
  if (shown_ >= static_cast<std::size_t>(criterion->most_trials) || criterion_met()) return false;
  if (shown_ == fixed_.size()) add_round();
  return true;
}

bool TaskPlan::criterion_met() const {
  const PracticeCriterion& criterion = *block().criterion;
  const auto of = static_cast<std::size_t>(criterion.of);
  if (right_.size() < of) return false;
  return std::count(right_.end() - static_cast<std::ptrdiff_t>(of), right_.end(), true) >=
         criterion.correct;
}

Trial TaskPlan::adaptive_trial() const {
  const TrackLevel wanted = *tracks_->next();
  const BlockTrack track = tracks_of(block())[wanted.track];
  Trial trial;
  trial.stimulus = track.stimulus;
  trial.renderer = track.renderer;
  trial.track = static_cast<int>(wanted.track) + 1;
  trial.level = wanted.level;
  trial.catch_trial = is_catch_trial(*protocol_, participant_number_, block_index(), shown_);
  stimuli::Random random =
      task_stream(protocol_->seed, participant_number_, block_index(), kTaskPosition, shown_ + 1);
  set_intervals(block(),
                static_cast<int>(random.below(static_cast<std::uint64_t>(block().intervals))),
                trial);
  return trial;
}

void TaskPlan::find_next() {
  next_.reset();
  while (at_ < order_.size()) {
    if (block_goes_on()) break;
    if (++at_ < order_.size()) begin_block();
  }
  if (at_ >= order_.size()) return;
  Trial trial = tracks_ ? adaptive_trial() : fixed_[shown_];
  trial.session = session_;
  trial.block = first_block_ + static_cast<int>(at_);
  trial.trial = static_cast<int>(done_) + 1;
  trial.practice = block().practice;
  trial.task_block = order_[at_];
  if (!has_order_of_version_1(block())) {
    trial.orientation =
        drawn_orientation(*protocol_, task_stream(protocol_->seed, participant_number_,
                                                  block_index(), kTaskOrientation, shown_ + 1));
  }
  next_ = std::move(trial);
}

void TaskPlan::propose(double level) {
  next_->level = level;
  for (Interval& interval : next_->intervals) {
    if (!interval.standard) interval.level = level;
  }
}

void TaskPlan::choose(const TrialChoice& choice) {
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
}

void TaskPlan::answered(const TrialOutcome& outcome) {
  if (tracks_ && !outcome.answered) ++unanswered_;
  if (tracks_ && outcome.answered && !next_->catch_trial)
    tracks_->record({outcome.level.value_or(*next_->level), outcome.success});
  right_.push_back(outcome.answered && outcome.correct);
  ++shown_;
  ++done_;
  find_next();
}

std::size_t TaskPlan::size() const {
  if (finished()) return done_;
  long long left = 0;
  for (std::size_t i = at_; i < order_.size(); ++i)
    left += most_trials_of(protocol_->blocks[static_cast<std::size_t>(order_[i])]);
  left -= static_cast<long long>(shown_ - unanswered_);
  return done_ + static_cast<std::size_t>(std::max(1LL, left));
}

}  // namespace palpate::protocols
