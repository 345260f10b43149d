#include "runner/evidence/reports/scene_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <sstream>
#include <utility>

#include "analysis/figures/panel_drawing.h"
#include "analysis/report/html_page.h"
#include "analysis/text.h"
#include "runner/evidence/reports/accuracy_report.h"

namespace palpate::runner::evidence {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kLeastForce = 1e-10;  // N: an error of 0 has no logarithm

double force_of(const SceneRow& row) { return std::max(kLeastForce, row.errors->force_rms); }

std::string or_dash(const std::optional<double>& value, double factor = 1) {
  return value ? significant(factor * *value) : "-";
}

std::string microseconds(double ns) { return significant(1e-3 * ns); }

std::vector<const SceneRow*> drawn_rows(const SceneStudy& study) {
  std::vector<const SceneRow*> rows;
  for (const SceneRow& row : study.rows) {
    if (row.errors && row.errors->ticks > 0 && row.median_ns > 0) rows.push_back(&row);
  }
  return rows;
}

/// How the exact answer and its ticks came about.
std::vector<std::string> how_to_read(const SceneStudy& study) {
  const auto count = [](std::size_t n) { return thousands(static_cast<long long>(n)); };
  std::vector<std::string> all;
  const std::string touching =
      "Of " + count(study.ticks) + " ticks, " + count(study.touching) + " touch";
  all.push_back(study.truth == "none"
                    ? "Exact answer: none, so there are times alone. " + touching + "."
                    : "Exact answer: " + study.truth + ". " + touching + "; " +
                          count(study.unknown) + " have no exact answer and are not compared.");
  if (study.tried > 0) {
    all.push_back("The exact ideal tool was tried by winding number at " + count(study.tried) +
                  " ticks: inside at " + count(study.found_inside) + ".");
  }
  all.emplace_back(
      "Errors: force and torque (about the virtual tip) as vectors, and the place of the ideal "
      "tip, "
      "over the ticks that touch. Torque: where no part of the tool lies along a face. Lost: "
      "contacts missed; phantom: found where there is none.");
  all.emplace_back(
      "Where two places of the ideal tool are right, a method and the exact answer may keep "
      "different "
      "ones until the tool has left the object.");
  all.emplace_back(
      "Times: a whole tick, that touches, on this machine; median and p99 of the quickest of "
      "several "
      "rounds, the worst of all. Cold: the near caches are swept before each tick.");
  for (const SceneRow& row : study.rows) {
    all.push_back(row.method + ": " + row.description + ".");
  }
  all.insert(all.end(), study.notes.begin(), study.notes.end());
  return all;
}

/// Force error over time, as letters on a grid of characters; the best are marked.
std::string scene_plot(const SceneStudy& study) {
  constexpr int kWide = 56, kHigh = 12;
  const std::vector<const SceneRow*> rows = drawn_rows(study);
  if (rows.size() < 2) return {};
  double left = HUGE_VAL, right = -HUGE_VAL, low = HUGE_VAL, high = -HUGE_VAL;
  for (const SceneRow* row : rows) {
    left = std::min(left, std::log10(row->median_ns));
    right = std::max(right, std::log10(row->median_ns));
    low = std::min(low, std::log10(force_of(*row)));
    high = std::max(high, std::log10(force_of(*row)));
  }
  std::vector<std::string> grid(kHigh + 1, std::string(kWide + 1, ' '));
  std::string legend;
  char letter = 'a';
  for (const SceneRow* row : rows) {
    const auto place = [](double at, double from, double to, int size) {
      return static_cast<std::size_t>(
          std::lround(to > from ? (at - from) / (to - from) * size : 0.0));
    };
    const std::size_t x = place(std::log10(row->median_ns), left, right, kWide);
    std::size_t y = kHigh - place(std::log10(force_of(*row)), low, high, kHigh);
    // Two of one place stand one above the other.
    while (grid[y][x] != ' ' && y + 1 < grid.size()) ++y;
    while (grid[y][x] != ' ' && y > 0) --y;
    grid[y][x] = row->best ? static_cast<char>(letter - 'a' + 'A') : letter;
    legend += std::string("  ") + (row->best ? static_cast<char>(letter - 'a' + 'A') : letter) +
              " " + row->method;
    ++letter;
  }
  std::ostringstream out;
  out << "\nForce error (rms, N, up) over time (median, us, right), both logarithmic\n";
  for (int y = 0; y <= kHigh; ++y) {
    std::string label = y == 0 ? significant(std::pow(10, high))
                               : (y == kHigh ? significant(std::pow(10, low)) : "");
    std::string line = analysis::pad_left(label, 9) + " |" + grid[static_cast<std::size_t>(y)];
    line.erase(line.find_last_not_of(' ') + 1);
    out << line << '\n';
  }
  const std::string first = microseconds(std::pow(10, left)),
                    last = microseconds(std::pow(10, right));
  out << std::string(10, ' ') << '+' << std::string(kWide + 1, '-') << '\n'
      << std::string(11, ' ') << first << analysis::pad_left(last, kWide + 1 - first.size())
      << "\n " << legend << "\n  Capital letters: no other method is both quicker and nearer.\n";
  return out.str();
}

Json scene_rows_json(const SceneStudy& study) {
  const auto figure = [](const std::optional<double>& value) {
    return value ? Json(*value) : Json(nullptr);
  };
  Json rows = Json::array();
  for (const SceneRow& row : study.rows) {
    const auto error = [&](double SceneErrors::*member) {
      return row.errors ? Json((*row.errors).*member) : Json(nullptr);
    };
    rows.push_back(
        {{"method", row.method},
         {"description", row.description},
         {"triangles", row.triangles},
         {"median_ns", row.median_ns},
         {"p99_ns", row.p99_ns},
         {"worst_ns", row.worst_ns},
         {"cold_median_ns", row.cold_median_ns},
         {"cold_p99_ns", row.cold_p99_ns},
         {"ticks_timed", row.timed},
         {"force_error_rms_n", error(&SceneErrors::force_rms)},
         {"force_error_p999_n", error(&SceneErrors::force_p999)},
         {"force_error_max_n", error(&SceneErrors::force_max)},
         {"torque_error_max_nm", row.errors ? figure(row.errors->torque_max) : Json(nullptr)},
         {"tip_error_max_m", row.errors ? figure(row.errors->tip_max) : Json(nullptr)},
         {"ticks_compared", row.errors ? Json(row.errors->ticks) : Json(nullptr)},
         {"lost", row.errors ? Json(row.errors->lost) : Json(nullptr)},
         {"phantom", row.errors ? Json(row.errors->phantom) : Json(nullptr)},
         {"best", row.best}});
  }
  return rows;
}

}  // namespace

