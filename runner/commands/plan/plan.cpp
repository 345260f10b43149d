#include "runner/commands/plan/plan.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iostream>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "analysis/figures/svg.h"
#include "analysis/report/coverage_report.h"
#include "analysis/report/plan_record.h"
#include "analysis/report/plan_report.h"
#include "analysis/statistics/analysis.h"
#include "analysis/statistics/comparison.h"
#include "analysis/text.h"
#include "protocols/json_document.h"
#include "protocols/parse.h"
#include "runner/commands/plan/plan_cues.h"
#include "runner/commands/plan/plan_groups.h"
#include "runner/commands/shared/command.h"
#include "runner/output/outputs.h"
#include "runner/output/progress_line.h"
#include "runner/study/study_trials.h"

namespace palpate::runner::commands {
namespace {

// The part of 'palpate plan' for thresholds.

struct ThresholdOptions {
  /// Of one of kMeasureOptions.
  double jnd = 0, pse = 0, threshold = 0, accuracy_points = 0, rating = 0, exponent = 0;
  double deviation = 0, aftereffect = 0, adaptation = 0;
  std::string weber = "0.1";  ///< with --cues two
  double participant_sd = 0.3, effect_sd = 0.2, pse_sd = 0.5, reach = 2.5;
  double accuracy = 0.8, equivalence = 0;
  std::string contrast;     ///< as analysis::to_string
  double movement_sd = -1;  ///< of reaching; < 0: the measure's default
};

/// Each plans another measure than times.
struct MeasureOption {
  const char* name;
  analysis::PlannedMeasure measure;
  double ThresholdOptions::*effect;
};
constexpr MeasureOption kMeasureOptions[] = {
    {"jnd-effect", analysis::PlannedMeasure::jnd, &ThresholdOptions::jnd},
    {"pse-effect", analysis::PlannedMeasure::pse, &ThresholdOptions::pse},
    {"threshold-effect", analysis::PlannedMeasure::threshold, &ThresholdOptions::threshold},
    {"accuracy-effect", analysis::PlannedMeasure::accuracy, &ThresholdOptions::accuracy_points},
    {"rating-effect", analysis::PlannedMeasure::rating, &ThresholdOptions::rating},
    {"exponent-effect", analysis::PlannedMeasure::exponent, &ThresholdOptions::exponent},
    {"deviation-effect", analysis::PlannedMeasure::deviation, &ThresholdOptions::deviation},
    {"aftereffect-effect", analysis::PlannedMeasure::aftereffect, &ThresholdOptions::aftereffect},
    {"adaptation-effect", analysis::PlannedMeasure::adaptation, &ThresholdOptions::adaptation}};

constexpr double kMillimetre = 1e-3;

namespace po = boost::program_options;

constexpr std::size_t kMostParticipants = 10'000, kMostTrials = 10'000, kMostStudies = 10'000'000;
constexpr double kMostSd = 100;  // log seconds

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == at) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

std::size_t whole_number(const std::string& option, const std::string& text, std::size_t least,
                         std::size_t most) {
  std::size_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < least || value > most) {
    throw UsageError("--" + option + ": expected a whole number from " + std::to_string(least) +
                     " to " + std::to_string(most) + ", found '" + printable(text, 60) + "'");
  }
  return value;
}

double real_number(const std::string& option, const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    throw UsageError("--" + option + ": expected a number, found '" + printable(text, 60) + "'");
  }
  return value;
}

void check_within(const std::string& option, double value, double low, double high) {
  if (value >= low && value <= high) return;
  throw UsageError("--" + option + ": expected a number from " + analysis::fixed(low, 2) + " to " +
                   analysis::fixed(high, 2));
}

std::string shapes_of(const analysis::StudyModel& model) {
  std::string known;
  for (const std::string& each : model.shapes)
    known += (known.empty() ? "" : ", ") + printable(each, 60);
  return known;
}

