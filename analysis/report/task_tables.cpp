#include "analysis/report/task_tables.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>
#include <utility>
#include <variant>

#include "analysis/report/design_report.h"
#include "analysis/statistics/conclusions.h"
#include "analysis/statistics/paired_evidence.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

constexpr double kClear = 0.05;  // largest Holm-adjusted p that is told as a finding
constexpr std::size_t kMostTold = 3;

std::string short_or_missing(const std::optional<double>& value) {
  return value ? short_number(*value) : kMissing;
}

std::string interval_cell(const std::optional<Interval>& interval) {
  if (!interval) return kMissing;
  if (!std::isfinite(interval->low)) return "below " + short_number(interval->high);
  if (!std::isfinite(interval->high)) return "above " + short_number(interval->low);
  return short_number(interval->low) + " to " + short_number(interval->high);
}

std::string labelled(const std::string& caption, const std::string& label) {
  return label.empty() ? caption : caption + " (" + label + ")";
}

std::string label_of(const StudyAnalysis& analysis) {
  return analysis.table.simulated ? "SIMULATED PARTICIPANTS" : "";
}

/// A value or an end on the scale of a comparison in its unit: a ratio of logarithms.
double in_units(const TaskComparison& one, double value) {
  return one.logarithms ? std::exp(value) : value;
}

std::optional<Interval> ends_in_units(const TaskComparison& one, const TTest& test) {
  if (!test.log_ratio_ci95) return std::nullopt;
  return Interval{in_units(one, test.log_ratio_ci95->low),
                  in_units(one, test.log_ratio_ci95->high)};
}

std::optional<Interval> ends90_in_units(const TaskComparison& one,
                                        const ConditionDifference& difference) {
  const auto ends = evidence_of(difference.mean, difference.t_test).ci90;
  if (!ends) return std::nullopt;
  return Interval{in_units(one, ends->low), in_units(one, ends->high)};
}

std::string pair_of(const TaskComparison& one, const ConditionDifference& difference) {
  return printable(one.conditions[difference.condition]) + (one.logarithms ? " / " : " − ") +
         printable(one.conditions[0]);
}

/// Only the columns of tests, which adjusted p have if there are several.
bool any_adjusted(const std::vector<TaskComparison>& comparisons) {
  return std::ranges::any_of(comparisons, [](const auto& one) { return one.n_tests > 1; });
}

std::string remarks_on(const GroupMean& one) {
  std::string text;
  for (const std::string& note : one.notes) text += (text.empty() ? "" : "; ") + note;
  return text;
}

Table means_table(const StudyAnalysis& analysis) {
  Table table;
  table.caption = labelled("Means over participants", label_of(analysis));
  table.header = {"measure",       "task, block, stimulus", "renderer", "mean",
                  "95 % interval", "participants",          "left out", "remark"};
  table.n_names = 3;
  table.n_remarks = 1;
  bool modelled = false;
  for (const TaskGroup& group : analysis.groups) {
    std::string measure = measure_plural(group.measure);
    if (!group.unit.empty()) measure += " (" + group.unit + ")";
    for (const GroupMean& one : group.renderers) {
      table.rows.push_back({measure, stimulus_of(group.task, group.block_name, group.shape),
                            one.renderer, short_or_missing(one.mean), interval_cell(one.ci95),
                            std::to_string(one.of_model ? one.n_of_model : one.participants.size()),
                            one.of_model ? "0" : std::to_string(one.n_undetermined),
                            remarks_on(one)});
      modelled |= one.of_model;
    }
  }
  table.notes = {
      "Means are geometric if all values are positive and have a true zero, except for exponents "
      "and ratings."};
  if (modelled)
    table.notes.emplace_back(
        "Of psychometric functions: a hierarchical model of all participants' answers, with "
        "intervals by profile likelihood. Nobody is left out for a function that cannot be fitted "
        "singly.");
  return table;
}

/// "0.3 to 0.86", "above 0.3"
std::string ends_of(const std::optional<double>& low, const std::optional<double>& high) {
  if (!low && !high) return "not determined";
  if (!low) return "below " + short_number(*high);
  if (!high) return "above " + short_number(*low);
  return short_number(*low) + " to " + short_number(*high);
}

/// d' and criterion at each level.
Table detection_model_table(const StudyAnalysis& analysis) {
  Table table;
  table.caption = labelled("Detection over participants, level by level", label_of(analysis));
  table.header = {"measure",       "task, block, stimulus",   "level",       "renderer", "value",
                  "95 % interval", "SD between participants", "participants"};
  table.n_names = 4;
  for (const TaskGroupModel& one : analysis.group_models.models) {
    if (!one.level) continue;
    table.rows.push_back(
        {measure_plural(one.measure), stimulus_of(one.task, one.block_name, one.shape),
         short_number(*one.level), one.renderer, short_or_missing(one.estimate),
         ends_of(one.low, one.high), short_or_missing(one.sd_between), std::to_string(one.n)});
  }
  table.notes = {"A hierarchical model of all answers, without corrected counts."};
  return table;
}

