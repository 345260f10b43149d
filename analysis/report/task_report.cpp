#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <variant>

#include "analysis/figures/figures.h"
#include "analysis/report/between_report.h"
#include "analysis/report/html_page.h"
#include "analysis/report/report.h"
#include "analysis/report/task_tables.h"
#include "analysis/statistics/paired_evidence.h"
#include "analysis/statistics/task_analysis.h"
#include "analysis/text.h"
#include "data/base/json_text.h"
#include "protocols/procedures/psychometric.h"

namespace palpate::analysis {
namespace {

/// The study's title, or its name, or its file.
std::string study_of(const StudyTable& table) {
  if (!table.title.empty()) return table.title;
  for (const auto& [name, sha256] : table.protocols) {
    if (!name.empty()) return name;
  }
  return "Tasks of " + table.source;
}

std::string explanation(const FunctionSettings& functions) {
  std::string text =
      std::string("Intervals are 95 % intervals. Psychometric functions: ") +
      to_string(functions.shape) + ", lapse rate free up to " + short_number(kMostLapse) +
      ".\ncompare with levels on both sides of the standard: the same lapse rate at both "
      "asymptotes; on one\nside: guess rate 1 / intervals, and the ";
  text += functions.shape == protocols::PsychometricShape::weibull
              ? "JND is measured half-way from there to certainty (threshold: at 63 %)"
              : "threshold is half-way from there to certainty";
  return text +
         ";\ndetect, same/different: guess rate free. d': log-linear correction.\nBayes: posterior "
         "mean of the threshold on a grid.\n";
}

/// Notes on what a table without its protocol does not contain: the scale of levels, and whether
/// numbers are steps.
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

/// On a page lines end where there is no room left.
std::string without_line_ends(std::string text) {
  std::ranges::replace(text, '\n', ' ');
  return text;
}

/// "left 3, right 9", or "20 to 31, mean 24.5, SD 3.2"
std::string described_answers(const data::ParticipantColumn& column) {
  std::map<std::string, std::size_t> counts;
  for (const std::string& choice : column.from.choices) counts[choice] = 0;
  std::vector<double> numbers;
  for (const auto& [code, answer] : column.answers) {
    ++counts[answer];
    double value = 0;
    const auto [end, error] = std::from_chars(answer.data(), answer.data() + answer.size(), value);
    if (error == std::errc() && end == answer.data() + answer.size()) numbers.push_back(value);
  }
  if (column.answers.empty()) return kMissing;
  if (column.from.number && numbers.size() == column.answers.size()) {
    const auto [least, most] = std::ranges::minmax(numbers);
    double mean = 0, squares = 0;
    for (const double one : numbers) mean += one / static_cast<double>(numbers.size());
    for (const double one : numbers) squares += (one - mean) * (one - mean);
    std::string text =
        short_number(least) + " to " + short_number(most) + ", mean " + short_number(mean);
    if (numbers.size() > 1)
      text += ", SD " + short_number(std::sqrt(squares / static_cast<double>(numbers.size() - 1)));
    return text;
  }
  // A text could tell who wrote it.
  if (column.from.choices.empty())
    return counted(counts.size(), "different answer", "different answers");
  std::string text;
  for (const std::string& choice : column.from.choices)
    text += (text.empty() ? "" : ", ") + choice + " " + std::to_string(counts[choice]);
  return text;
}

Table people_table(const StudyTable& source, const std::string& label) {
  Table table;
  table.caption = label.empty() ? "Who took part" : "Who took part, " + label;
  table.header = {"column", "question", "answers", "answered"};
  table.n_names = 3;
  std::set<std::string> codes;
  for (const StudyTrial& trial : source.trials) codes.insert(trial.participant);
  for (const data::ParticipantColumn& one : source.people) {
    table.rows.push_back(
        {one.from.column, printable(one.from.question, 200), printable(described_answers(one), 400),
         std::to_string(one.answers.size()) + " of " + std::to_string(codes.size())});
  }
  table.notes = {"Answers to the questions of pages that name a column of participants."};
  return table;
}

/// Sections of a page of tasks: results over participants, figures, each task's numbers.
/// What was found: in a study of groups first between them.
std::string headline(const StudyAnalysis& analysis) {
  const std::string groups = groups_conclusion(analysis.between_groups);
  return groups.empty() ? conclusion(analysis) : groups + " " + conclusion(analysis);
}

class TaskPage {
 public:
  TaskPage(const StudyAnalysis& analysis, const StudyRecord& record)
      : analysis_(analysis),
        record_(record),
        label_(analysis.table.simulated ? "SIMULATED PARTICIPANTS" : ""),
        figures_(task_figures(analysis)),
        page_(headline(analysis), label_) {}