/// "cone=22,cube=11": percent reductions; other shapes have no effect. "11": all shapes.
void put_effects(const std::string& text, analysis::StudyModel& model) {
  const auto log_ratio = [](const std::string& percent) {
    const double value = real_number("effect", percent);
    if (!(value < 100) || value < -1000) {
      throw UsageError("--effect: expected a percent reduction of time below 100, found '" +
                       printable(percent, 60) + "'");
    }
    return std::log1p(-value / 100);
  };
  if (text.find('=') == std::string::npos) {
    std::ranges::fill(model.log_ratios, log_ratio(text));
    return;
  }
  std::ranges::fill(model.log_ratios, 0.0);
  std::set<std::string> named;
  for (const std::string& part : split(text, ',')) {
    const std::size_t at = part.rfind('=');
    const std::string name = part.substr(0, at);
    const auto shape = std::ranges::find(model.shapes, name);
    if (at == std::string::npos || shape == model.shapes.end()) {
      throw UsageError("--effect: expected SHAPE=PERCENT with a shape of " + shapes_of(model) +
                       ", found '" + printable(part, 60) + "'");
    }
    if (!named.insert(name).second) {
      throw UsageError("--effect: expected each shape once, found '" + printable(name, 60) +
                       "' again");
    }
    model.log_ratios[static_cast<std::size_t>(shape - model.shapes.begin())] =
        log_ratio(part.substr(at + 1));
  }
}

/// The paper's figure 15, for the shapes in the model; other shapes all get the smaller of the
/// paper's effects. \return the assumed effects, in words
std::string put_default_effects(analysis::StudyModel& model) {
  double smallest = 100;
  for (const analysis::PaperEffect& effect : analysis::kPaperEffects) {
    smallest = std::min(smallest, effect.percent_reduction.value_or(smallest));
  }
  bool known = false;
  for (std::size_t s = 0; s < model.shapes.size(); ++s) {
    const analysis::PaperEffect* effect = analysis::find_paper_effect(model.shapes[s]);
    const double percent = effect ? effect->percent_reduction.value_or(0) : 0;
    model.log_ratios[s] = std::log1p(-percent / 100);
    known = known || percent > 0;
  }
  std::string assumed = "the paper's";
  if (!known) {
    std::ranges::fill(model.log_ratios, std::log1p(-smallest / 100));
    assumed = analysis::fixed(smallest, 0) +
              " % for every shape, the smaller of the paper's, whose shapes are "
              "not among these";
  }
  return "No effects were given (--effect SHAPE=PERCENT,...); assumed: " + assumed +
         ". The shapes: " + shapes_of(model) + ".";
}

/// The times of a pilot, which may be of a protocol with tasks. \throws UsageError
analysis::TrialTable pilot_trials(const PlanOptions& options) {
  analysis::StudyTable pilot =
      study::read_study({options.database, options.csv, options.protocol}).table;
  analysis::identify_times(pilot);
  if (pilot.times) return std::move(*pilot.times);
  throw UsageError(printable(pilot.source) +
                   ": expected a pilot in which stimuli are identified; plan --jnd-effect is for "
                   "thresholds and needs no pilot");
}

void require(bool right, const char* option, const char* expected) {
  if (!right) throw UsageError(std::string("--") + option + ": expected " + expected);
}

bool is_in_millimetres(analysis::PlannedMeasure measure) {
  return measure == analysis::PlannedMeasure::deviation ||
         measure == analysis::PlannedMeasure::aftereffect;
}

/// A percentage as a log ratio, points as a share, millimetres in m, others as they are.
double on_scale(analysis::PlannedMeasure measure, double effect) {
  switch (measure) {
    case analysis::PlannedMeasure::jnd:
    case analysis::PlannedMeasure::threshold:
    case analysis::PlannedMeasure::exponent:
      return std::log1p(-effect / 100);
    case analysis::PlannedMeasure::accuracy:
      return effect / 100;
    case analysis::PlannedMeasure::deviation:
    case analysis::PlannedMeasure::aftereffect:
      return effect * kMillimetre;
    case analysis::PlannedMeasure::pse:
    case analysis::PlannedMeasure::rating:
    case analysis::PlannedMeasure::adaptation:
      break;
  }
  return effect;
}