std::string pair_of(const TaskGroupComparison& one) {
  return printable(one.compared) + (one.ratio ? " / " : " − ") + printable(one.reference);
}

Table model_differences_table(const StudyAnalysis& analysis) {
  const auto& comparisons = analysis.group_models.comparisons;
  Table table;
  table.caption = labelled("Comparison of the group between renderers", label_of(analysis));
  table.header = {"measure",       "task, block, stimulus", "compared", "value",    "95 % interval",
                  "90 % interval", "likelihood ratio",      "p",        "p (Holm)", "of tests",
                  "participants",  "individual fits: p",    "pairs",    "left out"};
  table.n_names = 3;
  for (const TaskGroupComparison& one : comparisons) {
    const IndividualFits& fits = one.individual_fits;
    table.rows.push_back(
        {measure_plural(one.measure) + (one.level ? " at " + short_number(*one.level) : ""),
         stimulus_of(one.task, one.block_name, one.shape), pair_of(one),
         short_or_missing(one.estimate), one.estimate ? ends_of(one.low, one.high) : one.undefined,
         one.estimate ? ends_of(one.low90, one.high90) : kMissing, number(one.likelihood_ratio, 3),
         p_or_missing(one.p), p_or_missing(one.p_holm), std::to_string(one.n_tests),
         std::to_string(one.n), p_or_missing(fits.p), std::to_string(fits.n),
         std::to_string(fits.left_out) +
             (fits.left_out_names.empty() ? "" : " (" + joined(fits.left_out_names) + ")")});
  }
  table.notes = {
      "Likelihood ratios of the hierarchical model, with p and interval as of a t-test. Individual "
      "fits: the paired t-test of functions fitted singly, which leaves out those without a "
      "threshold among the levels shown, with a slope too steep for them, or with reversed "
      "answers."};
  return table;
}

/// Why a Wilcoxon test beside a t-test may say nothing; empty: it has enough pairs.
std::string few_pairs_note(const std::vector<TaskComparison>& comparisons) {
  const bool few = std::ranges::any_of(comparisons, [](const TaskComparison& one) {
    return one.measure == "rating" &&
           std::ranges::any_of(one.comparison.differences, [](const ConditionDifference& d) {
             return d.wilcoxon.p && d.wilcoxon.n_nonzero < kLeastForWilcoxon;
           });
  });
  return few ? "Wilcoxon: with 5 or fewer participants who differ, the exact p cannot be below "
               "0.05, however clear the difference."
             : "";
}

/// \param of_renderers  otherwise of blocks and stimuli
Table differences_table(const StudyAnalysis& analysis, bool of_renderers) {
  const auto& comparisons = of_renderers ? analysis.renderers : analysis.conditions;
  const bool adjusted = any_adjusted(comparisons);
  const bool rated = std::ranges::any_of(
      comparisons, [](const TaskComparison& one) { return one.measure == "rating"; });
  Table table;
  table.caption = labelled(std::string("Comparison within participants, by ") +
                               (of_renderers ? "renderer" : "block and stimulus"),
                           label_of(analysis));
  table.header = {"measure",
                  of_renderers ? "task, block, stimulus" : "task, block, renderer",
                  "compared",
                  "value",
                  "95 % interval",
                  "90 % interval",
                  "BF10",
                  "t",
                  "df",
                  "p"};
  if (adjusted) table.header.insert(table.header.end(), {"p (Holm)", "of tests"});
  table.header.emplace_back("dz");
  if (rated) table.header.insert(table.header.end(), {"V", "p (Wilcoxon)"});
  table.header.emplace_back("pairs");
  table.n_names = 3;
  for (const TaskComparison& one : comparisons) {
    if (of_renderers && has_model(analysis, one)) continue;
    for (const ConditionDifference& difference : one.comparison.differences) {
      const TTest& test = difference.t_test;
      auto& row = table.rows.emplace_back(std::vector<std::string>{
          measure_plural(one.measure),
          stimulus_of(one.task, one.block_name, of_renderers ? one.shape : one.renderer),
          pair_of(one, difference),
          difference.n_pairs > 0 ? short_number(in_units(one, difference.mean)) : kMissing,
          interval_cell(ends_in_units(one, test)), interval_cell(ends90_in_units(one, difference)),
          short_or_missing(evidence_of(difference.mean, test).bayes_factor), number(test.t, 2),
          number(test.df, 0), p_or_missing(test.p)});
      if (adjusted) {
        row.push_back(p_or_missing(test.p_holm));
        row.push_back(std::to_string(one.n_tests));
      }
      row.push_back(number(difference.effect_size.dz, 2));
      if (rated) {
        const bool shown = one.measure == "rating";
        row.push_back(shown ? number(difference.wilcoxon.positive_rank_sum, 1) : kMissing);
        row.push_back(shown ? p_or_missing(difference.wilcoxon.p) : kMissing);
      }
      row.push_back(std::to_string(difference.n_pairs));
    }
  }
  table.notes = {
      "Paired t-tests: of ratios (/) on natural logarithms if all values are positive and have a "
      "true zero, otherwise of differences (−). Intervals are not adjusted. Equivalent within "
      "registered bounds if the 90 % interval lies inside. BF10: Bayes factor for a difference "
      "(Rouder et al. 2009); with fewer than nine pairs it cannot fall below 1/3, so it can never "
      "support \"no difference\"."};
  if (rated)
    table.notes.emplace_back(
        "Ratings: of participants' means, p adjusted over all tests of a block; V: positive rank "
        "sum of the exact Wilcoxon test.");
  if (const std::string few = few_pairs_note(comparisons); rated && !few.empty())
    table.notes.push_back(few);
  return table;
}

