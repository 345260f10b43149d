#include "protocols/schedule.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <numeric>

#include "data/base/random.h"
#include "protocols/order.h"
#include "stimuli/orientation.h"

namespace palpate::protocols {
namespace {

// A random stream for each use, so that a change to one part of a protocol does not change the
// draws of the others. The values are part of the meaning of a seed: never renumber them.
enum Stream : std::uint64_t { kOrder = 1, kOrientation = 2, kPractice = 3, kWarmUp = 4 };

/// Renderers whose trials are shown together: one of them, or all when interleaved.
using Group = std::vector<RendererKind>;

/// An uninterrupted sequence of trials.
struct Block {
  int session = 1;
  int group = 0;  ///< index into the groups
  std::vector<Trial> trials;
};

/// Size of part `index` when `total` is divided into `parts` as evenly as possible, larger parts
/// first.
int part_size(long long total, int parts, int index) {
  return static_cast<int>(total / parts + (index < total % parts ? 1 : 0));
}

std::uint64_t code(RendererKind renderer) { return renderer == RendererKind::point ? 0 : 1; }

/// Separates the streams of groups; the interleaved group has its own code.
std::uint64_t code(const Group& group) { return group.size() == 1 ? code(group.front()) : 2; }

std::vector<std::string> names_of(const Protocol& protocol) {
  std::vector<std::string> names;
  names.reserve(protocol.stimuli.size());
  for (const StimulusSpec& stimulus : protocol.stimuli) names.push_back(stimulus.name);
  return names;
}

std::vector<Group> groups_in_order(const Protocol& protocol, int participant_number) {
  if (protocol.renderer_order == RendererOrder::interleaved) return {protocol.renderers};
  std::vector<int> row(protocol.renderers.size());
  std::iota(row.begin(), row.end(), 0);
  if (protocol.renderer_order == RendererOrder::counterbalanced) {
    row = latin_square_row(static_cast<int>(row.size()), participant_number);
  }
  std::vector<Group> groups;
  groups.reserve(row.size());
  for (const int index : row) {
    groups.push_back({protocol.renderers[static_cast<std::size_t>(index)]});
  }
  return groups;
}

/// Assigns renderers to trials: each stimulus is shown with each renderer of the group equally
/// often. With a uniform order of the stimuli, every mixed order is equally likely.
void mix_renderers(const Protocol& protocol, const Group& group, std::vector<Trial>& trials,
                   Random& random) {
  for (int stimulus = 0; stimulus < static_cast<int>(protocol.stimuli.size()); ++stimulus) {
    std::vector<Trial*> shown;
    for (Trial& trial : trials) {
      if (trial.stimulus == stimulus) shown.push_back(&trial);
    }
    std::vector<RendererKind> renderers;
    // A sequential order shows all stimuli with one renderer, then with the next; a random order
    // mixes them.
    for (std::size_t i = 0; i < shown.size(); ++i) renderers.push_back(group[i % group.size()]);
    if (protocol.order.kind == OrderKind::random && group.size() > 1) random.shuffle(renderers);
    for (std::size_t i = 0; i < shown.size(); ++i) shown[i]->renderer = renderers[i];
  }
}

/// A block without orientations: counts[i] trials of stimulus i.
std::vector<Trial> ordered_trials(const Protocol& protocol, const Group& group,
                                  const std::vector<int>& counts, Random& random) {
  std::vector<Trial> trials;
  for (const int stimulus : order_block(counts, protocol.order, names_of(protocol), random)) {
    Trial trial;
    trial.stimulus = stimulus;
    trials.push_back(trial);
  }
  mix_renderers(protocol, group, trials, random);
  return trials;
}

std::vector<int> equal_counts(const Protocol& protocol, const Group& group, int repetitions) {
  const int count = repetitions * static_cast<int>(group.size());
  std::vector<int> counts(protocol.stimuli.size(), count);
  return counts;
}

/// Listed orientations: for each stimulus and renderer the list as evenly as possible, shuffled.
void orient_from_list(const Protocol& protocol, const std::vector<Trial*>& trials, Random& random) {
  if (protocol.orientations.empty()) throw ScheduleError("the list of orientations is empty");
  for (const RendererKind renderer : protocol.renderers) {
    for (int stimulus = 0; stimulus < static_cast<int>(protocol.stimuli.size()); ++stimulus) {
      std::vector<Trial*> shown;
      std::copy_if(trials.begin(), trials.end(), std::back_inserter(shown), [&](const Trial* t) {
        return t->renderer == renderer && t->stimulus == stimulus;
      });
      std::vector<Quat> turns;
      while (turns.size() < shown.size()) {
        std::vector<Quat> round = protocol.orientations;
        random.shuffle(round);  // the last, incomplete round is a random choice
        turns.insert(turns.end(), round.begin(), round.end());
      }
      turns.resize(shown.size(), Quat(1, 0, 0, 0));
      random.shuffle(turns);
      for (std::size_t i = 0; i < shown.size(); ++i) shown[i]->orientation = turns[i];
    }
  }
}

void orient(const Protocol& protocol, const std::vector<Trial*>& trials, Random& random) {
  switch (protocol.orientation) {
    case OrientationKind::uniform:
      for (Trial* trial : trials) trial->orientation = stimuli::uniform_rotation(random);
      break;
    case OrientationKind::fixed:
      for (Trial* trial : trials) trial->orientation = Quat(1, 0, 0, 0);
      break;
    case OrientationKind::listed:
      orient_from_list(protocol, trials, random);
      break;
  }
}

void finish_practice(const Protocol& protocol, std::vector<Trial>& trials, Random random) {
  std::vector<Trial*> all;
  int number = 0;
  for (Trial& trial : trials) {
    trial.practice = true;
    trial.trial = ++number;
    all.push_back(&trial);
  }
  orient(protocol, all, random);
}

std::vector<Trial> practice_trials(const Protocol& protocol, int participant_number,
                                   const Group& group, int round) {
  const auto participant = static_cast<std::uint64_t>(participant_number);
  const auto number = static_cast<std::uint64_t>(round);
  Random random(protocol.seed, {participant, kPractice, kOrder, code(group), number});
  std::vector<Trial> trials = ordered_trials(
      protocol, group, equal_counts(protocol, group, protocol.practice.repetitions), random);
  finish_practice(
      protocol, trials,
      Random(protocol.seed, {participant, kPractice, kOrientation, code(group), number}));
  return trials;
}

std::vector<Trial> warm_up_trials(const Protocol& protocol, int participant_number,
                                  const Group& group, int session) {
  const auto participant = static_cast<std::uint64_t>(participant_number);
  const auto number = static_cast<std::uint64_t>(session);
  Random random(protocol.seed, {participant, kWarmUp, kOrder, number});
  const int stimuli = static_cast<int>(protocol.stimuli.size());
  std::vector<int> counts;
  counts.reserve(protocol.stimuli.size());
  for (int i = 0; i < stimuli; ++i) {
    counts.push_back(part_size(protocol.sessions.warm_up_trials, stimuli, i));
  }
  if (protocol.order.kind == OrderKind::random) random.shuffle(counts);
  std::vector<Trial> trials = ordered_trials(protocol, group, counts, random);
  finish_practice(protocol, trials,
                  Random(protocol.seed, {participant, kWarmUp, kOrientation, number}));
  return trials;
}

std::vector<Block> main_blocks(const Protocol& protocol, int participant_number,
                               const std::vector<Group>& groups) {
  std::vector<Block> blocks;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    for (int b = 0; b < protocol.blocks_per_renderer; ++b) {
      const int repetitions = part_size(protocol.repetitions, protocol.blocks_per_renderer, b);
      blocks.push_back({1, static_cast<int>(g),
                        block_of_trials(protocol, participant_number, groups[g], b, repetitions)});
    }
  }
  std::vector<Trial*> all;
  for (Block& block : blocks) {
    for (Trial& trial : block.trials) all.push_back(&trial);
  }
  draw_orientations(protocol, participant_number, all);
  return blocks;
}

/// Gives each session whole blocks if there are enough of them; otherwise divides the trials
/// evenly.
std::vector<Block> into_sessions(const Protocol& protocol, std::vector<Block> blocks) {
  const int sessions = protocol.sessions.count;
  const int count = static_cast<int>(blocks.size());
  if (sessions <= count) {
    std::size_t next = 0;
    for (int s = 0; s < sessions; ++s) {
      for (int i = part_size(count, sessions, s); i > 0; --i) blocks[next++].session = s + 1;
    }
    return blocks;
  }
  std::vector<Block> parts;
  int session = 1;
  int remaining = part_size(main_trials(protocol), sessions, 0);
  for (const Block& block : blocks) {
    Block part{session, block.group, {}};
    for (const Trial& trial : block.trials) {
      if (remaining == 0) {
        if (!part.trials.empty()) parts.push_back(part);
        remaining = part_size(main_trials(protocol), sessions, session);
        part = {++session, block.group, {}};
      }
      part.trials.push_back(trial);
      --remaining;
    }
    parts.push_back(part);
  }
  return parts;
}

}  // namespace