analysis::Table scene_table(const std::vector<SceneStudy>& studies) {
  const bool several = studies.size() > 1;
  analysis::Table table;
  table.caption =
      several ? "Scenes of every kind: every method that can show them"
              : "Methods on " + studies.front().name + " (" + studies.front().renderer + ")";
  if (several) table.header.emplace_back("scene");
  for (const char* name :
       {"method", "triangles", "median us", "p99 us", "worst us", "cold us", "cold p99",
        "force N: rms", "99.9 %", "worst", "torque Nm", "tip mm", "lost", "phantom", "best"})
    table.header.emplace_back(name);
  table.n_names = several ? 2 : 1;
  for (const SceneStudy& study : studies) {
    for (const SceneRow& row : study.rows) {
      std::vector<std::string> cells;
      if (several) cells.push_back(study.name);
      cells.insert(cells.end(), {row.method, thousands(static_cast<long long>(row.triangles)),
                                 microseconds(row.median_ns), microseconds(row.p99_ns),
                                 microseconds(row.worst_ns), microseconds(row.cold_median_ns),
                                 microseconds(row.cold_p99_ns)});
      if (row.errors) {
        const SceneErrors& e = *row.errors;
        cells.insert(cells.end(),
                     {significant(e.force_rms), significant(e.force_p999), significant(e.force_max),
                      or_dash(e.torque_max), or_dash(e.tip_max, 1e3), std::to_string(e.lost),
                      std::to_string(e.phantom)});
      } else {
        cells.insert(cells.end(), 7, "-");
      }
      cells.emplace_back(row.best ? "*" : "");
      table.rows.push_back(std::move(cells));
    }
  }
  table.notes.emplace_back("*: no other method of the scene is both quicker and nearer.");
  return table;
}