/// The greatest effect that makes sense: of percentages smaller and larger.
void require_effect(const MeasureOption& option, double effect, double accuracy) {
  const auto within = [effect](double low, double high) { return effect >= low && effect <= high; };
  switch (option.measure) {
    case analysis::PlannedMeasure::jnd:
    case analysis::PlannedMeasure::threshold:
    case analysis::PlannedMeasure::exponent:
      return require(within(-400, 95), option.name, "percent from -400 to 95");
    case analysis::PlannedMeasure::accuracy:
      return require(within(-100 * accuracy + 1, 100 * (1 - accuracy) - 1), option.name,
                     "percentage points that leave the accuracy between 1 and 99 %");
    case analysis::PlannedMeasure::pse:
      return require(within(-5, 5), option.name, "-5 to 5 JNDs");
    case analysis::PlannedMeasure::rating:
      return require(within(-6, 6), option.name, "-6 to 6 steps");
    case analysis::PlannedMeasure::deviation:
    case analysis::PlannedMeasure::aftereffect:
      return require(within(-100, 100), option.name, "-100 to 100 mm");
    case analysis::PlannedMeasure::adaptation:
      return require(within(-2, 2), option.name, "-2 to 2");
  }
}

/// NaN: it is no number.
double number_of(const std::string& text) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  return error == std::errc() && stop == end ? value : std::nan("");
}

/// Puts what a plan of movements to targets has beside the effect and its bound. Without a pilot
/// the standard deviations are guesses.
void put_reaching(const ThresholdOptions& options, const po::variables_map& values,
                  analysis::ThresholdStudy& study) {
  constexpr double kDeviationSd = 3, kMovementSd = 6;  // mm
  constexpr double kAdaptationSd = 0.15, kClampedSd = 0.3;
  const bool lengths = is_in_millimetres(study.measure);
  const double unit = lengths ? kMillimetre : 1, most = lengths ? 100 : 2;
  const double usual = lengths ? kDeviationSd : kAdaptationSd;
  const auto put = [&](const char* option, double given, double otherwise, double& out) {
    const bool own = values.count(option) != 0 && !values[option].defaulted();
    require(!own || (given >= 0 && given <= most), option, lengths ? "0 to 100 mm" : "0 to 2");
    out = unit * (own ? given : otherwise);
  };
  put("jnd-sd", options.participant_sd, usual, study.participant_sd);
  put("jnd-effect-sd", options.effect_sd, usual, study.effect_sd);
  put("movement-sd", options.movement_sd, lengths ? kMovementSd : kClampedSd, study.movement_sd);
  for (const auto contrast : {analysis::PlannedContrast::conditions,
                              analysis::PlannedContrast::groups, analysis::PlannedContrast::zero}) {
    if (options.contrast == to_string(contrast)) study.contrast = contrast;
  }
  require(options.contrast == to_string(study.contrast), "contrast", "conditions, groups or zero");
  require(!(study.bound && study.contrast == analysis::PlannedContrast::groups), "equivalence",
          "conditions or zero as --contrast: groups are compared by an analysis of variance");
}

