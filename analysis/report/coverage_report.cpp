#include "analysis/report/coverage_report.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "analysis/text.h"

namespace palpate::analysis {
namespace {

std::string percent_of(std::size_t count, std::size_t studies) {
  if (studies == 0) return "-";
  return fixed(100 * static_cast<double>(count) / static_cast<double>(studies), 1);
}

std::string counts_text(const CoverageCounts& counts, std::size_t studies) {
  return pad_left(percent_of(counts.threshold, studies), 7) +
         pad_left(percent_of(counts.slope, studies), 7) +
         pad_left(percent_of(counts.lapse, studies), 7);
}

nlohmann::ordered_json counts_json(const CoverageCounts& counts, std::size_t studies) {
  nlohmann::ordered_json out;
  for (const auto& [name, count] : {std::pair{"threshold", counts.threshold},
                                    {"slope", counts.slope},
                                    {"lapse", counts.lapse}}) {
    const Interval ends = coverage_interval(count, studies);
    out[name] = {{"held", count}, {"ci95", {ends.low, ends.high}}};
  }
  return out;
}

std::string tally_text(const GroupTally& sum) {
  return pad_left(fixed(sum.bias(), 3), 9) + pad_left(percent_of(sum.held, sum.results), 7);
}

nlohmann::ordered_json tally_json(const GroupTally& sum) {
  const Interval ends = coverage_interval(sum.held, sum.results);
  return {{"n", sum.results},   {"bias", sum.bias()},
          {"held", sum.held},   {"ci95", {ends.low, ends.high}},
          {"n_open", sum.open}, {"n_not_determined", sum.both_open}};
}

nlohmann::ordered_json difference_json(const GroupTally& sum) {
  nlohmann::ordered_json out = tally_json(sum);
  out["n_found"] = sum.found;
  return out;
}

nlohmann::ordered_json group_coverage_json(const std::vector<GroupCoverage>& results) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const GroupCoverage& one : results)
    out.push_back({{"design", one.study.name},
                   {"n_studies", one.studies},
                   {"location", tally_json(one.location)},
                   {"log_width", tally_json(one.log_width)},
                   {"location_difference", difference_json(one.location_difference)},
                   {"log_width_difference", difference_json(one.log_width_difference)}});
  return out;
}

}  // namespace

std::string group_coverage_text(const std::vector<GroupCoverage>& results,
                                const GroupCoverageSettings& settings) {
  std::string text =
      "\nThe group's model, " + std::to_string(settings.studies) + " studies per line, seed " +
      std::to_string(settings.seed) +
      ". Bias of the group's value, % of 95 % intervals that hold it; of the\ndifference between "
      "renderers (none), % of intervals that hold it and % of tests with p < 0.05\n\n" +
      pad_right("", 68) + "location      log width     location   log ratio     not\n" +
      pad_right("", 68) + "bias   holds   bias   holds holds found holds found determined\n";
  for (const GroupCoverage& one : results) {
    text +=
        "  " + pad_right(one.study.name, 62) + tally_text(one.location) + tally_text(one.log_width);
    for (const GroupTally* sum : {&one.location_difference, &one.log_width_difference})
      text += pad_left(percent_of(sum->held, sum->results), 6) +
              pad_left(percent_of(sum->found, sum->results), 6);
    text +=
        pad_left(percent_of(one.log_width_difference.both_open, one.log_width_difference.results),
                 6) +
        "\n";
  }
  return text +
         "\nLocations of forced choice and yes/no are natural logarithms. Not determined: both "
         "ends of "
         "the interval\nof the ratio of JNDs (or widths) are open.\n";
}

std::string coverage_text(const std::vector<CoverageResult>& results,
                          const CoverageSettings& settings) {
  std::string text = "SIMULATED STUDIES\n\nCoverage of 95 % intervals, in % of " +
                     std::to_string(settings.studies) + " studies per line, seed " +
                     std::to_string(settings.seed) + "\n\n" + std::string(55, ' ') +
                     "likelihood           Bayes\n" + pad_right("", 43) + " lapses" +
                     "  thresh  slope  lapse thresh  slope  lapse  bad fit  open\n";
  std::string task;
  for (const CoverageResult& one : results) {
    if (one.design.task != task) text += one.design.task + "\n";
    task = one.design.task;
    text += "  " + pad_right(one.design.procedure, 41) +
            pad_left(fixed(one.design.truth.parameters.lapse, 2), 7) + " " +
            counts_text(one.likelihood, one.studies) + counts_text(one.bayes, one.bayes_studies) +
            pad_left(percent_of(one.called_bad, one.studies), 9) +
            pad_left(percent_of(one.open, one.studies), 6) + "\n";
  }
  const auto held =
      static_cast<std::size_t>(std::lround(0.95 * static_cast<double>(settings.studies)));
  const Interval noise = coverage_interval(held, settings.studies);
  return text + "\nThe simulation's own 95 % interval about 95 %: " + fixed(100 * noise.low, 1) +
         " to " + fixed(100 * noise.high, 1) +
         " %. Bad fit: goodness of fit has p <= 0.05\n(5 % if the model is correct). Open: the "
         "interval of the threshold is unbounded on one side. Lapses: at both\nasymptotes if "
         "levels lie "
         "on both sides of the standard. The JND follows from the slope there, and from the "
         "threshold\nin a forced choice. Staircases and QUEST+ have 140 trials. Bayes of yes/no: "
         "one study in four.\n";
}

std::string coverage_json(const std::vector<CoverageResult>& results,
                          const CoverageSettings& settings,
                          const std::vector<GroupCoverage>& groups) {
  nlohmann::ordered_json out{{"version", 1},
                             {"simulated", true},
                             {"seed", settings.seed},
                             {"n_studies", settings.studies},
                             {"n_refits", settings.simulations},
                             {"designs", nlohmann::ordered_json::array()}};
  for (const CoverageResult& one : results) {
    const protocols::PsychometricParameters& truth = one.design.truth.parameters;
    out["designs"].push_back({{"task", one.design.task},
                              {"procedure", one.design.procedure},
                              {"threshold", truth.threshold},
                              {"slope", truth.slope},
                              {"guess", truth.guess},
                              {"lapse", truth.lapse},
                              {"mean_trials", one.mean_trials},
                              {"n_fitted", one.studies},
                              {"n_without_fit", one.unfitted},
                              {"n_open", one.open},
                              {"n_with_posterior", one.bayes_studies},
                              {"n_called_bad", one.called_bad},
                              {"median_slope_bias", one.slope_bias},
                              {"likelihood", counts_json(one.likelihood, one.studies)},
                              {"bayes", counts_json(one.bayes, one.bayes_studies)}});
  }
  out["group_designs"] = group_coverage_json(groups);
  return out.dump(1) + "\n";
}

}  // namespace palpate::analysis