/// "JNDs", "thresholds": as a word within a sentence.
std::string measure_word(const std::string& measure) {
  std::string word = measure_plural(measure);
  const bool name = word.size() > 1 && std::isupper(static_cast<unsigned char>(word[1]));
  if (!name && measure != "weber_fraction")
    word[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(word[0])));
  return word;
}

bool is_clear(const ConditionDifference& difference) {
  return difference.t_test.p_holm && *difference.t_test.p_holm < kClear;
}

/// "35 % lower", "0.8 higher"
std::string how_far(bool logarithms, double mean) {
  const double away = logarithms ? 100 * std::abs(std::expm1(mean)) : std::abs(mean);
  return (logarithms ? fixed(away, 0) + " %" : fixed(away, away < 0.1 ? 3 : 1)) +
         (mean < 0 ? " lower" : " higher");
}

/// A difference between two renderers.
struct Told {
  std::string place, compared, reference, how_far;
  double p = 1;
};

std::string place_of(const std::string& measure, const std::string& block,
                     const std::string& shape) {
  const std::string where = stimulus_of(block, shape, "");
  return measure_word(measure) + (where.empty() ? "" : " (" + where + ")");
}

/// The ratio of JNDs stands for that of Weber fractions.
std::vector<Told> differences_of_renderers(const StudyAnalysis& analysis) {
  std::vector<Told> all;
  for (const TaskGroupComparison& one : analysis.group_models.comparisons) {
    if (!one.p_holm || one.measure == "weber_fraction" || one.level) continue;
    const double value = one.ratio ? std::log(*one.estimate) : *one.estimate;
    all.push_back({place_of(one.measure, one.block_name, one.shape), one.compared, one.reference,
                   how_far(one.ratio, value), *one.p_holm});
  }
  for (const TaskComparison& one : analysis.renderers) {
    if (has_model(analysis, one)) continue;
    for (const ConditionDifference& difference : one.comparison.differences) {
      if (!difference.t_test.p_holm) continue;
      all.push_back({place_of(one.measure, one.block_name, one.shape),
                     one.conditions[difference.condition], one.conditions[0],
                     how_far(one.logarithms, difference.mean), *difference.t_test.p_holm});
    }
  }
  return all;
}

/// The measures that differ clearly between renderers, and those without a clear difference.
std::string finding_on_renderers(const StudyAnalysis& analysis) {
  std::vector<std::string> clear, unclear;
  std::size_t more = 0;
  for (const Told& one : differences_of_renderers(analysis)) {
    if (!(one.p < kClear)) {
      unclear.push_back(one.place);
    } else if (clear.size() == kMostTold) {
      ++more;
    } else {
      clear.push_back(one.place + " are " + one.how_far + " with " +
                      with_article(printable(one.compared, 40)) + " than with " +
                      with_article(printable(one.reference, 40)));
    }
  }
  std::string text;
  for (std::string& one : clear) {
    one[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(one[0])));
    text += one + ". ";
  }
  if (more > 0) text += counted(more, "more clear difference", "more clear differences") + ". ";
  if (unclear.size() > kMostTold)
    text += "No clear difference in " + std::to_string(unclear.size()) + " other comparisons. ";
  else if (!unclear.empty())
    text += "No clear difference between renderers in " + joined(unclear) + ". ";
  return text;
}

/// Highest and lowest of the rated stimuli of a block, and how many pairs differ clearly.
std::string finding_on_ratings(const StudyAnalysis& analysis) {
  std::size_t pairs = 0, clear = 0;
  for (const TaskComparison& one : analysis.conditions) {
    if (one.measure != "rating") continue;
    pairs += one.comparison.differences.size();
    clear += static_cast<std::size_t>(std::ranges::count_if(one.comparison.differences, is_clear));
  }
  if (pairs == 0) return "";
  const TaskCell *highest = nullptr, *lowest = nullptr;
  for (const TaskCell& cell : analysis.cells) {
    if (!cell.ratings || !cell.ratings->mean.mean) continue;
    if (highest == nullptr || *cell.ratings->mean.mean > *highest->ratings->mean.mean)
      highest = &cell;
    if (lowest == nullptr || *cell.ratings->mean.mean < *lowest->ratings->mean.mean) lowest = &cell;
  }
  const auto name = [](const TaskCell& cell) {
    return printable(cell.shape, 40) + " (mean " + short_number(*cell.ratings->mean.mean) + ")";
  };
  return "Rated highest: " + name(*highest) + ", lowest: " + name(*lowest) + "; " +
         std::to_string(clear) + " of " + counted(pairs, "pair", "pairs") +
         (clear == 1 ? " of stimuli differs clearly. " : " of stimuli differ clearly. ");
}

