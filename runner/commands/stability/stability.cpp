#include <algorithm>
#include <cstdint>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "analysis/figures/svg.h"
#include "runner/commands/shared/command.h"
#include "runner/evidence/reports/stability_report.h"
#include "runner/evidence/reports/stability_study.h"
#include "runner/evidence/stability/boundary.h"
#include "runner/output/outputs.h"
#include "runner/output/progress_line.h"

namespace palpate::runner::commands {

int stability_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate stability [--full] [--report FILE.html] [--json FILE]\n"
      "       palpate stability --soft [--seed S] [--figure FILE.svg]";
  line.summary =
      "At what stiffness does a contact become unstable (buzz)? Simulates the closed loop of\n"
      "hand, two devices and renderer against a wall, an edge, a sphere, two objects and a body\n"
      "on a wall, and compares the stability boundary with the passivity condition of theory.\n"
      "Status 1 if theory is violated. With --soft: does a tool come to rest on a soft body\n"
      "that is stepped at its own rate? Status 1 if it does not although scenes allow it.";
  line.example =
      "  palpate stability\n"
      "  palpate stability --soft\n"
      "  palpate stability --full --report stability.html --json stability.json";
  std::string json, page, figure;
  int jobs = 0;
  std::uint64_t seed = 0;
  auto add = line.options.add_options();
  namespace po = boost::program_options;
  add("full", "four stiffnesses a decade instead of one");
  add("soft", "only the map of soft bodies: moduli, springs, rates of the body (a minute)");
  add("seed", po::value(&seed)->value_name("S"),
      "with --soft: other places, depths and speeds, drawn with this seed");
  add("report", po::value(&page)->value_name("FILE"),
      "write a report with figures as an HTML page");
  add("figure", po::value(&figure)->value_name("FILE"), "write the map as SVG");
  add("json", po::value(&json)->value_name("FILE"), "write every number as JSON");
  add("jobs", po::value(&jobs)->value_name("J"), "threads; default: one for each core");
  add("force", "replace existing files");
  const auto values = line.parse(args);
  if (!values) return 0;
  if (values->count("jobs") && (jobs < 1 || jobs > 256)) {
    throw UsageError("--jobs: must be 1 to 256, not " + std::to_string(jobs));
  }
  output::Outputs outputs(*values, {"json", "report", "figure"}, {});
  if (jobs == 0) jobs = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  std::optional<output::ProgressLine> progress("loops");
  const evidence::StudyJobs work{jobs, [&](double share) { progress->show(share); },
                                 output::now_ns};
  if (values->count("soft") > 0) {
    for (const char* const other : {"full", "report", "json"}) {
      if (values->count(other) > 0)
        throw UsageError(std::string("--soft: expected without --") + other);
    }
    const std::vector<evidence::SoftSwing> map = evidence::soft_study(
        values->count("seed") > 0 ? evidence::soft_cases_elsewhere(seed) : evidence::soft_cases(),
        work);
    progress.reset();
    if (outputs.wanted("figure"))
      outputs.put("figure",
                  analysis::figure_svg(evidence::soft_map_figure(map), analysis::light_palette()));
    outputs.write();
    std::cout << evidence::soft_map_text(map);
    const auto is_good = [](const evidence::SoftSwing& one) {
      return !one.accepted || one.settles();
    };
    return std::ranges::all_of(map, is_good) ? 0 : 1;
  }
  if (values->count("seed") > 0) throw UsageError("--seed: expected with --soft");
  const evidence::StabilityReport report =
      evidence::stability_study(values->count("full") > 0, work);
  progress.reset();
  if (outputs.wanted("json")) outputs.put("json", evidence::stability_json(report).dump(1) + "\n");
  if (outputs.wanted("figure"))
    outputs.put("figure", analysis::figure_svg(evidence::stability_figure(report),
                                               analysis::light_palette()));
  if (outputs.wanted("report")) outputs.put("report", evidence::stability_page(report));
  outputs.write();
  std::cout << evidence::stability_text(report);
  return report.unsafe() == 0 && report.worst_disagreement() <= 0.05 ? 0 : 1;
}

}  // namespace palpate::runner::commands
