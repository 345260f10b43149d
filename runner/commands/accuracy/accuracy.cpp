#include <algorithm>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "analysis/figures/figure_svg.h"
#include "runner/commands/accuracy/measure.h"
#include "runner/commands/accuracy/report.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/outputs.h"

namespace palpate::runner {
namespace {

rendering::AccuracySettings quick_settings() {
  rendering::AccuracySettings quick;
  quick.paths = 2;
  quick.contact_ticks = 500;
  quick.most_triangles = 20480;
  quick.visits = 1e7;
  return quick;
}

void check_range(const char* option, int value, int low, int high) {
  if (value >= low && value <= high) return;
  throw UsageError(std::string("--") + option + ": must be " + std::to_string(low) + " to " +
                   std::to_string(high) + ", not " + std::to_string(value));
}

void check_ticks(std::uint64_t ticks, bool searching) {
  constexpr std::uint64_t kMost = 1'000'000'000'000;
  if (searching && (ticks == 0 || ticks > kMost)) {
    throw UsageError("--search: must be 1 to " + std::to_string(kMost) + " ticks");
  }
}

}  // namespace

int accuracy_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate accuracy [--quick | --search TICKS [--unions]] [--report FILE.html] [--figure "
      "FILE.svg] "
      "[--json FILE]";
  line.summary =
      "Error of the rendered forces against run time: every method over every tessellation of\n"
      "every analytic shape, and which tessellation to choose; contact with concave objects and\n"
      "with tools of several segments, beside simpler ways to do it; soft bodies. Takes four\n"
      "minutes, with --quick half a minute. Status 1 when a tick of the search is wrong or an\n"
      "extreme case fails.";
  line.example =
      "  palpate accuracy --quick\n"
      "  palpate accuracy --report accuracy.html --json accuracy.json\n"
      "  palpate accuracy --search 10000000   (random solids and paths against brute force)\n"
      "  palpate accuracy --search 10000000 --unions --seed 2";
  std::string json, figure, page;
  std::uint64_t search_ticks = 0, seed = 1;
  rendering::AccuracySettings settings;
  int jobs = 0;
  auto add = line.options.add_options();
  namespace po = boost::program_options;
  add("quick", "fewer and shorter paths, at most 20,480 triangles");
  add("paths", po::value<int>()->value_name("N"), "paths for each shape and probe; default 4");
  add("ticks", po::value<int>()->value_name("N"), "ticks of contact of each path; default 1000");
  add("most-triangles", po::value<int>()->value_name("N"),
      "of the finest tessellation; default 327680");
  add("json", po::value(&json)->value_name("FILE"), "write every number as JSON");
  add("figure", po::value(&figure)->value_name("FILE"),
      "write the figure of error against run time as SVG");
  add("report", po::value(&page)->value_name("FILE"),
      "write all of it, with the figure, as one HTML page");
  add("search", po::value(&search_ticks)->value_name("TICKS"),
      "instead of all that: search this many random ticks for wrong ones");
  add("unions", "search clusters of 3 to 8 convex parts with tools of 1 to 3 segments");
  add("seed", po::value(&seed)->value_name("N")->default_value(1), "of the search");
  add("jobs", po::value(&jobs)->value_name("J"),
      "threads of the search; default: one for each core");
  add("force", "replace existing files");
  const auto values = line.parse(args);
  if (!values) return 0;
  const bool searching = values->count("search") > 0;
  check_ticks(search_ticks, searching);
  if (values->count("quick")) settings = quick_settings();
  const auto take = [&](const char* option, int& setting, int low, int high) {
    if (!values->count(option)) return;
    setting = (*values)[option].as<int>();
    check_range(option, setting, low, high);
  };
  take("paths", settings.paths, 1, 10000);
  take("ticks", settings.contact_ticks, 1, 1000000);
  take("most-triangles", settings.most_triangles, 20, 1310720);
  if (values->count("jobs")) check_range("jobs", jobs, 1, 256);
  const bool unions = values->count("unions") > 0;
  if (unions && !searching) throw UsageError("--unions: goes with --search");
  if (searching && !figure.empty()) throw UsageError("--figure: a search has no figure");
  Outputs outputs(*values, {"json", "figure", "report"}, {});

  AccuracyReport report;
  if (jobs == 0) jobs = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  if (searching) {
    report.search_seed = seed;
    if (unions) {
      report.union_search = search_unions_in_threads(search_ticks, seed, jobs);
    } else {
      report.search = search_in_threads(search_ticks, seed, jobs);
    }
  } else {
    report.settings = settings;
    measure_accuracy(report, values->count("quick") > 0, jobs, seed);
  }
  if (outputs.wanted("json")) outputs.put("json", accuracy_json(report).dump(1) + "\n");
  if (outputs.wanted("figure"))
    outputs.put("figure", analysis::figure_svg(accuracy_figure(report), analysis::light_palette()));
  if (outputs.wanted("report")) outputs.put("report", accuracy_page(report));
  outputs.write();
  std::cout << accuracy_text(report);
  const bool extremes_hold = std::all_of(report.extremes.begin(), report.extremes.end(),
                                         [](const ExtremeRow& row) { return row.result.passed; });
  const std::uint64_t wrong = (report.search ? report.search->wrong() : 0) +
                              (report.union_search ? report.union_search->wrong() : 0);
  return extremes_hold && wrong == 0 ? 0 : 1;
}

}  // namespace palpate::runner