/// The first means.
std::string finding_on_means(const StudyAnalysis& analysis) {
  std::string text;
  std::size_t told = 0;
  for (const TaskGroup& group : analysis.groups) {
    for (const GroupMean& one : group.renderers) {
      if (!one.mean || told == kMostTold) continue;
      ++told;
      std::string what = measure_plural(group.measure);
      if (what.back() == 's') what.pop_back();
      text += what + " (" + stimulus_of(group.block_name, group.shape, one.renderer) +
              "): " + short_number(*one.mean) +
              (group.unit.empty() ? "" : " " + printable(group.unit));
      if (one.ci95) text += ", 95 % interval " + interval_cell(one.ci95);
      text += ", " +
              counted(one.of_model ? one.n_of_model : one.participants.size(), "participant",
                      "participants") +
              ". ";
    }
  }
  return text;
}

std::string name_of_cell(const TaskCell& cell) {
  return stimulus_of(cell.task, cell.block_name, cell.shape) +
         (cell.renderer.empty() ? "" : ", " + printable(cell.renderer));
}

Table table_of(const TaskCell& cell, const std::string& what, const std::string& label,
               std::vector<std::string> header, std::size_t names = 1) {
  Table table;
  table.caption = labelled(what + ": " + name_of_cell(cell), label);
  table.header = std::move(header);
  table.n_names = names;
  return table;
}

std::string remark_on(const ParticipantFunction& one) {
  if (!one.fit.undefined.empty()) return one.fit.undefined;
  if (one.reversed) return "not compared: reversed answers";
  if (!one.determined) return "threshold not determined";
  return one.fit.slope_at_bound ? "slope not determined" : "";
}

Table functions_table(const TaskCell& cell, const std::string& label) {
  const bool pse = std::ranges::any_of(
      cell.functions, [](const ParticipantFunction& one) { return one.figures.pse.has_value(); });
  Table table = table_of(cell, "Psychometric functions", label,
                         {"participant", pse ? "PSE" : "threshold", "95 % interval", "JND",
                          "95 % interval", "Weber fraction", "slope", "95 % interval", "lapses",
                          "95 % interval", "fit p", "Bayes", "95 % interval", "remark"});
  table.n_remarks = 1;
  for (const ParticipantFunction& one : cell.functions) {
    std::vector<std::string> row(table.header.size(), kMissing);
    row[0] = one.participant;
    row.back() = remark_on(one);
    if (one.fit.undefined.empty()) {
      const LevelFigures& found = one.figures;
      row[1] = short_number(pse && found.pse ? *found.pse : one.fit.parameters.threshold);
      row[2] = interval_cell(pse ? found.pse_ci95 : std::optional(one.fit.threshold_ci95));
      row[3] = short_or_missing(found.jnd);
      row[4] = interval_cell(found.jnd_ci95);
      row[5] = short_or_missing(found.weber_fraction);
      if (!one.fit.slope_at_bound) {
        row[6] = short_number(one.fit.parameters.slope);
        row[7] = interval_cell(one.fit.slope_ci95);
      }
      if (one.model.lapse.free) {
        row[8] = fixed(one.fit.parameters.lapse, 3);
        row[9] = fixed(one.fit.lapse_ci95.low, 3) + " to " + fixed(one.fit.lapse_ci95.high, 3);
      }
      row[10] = p_or_missing(one.goodness.p);
      if (one.posterior.undefined.empty()) {
        row[11] = short_number(one.posterior.mean.threshold);
        row[12] = interval_cell(one.posterior.threshold_ci95);
      }
    }
    table.rows.push_back(std::move(row));
  }
  table.notes = {std::string("Over ") +
                 (cell.scale == protocols::LevelScale::linear
                      ? "the untransformed levels"
                      : "the logarithm (base 10) of the levels") +
                 ". fit p: goodness of fit, from refitted simulations. Bayes: posterior mean of "
                 "the threshold. The group's values do not use these fits singly."};
  if (!cell.no_function.empty()) table.notes = {cell.no_function + "."};
  return table;
}