analysis::Figure scene_figure(const std::vector<SceneStudy>& studies) {
  analysis::Figure figure;
  figure.id = "scenes";
  figure.title = "Error over time, for each method that can show the scene";
  figure.subtitle = "Filled: no other method is both quicker and nearer.";
  figure.description =
      "Error of the force (rms, N) over the median time of a tick (us) for each method, both axes "
      "logarithmic. One panel for each scene.";
  for (const SceneStudy& study : studies) {
    const std::vector<const SceneRow*> rows = drawn_rows(study);
    if (rows.empty()) continue;
    double quickest = HUGE_VAL, slowest = 0, low = HUGE_VAL, high = 0;
    for (const SceneRow* row : rows) {
      quickest = std::min(quickest, 1e-3 * row->median_ns);
      slowest = std::max(slowest, 1e-3 * row->median_ns);
      low = std::min(low, force_of(*row));
      high = std::max(high, force_of(*row));
    }
    analysis::Panel panel;
    panel.title = study.name;
    panel.x = analysis::decades_axis(0.9 * quickest, 1.1 * slowest, "median us a tick");
    panel.y = analysis::decades_axis(0.9 * low, 1.1 * high, "rms error of force (N)");
    panel.width = studies.size() == 1 ? 700 : 300;
    panel.height = studies.size() == 1 ? 380 : 220;
    std::vector<std::pair<double, double>> front;
    for (const SceneRow* row : rows) {
      const double x = std::log10(1e-3 * row->median_ns), y = std::log10(force_of(*row));
      const std::string tip = row->method + ": median " + microseconds(row->median_ns) +
                              " us, p99 " + microseconds(row->p99_ns) + " us, force " +
                              significant(row->errors->force_rms) + " N";
      panel.marks.push_back(analysis::symbol(
          row->best ? analysis::Role::point : analysis::Role::soft,
          row->best ? analysis::MarkerShape::circle : analysis::MarkerShape::diamond, x, y, 5,
          tip));
      analysis::Mark label = analysis::text_mark(analysis::Role::ink, x, y, row->method, 11);
      label.kind = analysis::Mark::Kind::label;
      panel.marks.push_back(std::move(label));
      if (row->best) front.emplace_back(x, y);
    }
    std::ranges::sort(front);
    if (front.size() > 1) {
      std::vector<double> x, y;
      for (const auto& [at, error] : front) {
        x.push_back(at);
        y.push_back(error);
      }
      analysis::Mark line = analysis::line_mark(analysis::Role::point, x, y, 1);
      line.dashed = true;
      panel.marks.insert(panel.marks.begin(), std::move(line));
    }
    figure.panels.push_back(std::move(panel));
  }
  return figure;
}

Json scene_json(const SceneStudy& study) {
  return {{"scene", study.name},
          {"renderer", study.renderer},
          {"truth", study.truth},
          {"ticks", study.ticks},
          {"ticks_touching", study.touching},
          {"ticks_unknown", study.unknown},
          {"truth_tried", study.tried},
          {"truth_inside", study.found_inside},
          {"rows", scene_rows_json(study)},
          {"choose", study.choose},
          {"notes", study.notes}};
}

std::string scene_text(const SceneStudy& study) {
  std::ostringstream out;
  put_wrapped(out, study.choose);
  put_table(out, scene_table({study}));
  out << scene_plot(study) << "\nHow to read it\n";
  for (const std::string& sentence : how_to_read(study)) put_wrapped(out, sentence);
  return out.str();
}

std::string scene_page(const SceneStudy& study) {
  analysis::HtmlPage page("How far the forces on " + study.name +
                          " are from the exact ones, and at what cost");
  analysis::put_list(page.below_title(), {study.choose});
  if (!drawn_rows(study).empty()) page.put_figure_section(scene_figure({study}), "Error over time");
  page.begin_section("tables", "The numbers", "Numbers");
  analysis::put_table(page.body(), scene_table({study}));
  page.end_section();
  page.begin_section("reading", "How to read it", "How to read it");
  analysis::put_list(page.body(), how_to_read(study));
  page.end_section();
  return page.html("palpate " PALPATE_VERSION ".");
}

}  // namespace palpate::runner::evidence
