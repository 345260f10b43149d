#include "runner/evidence/reports/stability_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <sstream>
#include <utility>

#include "analysis/figures/panel_drawing.h"
#include "analysis/figures/svg.h"
#include "analysis/report/html_page.h"
#include "analysis/report/tables.h"
#include "analysis/text.h"
#include "runner/evidence/reports/accuracy_report.h"

namespace palpate::runner::evidence {
namespace {

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
  for (const BoundaryPoint& point : curve.points) {
    const double x = std::log10(point.stiffness);
    if (point.promised) {
      theory.x.push_back(x);
      theory.y.push_back(std::log10(std::max(point.theory, kLeastDamping)));
    }
    const std::string text = curve.name + ", " + significant(point.stiffness) + " N/m: ";
    if (point.measured > 0) {
      panel.marks.push_back(
          analysis::symbol(role, line_shape(row), x,
                           std::clamp(std::log10(point.measured), panel.y.low, panel.y.high), 3.5,
                           text + significant(point.measured) + " N s/m"));
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
  return modulus < 1e6 ? significant(modulus / 1e3) + " kPa" : significant(modulus / 1e6) + " MPa";
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
  for (const IntegratorRow& row : report.integrators) {
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
      for (const IntegratorRow& row : report.integrators) {
        if (row.oscillator != panel.title || row.method != kMethods[m]) continue;
        if (!std::isfinite(row.error)) continue;
        line.x.push_back(std::clamp(std::log10(row.ns_per_tick), panel.x.low, panel.x.high));
        line.y.push_back(
            std::clamp(std::log10(std::max(row.error, kLeastError)), panel.y.low, panel.y.high));
        panel.marks.push_back(analysis::symbol(
            analysis::line_role(m), line_shape(m), line.x.back(), line.y.back(), m == 3 ? 5 : 3.5,
            row.method + ", " + std::to_string(row.steps) + " steps a tick: " +
                significant(row.ns_per_tick) + " ns, error " + significant(row.error) + " m"));
      }
      if (line.x.size() > 1) panel.marks.push_back(std::move(line));
    }
  }
  return figure;
}

using Json = nlohmann::ordered_json;

std::string times(double factor) { return significant(factor) + " times"; }

analysis::Table theory_table(const StabilityReport& report) {
  analysis::Table table;
  table.caption =
      "The case of the theory: a plain wall, ends so heavy that their mass does not matter";
  table.header = {"curve", "stiffness N/m", "damping N s/m: theory", "measured", "ratio"};
  for (const BoundaryCurve& curve : report.theory) {
    for (const BoundaryPoint& p : curve.points) {
      table.rows.push_back({curve.name, significant(p.stiffness), significant(p.theory),
                            significant(p.measured), significant(p.measured / p.theory)});
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
    for (const BoundaryPoint& p : curve.points) {
      table.rows.push_back({curve.name, significant(p.stiffness),
                            p.promised ? significant(p.theory) : "no promise",
                            p.measured == 0 ? "none" : significant(p.measured)});
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
    const LoopSettings& s = g.loop.settings;
    table.rows.push_back({to_string(g.loop.contact_case), protocols::to_string(g.loop.renderer),
                          significant(s.rate), significant(g.damping),
                          significant(1e6 * s.resolution), std::to_string(s.delay),
                          significant(g.damping * s.rate / (0.5 + s.delay)), significant(g.without),
                          significant(g.with), significant(g.with / g.without)});
  }
  return table;
}

analysis::Table integrator_table(const StabilityReport& report) {
  analysis::Table table;
  table.caption = "Integrators of the hand, 1 kHz: error after 500 ticks over run time";
  table.header = {"case", "method", "steps a tick", "ns a tick", "worst error, m"};
  table.n_names = 2;
  for (const IntegratorRow& row : report.integrators) {
    table.rows.push_back({row.oscillator, row.method, std::to_string(row.steps),
                          significant(row.ns_per_tick),
                          std::isfinite(row.error) ? significant(row.error) : "diverges"});
  }
  return table;
}

/// Run time of the fastest other method that errs by at most a micrometre, as a multiple of the
/// exact one's; worst case.
double integrator_gain(const StabilityReport& report) {
  double worst = HUGE_VAL;
  for (const IntegratorRow& exact : report.integrators) {
    if (exact.method != "exact") continue;
    double cheapest = HUGE_VAL;
    for (const IntegratorRow& row : report.integrators) {
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

Json loop_json(const LoopCase& loop) {
  const LoopSettings& s = loop.settings;
  return {{"scene", to_string(loop.contact_case)},
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
  for (const BoundaryPoint& p : curve.points) {
    json["points"].push_back({{"stiffness_n_per_m", p.stiffness},
                              {"measured_ns_per_m", p.measured},
                              {"theory_ns_per_m", p.theory},
                              {"promised", p.promised}});
  }
  return json;
}

/// The conclusions in sentences.
std::vector<std::string> stability_sentences(const StabilityReport& report) {
  std::vector<std::string> out;
  out.push_back(
      "The measured boundary of a plain wall is the theory's, b = K (T/2 + t_d), within " +
      significant(100 * report.worst_disagreement()) + " % at all rates, with and without delay.");
  const int unsafe = report.unsafe();
  out.push_back(
      (unsafe == 0
           ? "Everywhere else the loop is stable where the theory promises passivity: at all "
           : "At " + std::to_string(unsafe) +
                 " points the loop is unstable where the theory promises passivity; of all ") +
      std::to_string(report.points()) + " points of the map.");
  double ideal = HUGE_VAL, coarse = HUGE_VAL, late = HUGE_VAL;
  for (const ControllerGain& g : report.gains) {
    const LoopSettings& settings = g.loop.settings;
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

}  // namespace

double StabilityReport::worst_disagreement() const {
  double worst = 0;
  for (const BoundaryCurve& curve : theory) {
    for (const BoundaryPoint& p : curve.points) {
      worst = std::max(worst, std::abs(p.measured / p.theory - 1));
    }
  }
  return worst;
}

int StabilityReport::unsafe() const {
  int count = 0;
  for (const BoundaryCurve& curve : curves) {
    for (const BoundaryPoint& p : curve.points) count += p.unsafe();
  }
  return count;
}

int StabilityReport::points() const {
  std::size_t count = 0;
  for (const BoundaryCurve& curve : curves) count += curve.points.size();
  return static_cast<int>(count);
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
analysis::Figure soft_map_figure(const std::vector<SoftSwing>& map) {
  constexpr double kCellWidth = 64, kCellHeight = 19;  // px
  analysis::Figure figure;
  figure.id = "soft-stability";
  int allowed = 0, settled = 0;
  for (const SoftSwing& one : map) {
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
  for (const SoftSwing& one : map) {
    const SoftCase& what = one.what;
    const std::string title = "tool of " + significant(1000 * what.radius) + " mm, Poisson " +
                              significant(what.poisson) + ", damping " +
                              significant(1000 * what.damping) + " ms";
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
                 y = slot(rows, in_pascals(what.young) + ", " + significant(what.stiffness / 1000) +
                                    " kN/m");
    analysis::Panel& panel = figure.panels.back();
    const std::string swing = one.finite ? significant(100 * one.swing) : "no number";
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

std::string stability_text(const StabilityReport& report) {
  std::ostringstream out;
  for (const std::string& sentence : stability_sentences(report)) put_wrapped(out, sentence);
  for (const analysis::Table& table : stability_tables(report)) put_table(out, table);
  out << "\nHow to read it\n";
  for (const std::string& note : how_to_read()) put_wrapped(out, note);
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
  for (const IntegratorRow& row : report.integrators) {
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

}  // namespace palpate::runner::evidence