Table detection_table(const TaskCell& cell, const std::string& label) {
  Table table = table_of(cell, "Detection", label,
                         {"participant", "d'", "95 % interval", "criterion", "95 % interval"});
  for (const ParticipantFunction& one : cell.functions) {
    const Detectability& found = one.detectability;
    if (!found.d_prime) continue;
    table.rows.push_back({one.participant, short_number(*found.d_prime),
                          interval_cell(found.d_prime_ci95), short_or_missing(found.criterion),
                          interval_cell(found.criterion_ci95)});
  }
  return table;
}

Table tracks_table(const TaskCell& cell, const std::string& label) {
  Table table = table_of(cell, "The procedures' own estimates", label,
                         {"participant", "track", "procedure", "estimate", "converges at",
                          "fitted function there", "trials", "reversals", "at a limit"},
                         3);
  for (const ParticipantFunction& one : cell.functions) {
    for (const Track& track : one.tracks) {
      if (!track.procedure) continue;
      const auto& [spec, estimate, target, fitted] = *track.procedure;
      const bool quest = std::holds_alternative<protocols::QuestPlus>(spec);
      table.rows.push_back({one.participant, track.name, quest ? "QUEST+" : kind_of(spec),
                            short_or_missing(estimate.threshold), percent(to_percent(target)),
                            short_or_missing(fitted), std::to_string(estimate.trials),
                            std::to_string(estimate.reversals), std::to_string(estimate.at_limit)});
    }
  }
  return table;
}

Table exponents_table(const TaskCell& cell, const std::string& label) {
  Table table = table_of(cell, "Magnitude estimation", label,
                         {"participant", "exponent", "standard error", "r²", "trials", "levels"});
  if (!cell.magnitude) return table;
  for (const StevensLine& line : cell.magnitude->lines)
    table.rows.push_back({cell.participants[line.participant], short_or_missing(line.exponent),
                          short_or_missing(line.exponent_se), short_or_missing(line.r_squared),
                          std::to_string(line.trials), std::to_string(line.levels)});
  if (cell.magnitude->exponent)
    table.notes.push_back("Mean of the participants' exponents " +
                          short_number(*cell.magnitude->exponent) +
                          (cell.magnitude->exponent_ci95
                               ? ", 95 % interval " + interval_cell(cell.magnitude->exponent_ci95)
                               : "") +
                          ".");
  if (cell.magnitude->without_logarithm > 0)
    table.notes.push_back(counted(cell.magnitude->without_logarithm, "answer", "answers") +
                          " of 0 or below left out: they have no logarithm.");
  return table;
}

Table magnitudes_table(const TaskCell& cell, const std::string& label) {
  Table table = table_of(cell, "Magnitudes by level", label,
                         {"level", "geometric mean", "95 % interval", "participants"});
  if (!cell.magnitude) return table;
  for (const MagnitudeMean& one : cell.magnitude->means)
    table.rows.push_back({short_number(one.level), short_number(one.geometric_mean),
                          interval_cell(one.ci95), std::to_string(one.participants)});
  table.notes = {
      "Participants' numbers were moved to one mean of logarithms before (modulus equalization)."};
  return table;
}

Table settings_table(const TaskCell& cell, const std::string& label) {
  Table table = table_of(cell, "Settings", label,
                         {"participant", "PSE", "95 % interval", "constant error", "JND",
                          "above − below", "settings"});
  for (const Adjustment& one : cell.adjustments)
    table.rows.push_back({cell.participants[one.participant], short_number(one.pse),
                          interval_cell(one.pse_ci95), short_number(one.constant_error),
                          short_or_missing(one.jnd), short_or_missing(one.start_effect),
                          std::to_string(one.settings)});
  return table;
}

Table reaches_table(const TaskCell& cell, const std::string& label) {
  Table table = table_of(cell, "Movements", label,
                         {"participant", "trials", "in time", "deviation (mm)", "catch (mm)",
                          "adaptation", "start (mm)", "end (mm)", "trials of learning",
                          "duration (s)", "path / chord", "end's error (mm)"});
  const auto millimetres = [](const std::optional<double>& metres) {
    return short_or_missing(metres ? std::optional(1e3 * *metres) : std::nullopt);
  };
  for (const Reaches& one : cell.reaches) {
    const LearningFit& fit = one.learning;
    const bool fitted = fit.undefined.empty();
    const auto of_fit = [&](double value) { return fitted ? std::optional(value) : std::nullopt; };
    table.rows.push_back({cell.participants[one.participant], std::to_string(one.trials),
                          std::to_string(one.in_time), millimetres(one.deviation),
                          millimetres(one.catch_deviation), short_or_missing(one.adaptation),
                          millimetres(of_fit(fit.start)), millimetres(of_fit(fit.end)),
                          short_or_missing(of_fit(fit.trials)), short_or_missing(one.duration),
                          short_or_missing(one.path_ratio), millimetres(one.endpoint_error)});
  }
  table.notes = {
      "Deviation: mean at peak speed in trials with the field, to the left of the line to the "
      "target. Adaptation: mean over clamp trials of the slope of the channel's sideways force on "
      "that of the field. Start, end and trials of learning: of an exponential fitted to the "
      "deviations over the trials of the block, where they have a course."};
  return table;
}

