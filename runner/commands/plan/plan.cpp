#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include "analysis/figures/figure_svg.h"
#include "analysis/report/plan_report.h"
#include "runner/commands/plan/options.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/outputs.h"
#include "runner/commands/shared/progress_line.h"

namespace palpate::runner {

namespace po = boost::program_options;

int plan_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate plan (--db FILE | --csv FILE | --gain-sd SD --residual-sd SD) [--effect "
      "SHAPE=PERCENT,...]";
  line.summary =
      "Sample size planning: the number of participants and trials that find an effect with a\n"
      "given power. Studies are simulated from the mixed model fitted to a pilot, or from given\n"
      "standard deviations, and tested as analyze tests them. Standard deviations are of the\n"
      "natural log of the time.";
  line.example =
      "  palpate plan --db pilot.db --effect cone=22,cube=11 --power 0.9\n"
      "  palpate plan --gain-sd 0.15 --residual-sd 0.5 --effect cone=15 --participants 4-60 \\\n"
      "      --trials 20,40 --json plan.json --figure power.svg";
  PlanOptions options;
  auto add = line.options.add_options();
  add("db", po::value(&options.database)->value_name("FILE"), "a pilot's database");
  add("csv", po::value(&options.csv)->value_name("FILE"), "a pilot's trials as CSV");
  add("effect", po::value(&options.effect)->value_name("SHAPE=PERCENT,..."),
      "wanted reductions of time with the ray (of a pilot of other renderers: with its second "
      "renderer), or one number for all shapes; default for ray: the paper's, cone=22,cube=11, or "
      "where there is neither, 11");
  add("power", po::value(&options.power)->default_value(0.8, "0.8"), "wanted power");
  add("alpha", po::value(&options.alpha)->default_value(0.05, "0.05"), "of the tests, after Holm");
  add("goal", po::value(&options.goal)->default_value("all")->value_name("all|any"),
      "find every shape with an effect, or at least one");
  add("participants", po::value(&options.participants)->default_value("2-100")->value_name("A-B"),
      "range of the numbers of participants");
  add("trials", po::value(&options.trials)->default_value("10,20,40,76")->value_name("N,..."),
      "trials of each shape with each renderer; a power curve for each");
  add("test", po::value(&options.test)->default_value("paired")->value_name("paired|model"),
      "paired t-tests, or a mixed model fitted to every study (slow)");
  add("gain-sd", po::value(&options.gain_sd)->value_name("SD"),
      "of participants' gains (random slope); a pilot's unless given");
  add("shape-gain-sd", po::value(&options.shape_gain_sd)->value_name("SD"),
      "of a participant's gain for a shape beyond that; a pilot's, or 0");
  add("residual-sd", po::value(&options.residual_sd)->value_name("SD"),
      "of single trials; a pilot's unless given");
  add("intercept-sd", po::value(&options.intercept_sd)->value_name("SD"),
      "of participants; a pilot's, or 0.3 (used by --test model only)");
  add("correlation", po::value(&options.correlation)->value_name("R"),
      "of participants' intercepts and gains; a pilot's, or 0");
  add("share-used", po::value(&options.share_used)->value_name("SHARE"),
      "of trials that give a time; a pilot's, or 1");
  add("studies", po::value(&options.studies)->value_name("N"),
      "simulated for each power; default 10000, with --test model 1000");
  add("seed", po::value(&options.seed)->default_value(2000), "of the simulation");
  add("jobs", po::value(&options.jobs)->value_name("J"), "threads; default: one a core");
  add("json", po::value(&options.json)->value_name("FILE"), "write every number as JSON");
  add("figure", po::value(&options.figure)->value_name("FILE.svg"), "write the power curve");
  add("force", "replace existing files");
  const auto values = line.parse(args);
  if (!values) return 0;
  if (!options.database.empty() && !options.csv.empty()) {
    throw UsageError("expected one of --db FILE and --csv FILE\nUsage: " + line.usage +
                     "\nMore: add --help");
  }
  Outputs outputs(*values, {"json", "figure"}, {"db", "csv"});
  analysis::PlanSettings settings = settings_of(options, *values);
  analysis::Pilot pilot = starting_point(options, *values);
  analysis::StudyModel model = model_of(pilot, options, *values);

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
