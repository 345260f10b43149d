#include <iostream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "analysis/figures/figure_svg.h"
#include "analysis/report/plan_report.h"
#include "protocols/json_document.h"
#include "runner/commands/plan/options.h"
#include "runner/commands/plan/thresholds.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/outputs.h"
#include "runner/commands/shared/progress_line.h"

namespace palpate::runner {

namespace po = boost::program_options;

namespace {

/// \throws UsageError
void read_known(const std::string& file, const analysis::StudyModel& model,
                analysis::PlanSettings& settings) {
  try {
    for (analysis::PlanPoint& point :
         analysis::read_plan_points(protocols::read_text_file(file), model, settings))
      settings.known.push_back(std::move(point));
  } catch (const std::invalid_argument& error) {
    throw UsageError("--reuse " + file + ": " + error.what());
  }
}

}  // namespace

int plan_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      R"(palpate plan (--db FILE | --csv FILE | --gain-sd SD --residual-sd SD) [--effect SHAPE=PERCENT,...]
       palpate plan --jnd-effect PERCENT [--weber W]
       palpate plan --coverage [--studies N] [--seed S])";
  line.summary =
      "Sample size planning: the number of participants and trials that find an effect with a\n"
      "given power. Studies are simulated from the mixed model fitted to a pilot, or from given\n"
      "standard deviations, and tested as analyze tests them. Standard deviations are of the\n"
      "natural log of the time.";
  line.example = R"(  palpate plan --db pilot.db --effect cone=22,cube=11 --power 0.9
  palpate plan --gain-sd 0.15 --residual-sd 0.5 --effect cone=15 --participants 4-60 \
      --trials 20,40 --json plan.json --figure power.svg
  palpate plan --jnd-effect 20 --weber 0.1 --trials 70,140 --participants 6-30   (thresholds)
  palpate plan --coverage --studies 500 --seed 1)";
  PlanOptions options;
  add_plan_options(line, options);
  ThresholdOptions thresholds;
  add_threshold_options(line, thresholds);
  auto add = line.options.add_options();
  add("jobs", po::value(&options.jobs)->value_name("J"), "threads; default: one a core");
  add("json", po::value(&options.json)->value_name("FILE"), "write every number as JSON");
  add("figure", po::value(&options.figure)->value_name("FILE.svg"), "write the power curve");
  add("reuse", po::value(&options.reuse)->composing()->value_name("FILE"),
      "what --json wrote for the same effects and standard deviations: powers in it are not "
      "simulated again; can be given several times");
  add("force", "replace existing files");
  const auto values = line.parse(args);
  if (!values) return 0;
  if (!options.database.empty() && !options.csv.empty()) {
    throw UsageError("expected one of --db FILE and --csv FILE\nUsage: " + line.usage +
                     "\nMore: add --help");
  }
  Outputs outputs(*values, {"json", "figure"}, {"db", "csv"});
  if (values->count("coverage")) {
    print_coverage(options, *values, outputs);
    return 0;
  }
  if (values->count("jnd-effect")) {
    plan_thresholds_of(thresholds, options, *values, outputs);
    return 0;
  }
  analysis::PlanSettings settings = settings_of(options, *values);
  analysis::Pilot pilot = starting_point(options, *values);
  analysis::StudyModel model = model_of(pilot, options, *values);

  for (const std::string& file : options.reuse) read_known(file, model, settings);

  const std::string curves = std::to_string(settings.trials.size());
  const auto studies = static_cast<double>(settings.simulation.studies);
  ProgressLine progress("curve 1 of " + curves);
  settings.simulation.progress = [&progress, studies](std::size_t done) {
    progress.show(static_cast<double>(done) / studies);
  };
  analysis::Plan plan =
      analysis::make_plan(std::move(model), std::move(settings), std::move(pilot.notes),
                          [&](std::size_t curve, std::size_t point) {
                            progress.begin("curve " + std::to_string(curve) + " of " + curves +
                                           ", point " + std::to_string(point));
                          });
  progress.clear();
  plan.label = std::move(pilot.label);
  if (outputs.wanted("json")) outputs.put("json", analysis::plan_json(plan));
  if (outputs.wanted("figure"))
    outputs.put("figure",
                analysis::figure_svg(analysis::plan_figure(plan), analysis::light_palette()));
  outputs.write();
  std::cout << analysis::plan_text(plan);
  return 0;
}

}  // namespace palpate::runner