std::vector<std::string> spread_cells(const RatingSpread& spread) {
  return {short_number(spread.median), short_number(spread.lower_quartile),
          short_number(spread.upper_quartile), short_number(spread.mean),
          std::to_string(spread.ratings)};
}

Table rated_participants_table(const TaskCell& cell, const std::string& label) {
  Table table =
      table_of(cell, "Ratings", label,
               {"participant", "median", "lower quartile", "upper quartile", "mean", "ratings"});
  if (!cell.ratings) return table;
  const auto add = [&](const std::string& name, const RatingSpread& spread) {
    auto& row = table.rows.emplace_back(std::vector<std::string>{name});
    std::ranges::move(spread_cells(spread), std::back_inserter(row));
  };
  for (const ParticipantRatings& one : cell.ratings->participants)
    add(cell.participants[one.participant], one.spread);
  if (table.rows.size() > 1) add("all ratings", cell.ratings->spread);
  return table;
}

Table rated_levels_table(const TaskCell& cell, const std::string& label) {
  Table table = table_of(cell, "Ratings by level", label,
                         {"level", "median", "lower quartile", "upper quartile", "mean of ratings",
                          "ratings", "mean of participants", "95 % interval", "participants"});
  if (!cell.ratings) return table;
  for (const RatingsAtLevel& at : cell.ratings->levels) {
    auto& row = table.rows.emplace_back(std::vector<std::string>{short_number(at.level)});
    std::ranges::move(spread_cells(at.spread), std::back_inserter(row));
    row.insert(row.end(), {short_or_missing(at.mean.mean), interval_cell(at.mean.ci95),
                           std::to_string(at.mean.participants)});
  }
  return table;
}

Table steps_table(const TaskCell& cell, const std::string& label) {
  Table table =
      table_of(cell, "Shares of the answers", label, {"answer", "share", "number", "ratings"});
  if (!cell.ratings) return table;
  for (const RatingStep& step : cell.ratings->steps)
    table.rows.push_back({step.label.empty() ? short_number(step.number) : step.label,
                          percent(100 * step.share), short_number(step.number),
                          std::to_string(step.count)});
  table.notes = {"Share: mean over participants of the share of their ratings."};
  return table;
}

Table information_table(const StudyAnalysis& analysis) {
  Table table;
  table.caption = labelled("Information transfer", label_of(analysis));
  table.header = {"task, block", "renderer",   "bits, pooled",         "of",
                  "corrected",   "categories", "mean of participants", "95 % interval",
                  "at most"};
  table.n_names = 2;
  for (const TaskCell& cell : analysis.cells) {
    if (!cell.information || !cell.information->plain) continue;
    table.rows.push_back(
        {stimulus_of(cell.task, cell.block_name, ""), cell.renderer,
         short_number(*cell.information->plain), short_number(cell.information->stimulus_entropy),
         short_number(std::max(0.0, *cell.information->corrected)),
         short_or_missing(cell.information->categories),
         short_or_missing(cell.information_mean.mean), interval_cell(cell.information_mean.ci95),
         cell.information_most > 0 ? short_number(cell.information_most) : kMissing});
  }
  table.notes = {
      "Corrected for the bias of few trials (Miller and Madow). The mean of participants is of "
      "arcsin sqrt(corrected / most), transformed back, with the t interval on that scale."};
  return table;
}

Table confidence_table(const StudyAnalysis& analysis) {
  Table table;
  table.caption = labelled("Confidence: area under the type 2 ROC", label_of(analysis));
  table.header = {
      "task, block, stimulus", "renderer",     "area",     "95 % interval", "mean of participants",
      "95 % interval",         "participants", "left out", "remark"};
  table.n_names = 2;
  table.n_remarks = 1;
  for (const TaskCell& cell : analysis.cells) {
    if (!cell.confidence.area) continue;
    const auto& ends = cell.confidence.area_ci95;
    table.rows.push_back(
        {stimulus_of(cell.task, cell.block_name, cell.shape), cell.renderer,
         short_number(*cell.confidence.area), interval_cell(ends),
         short_or_missing(cell.confidence_mean.mean), interval_cell(cell.confidence_mean.ci95),
         std::to_string(cell.confidence_mean.n), std::to_string(cell.confidence_mean.left_out),
         ends && ends->high < 0.5 ? "below 0.5: is the scale reversed?" : ""});
  }
  return table;
}

