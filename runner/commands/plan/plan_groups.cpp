#include "runner/commands/plan/plan_groups.h"

#include <cmath>
#include <iomanip>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "analysis/statistics/group_power.h"
#include "analysis/text.h"
#include "runner/output/progress_line.h"
#include "runner/usage_error.h"

namespace palpate::runner::commands {
namespace {

namespace po = boost::program_options;
using analysis::GroupEffects;
using analysis::GroupPower;

GroupEffects group_effects(const GroupOptions& options) {
  if (options.groups < 2 || options.groups > 12) throw UsageError("--groups: must be 2 to 12");
  for (const auto& [name, value] : {std::pair("effect-between", options.between),
                                    std::pair("effect-interaction", options.interaction)}) {
    if (!(value >= 0 && value <= 1000))
      throw UsageError(std::string("--") + name + ": must be 0 to 1000 percent");
  }
  if (options.between == 0 && options.interaction == 0)
    throw UsageError("--groups: expected --effect-between or --effect-interaction above 0 percent");
  return {static_cast<std::size_t>(options.groups), std::log1p(options.between / 100),
          std::log1p(options.interaction / 100)};
}

/// "62.5 % (+-1.0)": the share of studies that found it, and its standard error.
std::string share_text(const GroupPower& power, std::size_t found) {
  const double share = power.share(found);
  const double se = std::sqrt(share * (1 - share) / static_cast<double>(power.studies));
  return analysis::fixed(100 * share, 1) + " % (+-" + analysis::fixed(100 * se, 1) + ")";
}

nlohmann::ordered_json to_json(const GroupOptions& groups, const PlanOptions& options,
                               const std::vector<GroupPower>& powers, const GroupEffects& effects) {
  nlohmann::ordered_json out{{"version", 1},
                             {"groups", groups.groups},
                             {"effect_between_percent", groups.between},
                             {"effect_interaction_percent", groups.interaction},
                             {"power", options.power},
                             {"alpha", options.alpha},
                             {"smallest_per_group", nullptr},
                             {"points", nlohmann::ordered_json::array()}};
  for (const GroupPower& one : powers) {
    out["points"].push_back({{"per_group", one.participants},
                             {"trials_with_each_renderer", one.trials},
                             {"studies", one.studies},
                             {"power_group", one.share(one.group)},
                             {"power_interaction", one.share(one.interaction)}});
    if (out["smallest_per_group"].is_null() && reaches(one, effects, options.power))
      out["smallest_per_group"] = one.participants;
  }
  return out;
}

}  // namespace

void add_group_options(CommandLine& line, GroupOptions& options) {
  auto add = line.options.add_options();
  add("groups", po::value(&options.groups)->value_name("N"),
      "plan groups of participants; --participants is then the range of each group's number, the "
      "last group differs from the others");
  add("effect-between", po::value(&options.between)->value_name("PERCENT"),
      "longer times of that group");
  add("effect-interaction", po::value(&options.interaction)->value_name("PERCENT"),
      "longer times of that group with the second renderer against the first");
}

void print_group_plan(const GroupOptions& groups, const PlanOptions& options,
                      const po::variables_map& values, output::Outputs& outputs) {
  if (outputs.wanted("figure")) throw UsageError("--figure: not with --groups");
  const GroupEffects effects = group_effects(groups);
  const analysis::PlanSettings settings = settings_of(options, values);
  if (settings.simulation.test == analysis::StudyTest::model)
    throw UsageError("--test model: not with --groups, which are tested by analysis of variance");
  analysis::Pilot pilot = starting_point(options, values);
  const analysis::StudyModel model = model_of(pilot, options, values);
  const std::size_t trials = settings.trials.back() * model.shapes.size();
  output::ProgressLine progress("power");
  const std::vector<GroupPower> powers = analysis::plan_groups(
      model, effects, settings.min_participants, settings.max_participants, trials, settings.power,
      settings.simulation, [&progress](std::size_t participants) {
        progress.begin("power of " + std::to_string(participants) + " in each group");
      });
  progress.clear();
  if (outputs.wanted("json"))
    outputs.put("json", to_json(groups, options, powers, effects).dump(1) + "\n");
  outputs.write();

  if (!pilot.label.empty()) std::cout << pilot.label << "\n\n";
  std::cout << groups.groups << " groups, " << trials
            << " trials of a participant with each renderer; the last group's times are "
            << groups.between << " % longer";
  if (groups.interaction > 0)
    std::cout << ", with the second renderer another " << groups.interaction << " %";
  std::cout << "\n  in each group   finds the group   finds group:renderer\n";
  const GroupPower* smallest = nullptr;
  for (const GroupPower& one : powers) {
    std::cout << std::right << std::setw(15) << one.participants << std::setw(18)
              << share_text(one, one.group) << std::setw(23) << share_text(one, one.interaction)
              << "\n";
    if (smallest == nullptr && reaches(one, effects, settings.power)) smallest = &one;
  }
  if (smallest != nullptr)
    std::cout << "Fewest with a power of " << 100 * settings.power
              << " %: " << smallest->participants << " in each group.\n";
  else
    std::cout << "A power of " << 100 * settings.power << " % is not reached with up to "
              << settings.max_participants << " in each group.\n";
  for (const std::string& note : pilot.notes) std::cout << note << "\n";
}

}  // namespace palpate::runner::commands