analysis::ThresholdStudy study_of(const ThresholdOptions& thresholds, const MeasureOption& measure,
                                  const PlanOptions& options, const po::variables_map& values) {
  const auto within = [](double value, double low, double high) {
    return value >= low && value <= high;  // false for NaN
  };
  require(within(thresholds.accuracy, 0.05, 0.98), "accuracy", "a share from 0.05 to 0.98");
  const double effect = thresholds.*measure.effect;
  require_effect(measure, effect, thresholds.accuracy);
  const double weber = number_of(thresholds.weber);
  require(within(weber, 0.001, 1), "weber", "a JND / standard from 0.001 to 1");
  const bool reaching = is_of_reaching(measure.measure);
  if (!reaching) {
    require(within(thresholds.participant_sd, 0, 2), "jnd-sd", "0 to 2");
    require(within(thresholds.effect_sd, 0, 2), "jnd-effect-sd", "0 to 2");
  }
  require(within(thresholds.pse_sd, 0, 5), "pse-sd", "0 to 5 JNDs");
  require(within(thresholds.reach, 0.5, 10), "reach", "0.5 to 10 JNDs");
  require(within(options.alpha, 1e-6, 0.5), "alpha", "0.000001 to 0.5");
  require(within(options.power, 0.01, 0.999), "power", "0.01 to 0.999");
  analysis::ThresholdStudy study;
  study.weber_fraction = weber;
  study.measure = measure.measure;
  study.effect = on_scale(measure.measure, effect);
  study.accuracy = thresholds.accuracy;
  study.participant_sd = thresholds.participant_sd;
  study.effect_sd = thresholds.effect_sd;
  // Between people, odds and ratings differ more than log JNDs.
  const bool wider = measure.measure == analysis::PlannedMeasure::accuracy ||
                     measure.measure == analysis::PlannedMeasure::rating;
  if (wider && values["jnd-sd"].defaulted()) study.participant_sd = 0.7;
  if (wider && values["jnd-effect-sd"].defaulted()) study.effect_sd = 0.5;
  if (values.count("equivalence")) {
    require(thresholds.equivalence > 0 && thresholds.equivalence < 400, "equivalence",
            "a bound above 0, in the unit of the effect");
    study.bound = std::abs(on_scale(measure.measure, -thresholds.equivalence));
  }
  if (reaching) put_reaching(thresholds, values, study);
  for (const char* const option : {"movement-sd", "contrast"}) {
    if (!reaching && values.count(option) != 0 && !values[option].defaulted())
      throw UsageError(std::string("--") + option +
                       ": requires --deviation-effect, --aftereffect-effect and "
                       "--adaptation-effect");
  }
  study.pse_sd = thresholds.pse_sd;
  study.reach = thresholds.reach;
  study.alpha = options.alpha;
  return study;
}

/// At most so many numbers of participants over the range: each study is fitted for each.
std::vector<std::size_t> numbers_over(std::size_t least, std::size_t most) {
  constexpr std::size_t kMost = 5;
  std::vector<std::size_t> numbers;
  const std::size_t steps = std::min(kMost - 1, most - least);
  for (std::size_t i = 0; i <= steps; ++i)
    numbers.push_back(steps == 0 ? least : least + i * (most - least) / steps);
  return numbers;
}