Table field_table(const TaskCell& cell, const std::string& label) {
  const bool fitted = cell.field && cell.field->undefined.empty();
  std::vector<std::string> header{"participant", "trials"};
  std::vector<std::string> names;
  if (fitted) {
    for (const ParticipantField& one : cell.field->participants) {
      for (const FieldParameter& parameter : one.fit.parameters)
        if (std::ranges::find(names, parameter.name) == names.end())
          names.push_back(parameter.name);
    }
    if (cell.field->has_jnd()) names.emplace_back("jnd");
  }
  for (const std::string& name : names) {
    const std::string unit = unit_of_parameter(*cell.field, name);
    header.push_back((name == "jnd" ? "JND" : name) + (unit.empty() ? "" : " (" + unit + ")"));
    header.emplace_back("95 % interval");
  }
  for (const char* const more : {"deviance", "df", "p", "remark"}) header.emplace_back(more);
  Table table = table_of(cell, "Functions of several dimensions", label, header);
  if (!fitted) return table;
  for (const ParticipantField& one : cell.field->participants) {
    auto& row = table.rows.emplace_back(
        std::vector<std::string>{printable(one.participant), std::to_string(one.fit.trials)});
    std::string open;
    for (const std::string& name : names) {
      const FieldParameter* found = name == "jnd" && one.fit.jnd ? &*one.fit.jnd : nullptr;
      for (const FieldParameter& parameter : one.fit.parameters)
        if (parameter.name == name) found = &parameter;
      row.push_back(found != nullptr ? short_number(found->value) : kMissing);
      row.push_back(found != nullptr
                        ? short_number(found->ci95.low) + " to " + short_number(found->ci95.high)
                        : kMissing);
      if (found != nullptr && !found->closed && name != "lapse" && name != "guess")
        open += (open.empty() ? "" : ", ") + name;
    }
    const FieldMisfit& misfit = one.fit.misfit;
    const bool tested = one.fit.undefined.empty() && misfit.undefined.empty();
    row.push_back(tested ? short_number(misfit.deviance) : kMissing);
    row.push_back(tested ? std::to_string(misfit.df) : kMissing);
    row.push_back(tested ? p_text(misfit.p) : kMissing);
    std::string remark = one.fit.undefined;
    if (!open.empty()) remark = "not determined: " + open;
    if (tested && misfit.p < kMisfitLevel) remark += remark.empty() ? "MISFIT" : "; MISFIT";
    row.push_back(remark);
  }
  table.notes = {
      std::string("Form ") + to_string(cell.field->function.form) +
      ", by maximum likelihood, with intervals by the profile likelihood. JND: at the median of "
      "the standards. Deviance: against a free value at every place of the other dimension; a "
      "small p "
      "says that the form does not hold."};
  if (cell.field->p)
    table.notes.push_back("Over " + counted(cell.field->tested, "participant", "participants") +
                          ": deviance " + short_number(cell.field->deviance) + " on " +
                          std::to_string(cell.field->df) + " degrees of freedom, " +
                          p_phrase(*cell.field->p) +
                          (*cell.field->p < kMisfitLevel ? ": MISFIT." : "."));
  return table;
}

}  // namespace

std::string stimulus_of(const std::string& task, const std::string& block,
                        const std::string& shape) {
  std::string name;
  for (const std::string* part : {&task, &block, &shape}) {
    if (!part->empty()) name += (name.empty() ? "" : ", ") + printable(*part);
  }
  return name;
}

bool has_model(const StudyAnalysis& analysis, const TaskComparison& one) {
  return std::ranges::any_of(
      analysis.group_models.comparisons, [&](const TaskGroupComparison& other) {
        return other.task == one.task && other.block_name == one.block_name &&
               other.shape == one.shape && other.measure == one.measure;
      });
}

std::string headline(const StudyAnalysis& analysis) {
  const std::string groups = design_conclusion(analysis.by_design, analysis.table.tests);
  return groups.empty() ? conclusion(analysis) : groups + " " + conclusion(analysis);
}

std::string explanation(const StudyAnalysis& analysis) {
  const FunctionSettings& functions = analysis.functions;
  std::string text =
      std::string("Intervals are 95 % intervals. Psychometric functions: ") +
      to_string(functions.shape) + ", lapse rate free up to " + short_number(kMostLapse) +
      ".\ncompare with levels on both sides of the standard: the same lapse rate at both "
      "asymptotes; on one\nside: guess rate 1 / intervals, and the ";
  text += functions.shape == protocols::PsychometricShape::weibull
              ? "JND is measured half-way from there to certainty (threshold: at 63 %)"
              : "threshold is half-way from there to certainty";
  text +=
      ";\ndetect, same/different: guess rate free. d': log-linear correction.\nBayes: posterior "
      "mean of the threshold on a grid.\n";
  if (std::ranges::any_of(analysis.cells,
                          [](const TaskCell& one) { return one.field.has_value(); }))
    text +=
        "Levels of several dimensions: the form of the block's procedure over a cumulative "
        "normal;\n"
        "threshold forms over the procedure's own function.\n";
  return text;
}

