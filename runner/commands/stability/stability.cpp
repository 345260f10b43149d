#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/figures/panel_drawing.h"
#include "analysis/figures/svg.h"
#include "analysis/report/html_page.h"
#include "analysis/report/tables.h"
#include "analysis/text.h"
#include "runner/commands/shared/command.h"
#include "runner/evidence/reports/accuracy_report.h"
#include "runner/evidence/stability/boundary.h"
#include "runner/output/outputs.h"
#include "runner/output/progress_line.h"

namespace palpate::runner::commands {
namespace {

// The results of `palpate stability`, as text, JSON, figures and an HTML page.

/// One curve of the map: the boundary over stiffness.
struct BoundaryCurve {
  std::string panel, name;  ///< "rates", "0.5 kHz"
  evidence::LoopCase loop;
  std::vector<evidence::BoundaryPoint> points;
};

/// Largest stable stiffness of a device, without and with the passivity controller.
struct ControllerGain {
  evidence::LoopCase loop;       ///< without the controller
  double damping = 0;            ///< N s/m, of each end
  double without = 0, with = 0;  ///< N/m, largest stable stiffness
};

struct StabilityReport {
  std::vector<BoundaryCurve> theory;  ///< heavy ends, as the theory assumes
  std::vector<BoundaryCurve> curves;
  std::vector<ControllerGain> gains;
  std::vector<evidence::IntegratorRow> integrators;