void add_threshold_options(CommandLine& line, ThresholdOptions& options) {
  auto add = line.options.add_options();
  add("jnd-effect", po::value(&options.jnd)->value_name("PERCENT"),
      "of JNDs instead of times: how much smaller the JND is with the second renderer or "
      "condition; --trials are those of a participant with each, --participants a range");
  add("pse-effect", po::value(&options.pse)->value_name("JNDS"),
      "of PSEs: how much higher with the second");
  add("threshold-effect", po::value(&options.threshold)->value_name("PERCENT"),
      "of thresholds of a forced choice: how much lower with the second");
  add("accuracy-effect", po::value(&options.accuracy_points)->value_name("POINTS"),
      "of accuracy: how many percentage points higher with the second");
  add("rating-effect", po::value(&options.rating)->value_name("STEPS"),
      "of mean ratings on seven steps: how much higher with the second");
  add("exponent-effect", po::value(&options.exponent)->value_name("PERCENT"),
      "of exponents of magnitude estimation: how much smaller with the second");
  add("deviation-effect", po::value(&options.deviation)->value_name("MM"),
      "of movements to targets: how much larger the mean deviation with the field is, mm");
  add("aftereffect-effect", po::value(&options.aftereffect)->value_name("MM"),
      "the same in catch trials");
  add("adaptation-effect", po::value(&options.adaptation)->value_name("DIFFERENCE"),
      "of movements to targets: how much higher the mean adaptation in clamp trials is");
  add("contrast",
      po::value(&options.contrast)
          ->default_value("conditions")
          ->value_name("conditions|groups|zero"),
      "of movements: with the second condition; in the second of two groups, whose participants "
      "--participants counts together; or than 0");
  add("movement-sd", po::value(&options.movement_sd)->value_name("SD"),
      "of single movements: mm, 6 by default; adaptations 0.3");
  add("equivalence", po::value(&options.equivalence)->value_name("BOUND"),
      "show equivalence within this bound instead, in the unit of the effect; with an effect of 0");
  add("accuracy", po::value(&options.accuracy)->default_value(0.8, "0.8")->value_name("SHARE"),
      "correct with the first condition");
  add("weber", po::value(&options.weber)->default_value("0.1")->value_name("W"),
      "JND / standard with the first condition; with --cues FELT,SEEN: standard deviations of a "
      "single estimate / standard");
  add("cues",
      "plan a study of seen and felt cues: gain over the better cue, and what --participants "
      "people (12) with --trials at a level (30) can show of it");
  add("jnd-sd", po::value(&options.participant_sd)->default_value(0.3, "0.3")->value_name("SD"),
      "of participants' log JND, threshold or exponent; of log odds and ratings 0.7, deviations "
      "3 mm, adaptations 0.15");
  add("jnd-effect-sd", po::value(&options.effect_sd)->default_value(0.2, "0.2")->value_name("SD"),
      "of participants' differences: log ratios, JNDs; of log odds and ratings 0.5, deviations "
      "3 mm, adaptations 0.15");
  add("pse-sd", po::value(&options.pse_sd)->default_value(0.5, "0.5")->value_name("SD"),
      "of participants' PSE, in JNDs");
  add("reach", po::value(&options.reach)->default_value(2.5, "2.5")->value_name("JNDS"),
      "how far the levels reach from the standard");
  add("coverage",
      "how often the 95 % intervals of thresholds, slopes and lapses hold the truth, after each "
      "procedure, with lapses and without, and those of the group's model; takes --studies (200), "
      "--seed, --jobs, --json");
}

/// Prints how often the intervals of thresholds contain the true value, and writes its JSON.
/// \throws UsageError
void print_coverage(const PlanOptions& options, const po::variables_map& values,
                    output::Outputs& outputs) {
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
    own.studies = "100";  // the number of plans, which are not made
  }
  const analysis::PowerSettings asked = settings_of(own, values).simulation;
  analysis::CoverageSettings settings;
  settings.studies = studies;
  settings.seed = asked.seed;
  settings.jobs = asked.jobs;
  output::ProgressLine progress("simulated studies");
  settings.progress = [&progress](double share) { progress.show(share); };
  const auto results = analysis::interval_coverage(settings);
  progress.begin("simulated studies of groups");
  analysis::GroupCoverageSettings of_groups;
  of_groups.studies = settings.studies;
  of_groups.seed = settings.seed;
  of_groups.jobs = settings.jobs;
  of_groups.progress = settings.progress;
  const auto groups = analysis::group_coverage(analysis::group_coverage_studies(), of_groups);
  progress.clear();
  if (outputs.wanted("json"))
    outputs.put("json", analysis::coverage_json(results, settings, groups));
  outputs.write();
  std::cout << analysis::coverage_text(results, settings)
            << analysis::group_coverage_text(groups, of_groups);
}

