#include <algorithm>
#include <cmath>
#include <variant>

#include "analysis/report/report_text.h"
#include "analysis/report/task_report.h"
#include "analysis/text.h"
#include "protocols/procedures/psychometric.h"

namespace palpate::analysis {
namespace {

std::string with_interval(double value, const Interval& interval) {
  return short_number(value) + " [" + short_number(interval.low) + ", " +
         short_number(interval.high) + "]";
}

/// To 0.01 %: searches end so near to 0.
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
    text += short_number(*estimate.threshold) + ", its reversals' mean, where it converges at " +
            fixed(100 * *target, 1) + " % successes";
    if (fitted) text += "; the function is there at " + short_number(*fitted);
  } else if (quest != nullptr) {
    text += "threshold " + short_number(*estimate.threshold) + ", slope " +
            short_number(*estimate.slope) + ", means of its posterior (" +
            to_string(quest->function.shape) + ", " + to_string(quest->function.scale) + ")";
  } else {
    text += short_number(*estimate.threshold) + ", mean of where the answer changed";
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
  std::string text =
      falls ? "successes FALL as the level rises, where " : "successes RISE with the level, where ";
  text += expected ? "the task has them " : "those of the others ";
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

std::string explanation(const FunctionSettings& functions) {
  std::string text = std::string("Intervals are of 95 %. Psychometric functions: ") +
                     to_string(functions.shape) + ", lapses free up to " +
                     short_number(kMostLapse) +
                     "; compare with levels on\nboth sides of the standard: lapses as many at "
                     "both ends; on one side: guesses 1 / intervals, the\n";
  text += functions.shape == protocols::PsychometricShape::weibull
              ? "JND is measured half-way from there to certainty (threshold: at 63 %)"
              : "threshold is half-way from there to certainty";
  return text +
         "; detect, same/different: guesses free.\nd': log-linear correction. Bayes: posterior "
         "mean of the threshold on a grid.\n";
}

/// Where levels are taken as they are because nothing is known of their procedure.
std::string scale_note(const TaskAnalysis& analysis) {
  const bool unknown =
      analysis.table.procedures.empty() && !analysis.functions.scale &&
      std::any_of(analysis.cells.begin(), analysis.cells.end(), [](const auto& cell) {
        return !cell.functions.empty() && cell.no_function.empty() &&
               cell.scale == protocols::LevelScale::linear;
      });
  return unknown
             ? "A table does not say on which scale an adaptive procedure has its levels: where "
               "that is\nlogarithmic, give --scale log.\n"
             : "";
}

std::string magnitude_text(const TaskCell& cell) {
  std::string text;
  const MagnitudeEstimation& magnitude = *cell.magnitude;
  for (const StevensLine& line : magnitude.lines) {
    text += "  " + pad_right(printable(cell.participants[line.participant]), 12);
    text += line.exponent ? "exponent " + short_number(*line.exponent) : line.undefined;
    if (line.r_squared) text += ", r2 " + short_number(*line.r_squared);
    if (line.exponent.value_or(0) < 0) text += ", the numbers FALL as the level rises";
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

std::string adjustment_text(const TaskCell& cell) {
  std::string text;
  for (const Adjustment& one : cell.adjustments) {
    text += "  " + pad_right(printable(cell.participants[one.participant]), 12) + "PSE " +
            optional_interval(one.pse, one.pse_ci95) + ", constant error " +
            short_number(one.constant_error);
    if (one.jnd) text += ", JND " + short_number(*one.jnd);
    if (one.start_effect) text += ", from above less from below " + short_number(*one.start_effect);
    text += "\n";
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
                ? "  functions over the levels as they are\n"
                : "  functions over the logarithm (base 10) of the levels\n";
  for (const ParticipantFunction& one : cell.functions)
    text += function_text(one, cell.expected_easier);
  if (cell.magnitude) text += magnitude_text(cell);
  text += adjustment_text(cell);
  if (cell.information && cell.information->plain) {
    text += "  information transfer " + short_number(*cell.information->plain) + " bit of " +
            short_number(cell.information->stimulus_entropy) + "; less the bias of few trials " +
            short_number(std::max(0.0, *cell.information->corrected)) + " bit, " +
            short_number(*cell.information->categories) + " categories";
    if (cell.information_mean)
      text += "; mean of the participants' " +
              optional_interval(cell.information_mean, cell.information_ci95);
    text += "\n";
  }
  if (cell.confidence.area)
    text += "  confidence: area under the type 2 ROC " +
            optional_interval(cell.confidence.area, cell.confidence.area_ci95) +
            (cell.confidence.area_ci95 && cell.confidence.area_ci95->high < 0.5
                 ? " (BELOW 0.5: is the scale turned round?)"
                 : "") +
            "\n";
  return text + "\n";
}

std::string group_text(const TaskGroup& group) {
  std::string text = measure_plural(group.measure) + " over participants";
  for (const std::string* name : {&group.task, &group.block_name, &group.shape}) {
    if (!name->empty()) text += ", " + printable(*name);
  }
  text += group.geometric ? " (geometric means" : " (means";
  text += (group.unit.empty() ? "" : ", " + group.unit) + ")\n";
  for (const GroupMean& one : group.renderers) {
    text += "  " + pad_right(printable(one.renderer), 12) +
            (one.mean ? optional_interval(one.mean, one.ci95) : "no mean") + " (" +
            counted(one.participants.size(), "participant", "participants");
    if (one.n_undetermined > 0)
      text += ", " + std::to_string(one.n_undetermined) + " not determined and left out";
    text += ")\n";
  }
  return text + "\n";
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
            " left out: no threshold among the levels shown, or answers the other way round\n";
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
    if (difference.t_test.p) text += ", p " + p_text(*difference.t_test.p);
    if (difference.t_test.p_holm && one.comparison.differences.size() > 1)
      text += " (Holm " + p_text(*difference.t_test.p_holm) + ")";
    if (difference.mixed_estimate) text += "; mixed model " + shown(*difference.mixed_estimate);
    text += " (" + counted(difference.n_pairs, "pair", "pairs") + ")\n";
  }
  return text + "\n";
}

std::string accuracy_text(const MixedLogistic& model) {
  std::string text =
      "Accuracy of identification, mixed logistic model: correct ~ renderer + shape + (1 | "
      "participant)\n";
  if (!model.undefined.empty()) return text + "  undefined: " + model.undefined + "\n\n";
  for (const LogisticCoefficient& one : model.coefficients) {
    const bool intercept = one.name == "(Intercept)";
    text +=
        "  " + pad_right(printable(one.name), 18) + (intercept ? "odds " : "odds ratio ") +
        with_interval(std::exp(one.estimate), {std::exp(one.ci95.low), std::exp(one.ci95.high)}) +
        ", p " + p_text(one.p) + "\n";
  }
  if (!model.random_sds.empty())
    text += "  standard deviation of the participants' log odds " +
            short_number(model.random_sds[0]) + (model.singular ? " (singular)" : "") + "\n";
  return text + "\n";
}

}  // namespace

std::string task_report_text(const TaskAnalysis& analysis) {
  std::string text;
  if (analysis.table.simulated) text += "SIMULATED PARTICIPANTS\n\n";
  for (const std::string& warning : analysis.table.warnings) text += printable(warning, 400) + "\n";
  if (!analysis.table.warnings.empty()) text += "\n";
  for (const TaskCell& cell : analysis.cells) text += cell_text(cell);
  for (const TaskGroup& group : analysis.groups) text += group_text(group);
  for (const TaskComparison& one : analysis.renderers) text += comparison_text(one, true);
  for (const TaskComparison& one : analysis.conditions) text += comparison_text(one, false);
  if (analysis.accuracy) text += accuracy_text(*analysis.accuracy);
  text += explanation(analysis.functions) + scale_note(analysis);
  if (analysis.identification)
    text += "\nTimes and accuracy of identification\n\n" + report_text(*analysis.identification);
  return text;
}

}  // namespace palpate::analysis
