// A study of blocks, each with its task.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iomanip>
#include <optional>
#include <sstream>

#include "data/base/cell_name.h"
#include "data/base/random.h"
#include "data/base/text.h"
#include "data/base/words.h"
#include "protocols/procedures/procedure.h"
#include "protocols/session_plan.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/levels.h"
#include "runner/output/outputs.h"
#include "runner/study/duration.h"
#include "runner/study/schedule_text.h"
#include "runner/study/study_words.h"
#include "runner/study/task_words.h"

namespace palpate::runner::study {
namespace {

using nlohmann::ordered_json;
using protocols::level_text;

std::string blocks_summary(const protocols::Protocol& protocol) {
  std::vector<std::string> renderers, stimuli;
  for (const protocols::RendererKind kind : protocol.renderers)
    renderers.emplace_back(protocols::to_string(kind));
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli) {
    if (stimulus.name == base_name(stimulus.name)) stimuli.push_back(stimulus.name);
  }
  long long trials = 0;
  std::ostringstream out;
  out << protocol.name << (protocol.title.empty() ? "" : ": " + printable(protocol.title))
      << "\n  renderers   " << listed(renderers) << "\n  stimuli     " << listed(stimuli)
      << "\n  blocks      " << protocol.blocks.size() << ", in " << protocol.sessions.count
      << (protocol.sessions.count == 1 ? " session" : " sessions")
      << (protocol.blocks_counterbalanced ? ", their order counterbalanced\n" : "\n");
  for (const protocols::TaskBlock& block : protocol.blocks) {
    trials += protocols::most_trials_of(block);
    out << "    " << block.name << "\n";
    for (const std::string& line : in_words(protocol, block)) out << "      " << line << "\n";
  }
  if (protocol.groups.any()) out << "  groups      " << groups_in_words(protocol) << "\n";
  for (const protocols::PageSpec& page : protocol.pages) {
    constexpr std::array kPlaces = {"before the first block", "before block ", "after the last"};
    out << "  page        " << page.name << ", " << kPlaces[static_cast<std::size_t>(page.when)]
        << page.before_block << "\n";
  }
  const std::vector<std::string> typed = keyboard_parts(protocol);
  if (!typed.empty())
    out << "  keyboard    needed beside a device's buttons for " << listed(typed) << "\n";
  const Duration duration = duration_of(protocol);
  out << "  trials      at most " << trials << " for each participant\n  duration    about "
      << time_in_words(duration.usual) << ", at most " << time_in_words(duration.longest)
      << "; breaks and pages besides\n"
      << heard_lines(protocol) << "  seed        " << protocol.seed << "\n"
      << "  sha256      " << protocol.sha256 << "\n";
  return out.str();
}

struct ListedTrial {
  const protocols::Trial& trial;
  const protocols::TaskBlock& block;
  std::string stimulus, level;
  int comparison = 0;
  bool example = false;  ///< depends on answers
  std::string kind;      ///< reach: "field", "catch", "clamp"
};

bool has_reaches(const protocols::Protocol& protocol) {
  return std::ranges::any_of(protocol.blocks, [](const auto& b) { return b.reaching.has_value(); });
}

/// The level as the table shows it: of a reach, the target and the field on the way.
std::string shown_level(const ListedTrial& row) {
  if (row.kind.empty()) return row.trial.catch_trial ? "catch" : row.level;
  return row.level + (row.trial.reach == protocols::ReachTrial::field ? "" : " " + row.kind);
}

/// "300;350", in the order of the dimensions.
std::string values_text(const protocols::LevelPoint& point) {
  std::string text;
  for (const double value : point) text += (text.empty() ? "" : ";") + level_text(value);
  return text;
}

/// The dimensions of all blocks, each once.
std::vector<std::string> dimensions_of(const protocols::Protocol& protocol) {
  std::vector<std::string> names;
  for (const protocols::TaskBlock& block : protocol.blocks) {
    for (const protocols::LevelDimension& one : block.dimensions)
      if (std::ranges::find(names, one.name) == names.end()) names.push_back(one.name);
  }
  return names;
}

/// The value of a trial's dimension; none: its block has no such dimension, or a catch trial.
std::optional<double> value_of(const ListedTrial& row, const std::string& name) {
  for (std::size_t d = 0; d < row.trial.point.size(); ++d)
    if (row.block.dimensions[d].name == name) return row.trial.point[d];
  return std::nullopt;
}

ListedTrial listed_trial(const protocols::Protocol& protocol, const protocols::Trial& trial) {
  const auto& block = protocols::block_of(protocol, trial);
  return {trial,
          block,
          protocol.stimuli[static_cast<std::size_t>(trial.stimulus)].name,
          trial.level ? protocols::level_text(*trial.level) : values_text(trial.point),
          comparison_interval(block, trial),
          protocols::is_adaptive(block),
          block.reaching ? to_string(trial.reach) : ""};
}

std::string blocks_table(const protocols::Protocol& protocol,
                         const std::vector<protocols::Trial>& trials) {
  std::ostringstream out;
  int block = 0;
  for (const protocols::Trial& trial : trials) {
    const ListedTrial row = listed_trial(protocol, trial);
    if (trial.block != block) {
      block = trial.block;
      out << (block > 1 ? "\n" : "") << "session " << trial.session << ", block " << block << ", "
          << row.block.name << "\n";
      for (const std::string& line : in_words(protocol, row.block)) out << "  " << line << "\n";
      if (row.example)
        out << "  answers choose the levels; with those of a participant whose threshold is in "
               "the middle:\n";
      out << "  trial  track  renderer  level         comparison  stimulus\n";
    }
    out << "  " << std::right << std::setw(5) << trial.trial << std::setw(7) << trial.track << "  "
        << std::left << std::setw(8) << protocols::to_string(trial.renderer) << "  "
        << std::setw(12) << shown_level(row) << "  " << std::setw(10)
        << (row.comparison > 0 ? std::to_string(row.comparison) : "") << "  " << row.stimulus
        << "\n";
  }
  return out.str();
}

std::string blocks_csv(const protocols::Protocol& protocol, int participant,
                       const std::vector<protocols::Trial>& trials) {
  std::vector<std::string> columns = schedule_columns();
  for (const char* more :
       {"task", "block_name", "track", "level", "catch_trial", "comparison_interval", "example"})
    columns.emplace_back(more);
  for (const protocols::Factor& factor : protocol.factors) columns.push_back(factor.name);
  if (has_reaches(protocol)) columns.emplace_back("reach_kind");
  const std::vector<std::string> dimensions = dimensions_of(protocol);
  columns.insert(columns.end(), dimensions.begin(), dimensions.end());
  output::CsvText table(columns, "\r\n");
  for (const protocols::Trial& trial : trials) {
    const ListedTrial row = listed_trial(protocol, trial);
    const Quat& q = trial.orientation;
    table << participant << trial.session << trial.block << trial.trial
          << protocols::to_string(trial.renderer) << base_name(row.stimulus) << q.w << q.x << q.y
          << q.z << trial.practice << protocol.sha256 << PALPATE_VERSION
          << protocols::to_string(row.block.task) << row.block.name << trial.track
          << (trial.level ? row.level : "") << trial.catch_trial
          << (row.comparison > 0 ? std::to_string(row.comparison) : "") << row.example;
    for (const protocols::Factor& factor : protocol.factors)
      table << cell_name(row.stimulus).level(factor.name);
    if (has_reaches(protocol)) table << row.kind;
    for (const std::string& name : dimensions) {
      const auto value = value_of(row, name);
      table << (value ? level_text(*value) : "");
    }
    table.end_row();
  }
  return table.text();
}

ordered_json blocks_rows(const protocols::Protocol& protocol,
                         const std::vector<protocols::Trial>& trials) {
  ordered_json rows = ordered_json::array();
  for (const protocols::Trial& trial : trials) {
    const ListedTrial row = listed_trial(protocol, trial);
    const Quat& q = trial.orientation;
    ordered_json out = {{"session", trial.session},
                        {"block", trial.block},
                        {"trial", trial.trial},
                        {"task", protocols::to_string(row.block.task)},
                        {"block_name", row.block.name},
                        {"track", trial.track},
                        {"renderer", protocols::to_string(trial.renderer)},
                        {"shape", base_name(row.stimulus)},
                        {"level", nullptr},
                        {"catch_trial", trial.catch_trial},
                        {"comparison_interval", nullptr},
                        {"orientation_wxyz", {q.w, q.x, q.y, q.z}},
                        {"practice", trial.practice},
                        {"example", row.example}};
    for (const auto& [factor, level] : cell_name(row.stimulus).levels)
      out["factors"][factor] = level;
    if (trial.level) out["level"] = *trial.level;
    for (std::size_t d = 0; d < trial.point.size(); ++d)
      out["levels"][row.block.dimensions[d].name] = trial.point[d];
    if (!row.kind.empty()) out["reach_kind"] = row.kind;
    if (row.comparison > 0) out["comparison_interval"] = row.comparison;
    rows.push_back(std::move(out));
  }
  return rows;
}

/// Answers as a participant whose threshold is in the middle of the levels.
bool succeeds(const protocols::Protocol& protocol, const protocols::TaskBlock& block,
              const protocols::Trial& trial, Random& random) {
  const double draw = random.unit();
  if (!trial.point.empty()) return draw < protocols::typical_success(protocol, trial);
  if (!trial.level || protocols::levels_of(block).size() < 2) return draw < 0.75;
  const protocols::PsychometricParticipant typical =
      protocols::typical_participant(protocol, block);
  return draw <
         protocols::psychometric_probability(typical.function, typical.parameters, *trial.level);
}

/// All trials of a participant. Those of adaptive blocks depend on answers, here of a participant
/// whose threshold is in the middle of the levels.
std::vector<protocols::Trial> example_trials(const protocols::Protocol& protocol, int participant) {
  std::vector<protocols::Trial> trials;
  Random random(protocol.seed, {static_cast<std::uint64_t>(participant), 0x5c});
  for (int session = 1; session <= protocol.sessions.count; ++session) {
    protocols::SessionPlan plan(protocol, participant, session);
    while (!plan.finished()) {
      const protocols::Trial& trial = plan.next();
      const auto& block = protocols::block_of(protocol, trial);
      const bool success = succeeds(protocol, block, trial, random);
      trials.push_back(trial);
      plan.answered({success, success, true});
    }
  }
  return trials;
}

}  // namespace

constexpr StudyWords kWordsOfBlocks{blocks_summary, example_trials, blocks_table, blocks_csv,
                                    blocks_rows};

}  // namespace palpate::runner::study
