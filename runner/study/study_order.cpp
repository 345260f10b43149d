#include "runner/study/study_order.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <utility>

#include "data/base/checksum.h"
#include "protocols/groups.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/levels.h"
#include "runner/study/schedule_text.h"

namespace palpate::runner::study {
namespace {

using protocols::Protocol;
using protocols::TaskBlock;

std::string digits_of(double value) {
  std::array<char, 40> digits{};
  const int length = std::snprintf(digits.data(), digits.size(), "%.17g", value + 0.0);
  return {digits.data(), static_cast<std::size_t>(length)};
}

std::string turn_text(const Quat& q) {
  std::string out;
  for (const double part : {q.w, q.x, q.y, q.z}) out += "," + digits_of(part);
  return out;
}

OrderRow row_of(const Protocol& protocol, const protocols::Trial& trial) {
  const Quat& q = trial.orientation;
  const TaskBlock& block = protocols::block_of(protocol, trial);
  return {trial.session,
          protocols::to_string(trial.renderer),
          protocol.stimuli[static_cast<std::size_t>(trial.stimulus)].name,
          {q.w, q.x, q.y, q.z},
          {trial.block, block.name, trial.track, trial.level, trial.catch_trial,
           comparison_interval(block, trial),
           block.reaching ? protocols::to_string(trial.reach) : "", trial.point}};
}

/// The order of the cells in tracks that they share.
std::string cell_lines(const Protocol& protocol, int number, int index) {
  std::string out;
  int track = 0;
  for (const auto& stimuli : protocols::shared_track_order(protocol, number, index)) {
    out += "cells," + std::to_string(++track);
    for (const int stimulus : stimuli)
      out += "," + protocol.stimuli[static_cast<std::size_t>(stimulus)].name;
    out += "\n";
  }
  return out;
}

/// The draws of an adaptive block, for as many trials as it may have.
std::string drawn_lines(const Protocol& protocol, int number, int index) {
  const TaskBlock& block = protocol.blocks[static_cast<std::size_t>(index)];
  const auto most = static_cast<std::size_t>(protocols::most_trials_of(block)) +
                    protocols::most_unanswered(block);
  std::string out;
  for (std::size_t i = 0; i < most; ++i) {
    const protocols::DrawnTrial drawn = protocols::drawn_trial(protocol, number, index, i);
    const bool compares = block.task == protocols::TaskKind::compare && !drawn.catch_trial;
    out += "trial," + std::to_string(i + 1) + (drawn.catch_trial ? ",1," : ",0,") +
           std::to_string(compares ? drawn.position + 1 : 0) + turn_text(drawn.orientation) + "\n";
  }
  std::size_t rounds = 0;
  for (const protocols::ProcedureSpec& procedure : block.procedures)
    rounds = std::max(rounds, protocols::most_trials(procedure));
  if (block.cells_share_tracks) out += cell_lines(protocol, number, index);
  for (std::uint64_t round = 0; round < rounds; ++round) {
    out += "round," + std::to_string(round + 1);
    for (const int track : protocols::track_order(protocol, number, index, round))
      out += "," + std::to_string(track);
    out += "\n";
  }
  return out;
}

/// An answer by which a block without adaptive levels goes on.
constexpr protocols::TrialOutcome kAnyAnswer{true, true, true, std::nullopt};

/// The lines of a session's blocks that are analysed. Its adaptive blocks are passed over with some
/// answers: those after them do not depend on these.
std::string session_lines(const Protocol& protocol, int number, int session) {
  std::string out;
  int block = 0;
  for (protocols::SessionPlan plan(protocol, number, session); !plan.finished();
       plan.answered(kAnyAnswer)) {
    const protocols::Trial& trial = plan.next();
    const TaskBlock& shown = plan.block();
    if (trial.practice) continue;
    if (!protocols::is_adaptive(shown)) {
      out += to_line(row_of(protocol, trial)) + "\n";
    } else if (trial.block != block) {
      out += "block," + std::to_string(session) + "," + std::to_string(trial.block) + "," +
             shown.name + "\n" + drawn_lines(protocol, number, trial.task_block);
    }
    block = trial.block;
  }
  return out;
}

std::string joined_in_order(const std::vector<std::string>& names) {
  std::vector<std::string> seen;
  for (const std::string& name : names) {
    if (std::ranges::find(seen, name) == seen.end()) seen.push_back(name);
  }
  std::string out;
  for (const std::string& name : seen) out += (out.empty() ? "" : ", then ") + name;
  return out;
}

/// Whether a program chooses the level of the next trial: any is as expected.
bool is_level_asked(const protocols::SessionPlan& plan) {
  if (!plan.tracks() || plan.next().catch_trial) return false;
  return protocols::is_asked(*protocols::procedure_of(plan.block(), plan.next()));
}

}  // namespace

bool OrderRow::operator==(const OrderRow& other) const { return to_line(*this) == to_line(other); }

std::string to_line(const OrderRow& row) {
  std::string line = std::to_string(row.session) + "," + row.renderer + "," + row.shape;
  for (const double part : row.orientation_wxyz) line += "," + digits_of(part);
  const OrderRow::Task& task = row.task;
  if (task.name.empty()) return line;
  line += "," + std::to_string(task.block) + "," + task.name + "," + std::to_string(task.track) +
          "," + (task.level ? digits_of(*task.level) : "") + (task.catch_trial ? ",1," : ",0,") +
          std::to_string(task.comparison) + (task.reach.empty() ? "" : "," + task.reach);
  if (!task.point.empty()) line += ",at";
  for (const double value : task.point) line += "," + digits_of(value);
  return line;
}

std::string fixed_order(const Protocol& all, int participant_number) {
  const Protocol& protocol = protocols::protocol_of(all, participant_number);
  std::string lines;
  for (int session = 1; session <= protocol.sessions.count; ++session)
    lines += session_lines(protocol, participant_number, session);
  return lines;
}

std::string order_checksum(const Protocol& protocol, int participant_number) {
  return checksum_hex(fixed_order(protocol, participant_number));
}

ExpectedTrials expected_trials(const Protocol& all, int participant_number,
                               const std::vector<ShownTrial>& shown) {
  const Protocol& protocol = protocols::protocol_of(all, participant_number);
  ExpectedTrials out;
  out.complete = true;
  for (int session = 1; session <= protocol.sessions.count; ++session) {
    protocols::SessionPlan plan(protocol, participant_number, session);
    int last_block = 0;
    for (const ShownTrial& one : shown) {
      if (one.row.session != session || plan.finished()) continue;
      last_block = one.row.task.block;
      // A program may end the blocks that it chooses the levels for.
      while (!plan.finished() && is_level_asked(plan) && plan.next().block < one.row.task.block)
        plan.end_block();
      if (plan.finished()) continue;
      if (!plan.next().practice) {
        out.rows.push_back(row_of(protocol, plan.next()));
        if (is_level_asked(plan)) {
          out.rows.back().task.level = one.row.task.level;
          out.rows.back().task.point = one.row.task.point;
        }
      }
      protocols::TrialOutcome outcome = one.outcome;
      outcome.block = 0;  // other blocks end as their procedures say
      plan.answered(outcome);
    }
    if (!plan.finished() && is_level_asked(plan) && plan.next().block == last_block) {
      plan.end_block();
      if (plan.finished()) ++out.ended_by_program;
    }
    out.complete = out.complete && plan.finished();
  }
  return out;
}

std::size_t planned_trials(const Protocol& protocol) {
  long long trials = 0;
  for (const TaskBlock& block : protocol.blocks)
    trials += block.practice ? 0 : protocols::expected_trials_of(block);
  return static_cast<std::size_t>(trials);
}

bool has_adaptive_blocks(const Protocol& protocol) {
  return std::ranges::any_of(protocol.blocks, [](const TaskBlock& block) {
    return !block.practice && protocols::is_adaptive(block);
  });
}

std::string condition_order(const Protocol& all, int participant_number) {
  const Protocol& protocol = protocols::protocol_of(all, participant_number);
  return joined_in_order(protocol.order_rule->conditions(protocol, participant_number));
}

std::string condition_order(const Protocol& protocol, const std::vector<ShownTrial>& shown) {
  std::vector<std::string> names;
  for (const ShownTrial& one : shown) {
    if (one.practice) continue;
    names.push_back(protocol.order_rule->condition_of(one.row.renderer, one.row.task.name));
  }
  return joined_in_order(names);
}

}  // namespace palpate::runner::study
