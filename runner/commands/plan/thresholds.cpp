#include "runner/commands/plan/thresholds.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iostream>
#include <utility>

#include "analysis/statistics/interval_coverage.h"
#include "analysis/statistics/threshold_plan.h"
#include "runner/commands/shared/progress_line.h"

namespace palpate::runner {

namespace po = boost::program_options;

namespace {

void require(bool right, const char* option, const char* expected) {
  if (!right) throw UsageError(std::string("--") + option + ": expected " + expected);
}

analysis::ThresholdStudy study_of(const ThresholdOptions& thresholds, const PlanOptions& options) {
  const auto within = [](double value, double low, double high) {
    return value >= low && value <= high;  // false for what is no number
  };
  require(within(thresholds.effect, -400, 95), "jnd-effect", "percent from -400 to 95");
  require(within(thresholds.weber, 0.001, 1), "weber", "a JND / standard from 0.001 to 1");
  require(within(thresholds.participant_sd, 0, 2), "jnd-sd", "0 to 2");
  require(within(thresholds.effect_sd, 0, 2), "jnd-effect-sd", "0 to 2");
  require(within(thresholds.pse_sd, 0, 5), "pse-sd", "0 to 5 JNDs");
  require(within(thresholds.reach, 0.5, 10), "reach", "0.5 to 10 JNDs");
  require(within(options.alpha, 1e-6, 0.5), "alpha", "0.000001 to 0.5");
  require(within(options.power, 0.01, 0.999), "power", "0.01 to 0.999");
  analysis::ThresholdStudy study;
  study.weber_fraction = thresholds.weber;
  study.ratio = 1 - thresholds.effect / 100;
  study.participant_sd = thresholds.participant_sd;
  study.effect_sd = thresholds.effect_sd;
  study.pse_sd = thresholds.pse_sd;
  study.reach = thresholds.reach;
  study.alpha = options.alpha;
  return study;
}

/// At most twelve numbers of participants over the range.
std::vector<std::size_t> numbers_over(std::size_t least, std::size_t most) {
  constexpr std::size_t kMost = 12;
  std::vector<std::size_t> numbers;
  const std::size_t steps = std::min(kMost - 1, most - least);
  for (std::size_t i = 0; i <= steps; ++i)
    numbers.push_back(steps == 0 ? least : least + i * (most - least) / steps);
  return numbers;
}

}  // namespace

void add_threshold_options(CommandLine& line, ThresholdOptions& options) {
  auto add = line.options.add_options();
  add("jnd-effect", po::value(&options.effect)->value_name("PERCENT"),
      "of thresholds instead of times: how much smaller the JND is with the second renderer or "
      "condition; --trials are those of a participant with each, --participants a range");
  add("weber", po::value(&options.weber)->default_value(0.1, "0.1")->value_name("W"),
      "JND / standard with the first condition");
  add("jnd-sd", po::value(&options.participant_sd)->default_value(0.3, "0.3")->value_name("SD"),
      "of participants' log JND");
  add("jnd-effect-sd", po::value(&options.effect_sd)->default_value(0.2, "0.2")->value_name("SD"),
      "of participants' log ratio of their JNDs");
  add("pse-sd", po::value(&options.pse_sd)->default_value(0.5, "0.5")->value_name("SD"),
      "of participants' PSE, in JNDs");
  add("reach", po::value(&options.reach)->default_value(2.5, "2.5")->value_name("JNDS"),
      "how far the levels reach from the standard");
  add("coverage",
      "how often the 95 % intervals of thresholds, slopes and lapses hold the truth, after each "
      "procedure, with lapses and without; takes --studies (200), --seed, --jobs, --json");
}

void print_coverage(const PlanOptions& options, const po::variables_map& values, Outputs& outputs) {
  for (const char* other :
       {"db", "csv", "effect", "gain-sd", "residual-sd", "figure", "reuse", "jnd-effect"}) {
    if (values.count(other))
      throw UsageError(std::string("--") + other + ": is of a plan; not with --coverage");
  }
  PlanOptions own = options;
  std::size_t studies = 200;
  if (values.count("studies")) {
    const char* const end = own.studies.data() + own.studies.size();
    const auto [stop, error] = std::from_chars(own.studies.data(), end, studies);
    require(error == std::errc() && stop == end && studies >= 1 && studies <= 100'000, "studies",
            "a whole number from 1 to 100000");
    own.studies = "100";  // of plans, which are not made
  }
  const analysis::PowerSettings asked = settings_of(own, values).simulation;
  analysis::CoverageSettings settings;
  settings.studies = studies;
  settings.seed = asked.seed;
  settings.jobs = asked.jobs;
  ProgressLine progress("simulated studies");
  settings.progress = [&progress](double share) { progress.show(share); };
  const auto results = analysis::interval_coverage(settings);
  progress.clear();
  if (outputs.wanted("json")) outputs.put("json", analysis::coverage_json(results, settings));
  outputs.write();
  std::cout << analysis::coverage_text(results, settings);
}

void plan_thresholds_of(const ThresholdOptions& thresholds, const PlanOptions& options,
                        const po::variables_map& values, Outputs& outputs) {
  for (const char* other : {"db", "csv", "effect", "gain-sd", "residual-sd", "figure", "reuse"}) {
    if (values.count(other))
      throw UsageError(std::string("--") + other + ": is of response times; not with --jnd-effect");
  }
  const analysis::ThresholdStudy study = study_of(thresholds, options);
  analysis::ThresholdPlanSettings settings;
  PlanOptions own = options;
  if (values["trials"].defaulted()) own.trials = "70,140,280";
  if (values["participants"].defaulted()) own.participants = "4-40";
  const analysis::PlanSettings asked = settings_of(own, values);
  settings.trials = asked.trials;
  settings.participants = numbers_over(asked.min_participants, asked.max_participants);
  constexpr std::size_t kStudies = 500;
  settings.studies = values.count("studies") ? asked.simulation.studies : kStudies;
  settings.seed = own.seed;
  settings.power = own.power;
  std::sort(settings.trials.begin(), settings.trials.end());
  ProgressLine progress("simulated studies");
  settings.progress = [&progress](double share) { progress.show(share); };
  const analysis::ThresholdPlan plan = analysis::plan_thresholds(study, std::move(settings));
  progress.clear();
  if (outputs.wanted("json")) outputs.put("json", analysis::threshold_plan_json(plan));
  outputs.write();
  std::cout << analysis::threshold_plan_text(plan);
}

}  // namespace palpate::runner