/// Prints the plan, and writes its JSON. \throws UsageError
void plan_thresholds_of(const ThresholdOptions& thresholds, const MeasureOption& measure,
                        const PlanOptions& options, const po::variables_map& values,
                        output::Outputs& outputs) {
  for (const char* other : {"db", "csv", "effect", "gain-sd", "residual-sd", "figure", "reuse"}) {
    if (values.count(other))
      throw UsageError(std::string("--") + other + ": is of response times; not with --" +
                       measure.name);
  }
  const analysis::ThresholdStudy study = study_of(thresholds, measure, options, values);
  analysis::ThresholdPlanSettings settings;
  PlanOptions own = options;
  const bool of_ratings = measure.measure == analysis::PlannedMeasure::rating;
  const bool of_reaching = is_of_reaching(measure.measure);
  if (values["trials"].defaulted())
    own.trials = of_ratings ? "2,4" : of_reaching ? "10,50" : "84,168";
  if (values["participants"].defaulted()) own.participants = "4-24";
  const analysis::PlanSettings asked = settings_of(own, values);
  settings.trials = asked.trials;
  settings.participants = numbers_over(asked.min_participants, asked.max_participants);
  settings.jobs = asked.simulation.jobs;
  constexpr std::size_t kStudies = 200;
  settings.studies = values.count("studies") ? asked.simulation.studies : kStudies;
  settings.seed = own.seed;
  settings.power = own.power;
  std::sort(settings.trials.begin(), settings.trials.end());
  output::ProgressLine progress("simulated studies");
  settings.progress = [&progress](double share) { progress.show(share); };
  const analysis::ThresholdPlan plan = analysis::plan_thresholds(study, std::move(settings));
  progress.clear();
  if (outputs.wanted("json")) outputs.put("json", analysis::threshold_plan_json(plan));
  outputs.write();
  std::cout << analysis::threshold_plan_text(plan);
}

/// \throws protocols::InputError
void read_known(const std::string& file, const analysis::StudyModel& model,
                analysis::PlanSettings& settings) {
  for (analysis::PlanPoint& point :
       analysis::read_plan_points(protocols::read_text_file(file), file, model, settings))
    settings.known.push_back(std::move(point));
}

}  // namespace

void add_plan_options(CommandLine& line, PlanOptions& options) {
  auto add = line.options.add_options();
  add("db", po::value(&options.database)->value_name("FILE"), "a pilot's database");
  add("csv", po::value(&options.csv)->value_name("FILE"), "a pilot's trials as CSV");
  add("protocol", po::value(&options.protocol)->value_name("NAME"),
      "which of a pilot's protocols: its name, or the beginning of its SHA-256");
  add("effect", po::value(&options.effect)->value_name("SHAPE=PERCENT,..."),
      "wanted reductions of time with the ray (of a pilot of other renderers: with its second "
      "renderer), or one number for all shapes; default for ray: the paper's, cone=22,cube=11, or "
      "where there is neither, 11");
  add("power", po::value(&options.power)->default_value(0.8, "0.8")->value_name("P"),
      "wanted power");
  add("alpha", po::value(&options.alpha)->default_value(0.05, "0.05")->value_name("P"),
      "of the tests, after Holm");
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
  add("seed", po::value(&options.seed)->default_value(2000)->value_name("S"), "of the simulation");
}

