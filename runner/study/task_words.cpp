#include "runner/study/task_words.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "data/base/cell_name.h"
#include "data/base/random.h"
#include "protocols/procedures/procedure.h"
#include "protocols/procedures/recovery.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/levels.h"
#include "runner/output/outputs.h"
#include "runner/usage_error.h"

namespace palpate::runner::study {
namespace {

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

/// What the table shows as the level: of a reach, the target and what is felt on the way.
std::string shown_level(const ListedTrial& row) {
  if (row.kind.empty()) return row.trial.catch_trial ? "catch" : row.level;
  return row.level + (row.trial.reach == protocols::ReachTrial::field ? "" : " " + row.kind);
}

using protocols::level_text;

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

ListedTrial listed(const protocols::Protocol& protocol, const protocols::Trial& trial) {
  const auto& block = protocols::block_of(protocol, trial);
  return {trial,
          block,
          protocol.stimuli[static_cast<std::size_t>(trial.stimulus)].name,
          trial.level ? protocols::level_text(*trial.level) : values_text(trial.point),
          comparison_interval(block, trial),
          protocols::is_adaptive(block),
          block.reaching ? to_string(trial.reach) : ""};
}

std::string table_text(const protocols::Protocol& protocol,
                       const std::vector<protocols::Trial>& trials) {
  std::ostringstream out;
  int block = 0;
  for (const protocols::Trial& trial : trials) {
    const ListedTrial row = listed(protocol, trial);
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

std::string csv_text(const protocols::Protocol& protocol, int participant,
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
    const ListedTrial row = listed(protocol, trial);
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

std::string json_text(const protocols::Protocol& protocol, int participant,
                      const std::vector<protocols::Trial>& trials) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const protocols::Trial& trial : trials) {
    const ListedTrial row = listed(protocol, trial);
    const Quat& q = trial.orientation;
    nlohmann::ordered_json out = {{"session", trial.session},
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
  const nlohmann::ordered_json document = {{"protocol", protocol.name},
                                           {"protocol_sha256", protocol.sha256},
                                           {"program_version", PALPATE_VERSION},
                                           {"participant_number", participant},
                                           {"trials", rows}};
  return document.dump(1) + "\n";
}

std::string joined(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + level_text(value);
  return text;
}

std::string range_of(const std::vector<double>& values) {
  if (values.size() <= 8) return joined(values);
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  return std::to_string(values.size()) + " from " + level_text(*least) + " to " + level_text(*most);
}

/// "4 x 21" values, or the range of each dimension.
std::string ranges_in_words(const protocols::ProcedureSpec& spec) {
  std::string text;
  for (const protocols::DimensionRange& range : protocols::ranges_of(spec))
    text += (text.empty() ? "" : ", ") + level_text(range.min) + " to " + level_text(range.max);
  return text;
}

std::string words(const protocols::SobolPoints& spec) {
  return "Sobol's sequence: " + std::to_string(spec.trials) + " points within " +
         ranges_in_words(spec);
}

std::string words(const protocols::AskedPoints& spec) {
  return "a program is asked for points within " + ranges_in_words(spec) + " (--ask); ends after " +
         std::to_string(spec.own.trials) + " trials";
}

std::string words(const protocols::FieldQuestPlus& spec) {
  std::ostringstream out;
  out << "QUEST+ of the form " << to_string(spec.function.form) << ": ";
  for (const auto& values : spec.levels)
    out << (&values == &spec.levels.front() ? "" : " x ") << values.size();
  out << " points within " << ranges_in_words(spec) << "; ";
  const std::vector<std::string> names = protocols::grid_names(spec.function.form);
  for (std::size_t k = 0; k < names.size(); ++k)
    out << (k > 0 ? ", " : "") << spec.parameters[k].values.size() << " of " << names[k];
  if (std::ranges::find(spec.interest, false) != spec.interest.end()) {
    out << "; of interest:";
    for (std::size_t k = 0; k < names.size(); ++k)
      if (spec.interest[k]) out << " " << names[k];
  }
  out << "; ends after " << spec.stop_trials << " trials";
  if (spec.stop_entropy_bits)
    out << " or at an entropy of " << level_text(*spec.stop_entropy_bits) << " bit";
  return out.str();
}

std::string words(const protocols::ConstantStimuli& spec) {
  if (!spec.points.empty())
    return "constant stimuli: " + std::to_string(spec.points.size()) + " points within " +
           ranges_in_words(spec) + ", each " + std::to_string(spec.repetitions) + " times";
  return "constant stimuli: levels " + range_of(spec.levels) + ", each " +
         std::to_string(spec.repetitions) + " times";
}

std::string words(const protocols::Staircase& spec) {
  std::ostringstream out;
  out << "staircase: " << spec.down << " down " << spec.up << " up from " << level_text(spec.start)
      << " within " << level_text(spec.min) << " to " << level_text(spec.max) << ", steps "
      << joined(spec.steps) << "; ends after ";
  if (spec.stop_reversals) out << *spec.stop_reversals << " reversals or ";
  out << spec.stop_trials << " trials; converges at " << std::fixed << std::setprecision(3)
      << protocols::convergence_point(spec);
  return out.str();
}

std::string words(const protocols::QuestPlus& spec) {
  std::ostringstream out;
  out << "QUEST+: levels " << range_of(spec.levels) << "; " << spec.threshold.values.size()
      << " thresholds, " << spec.slope.values.size() << " slopes, " << spec.guess.values.size()
      << " guess rates, " << spec.lapse.values.size() << " lapse rates; ends after "
      << spec.stop_trials << " trials";
  if (spec.stop_entropy_bits)
    out << " or at an entropy of " << level_text(*spec.stop_entropy_bits) << " bit";
  return out.str();
}

std::string words(const protocols::Limits& spec) {
  return "limits: " + std::to_string(spec.series) + " series from " + level_text(spec.low) +
         " to " + level_text(spec.high) + " and back, steps of " + level_text(spec.step);
}

std::string words(const protocols::Asked& spec) {
  return "a program is asked for levels from " + level_text(spec.min) + " to " +
         level_text(spec.max) + " (--ask); ends after " + std::to_string(spec.stop_trials) +
         " trials";
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

struct RecoveredProcedure {
  const protocols::TaskBlock* block;
  std::size_t number;  ///< from 1, within the block
  protocols::PsychometricParticipant participant;
  double truth;  ///< a level
  protocols::Recovery recovery;
};

/// QUEST+ is tried with a participant that fits its model: of its function, in the middle of its
/// grids.
protocols::PsychometricParticipant participant_for(const protocols::Protocol& protocol,
                                                   const protocols::TaskBlock& block,
                                                   const protocols::ProcedureSpec& procedure) {
  protocols::PsychometricParticipant participant = protocols::typical_participant(protocol, block);
  if (const auto* quest = std::get_if<protocols::QuestPlus>(&procedure)) {
    const auto middle = [](const protocols::ParameterGrid& grid) {
      return grid.values[grid.values.size() / 2];
    };
    participant.function = quest->function;
    participant.parameters = {middle(quest->threshold), middle(quest->slope),
                              quest->guess.values.front(), quest->lapse.values.front()};
  }
  return participant;
}

bool has_no_estimate(const protocols::ProcedureSpec& spec) {
  return std::holds_alternative<protocols::ConstantStimuli>(spec) || protocols::is_asked(spec) ||
         !protocols::ranges_of(spec).empty();
}

std::vector<RecoveredProcedure> recovered(const protocols::Protocol& protocol, int participants,
                                          std::uint64_t seed) {
  std::vector<RecoveredProcedure> all;
  for (const protocols::TaskBlock& block : protocol.blocks) {
    for (std::size_t i = 0; i < block.procedures.size(); ++i) {
      const protocols::ProcedureSpec& procedure = block.procedures[i];
      if (block.practice || has_no_estimate(procedure)) continue;
      const auto participant = participant_for(protocol, block, procedure);
      all.push_back({&block, i + 1, participant, protocols::true_threshold(procedure, participant),
                     protocols::simulate_recovery(procedure, participant, participants, seed)});
    }
  }
  if (all.empty())
    throw UsageError(
        "--recover: expected a protocol of version 2 with a staircase, QUEST+ or limits of one "
        "dimension");
  return all;
}

std::string table_text(const std::vector<RecoveredProcedure>& all, int participants,
                       std::uint64_t seed) {
  std::string text = std::to_string(participants) +
                     " SIMULATED participants whose function is known, seed " +
                     std::to_string(seed) + "; bias and spread on the scale of the procedure\n";
  for (const RecoveredProcedure& one : all) {
    std::array<char, 300> line{};
    std::snprintf(line.data(), line.size(),
                  "%s, %s\n  true threshold %.6g: bias %.4g (standard error %.2g), spread %.4g, "
                  "%.1f trials, %d without an estimate\n",
                  one.block->name.c_str(),
                  in_words(one.block->procedures[one.number - 1]).substr(0, 150).c_str(), one.truth,
                  one.recovery.bias, one.recovery.bias_se, one.recovery.spread,
                  one.recovery.mean_trials, one.recovery.without_estimate);
    text += line.data();
  }
  return text;
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

std::string task_schedule_text(const protocols::Protocol& protocol, int participant,
                               const std::string& format) {
  const std::vector<protocols::Trial> trials = example_trials(protocol, participant);
  if (format == "csv") return csv_text(protocol, participant, trials);
  if (format == "json") return json_text(protocol, participant, trials);
  return table_text(protocol, trials);
}

std::string groups_in_words(const protocols::Protocol& protocol) {
  const GroupAssignment& groups = protocol.groups;
  if (!groups.any()) return "";
  const auto listed = [](const std::vector<std::string>& all) {
    std::string out;
    for (const std::string& name : all) out += (out.empty() ? "" : ", ") + name;
    return out;
  };
  const std::string masks = groups.masked() ? " (masked as " + listed(groups.listed()) + ")" : "";
  const std::string names = listed(groups.unmasked().names) + masks;
  switch (groups.rule) {
    case GroupAssignment::Rule::balanced:
      return names + ": in turn by participant number";
    case GroupAssignment::Rule::blocked:
      return names + ": in permuted blocks with " + std::to_string(groups.block) + " of each";
    case GroupAssignment::Rule::given:
      break;
  }
  return names + ": chosen by the experimenter";
}

std::string in_words(const protocols::ProcedureSpec& procedure) {
  return std::visit([](const auto& spec) { return words(spec); }, procedure);
}

std::vector<std::string> in_words(const protocols::Protocol& protocol,
                                  const protocols::TaskBlock& block) {
  const auto name = [&](int i) { return protocol.stimuli[static_cast<std::size_t>(i)].name; };
  std::string head = std::string(to_string(block.task)) + " ";
  std::vector<std::string> shown;
  for (const int stimulus : block.stimuli) {
    const std::string plain = base_name(name(stimulus));
    if (std::ranges::find(shown, plain) == shown.end()) shown.push_back(plain);
  }
  for (std::size_t i = 0; i < shown.size(); ++i) head += (i > 0 ? ", " : "") + shown[i];
  if (block.standard) head += " with " + name(*block.standard);
  if (block.task == protocols::TaskKind::compare)
    head += ", " + std::to_string(block.intervals) + " intervals";
  if (block.level) head += "; " + block.level->pointer + " varies";
  for (const protocols::LevelDimension& one : block.dimensions)
    head += (&one == &block.dimensions.front() ? "; " : ", ") + one.name + " (" +
            one.target.pointer + (block.standard ? std::string(" of ") + to_string(one.of) : "") +
            ")";
  if (!block.dimensions.empty()) head += " vary";
  if (block.cell) {
    const CellName cell = cell_name(name(block.stimuli.front()));
    for (const auto& [factor, level] : cell.levels) head += "; " + factor + " " + level;
  } else if (!block.factors.empty()) {
    head += "; mixed:";
    for (const protocols::CrossedFactor& crossed : block.factors) {
      const protocols::Factor& factor = protocol.factors[crossed.factor];
      head += (&crossed == &block.factors.front() ? " " : " x ") + factor.name + " (";
      for (const std::size_t level : crossed.levels)
        head += (level == crossed.levels.front() ? "" : ", ") + factor.levels[level].name;
      head += ")";
    }
    if (block.cells_share_tracks) head += ", tracks shared by all cells";
  }
  if (block.reaching) {
    const protocols::ReachingSpec& reaching = *block.reaching;
    head += "; " + std::to_string(reaching.targets.size()) +
            (reaching.targets.size() == 1 ? " target" : " targets");
    if (reaching.most_time)
      head += " in " + level_text(*reaching.least_time) + " to " + level_text(*reaching.most_time) +
              " s";
    if (reaching.clamp_share > 0)
      head += "; " + level_text(100 * reaching.clamp_share) + " % clamp trials";
    if (reaching.catch_share > 0)
      head += "; " + level_text(100 * reaching.catch_share) + " % catch trials";
  }
  if (block.catch_trials > 0)
    head += "; " + level_text(100 * block.catch_trials) + " % catch trials";
  if (block.practice) head += "; practice";
  head += "; " + std::string(protocols::is_adaptive(block) ? "at most " : "") +
          std::to_string(protocols::most_trials_of(block)) + " trials";
  const long long expected = protocols::expected_trials_of(block);
  if (expected != protocols::most_trials_of(block))
    head += ", usually about " + std::to_string(expected);
  std::vector<std::string> lines{head};
  for (const protocols::ProcedureSpec& procedure : block.procedures)
    lines.push_back(in_words(procedure));
  return lines;
}

std::vector<std::string> keyboard_parts(const protocols::Protocol& protocol) {
  constexpr std::size_t kButtons = 8;
  std::vector<std::string> parts;
  for (const protocols::TaskBlock& block : protocol.blocks) {
    if (block.answers.empty()) parts.push_back("numbers of '" + block.name + "'");
    if (block.answers.size() > kButtons) parts.push_back("answers to '" + block.name + "'");
    if (block.confidence && block.confidence->scale.size() > kButtons)
      parts.push_back("confidence of '" + block.name + "'");
  }
  for (const protocols::PageSpec& page : protocol.pages) {
    for (const protocols::PageItem& item : page.items) {
      const bool typed = item.kind == protocols::PageItem::Kind::text ||
                         item.kind == protocols::PageItem::Kind::number;
      if (typed || item.choices.size() > kButtons)
        parts.push_back("'" + item.name + "' of page '" + page.name + "'");
    }
  }
  return parts;
}

int comparison_interval(const protocols::TaskBlock& block, const protocols::Trial& trial) {
  if (block.task != protocols::TaskKind::compare) return 0;
  for (std::size_t i = 0; i < trial.intervals.size(); ++i) {
    if (!trial.intervals[i].standard) return static_cast<int>(i) + 1;
  }
  return 0;
}

std::string recovery_text(const protocols::Protocol& protocol, int participants, std::uint64_t seed,
                          const std::string& format) {
  const std::vector<RecoveredProcedure> all = recovered(protocol, participants, seed);
  if (format == "table") return table_text(all, participants, seed);
  const std::vector<std::string> columns{
      "block", "procedure", "participants", "seed",        "true_threshold",
      "bias",  "bias_se",   "spread",       "mean_trials", "without_estimate"};
  output::CsvText csv(columns, "\r\n");
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const RecoveredProcedure& one : all) {
    const protocols::Recovery& r = one.recovery;
    csv << one.block->name << static_cast<int>(one.number) << participants << std::to_string(seed)
        << one.truth << r.bias << r.bias_se << r.spread << r.mean_trials << r.without_estimate;
    csv.end_row();
    rows.push_back({{"block", one.block->name},
                    {"procedure", one.number},
                    {"true_threshold", one.truth},
                    {"slope", one.participant.parameters.slope},
                    {"guess", one.participant.parameters.guess},
                    {"lapse", one.participant.parameters.lapse},
                    {"bias", r.bias},
                    {"bias_se", r.bias_se},
                    {"spread", r.spread},
                    {"mean_trials", r.mean_trials},
                    {"without_estimate", r.without_estimate}});
  }
  if (format == "csv") return csv.text();
  const nlohmann::ordered_json document{{"protocol", protocol.name},
                                        {"simulated", true},
                                        {"participants", participants},
                                        {"seed", seed},
                                        {"procedures", rows}};
  return document.dump(1) + "\n";
}

}  // namespace palpate::runner::study