std::vector<Trial> block_of_trials(const Protocol& protocol, int participant_number,
                                   const Group& group, int number, int repetitions) {
  Random random(protocol.seed, {static_cast<std::uint64_t>(participant_number), kOrder, code(group),
                                static_cast<std::uint64_t>(number)});
  return ordered_trials(protocol, group, equal_counts(protocol, group, repetitions), random);
}

void draw_orientations(const Protocol& protocol, int participant_number,
                       const std::vector<Trial*>& trials) {
  Random random(protocol.seed, {static_cast<std::uint64_t>(participant_number), kOrientation});
  orient(protocol, trials, random);
}

int renderer_orders(const Protocol& protocol) {
  if (protocol.renderer_order != RendererOrder::counterbalanced) return 1;
  return latin_square_rows(static_cast<int>(protocol.renderers.size()));
}

long long main_trials(const Protocol& protocol) {
  return static_cast<long long>(protocol.renderers.size()) *
         static_cast<long long>(protocol.stimuli.size()) * protocol.repetitions;
}

TaskBlock shapes_block(const Protocol& protocol) {
  TaskBlock block;
  block.announced = false;
  block.renderers = protocol.renderers;
  block.repetitions = protocol.repetitions;
  block.practice_feedback = block.by_shape = true;
  for (const StimulusSpec& stimulus : protocol.stimuli) {
    block.stimuli.push_back(static_cast<int>(block.stimuli.size()));
    block.answers.push_back({"", stimulus.name, ""});
  }
  return block;
}

