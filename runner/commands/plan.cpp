#include "analysis/plan.h"

#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "analysis/analysis.h"
#include "analysis/pilot.h"
#include "analysis/text.h"
#include "analysis/trials.h"
#include "data/store.h"
#include "protocols/parse.h"
#include "runner/commands/command.h"

namespace palpate {

namespace {

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
  throw UsageError("--" + option + ": expected a number from " + fixed(low, 2) + " to " +
                   fixed(high, 2));
}

/// "cone=22,cube=11": percent reductions; shapes that are not named have no effect. "11": all.
void put_effects(const std::string& text, StudyModel& model) {
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
  for (const std::string& part : split(text, ',')) {
    const std::size_t at = part.rfind('=');
    const std::string name = part.substr(0, at);
    const auto shape = std::ranges::find(model.shapes, name);
    if (at == std::string::npos || shape == model.shapes.end()) {
      std::string known;
      for (const std::string& each : model.shapes)
        known += (known.empty() ? "" : ", ") + printable(each, 60);
      throw UsageError("--effect: expected SHAPE=PERCENT with a shape of " + known + ", found '" +
                       printable(part, 60) + "'");
    }
    model.log_ratios[static_cast<std::size_t>(shape - model.shapes.begin())] =
        log_ratio(part.substr(at + 1));
  }
}

/// The paper's figure 15, for the shapes that are there.
void put_paper_effects(StudyModel& model) {
  for (std::size_t s = 0; s < model.shapes.size(); ++s) {
    const double percent = model.shapes[s] == "cone" ? 22 : model.shapes[s] == "cube" ? 11 : 0;
    model.log_ratios[s] = std::log1p(-percent / 100);
  }
}

TrialTable read_trials(const std::string& database, const std::string& csv) {
  if (!csv.empty()) return read_trials_csv(csv);
  try {
    return read_trials_store(database);
  } catch (const StoreRefused& error) {
    throw UsageError(error.what());
  }
}

/// One line on a terminal.
class ProgressLine {
 public:
  explicit ProgressLine(std::string what)
      : what_(std::move(what)), on_terminal_(isatty(STDERR_FILENO) == 1) {}
  ~ProgressLine() {
    if (shown_) std::cerr << "\r\033[K";
  }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void at(std::size_t curve, std::size_t point) {
    curve_ = curve;
    point_ = point;
  }
  void show(double done) {
    const auto now = std::chrono::steady_clock::now();
    if (!on_terminal_ || now - last_ < std::chrono::milliseconds(200)) return;
    last_ = now;
    shown_ = true;
    std::cerr << "\r\033[Kcurve " << curve_ << " of " << what_ << ", point " << point_ << ": "
              << std::lround(100 * done) << " % of its studies" << std::flush;
  }