  /// Largest |measured / theory - 1| of the plain wall with heavy ends.
  double worst_disagreement() const;
  /// Points that are unstable although the theory promises passivity; must be 0.
  int unsafe() const;
  int points() const;
};

constexpr double kPanelWidth = 245, kPanelHeight = 245, kRoom = 1000;  // px: three side by side
constexpr double kLeastDamping = 1e-4, kMostDamping = 1e3;             // N s/m
constexpr double kLeastError = 1e-19;                                  // m

/// The symbol of a curve or method, which tells it from others without colour.
analysis::MarkerShape line_shape(std::size_t line) {
  using enum analysis::MarkerShape;
  constexpr std::array kShapes = {circle, square, diamond, up, cross, saltire, right, left};
  return kShapes[line % kShapes.size()];
}

/// The curve's name in the panel's upper left corner, `row` names below the top.
void add_name(analysis::Panel& panel, const std::string& name, std::size_t row) {
  const double dy = 18 + 15 * static_cast<double>(row);
  analysis::Mark dot =
      analysis::symbol(analysis::line_role(row), line_shape(row), panel.x.low, panel.y.high, 3.5);
  dot.dx = 12;
  dot.dy = dy - 4;
  panel.marks.push_back(std::move(dot));
  analysis::Mark text =
      analysis::text_mark(analysis::Role::ink, panel.x.low, panel.y.high, name, 11);
  text.anchor = -1;
  text.dx = 21;
  text.dy = dy;
  panel.marks.push_back(std::move(text));
}

void add_curve(analysis::Panel& panel, const BoundaryCurve& curve, std::size_t row) {
  constexpr double kApart = 9;  // px between symbols of curves on the lower edge
  const analysis::Role role = analysis::line_role(row);
  analysis::Mark theory = analysis::line_mark(role, {}, {}, 1.4);
  for (const evidence::BoundaryPoint& point : curve.points) {
    const double x = std::log10(point.stiffness);
    if (point.promised) {
      theory.x.push_back(x);
      theory.y.push_back(std::log10(std::max(point.theory, kLeastDamping)));
    }
    const std::string text = curve.name + ", " + evidence::significant(point.stiffness) + " N/m: ";
    if (point.measured > 0) {
      panel.marks.push_back(
          analysis::symbol(role, line_shape(row), x,
                           std::clamp(std::log10(point.measured), panel.y.low, panel.y.high), 3.5,
                           text + evidence::significant(point.measured) + " N s/m"));
    } else {
      panel.marks.push_back(analysis::symbol(role, line_shape(row), x, panel.y.low, 3.5,
                                             text + "stable without any damping"));
      panel.marks.back().dy = -5 - kApart * static_cast<double>(row);
    }
  }
  if (theory.x.size() > 1) panel.marks.push_back(std::move(theory));
}

/// "20 kPa", "1 MPa"
std::string in_pascals(double modulus) {
  return modulus < 1e6 ? evidence::significant(modulus / 1e3) + " kPa"
                       : evidence::significant(modulus / 1e6) + " MPa";
}

/// Damping over stiffness, measured and by theory, a panel for each question.
analysis::Figure stability_figure(const StabilityReport& report) {
  analysis::Figure figure;
  figure.id = "stability";
  figure.title = "A stiffer wall needs more damping: lines are the theory, symbols the loop";
  figure.subtitle =
      "Below a line no hand can make it buzz. A symbol on or under its line is on the safe side; "
      "in "
      "a row at the bottom: stable without any damping.";
  figure.description =
      "Stability boundaries: damping over stiffness. Each panel asks one question; logarithmic "
      "both ways. Lines: b = K (T/2 + t_d) + |B|. Dots: the least damping with which the simulated "
      "loop comes to rest.";
  figure.max_row_width = kRoom;
  std::size_t row = 0;
  for (const BoundaryCurve& curve : report.curves) {
    if (figure.panels.empty() || figure.panels.back().title != curve.panel) {
      analysis::Panel panel;
      panel.title = curve.panel;
      panel.x = analysis::decades_axis(10, 1e5, "stiffness K (N/m)");
      panel.y =
          analysis::decades_axis(kLeastDamping, kMostDamping, "damping b of each end (N s/m)");
      panel.width = kPanelWidth;
      panel.height = kPanelHeight;
      figure.panels.push_back(std::move(panel));
      row = 0;
    }
    analysis::Panel& panel = figure.panels.back();
    add_curve(panel, curve, row);
    add_name(panel, curve.name, row);
    ++row;
  }
  return figure;
}

/// Swing of the force on soft bodies, by modulus, spring and rate, a panel for each tool.
analysis::Figure soft_map_figure(const std::vector<evidence::SoftSwing>& map) {
  constexpr double kCellWidth = 64, kCellHeight = 19;  // px
  analysis::Figure figure;
  figure.id = "soft-stability";
  int allowed = 0, settled = 0;
  for (const evidence::SoftSwing& one : map) {
    allowed += one.accepted;
    settled += one.accepted && one.settles();
  }
  figure.title = "A tool held still on a soft body: where scenes allow it, the force comes to rest";
  figure.subtitle =
      "Swing of the force in % of it, highest less lowest of the last 0.2 s. Amber: "
      "refused. Blue: " +
      std::to_string(settled) + " of " + std::to_string(allowed) +
      " that scenes allow, within 1 %.";
  figure.description =
      "Stability of soft bodies. A panel for each tool and material; rows are moduli and contact "
      "springs, columns the rate of the body's steps, numbers the swing of the force in percent.";
  figure.max_row_width = kRoom;
  std::vector<std::string> rates, rows;
  for (const evidence::SoftSwing& one : map) {
    const evidence::SoftCase& what = one.what;
    const std::string title = "tool of " + evidence::significant(1000 * what.radius) +
                              " mm, Poisson " + evidence::significant(what.poisson) + ", damping " +
                              evidence::significant(1000 * what.damping) + " ms";
    const auto slot = [](std::vector<std::string>& names, const std::string& name) {
      const auto at = std::find(names.begin(), names.end(), name) - names.begin();
      if (at == std::ssize(names)) names.push_back(name);
      return static_cast<double>(at);
    };
    if (figure.panels.empty() || figure.panels.back().title != title) {
      figure.panels.emplace_back();
      figure.panels.back().title = title;
    }
    const std::string rate = analysis::fixed(what.rate, what.rate < 100 ? 1 : 0);
    const double x = slot(rates, rate),
                 y = slot(rows, in_pascals(what.young) + ", " +
                                    evidence::significant(what.stiffness / 1000) + " kN/m");
    analysis::Panel& panel = figure.panels.back();
    const std::string swing = one.finite ? evidence::significant(100 * one.swing) : "no number";
    // Rows are reversed once their number is known.
    panel.marks.push_back(analysis::rect_mark(
        one.accepted ? analysis::Role::point : analysis::Role::amber, x + 0.03, -y - 0.05, x + 0.97,
        -y - 0.95, one.settles() ? (one.accepted ? 0.16 : 0.25) : 0.8,
        title + ", " + rows[static_cast<std::size_t>(y)] + ", " + rate + " Hz: " + swing + " %" +
            (one.accepted ? "" : ", refused")));
    // Do not print a number below a hundredth of a percent.
    analysis::Mark text =
        analysis::text_mark(one.settles() ? analysis::Role::ink : analysis::Role::page, x + 0.5,
                            -y - 0.5, one.finite && one.swing < 1e-4 ? "0" : swing, 11);
    text.dy = 4;
    panel.marks.push_back(std::move(text));
  }
  for (analysis::Panel& panel : figure.panels) {
    panel.x = analysis::names_axis(rates, rates.size(), "rate of the body's steps (Hz)");
    panel.y = analysis::names_axis(rows, rows.size(), "");
    for (analysis::Tick& tick : panel.y.ticks) tick.at = panel.y.high - tick.at;
    for (analysis::Mark& mark : panel.marks) {
      for (double& y : mark.y) y += panel.y.high;
    }
    panel.width = kCellWidth * static_cast<double>(rates.size());
    panel.height = kCellHeight * static_cast<double>(rows.size());
  }
  return figure;
}

/// Error over run time of the integrators.
analysis::Figure integrator_figure(const StabilityReport& report) {
  constexpr std::array kMethods = {"explicit", "semi-implicit", "implicit", "exact"};
  analysis::Figure figure;
  figure.id = "integrators";
  figure.title = "Integrators: the exact one has the least cost and error";
  figure.subtitle = "Symbols: 1, 4, 16, ... 1024 steps a tick; diverging ones are not drawn.";
  figure.description =
      "Error over run time of integrators. A panel for each oscillator, logarithmic both ways.";
  figure.max_row_width = kRoom;
  for (std::size_t m = 0; m < kMethods.size(); ++m) {
    figure.legend.push_back({kMethods[m], analysis::line_role(m), line_shape(m)});
  }
  for (const evidence::IntegratorRow& row : report.integrators) {
    if (!figure.panels.empty() && figure.panels.back().title == row.oscillator) continue;
    analysis::Panel panel;
    panel.title = row.oscillator;
    panel.x = analysis::decades_axis(1, 1e5, "ns a tick");
    panel.y = analysis::decades_axis(kLeastError, 1, "worst error (m)");
    panel.width = kPanelWidth;
    panel.height = kPanelHeight;
    figure.panels.push_back(std::move(panel));
  }
  for (analysis::Panel& panel : figure.panels) {
    for (std::size_t m = 0; m < kMethods.size(); ++m) {
      analysis::Mark line = analysis::line_mark(analysis::line_role(m), {}, {}, 1.4);
      for (const evidence::IntegratorRow& row : report.integrators) {
        if (row.oscillator != panel.title || row.method != kMethods[m]) continue;
        if (!std::isfinite(row.error)) continue;
        line.x.push_back(std::clamp(std::log10(row.ns_per_tick), panel.x.low, panel.x.high));
        line.y.push_back(
            std::clamp(std::log10(std::max(row.error, kLeastError)), panel.y.low, panel.y.high));
        panel.marks.push_back(analysis::symbol(
            analysis::line_role(m), line_shape(m), line.x.back(), line.y.back(), m == 3 ? 5 : 3.5,
            row.method + ", " + std::to_string(row.steps) +
                " steps a tick: " + evidence::significant(row.ns_per_tick) + " ns, error " +
                evidence::significant(row.error) + " m"));
      }
      if (line.x.size() > 1) panel.marks.push_back(std::move(line));
    }
  }
  return figure;
}

using Json = nlohmann::ordered_json;

std::string times(double factor) { return evidence::significant(factor) + " times"; }

analysis::Table theory_table(const StabilityReport& report) {
  analysis::Table table;
  table.caption =
      "The case of the theory: a plain wall, ends so heavy that their mass does not matter";
  table.header = {"curve", "stiffness N/m", "damping N s/m: theory", "measured", "ratio"};
  for (const BoundaryCurve& curve : report.theory) {
    for (const evidence::BoundaryPoint& p : curve.points) {
      table.rows.push_back({curve.name, evidence::significant(p.stiffness),
                            evidence::significant(p.theory), evidence::significant(p.measured),
                            evidence::significant(p.measured / p.theory)});
    }
  }
  return table;
}

analysis::Table curve_table(const StabilityReport& report, const std::string& panel) {
  analysis::Table table;
  table.caption = "Damping needed for stability, N s/m at each end: " + panel;
  table.header = {"curve", "stiffness N/m", "theory", "measured"};
  for (const BoundaryCurve& curve : report.curves) {
    if (curve.panel != panel) continue;
    for (const evidence::BoundaryPoint& p : curve.points) {
      table.rows.push_back({curve.name, evidence::significant(p.stiffness),
                            p.promised ? evidence::significant(p.theory) : "no promise",
                            p.measured == 0 ? "none" : evidence::significant(p.measured)});
    }
  }
  return table;
}

std::vector<std::string> panels_of(const StabilityReport& report) {
  std::vector<std::string> panels;
  for (const BoundaryCurve& curve : report.curves) {
    if (std::find(panels.begin(), panels.end(), curve.panel) == panels.end()) {
      panels.push_back(curve.panel);
    }
  }
  return panels;
}

analysis::Table gain_table(const StabilityReport& report) {
  analysis::Table table;
  table.caption = "Largest stable stiffness, N/m, without the passivity controller and with it";
  table.header = {"scene", "probe",  "Hz",      "damping N s/m", "resolution um",
                  "delay", "theory", "without", "with",          "factor"};
  table.n_names = 2;
  for (const ControllerGain& g : report.gains) {
    const evidence::LoopSettings& s = g.loop.settings;
    table.rows.push_back({evidence::to_string(g.loop.contact_case),
                          protocols::to_string(g.loop.renderer), evidence::significant(s.rate),
                          evidence::significant(g.damping),
                          evidence::significant(1e6 * s.resolution), std::to_string(s.delay),
                          evidence::significant(g.damping * s.rate / (0.5 + s.delay)),
                          evidence::significant(g.without), evidence::significant(g.with),
                          evidence::significant(g.with / g.without)});
  }
  return table;
}

analysis::Table integrator_table(const StabilityReport& report) {
  analysis::Table table;
  table.caption = "Integrators of the hand, 1 kHz: error after 500 ticks over run time";
  table.header = {"case", "method", "steps a tick", "ns a tick", "worst error, m"};
  table.n_names = 2;
  for (const evidence::IntegratorRow& row : report.integrators) {
    table.rows.push_back(
        {row.oscillator, row.method, std::to_string(row.steps),
         evidence::significant(row.ns_per_tick),
         std::isfinite(row.error) ? evidence::significant(row.error) : "diverges"});
  }
  return table;
}

/// Run time of the fastest other method that errs by at most a micrometre, as a multiple of the
/// exact one's; worst case.
double integrator_gain(const StabilityReport& report) {
  double worst = HUGE_VAL;
  for (const evidence::IntegratorRow& exact : report.integrators) {
    if (exact.method != "exact") continue;
    double cheapest = HUGE_VAL;
    for (const evidence::IntegratorRow& row : report.integrators) {
      if (row.oscillator == exact.oscillator && row.method != "exact" && row.error <= 1e-6) {
        cheapest = std::min(cheapest, row.ns_per_tick);
      }
    }
    worst = std::min(worst, cheapest / exact.ns_per_tick);
  }
  return worst;
}

std::vector<std::string> how_to_read() {
  std::vector<std::string> notes;
  notes.emplace_back(
      "Each end of the stylus is a mass that moves along the direction of pressing, with the "
      "device's damping and friction and the hand's impedance, integrated exactly (matrix "
      "exponential) under a force held over the tick. The renderers are those of sessions. The "
      "stylus is released 0.1 mm from equilibrium, 1 mm deep; the loop is unstable when the "
      "contact "
      "force oscillates with a larger amplitude in the last quarter of 40 periods than in the "
      "second (and larger than three counts of the resolution).");
  notes.emplace_back(
      "Theory: b > K (T/2 + t_d) + |B| (Colgate & Schenkel 1997; t_d: delay), as long as friction "
      "dissipates the effect of quantisation, K <= 2 f_c / Delta (Abbott & Okamura 2005). This is "
      "the condition of passivity: up to this stiffness no passive hand can make the loop "
      "unstable. "
      "A given loop may be stable far beyond.");
  notes.emplace_back(
      "Where two objects or the side of the stylus are in contact, the theory still assumes one "
      "contact at one end, although both ends carry the load.");
  return notes;
}

/// Null: the stylus is as long as the real one.
Json reach_json(const std::optional<rendering::Reach>& reach) {
  if (!reach) return nullptr;
  return {{"factor", reach->factor}, {"pivot_share_of_stylus", reach->fraction}};
}

Json loop_json(const evidence::LoopCase& loop) {
  const evidence::LoopSettings& s = loop.settings;
  return {{"scene", evidence::to_string(loop.contact_case)},
          {"renderer", protocols::to_string(loop.renderer)},
          {"rate_hz", s.rate},
          {"end_mass_kg", loop.heavy ? Json() : Json(s.mass)},
          {"virtual_damping_ns_per_m", loop.virtual_damping},
          {"friction_n", s.friction},
          {"resolution_m", s.resolution},
          {"delay_ticks", s.delay},
          {"layer_stiffness_of_surface", loop.layer_share},
          {"reach", reach_json(s.reach)},
          {"hand_stiffness_n_per_m", s.hand.stiffness},
          {"hand_damping_ns_per_m", s.hand.damping},
          {"hand_mass_kg", s.hand.mass}};
}

Json curve_json(const BoundaryCurve& curve) {
  Json json = {{"panel", curve.panel}, {"name", curve.name}, {"loop", loop_json(curve.loop)}};
  json["points"] = Json::array();
  for (const evidence::BoundaryPoint& p : curve.points) {
    json["points"].push_back({{"stiffness_n_per_m", p.stiffness},
                              {"measured_ns_per_m", p.measured},
                              {"theory_ns_per_m", p.theory},
                              {"promised", p.promised}});
  }
  return json;
}

double StabilityReport::worst_disagreement() const {
  double worst = 0;
  for (const BoundaryCurve& curve : theory) {
    for (const evidence::BoundaryPoint& p : curve.points) {
      worst = std::max(worst, std::abs(p.measured / p.theory - 1));
    }
  }
  return worst;
}

int StabilityReport::unsafe() const {
  int count = 0;
  for (const BoundaryCurve& curve : curves) {
    for (const evidence::BoundaryPoint& p : curve.points) count += p.unsafe();
  }
  return count;
}

int StabilityReport::points() const {
  std::size_t count = 0;
  for (const BoundaryCurve& curve : curves) count += curve.points.size();
  return static_cast<int>(count);
}

/// The conclusions in sentences.
std::vector<std::string> stability_sentences(const StabilityReport& report) {
  std::vector<std::string> out;
  out.push_back(
      "The measured boundary of a plain wall is the theory's, b = K (T/2 + t_d), within " +
      evidence::significant(100 * report.worst_disagreement()) +
      " % at all rates, with and without delay.");
  const int unsafe = report.unsafe();
  out.push_back(
      (unsafe == 0
           ? "Everywhere else the loop is stable where the theory promises passivity: at all "
           : "At " + std::to_string(unsafe) +
                 " points the loop is unstable where the theory promises passivity; of all ") +
      std::to_string(report.points()) + " points of the map.");
  double ideal = HUGE_VAL, coarse = HUGE_VAL, late = HUGE_VAL;
  for (const ControllerGain& g : report.gains) {
    const evidence::LoopSettings& settings = g.loop.settings;
    double& least = settings.delay > 0 ? late : settings.resolution > 0 ? coarse : ideal;
    least = std::min(least, g.with / g.without);
  }
  if (!report.gains.empty()) {
    out.push_back(
        "The passivity controller (\"servo\": {\"passivity_controller\": true}) makes at least " +
        times(ideal) + " the stiffness stable in every scene, " + times(coarse) +
        " with a resolution of 30 um and friction, but only " + times(late) +
        " where forces come a tick late.");
  }
  if (!report.integrators.empty()) {
    out.push_back(
        "The hand is integrated exactly: within a micrometre, every other method takes at least " +
        times(integrator_gain(report)) + " the run time in the stiff cases, or diverges.");
  }
  return out;
}

std::vector<analysis::Table> stability_tables(const StabilityReport& report) {
  std::vector<analysis::Table> tables;
  if (!report.gains.empty()) tables.push_back(gain_table(report));
  tables.push_back(theory_table(report));
  for (const std::string& panel : panels_of(report)) tables.push_back(curve_table(report, panel));
  if (!report.integrators.empty()) tables.push_back(integrator_table(report));
  return tables;
}

std::string stability_text(const StabilityReport& report) {
  std::ostringstream out;
  for (const std::string& sentence : stability_sentences(report))
    evidence::put_wrapped(out, sentence);
  for (const analysis::Table& table : stability_tables(report)) evidence::put_table(out, table);
  out << "\nHow to read it\n";
  for (const std::string& note : how_to_read()) evidence::put_wrapped(out, note);
  return out.str();
}

Json stability_json(const StabilityReport& report) {
  Json json = {{"version", 1},
               {"program_version", PALPATE_VERSION},
               {"worst_disagreement", report.worst_disagreement()},
               {"unsafe_points", report.unsafe()},
               {"points", report.points()}};
  for (const BoundaryCurve& curve : report.theory) json["theory"].push_back(curve_json(curve));
  for (const BoundaryCurve& curve : report.curves) json["curves"].push_back(curve_json(curve));
  for (const ControllerGain& g : report.gains) {
    Json gain = {{"loop", loop_json(g.loop)},
                 {"damping_ns_per_m", g.damping},
                 {"stiffest_without_n_per_m", g.without},
                 {"stiffest_with_n_per_m", g.with}};
    json["passivity_controller"].push_back(std::move(gain));
  }
  for (const evidence::IntegratorRow& row : report.integrators) {
    json["integrators"].push_back(
        {{"case", row.oscillator},
         {"method", row.method},
         {"steps_per_tick", row.steps},
         {"ns_per_tick", row.ns_per_tick},
         {"worst_error_m", std::isfinite(row.error) ? Json(row.error) : Json()}});
  }
  return json;
}

std::string stability_page(const StabilityReport& report) {
  analysis::HtmlPage page("At what stiffness does it buzz?");
  analysis::put_list(page.below_title(), stability_sentences(report));
  page.put_figure_section(stability_figure(report), "Boundaries");
  if (!report.integrators.empty()) {
    page.put_figure_section(integrator_figure(report), "Integrators");
  }
  page.begin_section("tables", "The numbers", "Numbers");
  for (const analysis::Table& table : stability_tables(report))
    analysis::put_table(page.body(), table);
  page.end_section();
  page.begin_section("reading", "How to read it", "How to read it");
  analysis::put_list(page.body(), how_to_read());
  page.end_section();
  return page.html("palpate " PALPATE_VERSION ".");
}

constexpr double kRates[] = {500, 1000, 2000, 5000, 10000};  // Hz
constexpr double kEndDamping = 0.25,
                 kEndFriction = 0.025;  // N s/m, N: half of the simulated device
constexpr double kResolution = 3e-5;    // m

std::string in_khz(double rate) { return evidence::significant(rate / 1000) + " kHz"; }

BoundaryCurve curve(const char* panel, std::string name, const evidence::LoopCase& loop) {
  return {panel, std::move(name), loop, {}};
}

std::vector<BoundaryCurve> theory_curves() {
  std::vector<BoundaryCurve> out;
  for (const int delay : {0, 1}) {
    for (const double rate : kRates) {
      evidence::LoopCase loop;
      loop.heavy = true;
      loop.settings.rate = rate;
      loop.settings.delay = delay;
      out.push_back(curve("theory", in_khz(rate) + (delay ? ", one tick late" : ""), loop));
    }
  }
  return out;
}

std::vector<BoundaryCurve> map_curves() {
  std::vector<BoundaryCurve> out;
  for (const protocols::RendererKind renderer :
       {protocols::RendererKind::point, protocols::RendererKind::ray}) {
    for (const evidence::ContactCase contact_case : evidence::kContactCases) {
      evidence::LoopCase loop;
      loop.contact_case = contact_case;
      loop.renderer = renderer;
      out.push_back(
          curve(renderer == protocols::RendererKind::point ? "scenes, point" : "scenes, ray",
                evidence::to_string(contact_case), loop));
    }
  }
  for (const double rate : kRates) {
    evidence::LoopCase loop;
    loop.settings.rate = rate;
    out.push_back(curve("rates, wall", in_khz(rate), loop));
  }
  for (const double damping : {0.0, 0.1, 1.0, 10.0}) {
    evidence::LoopCase loop;
    loop.virtual_damping = damping;
    out.push_back(
        curve("damping of the wall", "B " + evidence::significant(damping) + " N s/m", loop));
  }
  struct Hand {
    const char* name;
    evidence::EndImpedance impedance;
  };
  const Hand hands[] = {{"none", {}},
                        {"soft: 50 N/m", {50, 1, 0.02}},
                        {"relaxed: 200 N/m", {200, 5, 0.05}},
                        {"stiff: 1000 N/m", {1000, 10, 0.05}}};
  for (const Hand& hand : hands) {
    evidence::LoopCase loop;
    loop.settings.hand = hand.impedance;
    out.push_back(curve("hand, wall", hand.name, loop));
  }
  evidence::LoopCase layered;
  layered.layer_share = 1;
  out.push_back(curve("layers and reach, wall", "a layer as stiff as the surface", layered));
  for (const double fraction : {1.0, 0.5}) {
    evidence::LoopCase far;
    far.settings.reach = rendering::Reach{.factor = 5, .fraction = fraction};
    out.push_back(curve("layers and reach, wall",
                        fraction == 1 ? "reach 5 about the tail" : "reach 5 about the middle",
                        far));
  }
  struct Device {
    const char* name;
    double friction, resolution;
    int delay;
  };
  const Device devices[] = {{"friction 0.025 N", kEndFriction, 0, 0},
                            {"and resolution 30 um", kEndFriction, kResolution, 0},
                            {"friction 0.5 N, 30 um", 0.5, kResolution, 0},
                            {"one tick late", 0, 0, 1}};
  for (const Device& device : devices) {
    evidence::LoopCase loop;
    loop.settings.friction = device.friction;
    loop.settings.resolution = device.resolution;
    loop.settings.delay = device.delay;
    out.push_back(curve("device, wall", device.name, loop));
  }
  return out;
}

std::vector<ControllerGain> gain_cases() {
  std::vector<ControllerGain> out;
  const auto add = [&](const evidence::LoopCase& loop) {
    out.push_back({loop, kEndDamping, 0, 0});
  };
  for (const protocols::RendererKind renderer :
       {protocols::RendererKind::point, protocols::RendererKind::ray}) {
    for (const evidence::ContactCase contact_case : evidence::kContactCases) {
      evidence::LoopCase loop;
      loop.contact_case = contact_case;
      loop.renderer = renderer;
      add(loop);
    }
  }
  for (const double rate : kRates) {
    evidence::LoopCase loop;
    loop.settings.rate = rate;
    if (rate != 1000) add(loop);
  }
  evidence::LoopCase coarse;
  coarse.settings.friction = kEndFriction;
  coarse.settings.resolution = kResolution;
  add(coarse);
  evidence::LoopCase late;
  late.settings.delay = 1;
  add(late);
  return out;
}

/// Stiffnesses from 10 N/m to 100 kN/m.
std::vector<double> grid(bool fine) {
  std::vector<double> out;
  const int parts = fine ? 4 : 1;
  for (int i = 0; i <= 4 * parts; ++i)
    out.push_back(std::pow(10.0, 1 + static_cast<double>(i) / parts));
  return out;
}

/// Runs all tasks on several threads.
void run_all(const std::vector<std::function<void()>>& tasks, int jobs) {
  output::ProgressLine progress("loops");
  std::atomic<std::size_t> next{0};
  std::vector<std::thread> threads;
  const auto work = [&](bool shows) {
    for (std::size_t i = next++; i < tasks.size(); i = next++) {
      tasks[i]();
      if (shows) progress.show(static_cast<double>(i + 1) / static_cast<double>(tasks.size()));
    }
  };
  for (int j = 1; j < jobs; ++j) threads.emplace_back(work, false);
  work(true);
  for (std::thread& thread : threads) thread.join();
}

StabilityReport study(bool full, int jobs) {
  StabilityReport report;
  report.theory = theory_curves();
  report.curves = map_curves();
  report.gains = gain_cases();
  const std::vector<double> stiffnesses = grid(full);
  std::vector<std::function<void()>> tasks;
  for (auto* curves : {&report.theory, &report.curves}) {
    for (BoundaryCurve& one : *curves) {
      one.points.resize(stiffnesses.size());
      for (std::size_t i = 0; i < stiffnesses.size(); ++i) {
        tasks.emplace_back(
            [&one, i, k = stiffnesses[i]] { one.points[i] = evidence::boundary_at(one.loop, k); });
      }
    }
  }
  for (ControllerGain& gain : report.gains) {
    tasks.emplace_back(
        [&gain] { gain.without = evidence::stiffest_stable(gain.loop, gain.damping); });
    tasks.emplace_back([&gain] {
      evidence::LoopCase with = gain.loop;
      with.settings.passivity_controller = true;
      gain.with = evidence::stiffest_stable(with, gain.damping);
    });
  }
  run_all(tasks, jobs);
  report.integrators = evidence::compare_integrators(output::now_ns);
  return report;
}

std::vector<evidence::SoftSwing> study_soft(const std::vector<evidence::SoftCase>& cases,
                                            int jobs) {
  std::vector<evidence::SoftSwing> map(cases.size());
  std::vector<std::function<void()>> tasks;
  for (std::size_t i = 0; i < cases.size(); ++i)
    tasks.emplace_back([&, i] { map[i] = evidence::press_and_hold(cases[i]); });
  run_all(tasks, jobs);
  return map;
}

}  // namespace

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
  if (values->count("soft") > 0) {
    for (const char* const other : {"full", "report", "json"}) {
      if (values->count(other) > 0)
        throw UsageError(std::string("--soft: expected without --") + other);
    }
    const std::vector<evidence::SoftSwing> map = study_soft(
        values->count("seed") > 0 ? evidence::soft_cases_elsewhere(seed) : evidence::soft_cases(),
        jobs);
    if (outputs.wanted("figure"))
      outputs.put("figure", analysis::figure_svg(soft_map_figure(map), analysis::light_palette()));
    outputs.write();
    std::cout << evidence::soft_map_text(map);
    const auto is_good = [](const evidence::SoftSwing& one) {
      return !one.accepted || one.settles();
    };
    return std::ranges::all_of(map, is_good) ? 0 : 1;
  }
  if (values->count("seed") > 0) throw UsageError("--seed: expected with --soft");
  const StabilityReport report = study(values->count("full") > 0, jobs);
  if (outputs.wanted("json")) outputs.put("json", stability_json(report).dump(1) + "\n");
  if (outputs.wanted("figure"))
    outputs.put("figure",
                analysis::figure_svg(stability_figure(report), analysis::light_palette()));
  if (outputs.wanted("report")) outputs.put("report", stability_page(report));
  outputs.write();
  std::cout << stability_text(report);
  return report.unsafe() == 0 && report.worst_disagreement() <= 0.05 ? 0 : 1;
}

}  // namespace palpate::runner::commands
