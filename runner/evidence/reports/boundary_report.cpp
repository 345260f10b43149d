#include "runner/evidence/reports/boundary_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <utility>
#include <vector>

#include "analysis/figures/panel_drawing.h"
#include "analysis/figures/svg.h"
#include "analysis/report/html_page.h"
#include "analysis/report/tables.h"
#include "runner/evidence/reports/accuracy_report.h"

namespace palpate::runner::evidence {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kLeastDrawn = 1e-4;  // N s/m: none has no logarithm

std::string name_of(const BuzzingPlace& place) {
  return "object " + std::to_string(place.object) + ", " + place.type + ", " +
         std::to_string(place.contacts) + (place.contacts == 1 ? " contact" : " contacts");
}

std::string damping(double value) {
  if (value == 0) return "0";
  return std::isfinite(value) ? significant(value) : "none is enough";
}

std::string in_hz(double rate) { return thousands(std::llround(rate)) + " Hz"; }

/// The place that needs the most damping at this rate, without delay.
std::pair<double, const BuzzingPlace*> most_needed(const SceneBoundary& boundary, double rate) {
  std::pair<double, const BuzzingPlace*> most{0, &boundary.places.front()};
  for (const BuzzingPlace& place : boundary.places) {
    for (const DampingNeeded& point : place.map) {
      if (point.rate == rate && point.delay == 0 && point.needed > most.first)
        most = {point.needed, &place};
    }
  }
  return most;
}

/// Whether the scene buzzes on the device, and where.
std::string on_device(const BoundaryReport& report) {
  const BuzzingDevice& device = *report.device;
  const std::string at = "At " + in_hz(device.ends.rate) + " on " + device.name + " (" +
                         significant(device.ends.damping) + " N s/m and " +
                         significant(device.ends.friction) + " N of friction at each end; delay " +
                         (device.measured ? significant(1e3 * device.delay) + " ms, measured, so " +
                                                std::to_string(device.ends.delay) + " ticks"
                                          : std::string("not measured")) +
                         ") ";
  if (!(device.ends.damping > 0))
    return at + "no more can be said: the device's damping is not known. See the tables.";
  std::string where;
  for (const BuzzingPlace& place : report.boundary.places) {
    if (!place.buzzes.value_or(false)) continue;
    where += (where.empty() ? "" : "; ") + name_of(place);
  }
  return at + (where.empty() ? "the scene comes to rest, also without a hand."
                             : "the scene buzzes: " + where + ".");
}

std::vector<std::string> sentences_of(const BoundaryReport& report) {
  std::vector<std::string> all;
  if (report.boundary.places.empty()) return report.boundary.notes;
  if (report.device) all.push_back(on_device(report));
  const auto [most, where] = most_needed(report.boundary, 1000);
  all.push_back("At 1,000 Hz without delay and friction it needs " + damping(most) +
                " N s/m of physical damping at each end of the stylus (" + name_of(*where) +
                "); less, and it buzzes.");
  all.insert(all.end(), report.boundary.notes.begin(), report.boundary.notes.end());
  return all;
}

std::vector<std::string> how_to_read_boundaries() {
  return {
      "Damping needed: of each end of the stylus, by simulating the loop of two ends (0.1 kg, no "
      "hand), devices and renderer at the place, 1 mm deep. Less, and a swing of 0.1 mm does not "
      "come to rest. A hand adds damping of its own; friction is left out.",
      "Theory: K (T/2 + delay), passive with any hand (Colgate & Schenkel 1997), with the "
      "stiffness K "
      "of the contact at the ends of the real stylus."};
}

analysis::Table table_of(const BuzzingPlace& place) {
  analysis::Table table;
  table.caption = name_of(place) + ", " + significant(place.stiffness) +
                  " N/m: damping needed at each end, N s/m (theory)";
  table.header = {"rate Hz", "no delay", "1 tick", "2 ticks", "3 ticks"};
  for (const double rate : kSceneRates) {
    std::vector<std::string> cells{thousands(std::llround(rate))};
    for (const DampingNeeded& point : place.map) {
      if (point.rate == rate)
        cells.push_back(damping(point.needed) + " (" + significant(point.theory) + ")");
    }
    table.rows.push_back(std::move(cells));
  }
  return table;
}

}  // namespace

std::string boundary_text(const BoundaryReport& report) {
  std::ostringstream out;
  for (const std::string& sentence : sentences_of(report)) put_wrapped(out, sentence);
  if (report.boundary.places.empty()) return out.str();
  for (const BuzzingPlace& place : report.boundary.places) put_table(out, table_of(place));
  out << "\nHow to read it\n";
  for (const std::string& sentence : how_to_read_boundaries()) put_wrapped(out, sentence);
  return out.str();
}