std::vector<Trial> practice_round(const Protocol& protocol, int participant_number,
                                  RendererKind renderer, int round) {
  if (participant_number < 1) throw std::invalid_argument("participants are numbered from 1");
  if (round < 1) throw std::invalid_argument("rounds of practice are numbered from 1");
  const bool mixed = protocol.renderer_order == RendererOrder::interleaved;
  std::vector<Trial> trials = practice_trials(protocol, participant_number,
                                              mixed ? protocol.renderers : Group{renderer}, round);
  for (Trial& trial : trials) trial.intervals = {{trial.stimulus, trial.renderer}};
  return trials;
}

std::vector<Trial> schedule(const Protocol& protocol, int participant_number) {
  if (participant_number < 1) throw std::invalid_argument("participants are numbered from 1");
  const std::vector<Group> groups = groups_in_order(protocol, participant_number);
  std::vector<Trial> trials;
  int session = 0, block = 0, trial = 0, practised = 0;
  const auto append = [&](std::vector<Trial> shown) {
    if (shown.empty()) return;
    ++block;
    for (Trial& next : shown) {
      next.session = session;
      next.block = block;
      next.trial = ++trial;
      next.intervals = {{next.stimulus, next.renderer}};
      trials.push_back(next);
    }
  };
  for (const Block& next :
       into_sessions(protocol, main_blocks(protocol, participant_number, groups))) {
    const Group& group = groups[static_cast<std::size_t>(next.group)];
    if (next.session != session) {
      session = next.session;
      trial = 0;
      if (session > 1) append(warm_up_trials(protocol, participant_number, group, session));
    }
    if (next.group == practised) {
      ++practised;
      append(practice_trials(protocol, participant_number, group, 1));
    }
    append(next.trials);
  }
  return trials;
}

}  // namespace palpate::protocols