 private:
  std::string what_;
  bool on_terminal_, shown_ = false;
  std::size_t curve_ = 1, point_ = 1;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

void check_output(const char* option, const std::string& path, bool force) {
  if (path.empty()) throw UsageError(std::string("--") + option + ": expected a path");
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    throw UsageError(std::string("--") + option + " " + path +
                     ": expected a file; this is a folder");
  }
  if (std::filesystem::is_regular_file(path, error) && !force) {
    throw UsageError(path + ": is there already; --force replaces it");
  }
}

struct Options {
  std::string database, csv, effect, participants = "2-100", trials = "10,20,40,76", goal = "all",
                                     test = "paired", json, figure;
  double gain_sd = 0, shape_gain_sd = 0, intercept_sd = 0.3, correlation = 0, residual_sd = 0,
         share_used = 1, power = 0.8, alpha = 0.05;
  std::string studies, jobs;
  std::uint64_t seed = 2000;
};

/// The pilot's model, or the paper's shapes with the figures given.
Pilot starting_point(const Options& options, const po::variables_map& values) {
  Pilot pilot;
  if (options.database.empty() && options.csv.empty()) {
    for (const char* needed : {"gain-sd", "residual-sd"}) {
      if (values.count(needed) == 0) {
        throw UsageError(std::string("without a pilot (--db or --csv) expected --") + needed +
                         "; more: add --help");
      }
    }
    pilot.pair = {"point", "ray", std::nullopt, std::nullopt};
    pilot.model.shapes = {"sphere", "cone", "cylinder", "cube"};
    pilot.model.log_ratios.assign(4, 0.0);
    pilot.model.intercept_sd = options.intercept_sd;
    return pilot;
  }
  const std::string& source = options.csv.empty() ? options.database : options.csv;
  pilot = read_pilot(analyze(read_trials(options.database, options.csv), {}, PALPATE_VERSION));
  if (!pilot.undefined.empty()) {
    throw UsageError(
        source + ": expected a pilot that the mixed model can be fitted to: " + pilot.undefined);
  }
  pilot.notes.insert(pilot.notes.begin(), "Standard deviations and share of used trials from " +
                                              printable(source, 200) + ", the wanted effects not.");
  return pilot;
}

StudyModel model_of(Pilot& pilot, const Options& options, const po::variables_map& values) {
  StudyModel model = std::move(pilot.model);
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
  put("share-used", options.share_used, 0.01, 1, model.share_used);
  if (model.gain_sd == 0 && model.shape_gain_sd == 0 && model.residual_sd == 0) {
    throw UsageError(
        "expected some variation: --gain-sd, --shape-gain-sd or --residual-sd above 0");
  }
  if (values.count("effect") != 0) {
    put_effects(options.effect, model);
  } else if (pilot.pair.is_ray_minus_point()) {
    put_paper_effects(model);
  } else {
    throw UsageError(
        "expected --effect SHAPE=PERCENT,...: the paper's effects are of ray against "
        "point, this pilot is of " +
        printable(pilot.pair.renderer, 60) + " against " + printable(pilot.pair.reference, 60));
  }
  if (std::ranges::all_of(model.log_ratios, [](double effect) { return effect == 0; })) {
    throw UsageError("expected the wanted effect of some shape: --effect SHAPE=PERCENT,...");
  }
  return model;
}

PlanSettings settings_of(const Options& options, const po::variables_map& values) {
  PlanSettings out;
  const auto ends = split(options.participants, '-');
  if (ends.size() > 2) throw UsageError("--participants: expected a range such as 4-40");
  out.least = whole_number("participants", ends.front(), 2, kMostParticipants);
  out.most = whole_number("participants", ends.back(), out.least, kMostParticipants);
  for (const std::string& trials : split(options.trials, ',')) {
    out.trials.push_back(whole_number("trials", trials, 1, kMostTrials));
  }
  check_within("power", options.power, 0.01, 0.9999);
  check_within("alpha", options.alpha, 0.0001, 0.5);
  out.power = options.power;
  if (options.goal != "all" && options.goal != "any") {
    throw UsageError("--goal: expected all or any");
  }
  out.goal = options.goal == "all" ? Goal::all : Goal::any;
  if (options.test != "paired" && options.test != "model") {
    throw UsageError("--test: expected paired or model");
  }
  PowerSettings& simulation = out.simulation;
  simulation.test = options.test == "paired" ? StudyTest::paired : StudyTest::model;
  simulation.alpha = options.alpha;
  simulation.seed = options.seed;
  simulation.studies = simulation.test == StudyTest::paired ? 10'000 : 1'000;
  if (values.count("studies") != 0) {
    simulation.studies = whole_number("studies", options.studies, 100, kMostStudies);
  }
  simulation.jobs = std::max(1U, std::thread::hardware_concurrency());
  if (values.count("jobs") != 0) simulation.jobs = whole_number("jobs", options.jobs, 1, 256);
  return out;
}

}  // namespace

