#include "protocols/tasks/block_trials.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <variant>

#include "data/base/random.h"
#include "protocols/order.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/block_tracks.h"
#include "protocols/tasks/levels.h"
#include "stimuli/orientation.h"

namespace palpate::protocols {
namespace {

/// Trials that are alike: a track at a level, or the catch trials.
struct Category {
  std::string name;
  Trial trial;
  int count = 0;
};

/// How many of a track's trials to a target have each field. Clamps begin with the first targets,
/// catch trials with the last, so that few of both go to different ones.
std::array<int, 3> counts_of_reaches(const TaskBlock& block, std::size_t target) {
  const ReachingSpec& reaching = *block.reaching;
  const auto targets = static_cast<long long>(reaching.targets.size());
  const long long clamps = reaches_of_track(block, ReachTrial::clamp);
  const long long catches = reaches_of_track(block, ReachTrial::none);
  const auto place = static_cast<long long>(target);
  const auto clamped = static_cast<int>(clamps / targets + (place < clamps % targets ? 1 : 0));
  const auto caught =
      static_cast<int>(catches / targets + (targets - 1 - place < catches % targets ? 1 : 0));
  return {block.repetitions - clamped - caught, caught, clamped};
}

void add_reaches(const TaskBlock& block, const Category& category,
                 std::vector<Category>& categories) {
  for (std::size_t t = 0; t < block.reaching->targets.size(); ++t) {
    const std::array<int, 3> counts = counts_of_reaches(block, t);
    for (const ReachTrial kind : {ReachTrial::field, ReachTrial::none, ReachTrial::clamp}) {
      Category one = category;
      one.name += " to target " + std::to_string(t + 1) + ", " + to_string(kind);
      one.trial.level = static_cast<double>(t + 1);
      one.trial.reach = kind;
      one.trial.catch_trial = kind == ReachTrial::none;
      one.count = counts[static_cast<std::size_t>(kind)];
      if (one.count > 0) categories.push_back(std::move(one));
    }
  }
}

void add_levels(const TaskBlock& block, const BlockTrack& track, Category category,
                std::vector<Category>& categories) {
  if (block.reaching) return add_reaches(block, category, categories);
  if (track.procedure == nullptr) {
    category.count = block.repetitions;
    categories.push_back(category);
    return;
  }
  const auto& constant = std::get<ConstantStimuli>(*track.procedure);
  for (const LevelPoint& point : constant.points) {
    Category one = category;
    one.name += " at " + point_text(block, point);
    one.trial.point = point;
    one.count = constant.repetitions;
    categories.push_back(std::move(one));
  }
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
  const int first = first_track(block);
  int number = 0;
  long long trials = 0;
  for (const BlockTrack& track : tracks_of(block)) {
    Category category;
    category.name = protocol.stimuli[static_cast<std::size_t>(track.stimulus)].name + " (" +
                    to_string(track.renderer) + ")";
    category.trial.stimulus = track.stimulus;
    category.trial.renderer = track.renderer;
    category.trial.track = first + number++;
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
    category.trial.track = first + t;
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

/// In a random order under the limits of the block.
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
  const std::uint64_t number = stream_of(block);
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

/// The study of shapes that determines an order.
/// \param block  null: all stimuli
Protocol shapes_view(const Protocol& protocol, const TaskBlock* block) {
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

/// How the trials of a block without adaptive levels are drawn.
class BlockRule {
 public:
  virtual ~BlockRule() = default;
  /// Without orientations.
  virtual std::vector<Trial> trials(const Protocol& protocol, int participant, int index,
                                    std::uint64_t round) const = 0;
  virtual void orient(const Protocol& protocol, int participant, int index, std::uint64_t round,
                      std::vector<Trial>& trials) const = 0;
};

const BlockRule& rule_of(const TaskBlock& block);

/// As in the study of shapes: the orientations of a participant's blocks are drawn together.
class DrawnTogether final : public BlockRule {
 public:
  std::vector<Trial> trials(const Protocol& protocol, int participant, int index,
                            std::uint64_t round) const override {
    const TaskBlock& block = protocol.blocks[static_cast<std::size_t>(index)];
    const Protocol view = shapes_view(protocol, &block);
    const auto before = std::count_if(
        protocol.blocks.begin(), protocol.blocks.begin() + index, [&](const TaskBlock& other) {
          return &rule_of(other) == this && other.practice == block.practice &&
                 other.renderers == block.renderers;
        });
    const int number = static_cast<int>(before);
    std::vector<Trial> trials =
        block.practice
            ? practice_round(view, participant, block.renderers.front(),
                             number + 1 + static_cast<int>(round))
            : block_of_trials(view, participant, block.renderers, number, block.repetitions);
    const std::vector<BlockTrack> tracks = tracks_of(block);
    for (Trial& trial : trials) {
      trial.stimulus = block.stimuli[static_cast<std::size_t>(trial.stimulus)];
      const auto is_its = [&](const BlockTrack& track) {
        return track.stimulus == trial.stimulus && track.renderer == trial.renderer;
      };
      const auto track = std::find_if(tracks.begin(), tracks.end(), is_its);
      trial.track = first_track(block) + static_cast<int>(track - tracks.begin());
      set_intervals(block, 0, trial);
    }
    return trials;
  }

  void orient(const Protocol& protocol, int participant, int index, std::uint64_t /*round*/,
              std::vector<Trial>& its_trials) const override {
    if (protocol.blocks[static_cast<std::size_t>(index)].practice) return;  // drawn with the order
    std::vector<std::vector<Trial>> others;
    std::vector<Trial*> all;
    for (int session = 1; session <= protocol.sessions.count; ++session) {
      for (const int other : blocks_in_order(protocol, participant, session)) {
        const TaskBlock& block = protocol.blocks[static_cast<std::size_t>(other)];
        if (block.practice || &rule_of(block) != this) continue;
        if (other != index) others.push_back(trials(protocol, participant, other, 0));
        for (Trial& trial : other == index ? its_trials : others.back()) all.push_back(&trial);
      }
    }
    draw_orientations(shapes_view(protocol, nullptr), participant, all);
  }
};

class DrawnAlone final : public BlockRule {
 public:
  std::vector<Trial> trials(const Protocol& protocol, int participant, int index,
                            std::uint64_t round) const override {
    return fixed_trials(protocol, participant, index, round);
  }
  void orient(const Protocol& protocol, int participant, int index, std::uint64_t round,
              std::vector<Trial>& trials) const override {
    const auto before = static_cast<std::size_t>(round) * trials.size();
    for (std::size_t i = 0; i < trials.size(); ++i)
      trials[i].orientation = orientation_in_block(protocol, participant,
                                                   static_cast<std::uint64_t>(index), before + i);
  }
};

/// Plain identification keeps the order that it had in version 1.
const BlockRule& rule_of(const TaskBlock& block) {
  static const DrawnTogether together;
  static const DrawnAlone alone;
  const bool identifies =
      block.task == TaskKind::identify && block.procedures.empty() && block.factors.empty();
  if (identifies && (block.renderers.size() == 1 || (!block.max_run && !block.min_distance)))
    return together;
  return alone;
}

}  // namespace

std::vector<Trial> trials_of_block(const Protocol& protocol, int participant, int index,
                                   std::uint64_t round) {
  const BlockRule& rule = rule_of(protocol.blocks[static_cast<std::size_t>(index)]);
  std::vector<Trial> trials = rule.trials(protocol, participant, index, round);
  rule.orient(protocol, participant, index, round, trials);
  return trials;
}

Quat orientation_in_block(const Protocol& protocol, int participant, std::uint64_t block,
                          std::size_t shown) {
  const TaskBlock& asked = protocol.blocks[static_cast<std::size_t>(block)];
  if (asked.reaching) return Quat(1, 0, 0, 0);  // targets and fields stand in one frame
  Random random =
      task_stream(protocol.seed, participant, stream_of(asked), kTaskOrientation, shown + 1);
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

void check_order(const Protocol& protocol, int block) {
  const TaskBlock& checked = protocol.blocks[static_cast<std::size_t>(block)];
  if (!is_adaptive(checked)) rule_of(checked).trials(protocol, 1, block, 0);
}

}  // namespace palpate::protocols
