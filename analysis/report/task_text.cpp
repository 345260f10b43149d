#include <algorithm>
#include <cmath>
#include <string>
#include <variant>

#include "analysis/report/answer_model_report.h"
#include "analysis/report/design_report.h"
#include "analysis/report/report.h"
#include "analysis/report/task_tables.h"
#include "analysis/statistics/task_analysis.h"
#include "analysis/text.h"
#include "protocols/procedures/psychometric.h"

namespace palpate::analysis {
namespace {

std::string with_interval(double value, const Interval& interval) {
  return short_number(value) + " [" + short_number(interval.low) + ", " +
         short_number(interval.high) + "]";
}

/// Rounded to 0.01 %: searches end this close to 0.
double rounded_rate(double rate) { return std::round(rate * 1e4) / 1e4; }

std::string optional_interval(const std::optional<double>& value,
                              const std::optional<Interval>& interval) {
  if (!value) return "undefined";
  return interval ? with_interval(*value, *interval) : short_number(*value);
}

std::string detection_text(const ParticipantFunction& one) {
  if (!one.detectability.d_prime) return "";
  const auto& ends = one.detectability.d_prime_ci95;
  const std::string swapped = ends && ends->high < 0 ? " (BELOW 0: are keys swapped?)" : "";
  return ", d' " + optional_interval(one.detectability.d_prime, one.detectability.d_prime_ci95) +
         swapped + ", criterion " +
         optional_interval(one.detectability.criterion, one.detectability.criterion_ci95);
}

std::string procedure_text(const Track& track) {
  const auto& [spec, estimate, target, fitted] = *track.procedure;
  std::string text = "    track " + printable(track.name) + ", ";
  const auto* quest = std::get_if<protocols::QuestPlus>(&spec);
  text += quest != nullptr ? "QUEST+" : kind_of(spec);
  text += ": ";
  if (!estimate.threshold) {
    text += "no estimate";
  } else if (target) {
    text += short_number(*estimate.threshold) + ", mean of its reversals, converging to " +
            fixed(100 * *target, 1) + " % successes";
    if (fitted) text += "; fitted function there at " + short_number(*fitted);
  } else if (quest != nullptr) {
    text += "threshold " + short_number(*estimate.threshold) + ", slope " +
            short_number(*estimate.slope) + ", posterior means (" +
            to_string(quest->function.shape) + ", " + to_string(quest->function.scale) + ")";
  } else {
    text += short_number(*estimate.threshold) + ", mean level at which the answer changed";
  }
  text += "; " + counted(static_cast<std::size_t>(estimate.trials), "trial", "trials");
  if (estimate.reversals > 0)
    text += ", " + counted(static_cast<std::size_t>(estimate.reversals), "reversal", "reversals");
  if (estimate.at_limit > 0)
    text += ", " + std::to_string(estimate.at_limit) +
            (target ? " at an end of its range" : " series without a change");
  return text + "\n";
}

/// \param easier  of the answers
std::string reversal_text(protocols::Easier easier,
                          const std::optional<protocols::Easier>& expected) {
  const bool falls = easier == protocols::Easier::lower;
  std::string text = falls ? "successes FALL as the level rises, although "
                           : "successes RISE with the level, although ";
  text += expected ? "the task expects them to " : "those of the others ";
  return text + (falls ? "rise" : "fall") + " (are keys swapped?)";
}

std::string function_line(const ParticipantFunction& one,
                          const std::optional<protocols::Easier>& expected) {
  std::string text = "  " + pad_right(printable(one.participant), 12);
  const std::string detected = detection_text(one);
  if (!one.fit.undefined.empty())
    return text + "no function: " + one.fit.undefined + detected + "\n";
  if (one.figures.pse) {
    text += "PSE " + optional_interval(one.figures.pse, one.figures.pse_ci95);
  } else {
    text += "threshold " + with_interval(one.fit.parameters.threshold, one.fit.threshold_ci95);
  }
  if (one.figures.jnd) text += ", JND " + optional_interval(one.figures.jnd, one.figures.jnd_ci95);
  if (one.figures.weber_fraction)
    text += ", Weber fraction " + short_number(*one.figures.weber_fraction);
  text += one.fit.slope_at_bound
              ? ", slope not determined"
              : ", slope " + with_interval(one.fit.parameters.slope, one.fit.slope_ci95);
  if (one.model.lapse.free)
    text += ", lapses " + with_interval(rounded_rate(one.fit.parameters.lapse),
                                        {rounded_rate(one.fit.lapse_ci95.low),
                                         rounded_rate(one.fit.lapse_ci95.high)});
  if (one.reversed) {
    text += ", NOT COMPARED: " + reversal_text(one.model.function.easier, expected);
  } else if (!one.determined) {
    text += ", threshold NOT DETERMINED by these levels";
  }
  if (one.goodness.p) text += ", fit p " + p_text(*one.goodness.p);
  if (one.posterior.undefined.empty())
    text += "; Bayes " + with_interval(one.posterior.mean.threshold, one.posterior.threshold_ci95);
  return text + detected + "\n";
}

std::string function_text(const ParticipantFunction& one,
                          const std::optional<protocols::Easier>& expected) {
  std::string text = function_line(one, expected);
  for (const Track& track : one.tracks) {
    if (track.procedure) text += procedure_text(track);
  }
  return text;
}

std::string magnitude_text(const TaskCell& cell) {
  std::string text;
  const MagnitudeEstimation& magnitude = *cell.magnitude;
  for (const StevensLine& line : magnitude.lines) {
    text += "  " + pad_right(printable(cell.participants[line.participant]), 12);
    text += line.exponent ? "exponent " + short_number(*line.exponent) : line.undefined;
    if (line.r_squared) text += ", r2 " + short_number(*line.r_squared);
    if (line.exponent.value_or(0) < 0) text += ", numbers FALL as the level rises";
    text += "\n";
  }
  if (magnitude.exponent)
    text += "  exponent over participants " +
            optional_interval(magnitude.exponent, magnitude.exponent_ci95) + "\n";
  for (const MagnitudeMean& one : magnitude.means)
    text += "  level " + short_number(one.level) + ": geometric mean " +
            optional_interval(one.geometric_mean, one.ci95) + "\n";
  if (magnitude.without_logarithm > 0)
    text += "  " + counted(magnitude.without_logarithm, "answer", "answers") +
            " of 0 or below left out: they have no logarithm\n";
  return text;
}

std::string spread_text(const RatingSpread& spread) {
  return "median " + short_number(spread.median) + ", quartiles " +
         short_number(spread.lower_quartile) + " to " + short_number(spread.upper_quartile) +
         ", mean " + short_number(spread.mean) + " (" +
         counted(spread.ratings, "rating", "ratings") + ")\n";
}

std::string ratings_text(const TaskCell& cell) {
  const Ratings& ratings = *cell.ratings;
  if (ratings.spread.ratings == 0) return "  no ratings with a number\n";
  std::string text;
  for (const ParticipantRatings& one : ratings.participants)
    text += "  " + pad_right(printable(cell.participants[one.participant]), 12) +
            spread_text(one.spread);
  for (const RatingStep& step : ratings.steps)
    text += "  " + short_number(step.number) +
            (step.label.empty() ? "" : " " + printable(step.label, 60)) + ": " +
            fixed(100 * step.share, 1) + " % (" + counted(step.count, "rating", "ratings") + ")\n";
  text += "  all ratings: " + spread_text(ratings.spread);
  for (const RatingsAtLevel& at : ratings.levels)
    text += "  level " + short_number(at.level) + ": mean of participants " +
            optional_interval(at.mean.mean, at.mean.ci95) + ", " + spread_text(at.spread);
  return text + "  mean of participants " +
         optional_interval(ratings.mean.mean, ratings.mean.ci95) + "\n";
}

std::string adjustment_text(const TaskCell& cell) {
  std::string text;
  for (const Adjustment& one : cell.adjustments) {
    text += "  " + pad_right(printable(cell.participants[one.participant]), 12) + "PSE " +
            optional_interval(one.pse, one.pse_ci95) + ", constant error " +
            short_number(one.constant_error);
    if (one.jnd) text += ", JND " + short_number(*one.jnd);
    if (one.start_effect)
      text += ", settings from above minus from below " + short_number(*one.start_effect);
    text += "\n";
  }
  return text;
}

std::string reaches_text(const TaskCell& cell) {
  std::string text;
  for (const Reaches& one : cell.reaches) {
    text += "  " + pad_right(printable(cell.participants[one.participant]), 12) + "in time " +
            std::to_string(one.in_time) + " of " + std::to_string(one.trials);
    if (one.deviation) text += ", deviation " + short_number(1e3 * *one.deviation) + " mm";
    if (one.catch_deviation)
      text += ", in catch trials " + short_number(1e3 * *one.catch_deviation) + " mm";
    if (one.adaptation) text += ", adaptation " + short_number(*one.adaptation);
    if (one.learning.undefined.empty())
      text += ", from " + short_number(1e3 * one.learning.start) + " to " +
              short_number(1e3 * one.learning.end) + " mm in " + short_number(one.learning.trials) +
              " trials";
    text += "\n";
  }
  return text;
}

std::string parameter_text(const FieldParameter& one) {
  const bool rate = one.name == "lapse" || one.name == "guess";
  const auto shown = [&](double value) { return rate ? rounded_rate(value) : value; };
  return one.name + " " +
         with_interval(shown(one.value), {shown(one.ci95.low), shown(one.ci95.high)});
}

std::string misfit_text(double deviance, int df, double p) {
  return (p < kMisfitLevel ? "MISFIT: deviance " : "form: deviance ") + short_number(deviance) +
         " on " + counted(static_cast<std::size_t>(df), "degree", "degrees") + " of freedom, " +
         p_phrase(p);
}

std::string field_text(const FieldAnalysis& field) {
  if (!field.undefined.empty()) return "  " + field.undefined + "\n";
  std::string text = "  form " + std::string(to_string(field.function.form)) + " of";
  for (const FieldAnalysis::Dimension& one : field.dimensions)
    text += (&one == &field.dimensions.front() ? " " : ", ") + printable(one.name) +
            (one.unit == "1" ? "" : " (" + printable(one.unit) + ")");
  text += "\n";
  for (const ParticipantField& one : field.participants) {
    text += "  " + pad_right(printable(one.participant), 12);
    if (!one.fit.undefined.empty()) {
      text += "no function: " + one.fit.undefined + "\n";
      continue;
    }
    for (const FieldParameter& parameter : one.fit.parameters)
      text += (&parameter == &one.fit.parameters.front() ? "" : ", ") + parameter_text(parameter);
    if (one.fit.jnd)
      text += "; JND at " + short_number(one.fit.middle) + " " +
              with_interval(one.fit.jnd->value, one.fit.jnd->ci95);
    const FieldMisfit& misfit = one.fit.misfit;
    text += "; " + (misfit.undefined.empty() ? misfit_text(misfit.deviance, misfit.df, misfit.p)
                                             : "form not tested: " + misfit.undefined);
    text += "\n";
  }
  if (field.p) {
    text += "  over " + counted(field.tested, "participant", "participants") + ": " +
            misfit_text(field.deviance, field.df, *field.p) +
            (*field.p < kMisfitLevel ? ": the form does NOT hold, and its parameters mean less\n"
                                     : "\n");
    for (const MisfitPlace& place : field.places) {
      const auto shown = [&](double value) { return field.has_jnd() ? std::exp(value) : value; };
      text += "    at " + short_number(place.at) + ": ";
      text += place.ci95 ? with_interval(shown(place.mean),
                                         {shown(place.ci95->low), shown(place.ci95->high)})
                         : short_number(shown(place.mean));
      text += field.has_jnd() ? " times the JND of the form\n" : " from the form\n";
    }
  }
  return text;
}

std::string cell_text(const TaskCell& cell) {
  std::string text = cell.task;
  for (const std::string* name : {&cell.block_name, &cell.shape, &cell.renderer}) {
    if (!name->empty()) text += ", " + printable(*name);
  }
  text += ": " + counted(cell.trials, "trial", "trials") + " of " +
          counted(cell.participants.size(), "participant", "participants") + ", " +
          std::to_string(cell.answered) + " answered\n";
  if (!cell.functions.empty() && cell.no_function.empty())
    text += cell.scale == protocols::LevelScale::linear
                ? "  functions over the untransformed levels\n"
                : "  functions over the logarithm (base 10) of the levels\n";
  if (!cell.expected_easier && !cell.functions.empty() && cell.no_function.empty() &&
      (cell.functions.front().model.function.easier == protocols::Easier::lower) !=
          cell.functions.front().reversed)
    text +=
        "  successes fall as the level rises; no protocol states which direction was asked for\n";
  for (const ParticipantFunction& one : cell.functions)
    text += function_text(one, cell.expected_easier);
  if (cell.field) text += field_text(*cell.field);
  if (cell.magnitude) text += magnitude_text(cell);
  if (cell.ratings) text += ratings_text(cell);
  text += adjustment_text(cell);
  text += reaches_text(cell);
  if (cell.information && cell.information->plain) {
    text += "  information transfer " + short_number(*cell.information->plain) + " bit of " +
            short_number(cell.information->stimulus_entropy) +
            "; corrected for the bias of few trials " +
            short_number(std::max(0.0, *cell.information->corrected)) + " bit, " +
            short_number(*cell.information->categories) + " categories";
    if (cell.information_mean.mean)
      text += "; mean of the participants' " +
              optional_interval(cell.information_mean.mean, cell.information_mean.ci95) +
              " of at most " + short_number(cell.information_most) +
              " (mean of arcsin sqrt, transformed back)";
    text += "\n";
  }
  if (cell.confidence.area)
    text += "  confidence: area under the type 2 ROC " +
            optional_interval(cell.confidence.area, cell.confidence.area_ci95) +
            (cell.confidence.area_ci95 && cell.confidence.area_ci95->high < 0.5
                 ? " (BELOW 0.5: is the scale reversed?)"
                 : "") +
            "\n";
  if (const TransformedMean& mean = cell.confidence_mean; mean.n > 1 || mean.left_out > 0) {
    text += "  confidence, mean of participants: " + optional_interval(mean.mean, mean.ci95) +
            " (" + counted(mean.n, "participant", "participants");
    if (mean.left_out > 0)
      text +=
          ", " + std::to_string(mean.left_out) + " without both correct and wrong answers left out";
    text += ")\n";
  }
  return text + "\n";
}

std::string group_text(const TaskGroup& group) {
  std::string text = measure_plural(group.measure) + " over participants";
  for (const std::string* name : {&group.task, &group.block_name, &group.shape}) {
    if (!name->empty()) text += ", " + printable(*name);
  }
  const bool modelled =
      std::ranges::any_of(group.renderers, [](const GroupMean& one) { return one.of_model; });
  text += group.geometric ? " (geometric means" : " (means";
  if (modelled) text += " of a hierarchical model of all answers";
  text += (group.unit.empty() ? "" : ", " + group.unit) + ")\n";
  for (const GroupMean& one : group.renderers) {
    text += "  " + pad_right(printable(one.renderer), 12) +
            (one.mean ? optional_interval(one.mean, one.ci95) : "no mean") + " (" +
            counted(one.of_model ? one.n_of_model : one.participants.size(), "participant",
                    "participants");
    for (const std::string& note : one.notes) text += "; " + note;
    if (!one.of_model && one.n_undetermined > 0)
      text += ", " + std::to_string(one.n_undetermined) + " not determined and left out";
    text += ")\n";
  }
  return text + "\n";
}

/// Beside the t-test of ratings.
std::string wilcoxon_text(const Wilcoxon& ranks) {
  if (!ranks.p) return "";
  const bool few = ranks.n_nonzero < kLeastForWilcoxon;
  return "; Wilcoxon V = " + short_number(*ranks.positive_rank_sum) + ", " + p_phrase(*ranks.p) +
         (few ? " (5 or fewer differ: p cannot be below 0.05)" : "");
}

std::string comparison_text(const TaskComparison& one, bool of_renderers) {
  std::string text =
      measure_plural(one.measure) + " by " + (of_renderers ? "renderer" : "block and stimulus");
  const auto add = [&](const std::string& name) {
    if (!name.empty()) text += ", " + printable(name);
  };
  add(one.task);
  add(one.block_name);
  add(one.shape);
  add(one.renderer);
  text += one.logarithms ? " (ratios)\n" : " (differences)\n";
  if (!one.comparison.undefined.empty()) text += "  " + one.comparison.undefined + "\n";
  if (one.n_undetermined > 0)
    text += "  " + counted(one.n_undetermined, "function", "functions") +
            (is_field_parameter(one.measure)
                 ? " left out: the answers leave an end of the interval open\n"
                 : " left out: no threshold among the levels shown, a slope too steep for them, "
                   "or reversed answers\n");
  for (const ConditionDifference& difference : one.comparison.differences) {
    const auto shown = [&](double value) {
      return short_number(one.logarithms ? std::exp(value) : value);
    };
    text += "  " + printable(one.conditions[difference.condition]) +
            (one.logarithms ? " / " : " - ") + printable(one.conditions[0]) + ": ";
    if (difference.n_pairs == 0) {
      text += "no participant has both\n";
      continue;
    }
    text += shown(difference.mean);
    if (const auto& ends = difference.t_test.log_ratio_ci95)
      text += " [" + shown(ends->low) + ", " + shown(ends->high) + "]";
    const TTest& test = difference.t_test;
    if (test.p) text += ", " + test_text(test);
    if (test.p_holm && one.n_tests > 1)
      text += " (" + p_phrase(*test.p_holm) + " adjusted over " + std::to_string(one.n_tests) +
              " tests, Holm)";
    if (difference.effect_size.dz) text += ", dz = " + fixed(*difference.effect_size.dz, 2);
    if (one.measure == "rating") text += wilcoxon_text(difference.wilcoxon);
    if (difference.mixed_estimate) text += "; mixed model " + shown(*difference.mixed_estimate);
    text += " (" + counted(difference.n_pairs, "pair", "pairs") + ")\n";
  }
  return text + "\n";
}

/// The group's d' and criterion, level by level.
std::string group_detection_text(const StudyAnalysis& analysis) {
  std::string text;
  for (const TaskGroupModel& one : analysis.group_models.models) {
    if (!one.level) continue;
    if (text.empty()) text = "Detection over participants (hierarchical model of all answers)\n";
    text += "  " + measure_plural(one.measure) + " at " + short_number(*one.level) + ", " +
            printable(one.renderer) + ": " + short_number(*one.estimate) + " [" +
            (one.low ? short_number(*one.low) : "open") + ", " +
            (one.high ? short_number(*one.high) : "open") + "] (" +
            counted(one.n, "participant", "participants") + ")\n";
  }
  return text.empty() ? text : text + "\n";
}

/// The group's differences between renderers.
std::string group_model_text(const StudyAnalysis& analysis) {
  const TaskGroupResults& results = analysis.group_models;
  if (results.comparisons.empty()) return "";
  std::string text = "The group compared between renderers (hierarchical model of all answers)\n";
  for (const TaskGroupComparison& one : results.comparisons) {
    text += "  " + group_sentence(one) + "\n";
    const IndividualFits& fits = one.individual_fits;
    if (fits.n == 0 && fits.left_out == 0) continue;
    text += "    individual fits: ";
    if (fits.t)
      text += "t(" + short_number(*fits.df) + ") = " + fixed(*fits.t, 2) + ", " +
              p_phrase(*fits.p) + ", ";
    text += counted(fits.n, "pair", "pairs") + ", " +
            counted(fits.left_out, "function", "functions") + " left out";
    if (!fits.left_out_names.empty())
      text += " (" + printable(joined(fits.left_out_names), 400) + ")";
    text += "\n";
  }
  return text + "\n";
}

}  // namespace

std::string task_report_text(const StudyAnalysis& analysis) {
  std::string text;
  if (analysis.table.simulated) text += "SIMULATED PARTICIPANTS\n\n";
  if (!analysis.groups.empty() || analysis.identification)
    text += paragraph_text(headline(analysis)) + "\n";
  for (const std::string& warning : analysis.table.warnings) text += printable(warning, 400) + "\n";
  if (!analysis.table.warnings.empty()) text += "\n";
  for (const TaskCell& cell : analysis.cells) text += cell_text(cell);
  for (const TaskGroup& group : analysis.groups) text += group_text(group);
  text += design_text(analysis.by_design) + answer_models_text(analysis.answer_models);
  text += group_detection_text(analysis) + group_model_text(analysis);
  for (const TaskComparison& one : analysis.renderers) text += comparison_text(one, true);
  for (const TaskComparison& one : analysis.conditions) text += comparison_text(one, false);
  const std::vector<std::string> sentences = sentences_to_quote(analysis);
  if (!sentences.empty()) text += "To quote\n";
  for (const std::string& sentence : sentences) text += paragraph_text(sentence);
  if (!sentences.empty()) text += "\n";
  text += explanation(analysis) + scale_note(analysis);
  if (analysis.identification)
    text += "\nTimes and accuracy of identification\n\n" + report_text(*analysis.identification);
  return text;
}

}  // namespace palpate::analysis
