#include "protocols/tasks/task_plan.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "data/base/random.h"
#include "protocols/order.h"
#include "protocols/procedures/procedure_spec.h"
#include "protocols/schedule.h"
#include "protocols/tasks/levels.h"
#include "protocols/tasks/parse_blocks.h"
#include "stimuli/orientation.h"

namespace palpate::protocols {

// The trials of a block whose levels do not follow from the answers.

/// In a random order under the limits of the block.
/// \param index  of the block
/// \param round  of practice with a criterion, from 0
/// \throws ScheduleError
std::vector<Trial> fixed_trials(const Protocol& protocol, int participant, int index,
                                std::uint64_t round = 0);

/// Whether the block is identification as in version 1 and so has its order: the same design in two
/// protocols gives the same trials. Limits on the order of several renderers differ from version 1.
bool has_order_of_version_1(const TaskBlock& block);
/// The protocol of version 1 that determines an order.
/// \param block  null: all stimuli
Protocol version_1_view(const Protocol& protocol, const TaskBlock* block);
/// Practice trials have their orientations; main trials get theirs from version_1_view of all
/// blocks.
std::vector<Trial> trials_of_version_1(const Protocol& protocol, int participant, int index,
                                       int round = 0);

// The elements of a block's trials: its tracks, their intervals, and random streams.

// Numbers of random streams, part of the meaning of a seed: never renumber them. schedule.cpp uses
// 1 to 4.
enum TaskUse : std::uint64_t {
  kTaskOrder = 1,
  kTaskPosition = 2,
  kTaskOrientation = 3,
  kTaskCatch = 4,
  kTaskTracks = 5
};
/// \param seed  of the protocol
/// \param block  its index
Random task_stream(std::uint64_t seed, int participant, std::uint64_t block, TaskUse use,
                   std::uint64_t number = 0);

/// The stimulus, renderer and procedure of a track.
struct BlockTrack {
  int stimulus = 0;
  RendererKind renderer = RendererKind::point;
  const ProcedureSpec* procedure = nullptr;  ///< of the block; nullptr: none
};

/// The tracks in order of their numbers, from 1: the procedure varies fastest.
std::vector<BlockTrack> tracks_of(const TaskBlock& block);
/// The number of trials with catch trials included.
long long with_catch_trials(const TaskBlock& block, long long trials);
/// Sets the intervals of a trial whose stimulus, renderer and level are set.
/// \param position  of the comparison, from 0
void set_intervals(const TaskBlock& block, int position, Trial& trial);

namespace {

/// Trials that are alike: a track at a level, or the catch trials.
struct Category {
  std::string name;
  Trial trial;
  int count = 0;
};

void add_levels(const TaskBlock& block, const BlockTrack& track, Category category,
                std::vector<Category>& categories) {
  if (track.procedure == nullptr) {
    category.count = block.repetitions;
    categories.push_back(category);
    return;
  }
  const auto& constant = std::get<ConstantStimuli>(*track.procedure);
  for (const double level : constant.levels) {
    Category one = category;
    one.name += " at " + level_text(level);
    one.trial.level = level;
    one.count = constant.repetitions;
    categories.push_back(std::move(one));
  }
}

std::vector<Category> categories_of(const Protocol& protocol, const TaskBlock& block) {
  std::vector<Category> categories;
  int number = 0;
  long long trials = 0;
  for (const BlockTrack& track : tracks_of(block)) {
    Category category;
    category.name = protocol.stimuli[static_cast<std::size_t>(track.stimulus)].name + " (" +
                    to_string(track.renderer) + ")";
    category.trial.stimulus = track.stimulus;
    category.trial.renderer = track.renderer;
    category.trial.track = ++number;
    add_levels(block, track, category, categories);
  }
  for (const Category& category : categories) trials += category.count;
  const auto catch_trials = static_cast<int>(with_catch_trials(block, trials) - trials);
  if (catch_trials == 0) return categories;
  // Catch trials are spread as evenly as possible over the tracks.
  const int tracks = number;
  for (int t = 0; t < tracks; ++t) {
    const BlockTrack track = tracks_of(block)[static_cast<std::size_t>(t)];
    Category category;
    category.name = "catch trial";
    category.trial.stimulus = track.stimulus;
    category.trial.renderer = track.renderer;
    category.trial.track = t + 1;
    category.trial.catch_trial = true;
    category.count = catch_trials / tracks + (t < catch_trials % tracks ? 1 : 0);
    if (category.count > 0) categories.push_back(std::move(category));
  }
  return categories;
}

std::vector<int> ordered_categories(const std::vector<Category>& categories, const TaskBlock& block,
                                    Random random) {
  Protocol::Order order;
  order.max_run = block.max_run;
  order.min_distance = block.min_distance;
  std::vector<int> counts;
  std::vector<std::string> names;
  counts.reserve(categories.size());
  names.reserve(categories.size());
  for (const Category& category : categories) {
    counts.push_back(category.count);
    names.push_back(category.name);
  }
  return order_block(counts, order, names, random);
}

/// The comparison's interval in each of `count` trials: each equally often, in random order.
std::vector<int> positions(int count, int intervals, Random& random) {
  std::vector<int> all, places;
  for (int i = 0; i < intervals; ++i) places.push_back(i);
  while (static_cast<int>(all.size()) < count) {
    random.shuffle(places);
    all.insert(all.end(), places.begin(), places.end());
  }
  all.resize(static_cast<std::size_t>(count));
  random.shuffle(all);
  return all;
}

}  // namespace

std::vector<Trial> fixed_trials(const Protocol& protocol, int participant, int index,
                                std::uint64_t round) {
  const TaskBlock& block = protocol.blocks[static_cast<std::size_t>(index)];
  if (block.task == TaskKind::external) {  // placeholders until the program chooses
    Trial trial;
    trial.stimulus = block.stimuli.front();
    trial.renderer = block.renderers.front();
    trial.track = 1;
    set_intervals(block, 0, trial);
    return std::vector<Trial>(static_cast<std::size_t>(block.repetitions), trial);
  }
  const auto number = static_cast<std::uint64_t>(index);
  std::vector<Category> categories = categories_of(protocol, block);
  Random places = task_stream(protocol.seed, participant, number, kTaskPosition, round);
  std::vector<std::vector<int>> left;
  left.reserve(categories.size());
  for (const Category& category : categories)
    left.push_back(positions(category.count, block.intervals, places));
  std::vector<std::size_t> shown(categories.size(), static_cast<std::size_t>(participant - 1));
  std::vector<Trial> trials;
  for (const int which : ordered_categories(
           categories, block, task_stream(protocol.seed, participant, number, kTaskOrder, round))) {
    const auto c = static_cast<std::size_t>(which);
    Trial trial = categories[c].trial;
    // Take the starts in turn; the next participant begins with the next start.
    if (block.task == TaskKind::adjust)
      trial.level = block.starts[shown[c]++ % block.starts.size()];
    set_intervals(block, left[c].back(), trial);
    left[c].pop_back();
    trials.push_back(std::move(trial));
  }
  return trials;
}

bool has_order_of_version_1(const TaskBlock& block) {
  return block.task == TaskKind::identify && block.procedures.empty() &&
         (block.renderers.size() == 1 || (!block.max_run && !block.min_distance));
}

Protocol version_1_view(const Protocol& protocol, const TaskBlock* block) {
  Protocol view;
  view.seed = protocol.seed;
  view.renderers = protocol.renderers;
  view.orientation = protocol.orientation;
  view.orientations = protocol.orientations;
  const auto add = [&](const StimulusSpec& stimulus) {
    view.stimuli.push_back({stimulus.name, {}});
  };
  if (block == nullptr) {
    for (const StimulusSpec& stimulus : protocol.stimuli) add(stimulus);
    return view;
  }
  for (const int stimulus : block->stimuli)
    add(protocol.stimuli[static_cast<std::size_t>(stimulus)]);
  view.renderers = block->renderers;
  view.renderer_order =
      block->renderers.size() > 1 ? RendererOrder::interleaved : RendererOrder::fixed;
  view.order.max_run = block->max_run;
  view.order.min_distance = block->min_distance;
  view.practice.repetitions = block->repetitions;
  return view;
}

std::vector<Trial> trials_of_version_1(const Protocol& protocol, int participant, int index,
                                       int round) {
  const TaskBlock& block = protocol.blocks[static_cast<std::size_t>(index)];
  const Protocol view = version_1_view(protocol, &block);
  const auto before = std::count_if(
      protocol.blocks.begin(), protocol.blocks.begin() + index, [&](const TaskBlock& other) {
        return has_order_of_version_1(other) && other.practice == block.practice &&
               other.renderers == block.renderers;
      });
  const int number = static_cast<int>(before);
  std::vector<Trial> trials =
      block.practice
          ? practice_round(view, participant, block.renderers.front(), number + 1 + round)
          : block_of_trials(view, participant, block.renderers, number, block.repetitions);
  const std::vector<BlockTrack> tracks = tracks_of(block);
  for (Trial& trial : trials) {
    trial.stimulus = block.stimuli[static_cast<std::size_t>(trial.stimulus)];
    const auto is_its = [&](const BlockTrack& track) {
      return track.stimulus == trial.stimulus && track.renderer == trial.renderer;
    };
    const auto track = std::find_if(tracks.begin(), tracks.end(), is_its);
    trial.track = static_cast<int>(track - tracks.begin()) + 1;
    set_intervals(block, 0, trial);
  }
  return trials;
}

namespace {

constexpr std::uint64_t kTaskStream = 5;

}  // namespace

Random task_stream(std::uint64_t seed, int participant, std::uint64_t block, TaskUse use,
                   std::uint64_t number) {
  return Random(seed, {static_cast<std::uint64_t>(participant), kTaskStream, block, use, number});
}

std::vector<BlockTrack> tracks_of(const TaskBlock& block) {
  std::vector<BlockTrack> tracks;
  for (const int stimulus : block.stimuli) {
    for (const RendererKind renderer : block.renderers) {
      if (block.procedures.empty()) tracks.push_back({stimulus, renderer, nullptr});
      for (const ProcedureSpec& procedure : block.procedures)
        tracks.push_back({stimulus, renderer, &procedure});
    }
  }
  return tracks;
}

long long with_catch_trials(const TaskBlock& block, long long trials) {
  return trials +
         std::llround(static_cast<double>(trials) * block.catch_trials / (1 - block.catch_trials));
}

void set_intervals(const TaskBlock& block, int position, Trial& trial) {
  const Interval asked{trial.stimulus, trial.renderer, trial.level};
  const Interval standard{block.standard.value_or(-1),
                          block.standard_renderer.value_or(trial.renderer), std::nullopt, true};
  switch (block.task) {
    case TaskKind::identify:
    case TaskKind::external:
      trial.intervals = {asked};
      break;
    case TaskKind::compare:
      trial.intervals.assign(static_cast<std::size_t>(block.intervals), standard);
      if (!trial.catch_trial) trial.intervals[static_cast<std::size_t>(position)] = asked;
      break;
    case TaskKind::detect:
      trial.intervals = {asked};
      if (trial.catch_trial) trial.intervals[0] = {block.absent.value_or(-1), trial.renderer};
      break;
    case TaskKind::rate:
      trial.intervals = {asked};
      if (block.standard) trial.intervals.insert(trial.intervals.begin(), standard);
      break;
    case TaskKind::adjust:
      trial.intervals = {asked, standard};  // alternating as often as the participant likes
      break;
  }
  if (trial.catch_trial) trial.level.reset();
}

namespace {

using nlohmann::json;

constexpr std::size_t kMaxTracks = 16;

}  // namespace

void read_procedures(ObjectReader& block, std::vector<ProcedureSpec>& procedures) {
  const json* const value = block.member("procedure");
  if (value == nullptr) return;
  const std::string pointer = block.pointer("procedure");
  const auto read_one = [&](const json& one, const std::string& where) {
    ObjectReader procedure(one, where, block.faults());
    if (auto spec = read_procedure(procedure)) procedures.push_back(std::move(*spec));
  };
  if (!value->is_array()) return read_one(*value, pointer);
  if (block.array("procedure", 1, kMaxTracks) == nullptr) return;
  for (std::size_t i = 0; i < value->size(); ++i) read_one((*value)[i], child_pointer(pointer, i));
}

const ProcedureSpec& BlockProcedures::spec_of(int track) const {
  return specs[static_cast<std::size_t>(track - 1) % specs.size()];
}

Procedure BlockProcedures::begin(int participant_number, int track) const {
  const std::uint64_t seed =
      task_stream(protocol_seed, participant_number, index, kTaskTracks).next();
  return {spec_of(track), track_seed(seed, static_cast<std::size_t>(track - 1))};
}

std::map<std::string, BlockProcedures> procedures_of_blocks(const std::string& text,
                                                            const std::string& file_name) {
  FaultList faults(file_name);
  const nlohmann::json root = read_json(text, faults);
  std::map<std::string, BlockProcedures> all;
  if (!root.is_object() || !root.contains("blocks") || !root["blocks"].is_array()) return all;
  std::uint64_t seed = 0;
  ObjectReader(root, "", faults).seed("seed", seed);
  for (const nlohmann::json& one : root["blocks"]) {
    ObjectReader block(one, "/blocks/" + std::to_string(all.size()), faults);
    std::string name;
    block.name("name", name);
    BlockProcedures procedures{seed, all.size(), {}};
    read_procedures(block, procedures.specs);
    block.choice("asks", procedures.asks_smaller, {{"larger", false}, {"smaller", true}});
    const nlohmann::json::json_pointer path("/level/path");
    if (one.is_object() && one.contains(path) && one[path].is_string())
      procedures.level_unit = unit_of_level(one[path].get<std::string>());
    if (one.is_object() && one.contains("task") && one["task"] == "rate")
      procedures.rating_steps = read_scale_steps(block, "scale", Presence::optional);
    all.emplace(name, std::move(procedures));
  }
  faults.throw_if_any();
  return all;
}

namespace {

constexpr std::size_t kCatchWindow = 20;    // trials
constexpr long long kLeastUnanswered = 10;  // trials

Quat drawn_orientation(const Protocol& protocol, Random random) {
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

/// Draws the orientations of a block's main trials, together with those of all blocks of the
/// participant.
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
  Random random = task_stream(protocol.seed, participant, block, kTaskCatch, shown / window);
  random.shuffle(marks);
  return marks[shown % window] == 1;
}

}  // namespace

DrawnTrial drawn_trial(const Protocol& protocol, int participant_number, int block,
                       std::size_t shown) {
  const auto index = static_cast<std::uint64_t>(block);
  const auto intervals = protocol.blocks[static_cast<std::size_t>(block)].intervals;
  DrawnTrial out;
  out.catch_trial = is_catch_trial(protocol, participant_number, index, shown);
  Random random = task_stream(protocol.seed, participant_number, index, kTaskPosition, shown + 1);
  out.position = static_cast<int>(random.below(static_cast<std::uint64_t>(intervals)));
  out.orientation = drawn_orientation(
      protocol, task_stream(protocol.seed, participant_number, index, kTaskOrientation, shown + 1));
  return out;
}

std::vector<int> track_order(const Protocol& protocol, int participant_number, int block,
                             std::uint64_t round) {
  const auto index = static_cast<std::uint64_t>(block);
  std::vector<std::size_t> tracks(
      tracks_of(protocol.blocks[static_cast<std::size_t>(block)]).size());
  for (std::size_t i = 0; i < tracks.size(); ++i) tracks[i] = i;
  std::vector<int> out;
  for (const std::size_t track :
       round_of_tracks(task_stream(protocol.seed, participant_number, index, kTaskTracks).next(),
                       round, std::move(tracks)))
    out.push_back(static_cast<int>(track) + 1);
  return out;
}

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

long long expected_trials_of(const TaskBlock& block) {
  if (!is_adaptive(block)) return most_trials_of(block);
  double trials = 0;
  for (const BlockTrack& track : tracks_of(block))
    trials += expected_trials(*track.procedure, Procedure(*track.procedure, 0));
  return with_catch_trials(block, std::llround(trials));
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

int block_orders(const Protocol& protocol) {
  int orders = 1;
  for (int session = 1; protocol.blocks_counterbalanced && session <= protocol.sessions.count;
       ++session) {
    const auto blocks =
        static_cast<int>(std::ranges::count_if(protocol.blocks, [session](const TaskBlock& block) {
          return block.session == session && !block.practice;
        }));
    if (blocks > 1) orders = std::max(orders, latin_square_rows(blocks));
  }
  return orders;
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

bool TaskPlan::block_continues() {
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
  const DrawnTrial drawn = drawn_trial(*protocol_, participant_number_, order_[at_], shown_);
  trial.catch_trial = drawn.catch_trial;
  set_intervals(block(), drawn.position, trial);
  return trial;
}

void TaskPlan::find_next() {
  next_.reset();
  while (at_ < order_.size()) {
    if (block_continues()) break;
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
  if (!choice.intervals.empty()) next_->intervals = choice.intervals;
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

std::size_t TaskPlan::expected_size() const {
  if (finished()) return done_;
  long long left = tracks_ ? 0 : most_trials_of(block()) - static_cast<long long>(shown_);
  if (tracks_) {
    double trials = 0;
    const std::vector<BlockTrack> all = tracks_of(block());
    for (std::size_t i = 0; i < all.size(); ++i)
      trials += expected_trials(*all[i].procedure, tracks_->tracks()[i]);
    left = with_catch_trials(block(), std::llround(trials));
  }
  for (std::size_t i = at_ + 1; i < order_.size(); ++i)
    left += expected_trials_of(protocol_->blocks[static_cast<std::size_t>(order_[i])]);
  return done_ + static_cast<std::size_t>(std::max(1LL, left));
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