std::string scale_note(const StudyAnalysis& analysis) {
  const bool unknown =
      analysis.table.procedures.empty() && !analysis.functions.scale &&
      std::any_of(analysis.cells.begin(), analysis.cells.end(), [](const auto& cell) {
        return !cell.functions.empty() && cell.no_function.empty() &&
               cell.scale == protocols::LevelScale::linear;
      });
  const bool numbers = analysis.table.procedures.empty() &&
                       std::ranges::any_of(analysis.cells, [](const TaskCell& cell) {
                         return cell.magnitude.has_value();
                       });
  std::string text;
  if (unknown)
    text +=
        "A table does not contain the scale of an adaptive procedure's levels: if it is\n"
        "logarithmic, give --scale log.\n";
  if (numbers)
    text +=
        "A table does not say whether numbers are steps of a labelled scale, for which a power law "
        "says\nnothing: analyse the database, or give the labels as responses.\n";
  return text;
}

std::vector<Table> group_tables(const StudyAnalysis& analysis) {
  std::vector<Table> tables{means_table(analysis), model_differences_table(analysis),
                            detection_model_table(analysis), differences_table(analysis, true),
                            differences_table(analysis, false)};
  std::erase_if(tables, [](const Table& table) { return table.rows.empty(); });
  return tables;
}

std::string group_sentence(const TaskGroupComparison& one) {
  const std::string where = stimulus_of(one.task, one.block_name, one.shape);
  std::string text = measure_plural(one.measure) +
                     (one.level ? " at " + short_number(*one.level) : "") +
                     (where.empty() ? "" : " (" + where + ")") + ", " + pair_of(one) + ": ";
  if (!one.estimate) return text + "undefined, " + one.undefined;
  text += short_number(*one.estimate);
  if (one.low && one.high) {
    text += ", 95 % CI [" + short_number(*one.low) + ", " + short_number(*one.high) + "]";
  } else {
    text += ", 95 % CI " + ends_of(one.low, one.high);
  }
  text += ", likelihood ratio " + fixed(*one.likelihood_ratio, 2) + ", " + p_phrase(*one.p);
  if (one.p_holm && *one.p_holm != *one.p) text += " (" + p_phrase(*one.p_holm) + ", Holm)";
  return text + ", n = " + std::to_string(one.n);
}

std::vector<std::string> sentences_to_quote(const StudyAnalysis& analysis) {
  std::vector<std::string> sentences;
  const bool of_renderers = !analysis.renderers.empty();
  const std::string label = label_of(analysis);
  for (const TaskGroupComparison& one : analysis.group_models.comparisons) {
    if (!one.p) continue;
    sentences.push_back(group_sentence(one) + " (hierarchical model of all answers" +
                        (label.empty() ? "" : "; " + label) + ").");
  }
  for (const TaskComparison& one : of_renderers ? analysis.renderers : analysis.conditions) {
    if (of_renderers && has_model(analysis, one)) continue;
    for (const ConditionDifference& difference : one.comparison.differences) {
      const TTest& test = difference.t_test;
      const auto ends = ends_in_units(one, test);
      if (!test.p || !ends) continue;
      sentences.push_back(
          measure_plural(one.measure) + " (" +
          stimulus_of(one.task, one.block_name, of_renderers ? one.shape : one.renderer) + "), " +
          pair_of(one, difference) + ": " + short_number(in_units(one, difference.mean)) +
          ", 95 % CI [" + short_number(ends->low) + ", " + short_number(ends->high) + "], " +
          test_sentence(test, difference.effect_size, difference.n_pairs, one.n_tests) +
          " (paired t-test" + (one.logarithms ? " of logarithms" : "") +
          (label.empty() ? "" : "; " + label) + ").");
    }
  }
  return sentences;
}

std::string conclusion(const StudyAnalysis& analysis) {
  std::string text;
  if (analysis.identification) text = conclusion(*analysis.identification) + " ";
  text += finding_on_renderers(analysis);
  if (text.empty()) text = finding_on_ratings(analysis);
  if (text.empty()) text = finding_on_means(analysis);
  if (text.empty())
    return "Results of tasks: " + counted(analysis.table.trials.size(), "trial", "trials") +
           ", none of which gives a mean over participants.";
  text.pop_back();
  return text;
}

std::vector<Table> cell_tables(const TaskCell& cell, const std::string& label) {
  std::vector<Table> tables{functions_table(cell, label),
                            detection_table(cell, label),
                            tracks_table(cell, label),
                            steps_table(cell, label),
                            rated_participants_table(cell, label),
                            rated_levels_table(cell, label),
                            exponents_table(cell, label),
                            magnitudes_table(cell, label),
                            settings_table(cell, label),
                            field_table(cell, label),
                            reaches_table(cell, label)};
  std::erase_if(tables, [](const Table& table) { return table.rows.empty(); });
  return tables;
}

std::vector<Table> summary_tables(const StudyAnalysis& analysis) {
  std::vector<Table> tables{information_table(analysis), confidence_table(analysis)};
  std::erase_if(tables, [](const Table& table) { return table.rows.empty(); });
  return tables;
}

}  // namespace palpate::analysis