  std::string html(const std::string& program_version) {
    put_header();
    put_people();
    put_groups();
    put_results();
    put_figures(true);
    put_cells();
    put_figures(false);
    put_identification();
    put_check();
    return page_.html("Analysed with palpate " + program_version + ".");
  }

 private:
  void put_header() {
    const StudyTable& source = analysis_.table;
    if (source.simulated)
      page_.put_banner(
          "SIMULATED PARTICIPANTS: numbers below are from a model of a participant, not from "
          "humans.");
    page_.above_title() +=
        "<p class=\"study\">" + escaped(printable(study_of(source), 400)) + "</p>\n";
    page_.below_title() += "<p class=\"lead\">" + counted(source.trials.size(), "trial", "trials") +
                           " of " + escaped(printable(source.source, 400)) + "</p>\n";
    if (source.warnings.empty()) return;
    page_.below_title() += "<div class=\"warnings\" aria-label=\"Warnings\">\n";
    put_list(page_.below_title(), source.warnings);
    page_.below_title() += "</div>\n";
  }

  void put_check() {
    if (record_.checked.empty()) return;
    page_.begin_section("registration", "Check against the registration", "Registration");
    page_.body() += "<p>" + escaped_sentence(printable(record_.checked, 4000)) +
                    "</p>\n<p><a href=\"" + escaped(record_.check_page) +
                    "\">The check, point by point</a></p>\n";
    page_.end_section();
  }

  void put_people() {
    if (analysis_.table.people.empty()) return;
    page_.begin_section("people", "Participants", "Participants");
    put_table(page_.body(), people_table(analysis_.table, label_));
    page_.end_section();
  }

  void put_groups() {
    if (analysis_.between_groups.empty()) return;
    page_.begin_section("groups", "Groups of participants", "Groups");
    for (const Figure& figure : between_figures(analysis_)) page_.put_figure(figure);
    for (const Table& table : groups_tables(analysis_.between_groups, label_))
      put_table(page_.body(), table);
    page_.end_section();
  }

  void put_results() {
    const std::vector<Table> groups = group_tables(analysis_),
                             summaries = summary_tables(analysis_);
    if (groups.empty() && summaries.empty()) return;
    page_.begin_section("participants", "Results over participants", "Results over participants");
    for (const Table& table : groups) put_table(page_.body(), table);
    put_quotable(page_.body(), sentences_to_quote(analysis_));
    for (const Table& table : summaries) put_table(page_.body(), table);
    page_.end_section();
  }

  /// \param of_all  of results over participants; otherwise of each one's functions and tracks
  void put_figures(bool of_all) {
    for (const Figure& figure : figures_) {
      const bool single = figure.id.starts_with("function") || figure.id.starts_with("track");
      if (single != of_all) page_.put_figure_section(figure, figure.title);
    }
  }

  void put_cells() {
    page_.begin_section("numbers", "Numbers of each participant", "Numbers");
    for (const TaskCell& cell : analysis_.cells) {
      const std::vector<Table> tables = cell_tables(cell, label_);
      if (tables.empty()) continue;
      put_collapsible_tables(page_.body(),
                             stimulus_of(cell.task, cell.block_name, cell.shape) + ", " +
                                 printable(cell.renderer) + ": " +
                                 counted(cell.trials, "trial", "trials") + " of " +
                                 counted(cell.participants.size(), "participant", "participants") +
                                 ", " + std::to_string(cell.answered) + " answered",
                             tables);
    }
    page_.put_note(without_line_ends(explanation(analysis_.functions) + scale_note(analysis_)));
    page_.end_section();
  }

  void put_identification() {
    if (!analysis_.identification) return;
    for (const Figure& figure : figures_of(*analysis_.identification, {}))
      page_.put_figure_section(figure, figure.title);
    page_.begin_section("identification", "Times and accuracy of identification", "Identification");
    for (const Table& table : all_tables(*analysis_.identification)) put_table(page_.body(), table);
    put_quotable(page_.body(), sentences_to_quote(*analysis_.identification));
    page_.end_section();
  }