Json boundary_json(const BoundaryReport& report) {
  const auto finite = [](double value) { return std::isfinite(value) ? Json(value) : Json(); };
  Json places = Json::array();
  for (const BuzzingPlace& place : report.boundary.places) {
    Json points = Json::array();
    for (const DampingNeeded& point : place.map) {
      points.push_back({{"rate_hz", point.rate},
                        {"delay_ticks", point.delay},
                        {"damping_needed_ns_per_m", finite(point.needed)},
                        {"theory_ns_per_m", point.theory}});
    }
    places.push_back({{"object", place.object},
                      {"contact_type", place.type},
                      {"contacts", place.contacts},
                      {"point_m", {place.point.x, place.point.y, place.point.z}},
                      {"stiffness_n_per_m", place.stiffness},
                      {"buzzes_on_device", place.buzzes ? Json(*place.buzzes) : Json()},
                      {"points", std::move(points)}});
  }
  Json json{{"version", 1},
            {"program_version", PALPATE_VERSION},
            {"scene", report.scene},
            {"renderer", report.renderer},
            {"places", std::move(places)},
            {"sentences", sentences_of(report)}};
  if (report.device) {
    const BuzzingDevice& device = *report.device;
    json["device"] = {{"name", device.name},
                      {"damping_of_each_end_ns_per_m",
                       device.ends.damping > 0 ? Json(device.ends.damping) : Json()},
                      {"friction_of_each_end_n", device.ends.friction},
                      {"resolution_m", device.ends.resolution},
                      {"rate_hz", device.ends.rate},
                      {"delay_s", device.measured ? Json(device.delay) : Json()},
                      {"delay_ticks", device.ends.delay}};
  }
  return json;
}

analysis::Figure boundary_figure(const BoundaryReport& report) {
  constexpr std::array kShapes = {analysis::MarkerShape::circle, analysis::MarkerShape::square,
                                  analysis::MarkerShape::up, analysis::MarkerShape::saltire};
  analysis::Figure figure;
  figure.id = "boundary";
  figure.title = "Damping that keeps " + report.scene + " from buzzing";
  figure.subtitle = "Of each end of the stylus; a line for each delay from a reading to its force.";
  figure.description =
      "Physical damping needed over the servo's rate, both logarithmic; a panel for each place of "
      "contact.";
  double low = HUGE_VAL, high = 0;
  for (const BuzzingPlace& place : report.boundary.places) {
    for (const DampingNeeded& point : place.map) {
      if (!std::isfinite(point.needed)) continue;
      low = std::min(low, std::max(kLeastDrawn, point.needed));
      high = std::max(high, std::max(kLeastDrawn, point.needed));
    }
  }
  for (int delay = 0; delay < kSceneDelays; ++delay) {
    figure.legend.push_back({delay == 0   ? "no delay"
                             : delay == 1 ? "1 tick"
                                          : std::to_string(delay) + " ticks",
                             analysis::line_role(static_cast<std::size_t>(delay)),
                             kShapes[static_cast<std::size_t>(delay)]});
  }
  for (const BuzzingPlace& place : report.boundary.places) {
    analysis::Panel panel;
    panel.title = name_of(place);
    panel.x = analysis::decades_axis(100, 10000, "rate (Hz)");
    panel.y = analysis::decades_axis(low < high ? low : kLeastDrawn, high > 0 ? high : 1,
                                     "damping needed (N s/m)");
    panel.width = 300;
    panel.height = 220;
    for (int delay = 0; delay < kSceneDelays; ++delay) {
      const auto k = static_cast<std::size_t>(delay);
      analysis::Mark line = analysis::line_mark(analysis::line_role(k), {}, {}, 1.5);
      for (const DampingNeeded& point : place.map) {
        if (point.delay != delay || !std::isfinite(point.needed)) continue;
        const double x = std::log10(point.rate),
                     y = std::log10(std::max(kLeastDrawn, point.needed));
        line.x.push_back(x);
        line.y.push_back(y);
        panel.marks.push_back(analysis::symbol(analysis::line_role(k), kShapes[k], x, y, 4,
                                               in_hz(point.rate) + ", " + std::to_string(delay) +
                                                   " ticks late: " + damping(point.needed) +
                                                   " N s/m, theory " + significant(point.theory)));
      }
      if (line.x.size() > 1) panel.marks.push_back(std::move(line));
    }
    figure.panels.push_back(std::move(panel));
  }
  return figure;
}

std::string boundary_page(const BoundaryReport& report) {
  analysis::HtmlPage page("Where " + report.scene + " buzzes");
  analysis::put_list(page.below_title(), sentences_of(report));
  if (!report.boundary.places.empty())
    page.put_figure_section(boundary_figure(report), "Damping over rate");
  page.begin_section("tables", "The numbers", "Numbers");
  for (const BuzzingPlace& place : report.boundary.places)
    analysis::put_table(page.body(), table_of(place));
  page.end_section();
  page.begin_section("reading", "How to read it", "How to read it");
  analysis::put_list(page.body(), how_to_read_boundaries());
  page.end_section();
  return page.html("palpate " PALPATE_VERSION ".");
}

}  // namespace palpate::runner::evidence