int plan_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate plan (--db FILE | --csv FILE | --gain-sd SD --residual-sd SD) [--effect "
      "SHAPE=PERCENT,...]";
  line.summary =
      "How many participants and trials find a wanted effect with a wanted power? Studies are "
      "drawn\n"
      "from the mixed model that was fitted to a pilot, or from standard deviations that are "
      "given,\n"
      "and tested as analyze tests them. Standard deviations are of the natural log of the time.";
  line.example =
      "  palpate plan --db pilot.db --effect cone=22,cube=11 --power 0.9\n"
      "  palpate plan --gain-sd 0.15 --residual-sd 0.5 --effect cone=15 --participants 4-60 \\\n"
      "      --trials 20,40 --json plan.json --figure power.svg";
  Options options;
  auto add = line.options.add_options();
  add("db", po::value(&options.database)->value_name("FILE"), "a pilot's database");
  add("csv", po::value(&options.csv)->value_name("FILE"), "a pilot's trials as CSV");
  add("effect", po::value(&options.effect)->value_name("SHAPE=PERCENT,..."),
      "wanted reductions of time with the ray (of a pilot of other renderers: with its second "
      "renderer), or one number for all shapes; default for ray: the paper's, cone=22,cube=11");
  add("power", po::value(&options.power)->default_value(0.8, "0.8"), "wanted power");
  add("alpha", po::value(&options.alpha)->default_value(0.05, "0.05"), "of the tests, after Holm");
  add("goal", po::value(&options.goal)->default_value("all")->value_name("all|any"),
      "find every shape with an effect, or at least one");
  add("participants", po::value(&options.participants)->default_value("2-100")->value_name("A-B"),
      "numbers of participants to look at");
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
      "of participants; a pilot's, or 0.3 (matters to --test model alone)");
  add("correlation", po::value(&options.correlation)->value_name("R"),
      "of participants' intercepts and gains; a pilot's, or 0");
  add("share-used", po::value(&options.share_used)->value_name("SHARE"),
      "of trials that give a time; a pilot's, or 1");
  add("studies", po::value(&options.studies)->value_name("N"),
      "simulated for each figure; default 10000, with --test model 1000");
  add("seed", po::value(&options.seed)->default_value(2000), "of the simulation");
  add("jobs", po::value(&options.jobs)->value_name("J"), "threads; default: one a core");
  add("json", po::value(&options.json)->value_name("FILE"), "write the figures as JSON");
  add("figure", po::value(&options.figure)->value_name("FILE.svg"), "write the power curve");
  add("force", po::bool_switch(), "replace files that are there already");
  const auto values = line.parse(args);
  if (!values) return 0;
  if (!options.database.empty() && !options.csv.empty()) {
    throw UsageError("expected one of --db FILE and --csv FILE\nUsage: " + line.usage +
                     "\nMore: add --help");
  }
  const bool force = (*values)["force"].as<bool>();
  if (values->count("json") != 0) check_output("json", options.json, force);
  if (values->count("figure") != 0) check_output("figure", options.figure, force);
  PlanSettings settings = settings_of(options, *values);
  Pilot pilot = starting_point(options, *values);
  StudyModel model = model_of(pilot, options, *values);

  ProgressLine progress(std::to_string(settings.trials.size()));
  const auto studies = static_cast<double>(settings.simulation.studies);
  settings.simulation.progress = [&progress, studies](std::size_t done) {
    progress.show(static_cast<double>(done) / studies);
  };
  Plan plan =
      make_plan(std::move(model), std::move(settings), std::move(pilot.notes),
                [&progress](std::size_t curve, std::size_t point) { progress.at(curve, point); });
  plan.label = std::move(pilot.label);
  if (!options.json.empty()) write_whole(options.json, plan_json(plan));
  if (!options.figure.empty()) write_whole(options.figure, plan_svg(plan));
  std::cout << plan_text(plan);
  return 0;
}

}  // namespace palpate
