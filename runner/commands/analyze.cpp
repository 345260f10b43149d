#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "analysis/analysis.h"
#include "analysis/figures.h"
#include "analysis/figures_svg.h"
#include "analysis/report_html.h"
#include "analysis/report_json.h"
#include "analysis/report_record.h"
#include "analysis/report_text.h"
#include "analysis/trials.h"
#include "data/store.h"
#include "runner/commands/command.h"

namespace palpate {

namespace {

namespace fs = std::filesystem;

struct Output {
  const char* option;
  std::string path;
};

bool same_file(const std::string& a, const std::string& b) {
  std::error_code error;
  return fs::weakly_canonical(a, error) == fs::weakly_canonical(b, error) ||
         fs::equivalent(a, b, error);
}

/// No output may be the data, or another output.
void check_outputs(const std::vector<Output>& outputs, const std::string& source) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const std::string& path = outputs[i].path;
    const std::string option = std::string("--") + outputs[i].option + " " + path;
    if (path.empty()) throw UsageError(option + ": expected a path");
    if (same_file(path, source)) {
      throw UsageError(option + ": this is the data to analyse; it would be overwritten");
    }
    for (std::size_t k = 0; k < i; ++k) {
      if (same_file(path, outputs[k].path)) {
        throw UsageError(option + ": --" + outputs[k].option + " writes the same file");
      }
    }
    if (fs::is_directory(path)) {
      throw UsageError(option + ": expected a file; this is a folder");
    }
  }
}

TrialTable read_trials(const std::string& database, const std::string& csv) {
  if (!csv.empty()) return read_trials_csv(csv);
  try {
    return read_trials_store(database);
  } catch (const StoreRefused& error) {
    throw UsageError(error.what());  // the file named is bad input: status 2
  }
}

/// Every figure as an SVG file in `folder`. None is written where one would replace a file.
void write_figures(const std::string& folder, bool force, const std::vector<Figure>& figures) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw std::runtime_error(folder + ": " + error.message());
  const auto path = [&](const Figure& figure) {
    return (fs::path(folder) / (figure.id + ".svg")).string();
  };
  if (!force) {
    std::string there;
    for (const Figure& figure : figures) {
      if (fs::exists(path(figure))) there += "\n  " + path(figure);
    }
    if (!there.empty()) {
      throw UsageError("--figures: these files exist; --force replaces them:" + there);
    }
  }
  for (const Figure& figure : figures) {
    write_whole(path(figure), figure_svg(figure, light_palette()));
  }
}

}  // namespace

int analyze_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate analyze (--db FILE | --csv FILE) [--json FILE] [--report FILE.html] [--figures DIR "
      "[--force]]";
  line.summary =
      "Is a shape identified faster with the ray than with the point renderer, by how much, how "
      "sure?\n"
      "Any renderers of other people's data: each is compared with the first (point where it is "
      "there).\n"
      "The answer and its tables go to stdout. A JSON file or report that is there already is "
      "replaced, figures only with --force.";
  line.example =
      "  palpate analyze --db study.db\n"
      "  palpate analyze --csv trials.csv --json analysis.json --report report.html   (other "
      "people's\n"
      "      data: participant_id, session, block, trial, renderer, shape, response, correct and\n"
      "      response_time are enough)";
  std::string database, csv, json, report, figures;
  bool force = false;
  AnalysisSettings settings;
  auto add = line.options.add_options();
  namespace po = boost::program_options;
  add("db", po::value(&database)->value_name("FILE"), "the study's database");
  add("csv", po::value(&csv)->value_name("FILE"), "trials as CSV, one row a trial");
  add("json", po::value(&json)->value_name("FILE"), "write every figure as JSON");
  add("report", po::value(&report)->value_name("FILE.html"), "write a report to look at and print");
  add("figures", po::value(&figures)->value_name("DIR"),
      "write the report's figures as SVG files into this folder");
  add("force", po::bool_switch(&force), "replace figures that are there already");
  add("too-fast-s", po::value(&settings.too_fast)->default_value(0.2, "0.2")->value_name("SECONDS"),
      "leave correct answers before this time out of the times");
  const auto values = line.parse(args);
  if (!values) return 0;
  if (database.empty() == csv.empty()) {
    throw UsageError("expected one of --db FILE and --csv FILE\nUsage: " + line.usage +
                     "\nMore: add --help");
  }
  if (!(settings.too_fast > 0) || !std::isfinite(settings.too_fast)) {
    throw UsageError("--too-fast-s: expected a time in s above 0 (a time of 0 has no logarithm)");
  }
  std::vector<Output> outputs;
  if (values->count("json")) outputs.push_back({"json", json});
  if (values->count("report")) outputs.push_back({"report", report});
  check_outputs(outputs, csv.empty() ? database : csv);
  if (values->count("figures") && figures.empty()) throw UsageError("--figures: expected a folder");

  const Analysis analysis = analyze(read_trials(database, csv), settings, PALPATE_VERSION);
  ReportRecord record;
  if (!database.empty() && (values->count("report") || values->count("figures"))) {
    record = read_report_record(database);
  }
  if (values->count("figures")) write_figures(figures, force, figures_of(analysis, record));
  if (values->count("json")) write_whole(json, report_json(analysis));
  if (values->count("report")) write_whole(report, report_html(analysis, record));
  std::cout << report_text(analysis);
  return 0;
}

}  // namespace palpate
