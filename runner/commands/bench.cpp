// palpate bench: run time of the renderers' ticks on this machine.

#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "runner/commands/shared/command.h"
#include "runner/evidence/scenes/tick_costs.h"
#include "runner/output/outputs.h"

namespace palpate::runner::commands {
namespace {

using evidence::TickCost;
namespace po = boost::program_options;

constexpr std::size_t kTicksForMillion = 20'000;

std::string table(const std::vector<TickCost>& rows) {
  std::string out;
  char line[200];
  std::snprintf(line, sizeof line, "%-24s%10s  %-7s%-20s%8s%8s%8s%9s%7s%8s\n", "mesh", "triangles",
                "probe", "state", "median", "p99", "max us", "net", "target", "allocs");
  out += line;
  for (const TickCost& r : rows) {
    const std::string state = r.state + (r.cold ? ", cold" : "");
    if (r.ticks == 0) {
      std::snprintf(line, sizeof line, "%-24s%10zu  %-7s%-20s did not occur\n", r.mesh.c_str(),
                    r.triangles, r.renderer.c_str(), state.c_str());
    } else {
      std::snprintf(line, sizeof line, "%-24s%10zu  %-7s%-20s%8.0f%8.0f%8.1f%9.0f%7.0f%8zu%s\n",
                    r.mesh.c_str(), r.triangles, r.renderer.c_str(), state.c_str(), r.median_ns,
                    r.p99_ns, r.max_ns / 1000, r.net_ns(), r.target_ns, r.allocations,
                    r.target_ns > 0 && r.judged_ns() > r.target_ns ? "  over" : "");
    }
    out += line;
  }
  return out;
}

const TickCost* find(const std::vector<TickCost>& rows, std::size_t triangles,
                     const char* renderer) {
  for (const TickCost& r : rows) {
    if (r.mesh == "icosphere" && r.triangles == triangles && r.renderer == renderer &&
        r.state == "contact" && !r.cold) {
      return &r;
    }
  }
  return nullptr;
}

const TickCost* find_union(const std::vector<TickCost>& rows, std::size_t triangles,
                           std::size_t parts) {
  for (const TickCost& r : rows) {
    if (r.target_is_p99 && r.near_parts == 10 && r.segments == 3 && r.triangles == triangles &&
        r.parts == parts && r.ticks > 0) {
      return &r;
    }
  }
  return nullptr;
}

/// Ten near parts and three segments: the cost, and its growth.
std::string growth_of_unions(const std::vector<TickCost>& rows) {
  const TickCost* const ten = find_union(rows, 1280, 10);
  const TickCost* const many = find_union(rows, 1280, 1000);
  const TickCost* const fine = find_union(rows, 327680, 10);
  if (ten == nullptr || many == nullptr || fine == nullptr) return "";
  char text[300];
  std::snprintf(text, sizeof text,
                "Ten near parts and a tool of three segments: median %.2f us, p99 %.2f us; %.2fx "
                "with 990 parts more out of reach, %.2fx with 327,680 triangles a part (medians "
                "without the empty tick).\n",
                ten->median_ns / 1000, ten->p99_ns / 1000, many->net_ns() / ten->net_ns(),
                fine->net_ns() / ten->net_ns());
  return text;
}

/// The meaning of the numbers for a lab.
std::string conclusions(const std::vector<TickCost>& rows) {
  std::string out;
  char text[300];
  for (const char* renderer : {"point", "ray"}) {
    const TickCost* const small = find(rows, 1280, renderer);
    const TickCost* const large = find(rows, 327680, renderer);
    if (small == nullptr || large == nullptr) continue;
    std::snprintf(text, sizeof text,
                  "Growth from 1,280 to 327,680 triangles in contact, %s: %.2fx as read, %.2fx "
                  "without the empty tick.\n",
                  renderer, large->median_ns / small->median_ns, large->net_ns() / small->net_ns());
    out += text;
  }
  out += growth_of_unions(rows);
  double p99 = 0;
  for (const TickCost& r : rows) {
    if (!r.cold && r.elements == 0) p99 = std::max(p99, r.p99_highest_ns);
  }
  const double percent = p99 / 100'000 * 100;
  std::snprintf(text, sizeof text,
                "99 %% of ticks in every warm row and round (but soft bodies) take less than %.1f "
                "us: %.1f %% of a "
                "period at 10 "
                "kHz, %.2f %% at 1 kHz. Rendering is %s on this computer; for the timing of the "
                "servo see palpate devices --timing.\n",
                p99 / 1000, percent, percent / 10,
                percent < 20    ? "fit for 1 to 10 kHz"
                : percent < 200 ? "fit for 1 kHz, not for 10 kHz"
                                : "too slow for 1 kHz");
  return out + text;
}

nlohmann::ordered_json to_json(const std::vector<TickCost>& rows) {
  auto list = nlohmann::ordered_json::array();
  for (const TickCost& r : rows) {
    nlohmann::ordered_json row = {
        {"mesh", r.mesh},   {"triangles", r.triangles},           {"renderer", r.renderer},
        {"state", r.state}, {"caches", r.cold ? "cold" : "warm"}, {"ticks", r.ticks}};
    const auto number = [&](const char* key, double ns) {
      row[key] = r.ticks > 0 ? nlohmann::ordered_json(ns) : nlohmann::ordered_json(nullptr);
    };
    number("median_ns", r.median_ns);
    number("p99_ns", r.p99_ns);
    number("p99_highest_ns", r.p99_highest_ns);
    number("max_ns", r.max_ns);
    row["allocations"] = r.allocations;
    row["empty_loop_ns"] = r.empty_loop_ns;
    row["target_ns"] = r.target_ns > 0 ? nlohmann::ordered_json(r.target_ns) : nullptr;
    row["target_of"] = r.target_is_p99 ? "p99" : "median";
    row["parts"] = r.parts;
    row["near_parts"] = r.near_parts;
    row["tool_segments"] = r.segments;
    if (r.elements > 0) row["elements"] = r.elements;
    list.push_back(std::move(row));
  }
  return {{"program_version", PALPATE_VERSION}, {"build", PALPATE_BUILD}, {"rows", list}};
}

}  // namespace

int bench_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage = "palpate bench [--json FILE [--force]] [--ticks N]";
  line.summary =
      "Measures the run time of the renderers' ticks on this machine, each tick separately,\n"
      "in nanoseconds, in five rounds of the same ticks. The lowest median and the lowest 99th\n"
      "percentile are kept, to leave out the load of other programs. Quit them nevertheless:\n"
      "they slow down all rounds.";
  line.example =
      "  palpate bench                       a table, about a minute\n"
      "  palpate bench --json bench.json     the same for programs\n";
  line.options.add_options()                                                               //
      ("json", po::value<std::string>()->value_name("FILE"), "write the numbers as JSON")  //
      ("ticks", po::value<long>()->default_value(200'000)->value_name("N"),
       "ticks a row, 1000 to 100 million; below 20000 without the mesh of a million triangles")  //
      ("force", "replace an existing file");
  const auto values = line.parse(args);
  if (!values) return 0;
  output::Outputs outputs(*values, {"json"}, {});
  const long ticks = (*values)["ticks"].as<long>();
  if (ticks < 1000 || ticks > 100'000'000)
    throw UsageError("--ticks: must be 1000 to 100000000, not " + std::to_string(ticks));
  evidence::TickCostSettings settings;
  settings.ticks = static_cast<std::size_t>(ticks);
  settings.with_million = settings.ticks >= kTicksForMillion;
  settings.approaches = std::max<std::size_t>(50, settings.ticks / 200);
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const auto rows =
      evidence::measure_tick_costs(settings, [&](std::size_t so_far, std::size_t all) {
        if (terminal)
          std::fprintf(stderr, "\r%zu of %zu rows%s", so_far, all, so_far == all ? "\n" : "");
      });
  std::cout
      << "A tick, ns (max: us). An empty tick takes " << rows[0].empty_loop_ns
      << ", which is subtracted in the net median. The lowest median and the lowest p99 of "
      << evidence::kTickRounds
      << " rounds of the same ticks;\nthe maximum is mostly due to the operating system.\n"
         "Stylus at 0.1 m/s, with a hand's tremor; contact 1 to 2 mm deep; free: 1 to 2 mm off the "
         "bounding sphere; first_contact: in a new trial each. cold: the near caches are cleared "
         "before each tick. Where a tool or a concave mesh is named, the target of contact and "
         "free "
         "is that of p99, of a cold row that of the median.\n\n"
      << table(rows) << "\n"
      << conclusions(rows);
  outputs.put("json", to_json(rows).dump(2) + "\n");
  outputs.write();
  return 0;
}

}  // namespace palpate::runner::commands