  const StudyAnalysis& analysis_;
  const StudyRecord& record_;
  std::string label_;
  std::vector<Figure> figures_;
  HtmlPage page_;
};

using TaskJson = nlohmann::ordered_json;

TaskJson finite(double value) { return std::isfinite(value) ? TaskJson(value) : TaskJson(nullptr); }

TaskJson maybe(const std::optional<double>& value) {
  return value ? finite(*value) : TaskJson(nullptr);
}

TaskJson ends_json(const std::optional<Interval>& interval) {
  if (!interval) return nullptr;
  return {finite(interval->low), finite(interval->high)};
}

/// Word for it in protocols.
const char* easier_name(protocols::Easier easier) {
  return easier == protocols::Easier::higher ? "higher" : "lower";
}

void put_status(TaskJson& out, const std::string& undefined) {
  out["status"] = undefined.empty() ? "ok" : "undefined";
  if (!undefined.empty()) out["reason"] = undefined;
}

TaskJson fit_json(const ParticipantFunction& one) {
  TaskJson fit;
  put_status(fit, one.fit.undefined);
  if (!one.fit.undefined.empty()) return fit;
  fit["function"] = to_string(one.model.function.shape);
  fit["scale"] = to_string(one.model.function.scale);
  fit["easier"] = easier_name(one.model.function.easier);
  fit["reversed"] = one.reversed;
  fit["threshold"] = one.fit.parameters.threshold;
  fit["threshold_ci95"] = ends_json(one.fit.threshold_ci95);
  fit["slope"] = one.fit.parameters.slope;
  fit["slope_ci95"] = ends_json(one.fit.slope_ci95);
  fit["determined"] = one.determined;
  fit["slope_at_bound"] = one.fit.slope_at_bound;
  fit["guess_is_lapse"] = one.model.guess_is_lapse;
  fit["guess"] = one.fit.parameters.guess;
  fit["guess_ci95"] = ends_json(one.fit.guess_ci95);
  fit["lapse"] = one.fit.parameters.lapse;
  fit["lapse_ci95"] = ends_json(one.fit.lapse_ci95);
  fit["log_likelihood"] = one.fit.log_likelihood;
  fit["deviance"] = one.goodness.deviance;
  fit["deviance_p"] = maybe(one.goodness.p);
  fit["pse"] = maybe(one.figures.pse);
  fit["pse_ci95"] = ends_json(one.figures.pse_ci95);
  fit["jnd"] = maybe(one.figures.jnd);
  fit["jnd_ci95"] = ends_json(one.figures.jnd_ci95);
  fit["weber_fraction"] = maybe(one.figures.weber_fraction);
  fit["weber_fraction_ci95"] = ends_json(one.figures.weber_fraction_ci95);
  return fit;
}

TaskJson posterior_json(const PsychometricPosterior& posterior) {
  TaskJson out;
  put_status(out, posterior.undefined);
  if (!posterior.undefined.empty()) return out;
  out["threshold"] = posterior.mean.threshold;
  out["threshold_ci95"] = ends_json(posterior.threshold_ci95);
  out["slope"] = posterior.mean.slope;
  out["slope_ci95"] = ends_json(posterior.slope_ci95);
  out["guess"] = posterior.mean.guess;
  out["guess_ci95"] = ends_json(posterior.guess_ci95);
  out["lapse"] = posterior.mean.lapse;
  out["lapse_ci95"] = ends_json(posterior.lapse_ci95);
  return out;
}

/// An adaptive procedure's own estimate.
TaskJson procedure_json(const TrackProcedure& procedure) {
  const protocols::Estimate& estimate = procedure.estimate;
  TaskJson out{{"kind", kind_of(procedure.spec)},
               {"threshold", maybe(estimate.threshold)},
               {"threshold_scale_sd", maybe(estimate.threshold_scale_sd)},
               {"slope", maybe(estimate.slope)},
               {"guess", maybe(estimate.guess)},
               {"lapse", maybe(estimate.lapse)},
               {"n_trials", estimate.trials},
               {"n_reversals", estimate.reversals},
               {"n_at_limit", estimate.at_limit},
               {"converges_at", maybe(procedure.target)},
               {"fit_level_there", maybe(procedure.fitted_level)}};
  if (const auto* quest = std::get_if<protocols::QuestPlus>(&procedure.spec)) {
    out["function"] = to_string(quest->function.shape);
    out["scale"] = to_string(quest->function.scale);
  }
  return out;
}

/// \param alternatives  of a forced choice; 0: of another task
TaskJson function_json(const ParticipantFunction& one, int alternatives) {
  TaskJson out{{"participant_id", one.participant}};
  for (const LevelCount& count : one.counts) {
    TaskJson level{
        {"level", count.level}, {"trials", count.trials}, {"successes", count.successes}};
    if (alternatives > 0 && count.trials > 0) {
      const auto found = forced_choice_detectability(count.successes, count.trials, alternatives);
      level["d_prime"] = finite(found.d_prime);
      level["d_prime_ci95"] = ends_json(found.d_prime_ci95);
    }
    out["levels"].push_back(std::move(level));
  }
  out["fit"] = fit_json(one);
  out["bayes"] = posterior_json(one.posterior);
  for (const Track& track : one.tracks) {
    out["tracks"].push_back({{"track", track.name},
                             {"levels", track.levels},
                             {"successes", track.successes},
                             {"reversal_trials", TaskJson::array()}});
    for (const std::size_t at : track.reversals)
      out["tracks"].back()["reversal_trials"].push_back(at + 1);
    if (track.procedure) out["tracks"].back()["procedure"] = procedure_json(*track.procedure);
  }
  TaskJson detection;
  put_status(detection, one.detectability.undefined);
  if (one.detectability.undefined.empty()) {
    detection["d_prime"] = maybe(one.detectability.d_prime);
    detection["d_prime_ci95"] = ends_json(one.detectability.d_prime_ci95);
    detection["criterion"] = maybe(one.detectability.criterion);
    detection["criterion_ci95"] = ends_json(one.detectability.criterion_ci95);
  }
  out["detectability"] = detection;
  return out;
}

TaskJson magnitude_json(const TaskCell& cell) {
  TaskJson out{{"exponent", maybe(cell.magnitude->exponent)},
               {"exponent_ci95", ends_json(cell.magnitude->exponent_ci95)},
               {"n_without_logarithm", cell.magnitude->without_logarithm}};
  for (const StevensLine& line : cell.magnitude->lines) {
    out["participants"].push_back({{"participant_id", cell.participants[line.participant]},
                                   {"exponent", maybe(line.exponent)},
                                   {"exponent_se", maybe(line.exponent_se)},
                                   {"log10_scale", maybe(line.log10_scale)},
                                   {"r_squared", maybe(line.r_squared)},
                                   {"levels", TaskJson::array()}});
    for (const StevensLine::Point& point : line.points)
      out["participants"].back()["levels"].push_back(
          {{"level", point.level}, {"geometric_mean", finite(point.magnitude)}});
  }
  for (const MagnitudeMean& one : cell.magnitude->means)
    out["levels"].push_back({{"level", one.level},
                             {"geometric_mean", one.geometric_mean},
                             {"ci95", ends_json(one.ci95)},
                             {"n_participants", one.participants}});
  return out;
}

TaskJson spread_json(const RatingSpread& spread) {
  return {{"n_ratings", spread.ratings},
          {"median", spread.median},
          {"lower_quartile", spread.lower_quartile},
          {"upper_quartile", spread.upper_quartile},
          {"mean", spread.mean}};
}

TaskJson mean_json(const MeanRating& mean) {
  return {{"n_participants", mean.participants},
          {"mean", maybe(mean.mean)},
          {"sd", maybe(mean.sd)},
          {"ci95", ends_json(mean.ci95)}};
}

TaskJson rated_participants_json(const std::vector<ParticipantRatings>& participants,
                                 const TaskCell& cell) {
  TaskJson out = TaskJson::array();
  for (const ParticipantRatings& one : participants) {
    TaskJson& entry =
        out.emplace_back(TaskJson{{"participant_id", cell.participants[one.participant]}});
    entry.update(spread_json(one.spread));
  }
  return out;
}

TaskJson ratings_json(const TaskCell& cell) {
  const Ratings& ratings = *cell.ratings;
  TaskJson out{{"labelled", ratings.labelled}, {"steps", TaskJson::array()}};
  for (const RatingStep& step : ratings.steps)
    out["steps"].push_back({{"number", step.number},
                            {"label", step.label.empty() ? TaskJson() : TaskJson(step.label)},
                            {"n_ratings", step.count},
                            {"share", finite(step.share)}});
  out["all"] = ratings.spread.ratings > 0 ? spread_json(ratings.spread) : TaskJson();
  out["mean_of_participants"] = mean_json(ratings.mean);
  out["participants"] = rated_participants_json(ratings.participants, cell);
  for (const RatingsAtLevel& at : ratings.levels)
    out["levels"].push_back({{"level", at.level},
                             {"all", spread_json(at.spread)},
                             {"mean_of_participants", mean_json(at.mean)},
                             {"participants", rated_participants_json(at.participants, cell)}});
  return out;
}

TaskJson wilcoxon_json(const Wilcoxon& ranks) {
  TaskJson out;
  put_status(out, ranks.undefined);
  out["V_positive_rank_sum"] = maybe(ranks.positive_rank_sum);
  out["n_nonzero"] = ranks.n_nonzero;
  out["p"] = maybe(ranks.p);
  out["method"] = ranks.exact ? "exact" : "normal approximation";
  if (ranks.p && ranks.n_nonzero < kLeastForWilcoxon)
    out["note"] = "With 5 or fewer participants who differ, the exact p cannot be below 0.05.";
  return out;
}

TaskJson information_json(const InformationTransfer& transfer) {
  return {{"bits", maybe(transfer.plain)},
          {"bits_corrected", maybe(transfer.corrected)},
          {"se", maybe(transfer.se)},
          {"stimulus_entropy_bits", transfer.stimulus_entropy},
          {"categories", maybe(transfer.categories)}};
}

TaskJson cell_json(const TaskCell& cell) {
  TaskJson out{{"task", cell.task},
               {"block_name", cell.block_name},
               {"shape", cell.shape},
               {"renderer", cell.renderer},
               {"n_trials", cell.trials},
               {"n_answered", cell.answered},
               {"n_judged", cell.judged},
               {"n_correct", cell.correct},
               {"standard_level", maybe(cell.standard_level)},
               {"level_unit", cell.level_unit.empty() ? TaskJson() : TaskJson(cell.level_unit)},
               {"expected_easier",
                cell.expected_easier ? TaskJson(easier_name(*cell.expected_easier)) : TaskJson()},
               {"forced_choice", cell.forced_choice},
               {"same_different", cell.same_different},
               {"n_intervals", cell.task == "compare" ? TaskJson(cell.intervals) : TaskJson()}};
  for (const ParticipantFunction& one : cell.functions)
    out["psychometric_functions"].push_back(
        function_json(one, cell.forced_choice ? cell.intervals : 0));
  if (cell.magnitude) out["magnitude_estimation"] = magnitude_json(cell);
  if (cell.ratings) out["ratings"] = ratings_json(cell);
  for (const Adjustment& one : cell.adjustments)
    out["adjustments"].push_back({{"participant_id", cell.participants[one.participant]},
                                  {"n_settings", one.settings},
                                  {"pse", one.pse},
                                  {"pse_ci95", ends_json(one.pse_ci95)},
                                  {"constant_error", one.constant_error},
                                  {"sd", maybe(one.sd)},
                                  {"jnd", maybe(one.jnd)},
                                  {"start_effect", maybe(one.start_effect)}});
  if (cell.information) {
    TaskJson& bits = out["information_transfer"] = information_json(*cell.information);
    bits["most_bits"] = finite(cell.information_most);
    bits["mean_of_participants_bits_corrected"] = maybe(cell.information_mean.mean);
    bits["mean_of_participants_ci95"] = ends_json(cell.information_mean.ci95);
    if (!cell.information_mean.undefined.empty())
      bits["mean_of_participants_reason"] = cell.information_mean.undefined;
    for (std::size_t i = 0; i < cell.informations.size(); ++i) {
      TaskJson one{{"participant_id", cell.participants[i]}};
      one.update(information_json(cell.informations[i]));
      bits["participants"].push_back(std::move(one));
    }
  }
  TaskJson confidence;
  put_status(confidence, cell.confidence.undefined);
  if (cell.confidence.area) {
    confidence["type2_roc_area"] = *cell.confidence.area;
    confidence["ci95"] = ends_json(cell.confidence.area_ci95);
    const TransformedMean& mean = cell.confidence_mean;
    confidence["mean_of_participants"] = {{"n_participants", mean.n},
                                          {"n_left_out", mean.left_out},
                                          {"type2_roc_area", maybe(mean.mean)},
                                          {"ci95", ends_json(mean.ci95)}};
  }
  out["confidence"] = confidence;
  return out;
}

TaskJson group_json(const TaskGroup& group) {
  TaskJson out{{"task", group.task},
               {"block_name", group.block_name},
               {"shape", group.shape},
               {"measure", group.measure},
               {"unit", group.unit.empty() ? TaskJson() : TaskJson(group.unit)},
               {"mean_is", group.geometric ? "geometric" : "arithmetic"}};
  for (const GroupMean& one : group.renderers) {
    TaskJson renderer{{"renderer", one.renderer},
                      {"from", one.of_model ? "hierarchical model" : "participants"},
                      {"n_participants", one.of_model ? one.n_of_model : one.participants.size()},
                      {"n_undetermined", one.n_undetermined},
                      {"mean", maybe(one.mean)},
                      {"ci95", ends_json(one.ci95)},
                      {group.geometric ? "sd_of_natural_logs" : "sd", maybe(one.sd)},
                      {"participants", TaskJson::array()}};
    for (const NamedFigure& figure : one.participants)
      renderer["participants"].push_back(
          {{"participant_id", figure.participant}, {"value", finite(figure.value)}});
    out["renderers"].push_back(std::move(renderer));
  }
  return out;
}

/// The least bound of equivalence: of ratios, on the scale of logarithms.
TaskJson least_bound(const TaskGroupComparison& one) {
  if (!one.low90 || !one.high90) return nullptr;
  const auto size = [&](double end) { return std::abs(one.ratio ? std::log(end) : end); };
  return std::max(size(*one.low90), size(*one.high90));
}

TaskJson comparison_json(const TaskComparison& one, bool of_renderers) {
  const char* const condition = of_renderers ? "renderer" : "condition";
  TaskJson out{{"task", one.task}, {"measure", one.measure}};
  if (one.measure == "rating" && !of_renderers) out["block_name"] = one.block_name;
  if (of_renderers) {
    out["block_name"] = one.block_name;
    out["shape"] = one.shape;
  } else {
    out["renderer"] = one.renderer;
  }
  out["reference"] = one.conditions[0];
  out["natural_logarithms"] = one.logarithms;
  out["n_undetermined"] = one.n_undetermined;
  put_status(out, one.comparison.undefined);
  out["participant_sd"] = maybe(one.comparison.participant_sd);
  out["residual_sd"] = maybe(one.comparison.residual_sd);
  if (!one.comparison.differences.empty()) out["n_tests"] = one.n_tests;
  for (const ConditionDifference& difference : one.comparison.differences) {
    out["differences"].push_back({{condition, one.conditions[difference.condition]},
                                  {"n_pairs", difference.n_pairs},
                                  {"mean", finite(difference.mean)},
                                  {"ci95", ends_json(difference.t_test.log_ratio_ci95)},
                                  {"t", maybe(difference.t_test.t)},
                                  {"df", maybe(difference.t_test.df)},
                                  {"p", maybe(difference.t_test.p)},
                                  {"p_holm", maybe(difference.t_test.p_holm)},
                                  {"dz", maybe(difference.effect_size.dz)},
                                  {"mixed_estimate", maybe(difference.mixed_estimate)},
                                  {"mixed_se", maybe(difference.mixed_se)}});
    const PairedEvidence evidence = evidence_of(difference.mean, difference.t_test);
    out["differences"].back()["ci90"] = ends_json(evidence.ci90);
    out["differences"].back()["least_bound"] = maybe(evidence.least_bound);
    out["differences"].back()["bf10"] = maybe(evidence.bayes_factor);
    if (one.measure == "rating")
      out["differences"].back()["wilcoxon"] = wilcoxon_json(difference.wilcoxon);
  }
  return out;
}

TaskJson maybe_ends(const std::optional<double>& low, const std::optional<double>& high) {
  return {maybe(low), maybe(high)};
}

TaskJson group_model_json(const TaskGroupModel& one) {
  TaskJson out{{"block", one.block_name},        {"task", one.task},         {"shape", one.shape},
               {"measure", one.measure},         {"renderer", one.renderer}, {"n", one.n},
               {"estimate", maybe(one.estimate)}};
  if (one.level) out["level"] = *one.level;
  out["ci95"] = maybe_ends(one.low, one.high);
  out["sd_between"] = maybe(one.sd_between);
  out["lapse_mean"] = maybe(one.lapse_mean);
  out["status"] = one.status();
  if (!one.undefined.empty()) out["reason"] = one.undefined;
  out["notes"] = one.notes;
  return out;
}

TaskJson group_comparison_json(const TaskGroupComparison& one) {
  TaskJson out{{"block", one.block_name},
               {"task", one.task},
               {"shape", one.shape},
               {"measure", one.measure},
               {"reference", one.reference},
               {"compared", one.compared},
               {"scale", one.ratio ? "ratio" : "difference"},
               {"n", one.n},
               {"estimate", maybe(one.estimate)}};
  if (one.level) out["level"] = *one.level;
  out["ci95"] = maybe_ends(one.low, one.high);
  out["ci90"] = maybe_ends(one.low90, one.high90);
  out["p"] = maybe(one.p);
  out["p_holm"] = maybe(one.p_holm);
  out["lr"] = maybe(one.likelihood_ratio);
  out["status"] = one.status();
  if (!one.undefined.empty()) out["reason"] = one.undefined;
  const IndividualFits& fits = one.individual_fits;
  out["individual_fits"] = {{"n", fits.n},
                            {"left_out", fits.left_out},
                            {"left_out_participants", fits.left_out_names},
                            {"t", maybe(fits.t)},
                            {"df", maybe(fits.df)},
                            {"p", maybe(fits.p)}};
  return out;
}

/// Where a result stands by name: MEASURE.BLOCK, of several stimuli in a block
/// MEASURE.BLOCK.STIMULUS.
TaskJson& named_place(TaskJson& out, const StudyAnalysis& analysis, const std::string& measure,
                      const std::string& task, const std::string& block, const std::string& shape) {
  const bool several = std::ranges::any_of(analysis.cells, [&](const TaskCell& cell) {
    return cell.task == task && cell.block_name == block && cell.shape != shape;
  });
  TaskJson& place = out[measure][block.empty() ? task : block];
  return several ? place[shape] : place;
}

/// "d_prime_at_2.5": a measure at a level.
std::string leveled(const std::string& measure, const std::optional<double>& level) {
  return level ? measure + "_at_" + short_number(*level) : measure;
}

/// A paired comparison by its names. \param place  where it stands in a root: a new key in a root
/// moves its other values, so neither place is kept
template <class Place>
void put_comparison(const TaskComparison& one, const ConditionDifference& difference, TaskJson& out,
                    const Place& place) {
  const auto back = [&](double value) { return one.logarithms ? std::exp(value) : value; };
  const PairedEvidence evidence = evidence_of(difference.mean, difference.t_test);
  const auto& ends = difference.t_test.log_ratio_ci95;
  const auto end = [&](const std::optional<Interval>& of, bool low) {
    return of ? finite(back(low ? of->low : of->high)) : TaskJson(nullptr);
  };
  place(out).update({{one.logarithms ? "ratio" : "difference", finite(back(difference.mean))},
                     {"ci95_low", end(ends, true)},
                     {"ci95_high", end(ends, false)},
                     {"ci90_low", end(evidence.ci90, true)},
                     {"ci90_high", end(evidence.ci90, false)},
                     {"t", maybe(difference.t_test.t)},
                     {"p", maybe(difference.t_test.p)},
                     {"p_holm", maybe(difference.t_test.p_holm)},
                     {"wilcoxon_p", maybe(difference.wilcoxon.p)},
                     {"bf10", maybe(evidence.bayes_factor)},
                     {"n", difference.n_pairs}});
  place(out["equivalence"])["least_bound"] = maybe(evidence.least_bound);
}

/// The name of a compared condition: BLOCK, of several stimuli in a block BLOCK.STIMULUS.
std::string short_condition(const StudyAnalysis& analysis, const TaskComparison& one,
                            const std::string& condition) {
  if (!one.block_name.empty()) return condition;
  for (const TaskCell& cell : analysis.cells) {
    if (cell.task != one.task ||
        cell.block_name + (cell.shape.empty() ? "" : ", " + cell.shape) != condition)
      continue;
    const bool several = std::ranges::any_of(analysis.cells, [&](const TaskCell& other) {
      return other.task == cell.task && other.block_name == cell.block_name &&
             other.shape != cell.shape;
    });
    return several ? cell.block_name + "." + cell.shape : cell.block_name;
  }
  return condition;
}

/// Comparisons of blocks and stimuli: between.MEASURE.REFERENCE.COMPARED, where a condition is
/// BLOCK or BLOCK.STIMULUS; of ratings between.rating.BLOCK.STIMULUS.STIMULUS. Of several renderers
/// the renderer follows.
void put_conditions(const StudyAnalysis& analysis, TaskJson& out) {
  std::set<std::string> renderers;
  for (const TaskCell& cell : analysis.cells) renderers.insert(cell.renderer);
  for (const TaskComparison& one : analysis.conditions) {
    for (const ConditionDifference& difference : one.comparison.differences) {
      const auto place = [&](TaskJson& root) -> TaskJson& {
        TaskJson* at = &root["between"][one.measure];
        if (!one.block_name.empty()) at = &(*at)[one.block_name];
        at = &(*at)[short_condition(analysis, one, one.conditions.front())];
        at = &(*at)[short_condition(analysis, one, one.conditions[difference.condition])];
        return renderers.size() > 1 ? (*at)[one.renderer] : *at;
      };
      put_comparison(one, difference, out, place);
    }
  }
}

/// The group's values without a model: means of exponents, ratings and settings.
void put_means(const StudyAnalysis& analysis, TaskJson& out) {
  for (const TaskGroup& group : analysis.groups) {
    for (const GroupMean& one : group.renderers) {
      if (one.of_model || !one.mean) continue;
      const auto end = [&](bool low) {
        return one.ci95 ? finite(low ? one.ci95->low : one.ci95->high) : TaskJson(nullptr);
      };
      TaskJson& place = named_place(out, analysis, group.measure, group.task, group.block_name,
                                    group.shape)[one.renderer];
      if (place.is_null())
        place = {{"estimate", finite(*one.mean)},
                 {"ci95_low", end(true)},
                 {"ci95_high", end(false)},
                 {"n", one.participants.size()}};
    }
  }
}

/// Results by name, for hypotheses: objects, as elements of lists have no names. Of more than two
/// renderers the compared one is a part of the name.
TaskJson named_json(const StudyAnalysis& analysis) {
  TaskJson out = TaskJson::object();
  for (const TaskGroupModel& one : analysis.group_models.models) {
    TaskJson& place = named_place(out, analysis, leveled(one.measure, one.level), one.task,
                                  one.block_name, one.shape)[one.renderer];
    place = {{"estimate", maybe(one.estimate)},
             {"ci95_low", maybe(one.low)},
             {"ci95_high", maybe(one.high)},
             {"n", one.n}};
  }
  for (const TaskGroupComparison& one : analysis.group_models.comparisons) {
    const bool several = std::ranges::any_of(
        analysis.group_models.comparisons, [&](const TaskGroupComparison& other) {
          return other.task == one.task && other.block_name == one.block_name &&
                 other.shape == one.shape && other.compared != one.compared;
        });
    TaskJson values{{one.ratio ? "ratio" : "difference", maybe(one.estimate)},
                    {"ci95_low", maybe(one.low)},
                    {"ci95_high", maybe(one.high)},
                    {"ci90_low", maybe(one.low90)},
                    {"ci90_high", maybe(one.high90)},
                    {"lr", maybe(one.likelihood_ratio)},
                    {"p", maybe(one.p)},
                    {"p_holm", maybe(one.p_holm)},
                    {"n", one.n}};
    const std::string measure = leveled(one.measure, one.level);
    TaskJson& place = named_place(out, analysis, measure, one.task, one.block_name, one.shape);
    (several ? place[one.compared] : place).update(values);
    TaskJson& bound =
        named_place(out["equivalence"], analysis, measure, one.task, one.block_name, one.shape);
    (several ? bound[one.compared] : bound)["least_bound"] = least_bound(one);
  }
  for (const TaskComparison& one : analysis.renderers) {
    if (has_model(analysis, one)) continue;
    for (const ConditionDifference& difference : one.comparison.differences) {
      const std::string& compared = one.conditions[difference.condition];
      const auto place = [&](TaskJson& root) -> TaskJson& {
        TaskJson& all =
            named_place(root, analysis, one.measure, one.task, one.block_name, one.shape);
        return one.conditions.size() > 2 ? all[compared] : all;
      };
      put_comparison(one, difference, out, place);
    }
  }
  put_conditions(analysis, out);
  put_means(analysis, out);
  return out;
}

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
  if (cell.magnitude) text += magnitude_text(cell);
  if (cell.ratings) text += ratings_text(cell);
  text += adjustment_text(cell);
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
            " left out: no threshold among the levels shown, a slope too steep for them, or "
            "reversed answers\n";
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

std::string task_report_html(const StudyAnalysis& analysis, const std::string& program_version,
                             const StudyRecord& record) {
  return TaskPage(analysis, record).html(program_version);
}

std::string task_report_json(const StudyAnalysis& analysis, const std::string& program_version) {
  TaskJson out{{"version", 1},
               {"simulated", analysis.table.simulated},
               {"title", analysis.table.title},
               {"source", analysis.table.source},
               {"warnings", analysis.table.warnings},
               {"program_version", program_version},
               {"n_trials", analysis.table.trials.size()},
               {"n_practice", analysis.table.n_practice},
               {"cells", TaskJson::array()},
               {"group_results", TaskJson::array()},
               {"renderer_comparisons", TaskJson::array()},
               {"condition_comparisons", TaskJson::array()}};
  for (const TaskCell& cell : analysis.cells) out["cells"].push_back(cell_json(cell));
  for (const TaskGroup& group : analysis.groups) out["group_results"].push_back(group_json(group));
  for (const TaskComparison& one : analysis.renderers)
    out["renderer_comparisons"].push_back(comparison_json(one, true));
  for (const TaskComparison& one : analysis.conditions)
    out["condition_comparisons"].push_back(comparison_json(one, false));
  out["group_model"] = TaskJson::array();
  for (const TaskGroupModel& one : analysis.group_models.models)
    out["group_model"].push_back(group_model_json(one));
  out["group_comparisons"] = TaskJson::array();
  for (const TaskGroupComparison& one : analysis.group_models.comparisons)
    out["group_comparisons"].push_back(group_comparison_json(one));
  out.update(named_json(analysis));
  put_groups(analysis.between_groups, out);
  if (analysis.identification)
    out["identification"] = read_ordered_json(report_json(*analysis.identification));
  return out.dump(1, ' ', false, TaskJson::error_handler_t::replace) + "\n";
}

std::string task_report_text(const StudyAnalysis& analysis) {
  std::string text;
  if (analysis.table.simulated) text += "SIMULATED PARTICIPANTS\n\n";
  if (!analysis.groups.empty() || analysis.identification)
    text += paragraph_text(headline(analysis)) + "\n";
  for (const std::string& warning : analysis.table.warnings) text += printable(warning, 400) + "\n";
  if (!analysis.table.warnings.empty()) text += "\n";
  for (const TaskCell& cell : analysis.cells) text += cell_text(cell);
  for (const TaskGroup& group : analysis.groups) text += group_text(group);
  text += groups_text(analysis.between_groups);
  text += group_detection_text(analysis) + group_model_text(analysis);
  for (const TaskComparison& one : analysis.renderers) text += comparison_text(one, true);
  for (const TaskComparison& one : analysis.conditions) text += comparison_text(one, false);
  const std::vector<std::string> sentences = sentences_to_quote(analysis);
  if (!sentences.empty()) text += "To quote\n";
  for (const std::string& sentence : sentences) text += paragraph_text(sentence);
  if (!sentences.empty()) text += "\n";
  text += explanation(analysis.functions) + scale_note(analysis);
  if (analysis.identification)
    text += "\nTimes and accuracy of identification\n\n" + report_text(*analysis.identification);
  return text;
}

}  // namespace palpate::analysis