analysis::Pilot starting_point(const PlanOptions& options, const po::variables_map& values) {
  analysis::Pilot pilot;
  if (options.database.empty() && options.csv.empty()) {
    for (const char* needed : {"gain-sd", "residual-sd"}) {
      if (values.count(needed) == 0) {
        throw UsageError(std::string("without a pilot (--db or --csv) expected --") + needed +
                         "; more: add --help");
      }
    }
    pilot.pair = {"point", "ray", std::nullopt, std::nullopt};
    for (const analysis::PaperEffect& effect : analysis::kPaperEffects)
      pilot.model.shapes.emplace_back(effect.shape);
    pilot.model.log_ratios.assign(pilot.model.shapes.size(), 0.0);
    pilot.model.intercept_sd = options.intercept_sd;
    return pilot;
  }
  const std::string& source = options.csv.empty() ? options.database : options.csv;
  const analysis::Analysis analysis = analysis::analyze(pilot_trials(options), {}, PALPATE_VERSION);
  pilot = analysis::read_pilot(analysis);
  if (!pilot.undefined.empty()) {
    throw UsageError(
        source + ": expected a pilot that the mixed model can be fitted to: " + pilot.undefined);
  }
  pilot.notes.insert(pilot.notes.begin(),
                     "Standard deviations and proportion of used trials are from " +
                         printable(source, 200) + "; the effects to find are not.");
  if (const analysis::Provenance& from = analysis.table.provenance; from.protocol_sha256.size() > 1)
    pilot.notes.push_back(pooled_protocols(from));
  return pilot;
}

analysis::StudyModel model_of(analysis::Pilot& pilot, const PlanOptions& options,
                              const po::variables_map& values) {
  analysis::StudyModel model = std::move(pilot.model);
  const auto put = [&](const char* option, double value, double low, double high, double& target) {
    if (values.count(option) == 0) return;
    check_within(option, value, low, high);
    target = value;
  };
  put("gain-sd", options.gain_sd, 0, kMostSd, model.gain_sd);
  put("shape-gain-sd", options.shape_gain_sd, 0, kMostSd, model.shape_gain_sd);
  put("intercept-sd", options.intercept_sd, 0, kMostSd, model.intercept_sd);
  put("correlation", options.correlation, -1, 1, model.correlation);
  put("residual-sd", options.residual_sd, 0, kMostSd, model.residual_sd);
  put("share-used", options.share_used, 0.01, 1, model.proportion_used);
  if (model.gain_sd == 0 && model.shape_gain_sd == 0 && model.residual_sd == 0) {
    throw UsageError(
        "expected some variation: --gain-sd, --shape-gain-sd or --residual-sd above 0");
  }
  if (values.count("effect") != 0) {
    put_effects(options.effect, model);
  } else if (pilot.pair.is_ray_minus_point()) {
    pilot.notes.push_back(put_default_effects(model));
  } else {
    throw UsageError(
        "expected --effect SHAPE=PERCENT,...: the paper's effects are of ray against "
        "point, this pilot is of " +
        printable(pilot.pair.renderer, 60) + " against " + printable(pilot.pair.reference, 60) +
        "; its shapes: " + shapes_of(model));
  }
  if (std::ranges::all_of(model.log_ratios, [](double effect) { return effect == 0; })) {
    throw UsageError(
        "expected the wanted effect of some shape: --effect SHAPE=PERCENT,... with a shape of " +
        shapes_of(model));
  }
  return model;
}

analysis::PlanSettings settings_of(const PlanOptions& options, const po::variables_map& values) {
  analysis::PlanSettings out;
  const auto ends = split(options.participants, '-');
  if (ends.size() > 2) throw UsageError("--participants: expected a range such as 4-40");
  out.min_participants = whole_number("participants", ends.front(), 2, kMostParticipants);
  out.max_participants =
      whole_number("participants", ends.back(), out.min_participants, kMostParticipants);
  for (const std::string& trials : split(options.trials, ',')) {
    out.trials.push_back(whole_number("trials", trials, 1, kMostTrials));
  }
  check_within("power", options.power, 0.01, 0.9999);
  check_within("alpha", options.alpha, 0.0001, 0.5);
  out.power = options.power;
  if (options.goal != "all" && options.goal != "any") {
    throw UsageError("--goal: expected all or any");
  }
  out.goal = options.goal == "all" ? analysis::Goal::all : analysis::Goal::any;
  if (options.test != "paired" && options.test != "model") {
    throw UsageError("--test: expected paired or model");
  }
  analysis::PowerSettings& simulation = out.simulation;
  simulation.test =
      options.test == "paired" ? analysis::StudyTest::paired : analysis::StudyTest::model;
  simulation.alpha = options.alpha;
  simulation.seed = options.seed;
  simulation.studies = simulation.test == analysis::StudyTest::paired ? 10'000 : 1'000;
  if (values.count("studies") != 0) {
    simulation.studies = whole_number("studies", options.studies, 100, kMostStudies);
  }
  simulation.jobs = std::max(1U, std::thread::hardware_concurrency());
  if (values.count("jobs") != 0) simulation.jobs = whole_number("jobs", options.jobs, 1, 256);
  return out;
}

