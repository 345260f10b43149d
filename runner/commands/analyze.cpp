#include <algorithm>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/figures/svg.h"
#include "analysis/input/study_record.h"
#include "analysis/input/trials.h"
#include "analysis/movement/comparison.h"
#include "analysis/movement/pictures.h"
#include "analysis/report/report.h"
#include "analysis/report/study_report.h"
#include "analysis/statistics/analysis.h"
#include "analysis/statistics/task_analysis.h"
#include "data/base/checksum.h"
#include "data/base/json_text.h"
#include "data/base/text.h"
#include "data/stored_protocol.h"
#include "protocols/json_document.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/sweep/sweep_options.h"
#include "runner/movement/movement_study.h"
#include "runner/output/outputs.h"
#include "runner/registration/bundle_contents.h"
#include "runner/study/cue_study.h"
#include "runner/study/study_trials.h"

namespace palpate::runner::commands {

namespace {

void check(const boost::program_options::variables_map& values,
           const analysis::AnalysisSettings& settings, const std::string& usage) {
  const std::size_t sources = values.count("db") + values.count("csv") + values.count("sweep");
  if (sources != 1) {
    throw UsageError("expected one of --db FILE, --csv FILE and --sweep FILE\nUsage: " + usage +
                     "\nMore: add --help");
  }
  if (values.count("design") && !values.count("csv"))
    throw UsageError("--design: is of a table of tasks; give --csv FILE");
  if (!values.count("glmm") && !values["bootstrap"].defaulted())
    throw UsageError("--bootstrap: is of the mixed model of answers; give --glmm");
  const auto studies = values["bootstrap"].as<std::size_t>();
  if (studies != 0 && (studies < 100 || studies > 100000))
    throw UsageError("--bootstrap: expected 0, or 100 to 100000 simulated studies");
  for (const char* other : {"sweep", "movement", "cues"}) {
    if (values.count("glmm") && values.count(other))
      throw UsageError("--glmm: cannot be combined with --" + std::string(other));
  }
  if (values.count("pattern") && !values.count("sweep"))
    throw UsageError("--pattern: is looked for in a sweep; give --sweep FILE");
  if (values.count("sweep") && !values["too-fast-s"].defaulted())
    throw UsageError("--too-fast-s: a sweep's points have their times already");
  if (!(settings.too_fast > 0) || !std::isfinite(settings.too_fast)) {
    throw UsageError("--too-fast-s: expected a time in s above 0 (a time of 0 has no logarithm)");
  }
}

void put(output::Outputs& outputs, const analysis::StudyAnalysis& analysis,
         const analysis::StudyRecord& record) {
  if (outputs.wanted("figures")) {
    for (const analysis::Figure& figure : analysis::study_figures(analysis, record)) {
      outputs.put_into_folder(figure.id + ".svg",
                              analysis::figure_svg(figure, analysis::light_palette()));
    }
  }
  if (outputs.wanted("json")) outputs.put("json", analysis::study_json(analysis));
  if (outputs.wanted("report")) outputs.put("report", analysis::study_html(analysis, record));
}

/// \throws UsageError
analysis::FunctionSettings function_settings(const boost::program_options::variables_map& values,
                                             const std::string& function,
                                             const std::string& scale) {
  using protocols::LevelScale;
  using protocols::PsychometricShape;
  analysis::FunctionSettings settings;
  if (function == "normal") {
    settings.shape = PsychometricShape::normal;
  } else if (function == "weibull") {
    settings.shape = PsychometricShape::weibull;
  } else if (function != "logistic") {
    throw UsageError("--function: expected logistic, normal or weibull, found '" +
                     printable(function) + "'");
  }
  if (values.count("glmm")) {
    settings.answer_model.emplace();
    settings.answer_model->bootstrap = values["bootstrap"].as<std::size_t>();
    settings.answer_model->jobs = std::max(1u, std::thread::hardware_concurrency());
  }
  if (values.count("scale") == 0) return settings;
  if (scale != "linear" && scale != "log")
    throw UsageError("--scale: expected linear or log, found '" + printable(scale) + "'");
  if (scale == "linear" && settings.shape == PsychometricShape::weibull)
    throw UsageError("--scale: expected log with --function weibull, whose slope is an exponent");
  settings.scale = scale == "log" ? LevelScale::log10 : LevelScale::linear;
  return settings;
}

/// The protocol of a file, or those of a bundle's record. \throws UsageError, InputError
std::vector<analysis::ProtocolText> protocols_in(const std::string& file) {
  if (file.empty()) return {};
  const std::string text = protocols::read_text_file(file);
  const nlohmann::json json = json_or_discarded(text);
  if (json.is_object() && json.contains("protocols"))
    return registration::parse_record(text, file).protocols;
  const data::StoredProtocol stored = data::read_stored_protocol(text);
  if (!json.is_object() || !json.contains("blocks"))
    throw UsageError(printable(file) +
                     ": expected a protocol with blocks, or record.json of a bundle");
  return {{json.value("name", ""), checksum_hex(text), text, stored.title, stored.seed}};
}

void analyze_cues_of(const study::Study& study, output::Outputs& outputs) {
  const study::CueStudy cues = study::analyze_cues(study, {});
  if (outputs.wanted("json")) outputs.put("json", analysis::cue_json(cues.analysis, cues.source));
  if (outputs.wanted("report"))
    outputs.put("report", analysis::cue_html(cues.analysis, cues.source));
  if (outputs.wanted("figures")) {
    for (const analysis::Figure& figure : analysis::cue_figures(cues.analysis))
      outputs.put_into_folder(figure.id + ".svg",
                              analysis::figure_svg(figure, analysis::light_palette()));
  }
  outputs.write();
  std::cout << analysis::cue_text(cues.analysis);
}

/// Checks the options of --movement and those that exclude it.
void check_movement(const boost::program_options::variables_map& values, double cutoff, int jobs) {
  if (!values.count("movement")) {
    for (const char* option : {"movement-csv", "meshes"}) {
      if (values.count(option)) throw UsageError("--" + std::string(option) + ": give --movement");
    }
    if (!values["cutoff-hz"].defaulted() || !values["jobs"].defaulted())
      throw UsageError("--cutoff-hz, --jobs: are for --movement");
    return;
  }
  if (!values.count("db"))
    throw UsageError("--movement: needs the samples of a database; give --db FILE");
  if (values.count("scale")) throw UsageError("--scale: cannot be combined with --movement");
  if (!values["function"].defaulted() || !values["too-fast-s"].defaulted())
    throw UsageError("--function, --too-fast-s: cannot be combined with --movement");
  if (!(cutoff > 0) || !std::isfinite(cutoff))
    throw UsageError("--cutoff-hz: expected a frequency in Hz above 0");
  if (jobs < 1 || jobs > 1024) throw UsageError("--jobs: must be 1 to 1024");
}

/// \throws UsageError: no trial has measures, with the reasons
void require_measures(const analysis::MovementTable& table, const std::string& database) {
  std::size_t without = 0;
  std::string reasons;
  for (const auto& [reason, trials] : table.missing) {
    without += trials;
    reasons += (reasons.empty() ? "" : "; ") + std::to_string(trials) + ": " + printable(reason);
  }
  if (without == table.values.size())
    throw UsageError(printable(database) + ": has no trial whose movement can be measured (" +
                     reasons + ")");
}

void analyze_movement_of(movement::MovementRequest request, output::Outputs& outputs) {
  request.pictures = outputs.wanted("report") || outputs.wanted("figures");
  movement::MovementStudy study = movement::measure_study(request);
  movement::require_samples(study, request.database);
  require_measures(study.table, request.database);
  if (outputs.wanted("movement-csv")) outputs.put("movement-csv", study.csv);
  const analysis::MovementAnalysis found =
      analysis::analyze_movement(std::move(study.table), PALPATE_VERSION);
  if (outputs.wanted("json")) outputs.put("json", analysis::movement_json(found));
  if (outputs.wanted("report"))
    outputs.put("report", analysis::movement_html(found, study.pictures));
  if (outputs.wanted("figures")) {
    for (const analysis::Figure& figure : analysis::movement_figures(found.table, study.pictures)) {
      outputs.put_into_folder(figure.id + ".svg",
                              analysis::figure_svg(figure, analysis::light_palette()));
    }
  }
  outputs.write();
  std::cout << analysis::movement_text(found);
}

}  // namespace

int analyze_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate analyze (--db FILE | --csv FILE | --sweep FILE [--pattern EXPR]) [--protocol NAME]\n"
      "       [--function logistic|normal|weibull] [--scale linear|log]\n"
      "       [--glmm [--bootstrap N]]\n"
      "       [--json FILE] [--report FILE.html] [--figures DIR] [--force]\n"
      "palpate analyze --db FILE --movement [--protocol NAME] [--movement-csv FILE]\n"
      "       [--cutoff-hz F] [--jobs J] [--meshes DIR] [--json FILE] [--report FILE.html]\n"
      "       [--figures DIR] [--force]\n"
      "palpate analyze (--db FILE | --csv FILE --design FILE) --cues [--protocol NAME]\n"
      "       [--json FILE] [--report FILE.html] [--figures DIR] [--force]";
  line.summary =
      "Compares response times with the ray and the point renderer: percent reduction for each\n"
      "shape with intervals and tests, accuracy, learning and exclusions. In data with other\n"
      "renderers each is compared with the first (point if it is among them). The conclusion\n"
      "and the tables go to stdout. Existing files are replaced only with --force.\n"
      "For a sweep: the share of settings in which a pattern holds, the spread of the gains, and\n"
      "their causes (Sobol indices of a saltelli design, rank correlations of others).\n"
      "For protocols of version 2 (databases, exports with a column 'task'): thresholds, PSE and\n"
      "JND, d', magnitude estimation, adjustment, information and confidence, by task.\n"
      "With --glmm: one mixed model of all answers besides, with PSE and JND of every cell.\n"
      "With --movement: measures of the hand's movement (path, speed, smoothness, contact,\n"
      "force, strokes, procedures, coverage), from the servo samples of a database.\n"
      "With --cues: weights of what is seen and felt, JNDs with one cue and with both, and rival\n"
      "models, for protocols with the key 'cues'.";
  line.example =
      "  palpate analyze --db study.db\n"
      "  palpate analyze --csv trials.csv --json analysis.json --report report.html\n"
      "      (data of others: participant_id, session, block, trial, renderer, shape, response,\n"
      "      correct and response_time suffice)\n"
      "  palpate analyze --db thresholds.db --function weibull\n"
      "  palpate analyze --db thresholds.db --glmm --report report.html\n"
      "  palpate analyze --db study.db --movement --movement-csv movement.csv\n"
      "  palpate analyze --db study.db --movement --report movement.html --figures figures\n"
      "  palpate analyze --db size.db --cues --report cues.html\n"
      "  palpate analyze --sweep people.sweep --report people.html\n"
      "  palpate analyze --sweep people.sweep --pattern 'cone > 5 && cone > 2 * abs(sphere)'\n"
      "      (names: shapes, for their gains in percent, and columns of the CSV, such as delay or\n"
      "      time_ray_cone; + - * /, < <= > >= == !=, && || !, min, max, abs, parentheses)";
  std::string database, csv, sweep, pattern, protocol, design, json, report, figures, function,
      scale;
  analysis::AnalysisSettings settings;
  auto add = line.options.add_options();
  namespace po = boost::program_options;
  add("db", po::value(&database)->value_name("FILE"), "the study's database");
  add("csv", po::value(&csv)->value_name("FILE"), "trials as CSV, one row a trial");
  add("sweep", po::value(&sweep)->value_name("FILE"), "a sweep's file");
  add("pattern", po::value(&pattern)->value_name("EXPR"),
      "of a sweep: what to look for at each point; default: the paper's pattern");
  add("protocol", po::value(&protocol)->value_name("NAME"),
      "which of several protocols: its name, or the beginning of its SHA-256");
  add("design", po::value(&design)->value_name("FILE"),
      "of a table of tasks: its protocol, or a bundle's record.json; so names, scales and "
      "procedures "
      "are those of a database");
  add("json", po::value(&json)->value_name("FILE"), "write every number as JSON");
  add("report", po::value(&report)->value_name("FILE.html"), "write a report as an HTML page");
  add("figures", po::value(&figures)->value_name("DIR"),
      "write the report's figures as SVG files into this folder");
  add("force", "replace existing files");
  add("too-fast-s", po::value(&settings.too_fast)->default_value(0.2, "0.2")->value_name("SECONDS"),
      "exclude correct answers faster than this from the times");
  add("function", po::value(&function)->default_value("logistic")->value_name("NAME"),
      "psychometric function of tasks: logistic, normal or weibull");
  add("scale", po::value(&scale)->value_name("NAME"),
      "of the levels of psychometric functions: linear or log; default: the procedure's");
  add("glmm",
      "of comparisons and detections: one mixed model of all answers, probit(answer) ~ level * "
      "group * renderer * factors + (1 + level | participant)");
  add("bootstrap",
      po::value<std::size_t>()
          ->default_value(analysis::AnswerModelSettings{}.bootstrap)
          ->value_name("N"),
      "with --glmm: simulated studies for its intervals, 0 or 100 to 100000");
  movement::MovementRequest movement;
  movement.jobs = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  std::string movement_csv;
  add("cues", "compare what is seen and felt, as the protocol's key 'cues' says");
  add("movement", "measure the movement of the hand instead of the times");
  add("movement-csv", po::value(&movement_csv)->value_name("FILE"),
      "with --movement: write every measure, a row a trial");
  add("cutoff-hz", po::value(&movement.settings.cutoff)->default_value(20, "20")->value_name("F"),
      "with --movement: low pass of the path");
  add("jobs", po::value(&movement.jobs)->default_value(movement.jobs)->value_name("J"),
      "with --movement: threads");
  add("meshes", po::value(&movement.mesh_folder)->value_name("DIR"),
      "with --movement: folder of the protocol's mesh files, for an old database that does not "
      "have them; default: the working directory");
  const auto values = line.parse(args);
  if (!values) return 0;
  check(*values, settings, line.usage);
  check_movement(*values, movement.settings.cutoff, movement.jobs);
  const analysis::FunctionSettings functions = function_settings(*values, function, scale);
  output::Outputs outputs(*values, {"json", "report", "movement-csv"}, {"db", "csv", "sweep"},
                          "figures");
  if (values->count("sweep")) {
    if (!(*values)["function"].defaulted() || values->count("scale"))
      throw UsageError("--function, --scale: a sweep's points have their figures already");
    if (values->count("protocol")) throw UsageError("--protocol: a sweep is of one protocol");
    const std::string text = analyze_sweep_file(sweep, pattern, outputs);
    outputs.write();
    std::cout << text;
    return 0;
  }
  if (values->count("cues")) {
    for (const char* option : {"movement", "sweep", "scale"}) {
      if (values->count(option)) throw UsageError("--cues: not with --" + std::string(option));
    }
    if (!(*values)["function"].defaulted() || !(*values)["too-fast-s"].defaulted())
      throw UsageError("--function, --too-fast-s: cannot be combined with --cues");
    std::vector<analysis::ProtocolText> protocols = protocols_in(design);
    study::Study study = study::read_study({database, csv, protocol, protocols}, true);
    if (!csv.empty()) study.record.protocols = std::move(protocols);
    analyze_cues_of(study, outputs);
    return 0;
  }
  if (values->count("movement")) {
    movement.database = database;
    movement.protocol = protocol;
    analyze_movement_of(movement, outputs);
    return 0;
  }
  study::Study study = study::read_study({database, csv, protocol, protocols_in(design)},
                                         outputs.wanted("report") || outputs.wanted("figures"));
  const analysis::StudyAnalysis analysis =
      analysis::analyze_study(std::move(study.table), functions, settings, PALPATE_VERSION);
  if ((!(*values)["function"].defaulted() || values->count("scale") || values->count("glmm")) &&
      std::ranges::all_of(analysis.cells,
                          [](const auto& cell) { return cell.functions.empty() && !cell.field; }))
    throw UsageError("--function, --scale, --glmm: there are no tasks with psychometric functions");
  if (functions.answer_model && analysis.answer_models.empty())
    throw UsageError("--glmm: there are no comparisons or detections with levels");
  put(outputs, analysis, study.record);
  outputs.write();
  std::cout << analysis::study_text(analysis);
  return 0;
}

}  // namespace palpate::runner::commands
