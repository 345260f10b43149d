#include "analysis/statistics/cue_study.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "data/base/json_text.h"

namespace palpate::analysis {
namespace {

using nlohmann::json;

/// The member of an array of objects that has this name.
const json& named(const json& list, const std::string& name) {
  static const json kNone = json::object();
  const auto found =
      std::ranges::find_if(list, [&](const json& one) { return one.value("name", "") == name; });
  return found != list.end() ? *found : kNone;
}

}  // namespace

std::optional<CueDesign> read_cue_design(const std::string& text) {
  const json protocol = json_or_discarded(text);
  if (!protocol.is_object() || !protocol.contains("cues")) return std::nullopt;
  const json& cues = protocol.at("cues");
  const json& blocks = protocol.at("blocks");
  CueDesign out;
  out.haptic = cues.at("haptic");
  out.visual = cues.at("visual");
  const json& haptic = named(blocks, out.haptic);
  out.level_path = haptic.at("level").at("path");
  out.asks_smaller = haptic.value("asks", "larger") == "smaller";
  const bool by_give = cues.at("conflict") == "/seen/give_stiffness_n_per_m";
  for (const json& name : cues.at("both")) {
    CueDesign::Both& both = out.both.emplace_back();
    both.block = name;
    const json& standard = named(protocol.at("stimuli"), named(blocks, both.block).at("standard"));
    const json seen = standard.value("seen", json::object());
    both.ratio = seen.value("size_ratio", 1.0);
    if (by_give) both.seen = seen.at("give_stiffness_n_per_m").get<double>();
  }
  return out;
}

std::vector<CueAnswers> cue_answers(const StudyTable& table, const CueDesign& design) {
  std::vector<CueAnswers> out;
  std::map<std::string, std::size_t> places;
  for (const StudyTrial& trial : table.trials) {
    if (trial.task != "compare" || trial.practice || !trial.answered || !trial.level) continue;
    const auto both = std::ranges::find(design.both, trial.block_name, &CueDesign::Both::block);
    const bool haptic = trial.block_name == design.haptic,
               visual = trial.block_name == design.visual;
    if (!haptic && !visual && both == design.both.end()) continue;
    const auto [place, is_new] = places.try_emplace(trial.participant, out.size());
    if (is_new) out.emplace_back().participant = trial.participant;
    CueAnswers& answers = out[place->second];
    const LevelCount count{*trial.level, 1, trial.success != design.asks_smaller ? 1 : 0};
    if (haptic) answers.haptic.push_back(count);
    if (visual) answers.visual.push_back(count);
    if (both == design.both.end() || !trial.standard_level) continue;
    auto block = std::ranges::find(answers.both, trial.block_name, &CueBlock::name);
    if (block == answers.both.end()) {
      const double felt = *trial.standard_level, seen = both->seen.value_or(felt * both->ratio);
      answers.both.push_back({trial.block_name, seen - felt, (seen + felt) / 2, {}});
      block = std::prev(answers.both.end());
    }
    block->counts.push_back(count);
  }
  for (CueAnswers& answers : out) {
    answers.haptic = sum_by_level(std::move(answers.haptic));
    answers.visual = sum_by_level(std::move(answers.visual));
    for (CueBlock& block : answers.both) block.counts = sum_by_level(std::move(block.counts));
    std::ranges::sort(answers.both, {}, &CueBlock::conflict);
  }
  return out;
}

}  // namespace palpate::analysis