int plan_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      R"(palpate plan ((--db FILE | --csv FILE) [--protocol NAME] | --gain-sd SD --residual-sd SD)
           [--effect SHAPE=PERCENT,...]
       palpate plan (--jnd-effect PERCENT | --pse-effect JNDS | --threshold-effect PERCENT |
           --accuracy-effect POINTS | --rating-effect STEPS | --exponent-effect PERCENT |
           --deviation-effect MM | --aftereffect-effect MM | --adaptation-effect DIFFERENCE)
           [--equivalence BOUND] [--contrast conditions|groups|zero]
       palpate plan --groups N (--effect-between PERCENT | --effect-interaction PERCENT) ...
       palpate plan --cues --weber FELT,SEEN [--participants N] [--trials N] [--studies N]
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
  palpate plan --adaptation-effect 0.2 --contrast groups --trials 10   (reaching)
  palpate plan --groups 2 --effect-between 20 --gain-sd 0.15 --residual-sd 0.5 --participants 4-60
  palpate plan --cues --weber 0.06,0.09 --participants 12 --trials 30
  palpate plan --coverage --studies 500 --seed 1)";
  PlanOptions options;
  add_plan_options(line, options);
  ThresholdOptions thresholds;
  add_threshold_options(line, thresholds);
  GroupOptions groups;
  add_group_options(line, groups);
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
  if (values->count("protocol") && !values->count("db") && !values->count("csv"))
    throw UsageError("--protocol: is one of a pilot; give --db FILE or --csv FILE");
  output::Outputs outputs(*values, {"json", "figure"}, {"db", "csv"});
  if (values->count("coverage")) {
    print_coverage(options, *values, outputs);
    return 0;
  }
  if (values->count("cues")) return print_cue_plan(thresholds.weber, options, *values, outputs);
  if (values->count("groups")) {
    print_group_plan(groups, options, *values, outputs);
    return 0;
  }
  for (const char* const option : {"effect-between", "effect-interaction"}) {
    if (values->count(option)) throw UsageError(std::string("--") + option + ": requires --groups");
  }
  for (const MeasureOption& one : kMeasureOptions) {
    if (values->count(one.name) == 0) continue;
    for (const MeasureOption& other : kMeasureOptions) {
      if (other.name != one.name && values->count(other.name))
        throw UsageError(std::string("--") + other.name + ": not with --" + one.name);
    }
    plan_thresholds_of(thresholds, one, options, *values, outputs);
    return 0;
  }
  if (values->count("equivalence"))
    throw UsageError(
        "--equivalence: expected one of --jnd-effect, --pse-effect, --threshold-effect, "
        "--accuracy-effect, --rating-effect, --exponent-effect, --deviation-effect, "
        "--aftereffect-effect and --adaptation-effect");
  analysis::PlanSettings settings = settings_of(options, *values);
  analysis::Pilot pilot = starting_point(options, *values);
  analysis::StudyModel model = model_of(pilot, options, *values);

  for (const std::string& file : options.reuse) read_known(file, model, settings);

  const std::string curves = std::to_string(settings.trials.size());
  const auto studies = static_cast<double>(settings.simulation.studies);
  output::ProgressLine progress("curve 1 of " + curves);
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

}  // namespace palpate::runner::commands
