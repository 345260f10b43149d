#include "runner/commands/plan/plan_cues.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include "analysis/report/report.h"
#include "analysis/statistics/cue_plan.h"
#include "analysis/text.h"
#include "runner/output/progress_line.h"
#include "runner/usage_error.h"

namespace palpate::runner::commands {
namespace {

using analysis::CuePlanResult;
using analysis::CuePlanSettings;
using analysis::fixed;

std::size_t count_of(const char* option, const std::string& text, std::size_t least,
                     std::size_t most) {
  std::size_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < least || value > most)
    throw UsageError(std::string("--") + option + ": with --cues expected one whole number from " +
                     std::to_string(least) + " to " + std::to_string(most) + ", found '" +
                     printable(text, 60) + "'");
  return value;
}

double share_of(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value >= 0.001 && value <= 1))
    throw UsageError(
        "--weber: with --cues expected FELT,SEEN: standard deviations of a single "
        "estimate as shares of the standard, 0.001 to 1, found '" +
        printable(text, 60) + "'");
  return value;
}

CuePlanSettings cue_settings(const std::string& weber, const PlanOptions& options,
                             const boost::program_options::variables_map& values) {
  CuePlanSettings out;
  const std::size_t comma = weber.find(',');
  out.haptic = share_of(weber.substr(0, comma));
  out.visual = share_of(comma == std::string::npos ? "" : weber.substr(comma + 1));
  if (!values["participants"].defaulted())
    out.participants = count_of("participants", options.participants, 2, 1000);
  if (!values["trials"].defaulted()) out.trials = count_of("trials", options.trials, 2, 1000);
  if (values.count("studies")) out.studies = count_of("studies", options.studies, 10, 100'000);
  out.seed = options.seed;
  out.jobs = std::max(1U, std::thread::hardware_concurrency());
  if (values.count("jobs")) out.jobs = count_of("jobs", options.jobs, 1, 256);
  return out;
}

std::string percent_of(double share) { return fixed(100 * share, 1) + " %"; }

/// How to make both cues alike.
std::string advice(const CuePlanSettings& settings) {
  constexpr double kSize = 0.055, kDistance = 0.5;  // m, for an example
  if (settings.visual > settings.haptic)
    return "The seen is the worse cue: draw it larger, nearer or with more contrast, or take "
           "blur_deg away.";
  const double needed =
      std::sqrt(settings.haptic * settings.haptic - settings.visual * settings.visual);
  const double blur = std::atan(needed * kSize / kDistance) * 180 / std::numbers::pi;
  return "Blur what is seen until both are alike: blur_deg = atan(" + fixed(needed, 3) +
         " size / distance of the eyes), for 55 mm at 0.5 m " + fixed(blur, 2) + " degrees.";
}

nlohmann::ordered_json plan_of(const CuePlanSettings& settings, double ratio,
                               const std::vector<CuePlanResult>& results) {
  nlohmann::ordered_json out{{"version", 1},
                             {"weber_haptic", settings.haptic},
                             {"weber_visual", settings.visual},
                             {"ratio", ratio},
                             {"gain_over_better", analysis::gain_over_better(ratio)},
                             {"participants", settings.participants},
                             {"levels", settings.levels},
                             {"trials_a_level", settings.trials},
                             {"studies", settings.studies},
                             {"seed", settings.seed},
                             {"people", nlohmann::ordered_json::array()}};
  for (const CuePlanResult& one : results)
    out["people"].push_back({{"rule", to_string(one.rule)},
                             {"weight_difference", one.weight_difference},
                             {"log_jnd_by_predicted", one.jnd_by_predicted},
                             {"weight_rejected", one.weight_rejected},
                             {"jnd_rejected", one.jnd_rejected},
                             {"below_better", one.below_better},
                             {"rule_has_least_aic", one.best_model}});
  return out;
}

}  // namespace

int print_cue_plan(const std::string& weber, const PlanOptions& options,
                   const boost::program_options::variables_map& values, output::Outputs& outputs) {
  for (const char* other : {"db", "csv", "effect", "gain-sd", "residual-sd", "figure", "reuse",
                            "groups", "coverage", "jnd-effect", "pse-effect"}) {
    if (values.count(other)) throw UsageError(std::string("--") + other + ": not with --cues");
  }
  CuePlanSettings settings = cue_settings(weber, options, values);
  const double ratio =
      std::max(settings.haptic, settings.visual) / std::min(settings.haptic, settings.visual);
  const double gain = analysis::gain_over_better(ratio);
  std::cout << analysis::paragraph_text("Single estimates: felt " + percent_of(settings.haptic) +
                                        ", seen " + percent_of(settings.visual) +
                                        " of the standard, a ratio of " + fixed(ratio, 2) +
                                        ". Optimal people with both cues have a JND " +
                                        percent_of(gain) + " below that of the better cue.");
  std::vector<CuePlanResult> results;
  const bool promised = ratio <= analysis::kMostCueRatio;
  if (promised) {
    output::ProgressLine progress("simulated studies");
    settings.progress = [&progress](double share) { progress.show(share); };
    results = analysis::plan_cues(settings);
    progress.clear();
    analysis::Table table;
    table.caption = std::to_string(settings.studies) + " simulated studies of " +
                    std::to_string(settings.participants) + " people, " +
                    std::to_string(settings.trials) + " trials at each of " +
                    std::to_string(settings.levels) + " levels in five blocks";
    table.header = {"people use", "weight off by",       "found",      "JND by predicted",
                    "found",      "below better: found", "model found"};
    for (const CuePlanResult& one : results)
      table.rows.push_back(
          {to_string(one.rule), fixed(one.weight_difference, 3), percent_of(one.weight_rejected),
           percent_of(std::expm1(one.jnd_by_predicted)), percent_of(one.jnd_rejected),
           percent_of(one.below_better), percent_of(one.best_model)});
    table.notes = {
        "weight off by: mean of observed less predicted weight. found: share of studies "
        "whose t-test over people finds it at 5 %; of optimal people, the first two are "
        "false alarms. model found: the summed AIC is the least for the people's own "
        "rule. Numbers of simulated people, not a promise."};
    std::cout << "\n" << analysis::table_text(table);
  } else {
    std::cout << analysis::paragraph_text(
        "Beyond a ratio of 2 the gain is so small that no number of people is promised to show "
        "it. " +
        advice(settings));
  }
  if (outputs.wanted("json")) outputs.put("json", plan_of(settings, ratio, results).dump(2) + "\n");
  outputs.write();
  return promised ? 0 : 1;
}

}  // namespace palpate::runner::commands
