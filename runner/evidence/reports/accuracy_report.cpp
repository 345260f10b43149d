#include "runner/evidence/reports/accuracy_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <sstream>

#include "analysis/report/html_page.h"
#include "analysis/text.h"
#include "runner/evidence/accuracy/peers.h"
#include "runner/evidence/reports/scene_report.h"

namespace palpate::runner::evidence {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// The value, or a dash if nothing was compared.
std::string known(const evidence::ErrorSpread& spread, double value) {
  return spread.count > 0 ? significant(value) : "-";
}

std::string setting_of(const evidence::AccuracyRow& row) {
  if (traits_of_shape(row.shape).subdivisions)
    return "subdivisions " + std::to_string(row.subdivisions);
  if (row.segments > 0) return "segments " + std::to_string(row.segments);
  return "";
}

const evidence::AccuracyRow* find(const AccuracyReport& report, const std::string& shape,
                                  int triangles, const std::string& probe,
                                  const std::string& method) {
  for (const evidence::AccuracyRow& row : report.rows) {
    if (row.shape == shape && row.triangles == triangles && row.probe == probe &&
        row.method == method) {
      return &row;
    }
  }
  return nullptr;
}

std::string choice(const AccuracyReport& report, const std::string& shape, int triangles) {
  const evidence::AccuracyRow* row = find(report, shape, triangles, "ray", "tick");
  const std::string setting = row ? setting_of(*row) : "";
  return thousands(triangles) + " triangles" + (setting.empty() ? "" : " (" + setting + ")");
}

/// The worse error of the two probes.
double worse(const AccuracyReport& report, const std::string& shape, int triangles,
             double (*of)(const evidence::ErrorSummary&)) {
  double most = 0;
  for (const char* probe : {"ray", "point"}) {
    const evidence::AccuracyRow* row = find(report, shape, triangles, probe, "tick");
    if (row) most = std::max(most, of(row->shape_errors));
  }
  return most;
}

double depth_of(const evidence::ErrorSummary& e) { return e.depth.p999; }
double normal_of(const evidence::ErrorSummary& e) { return e.normal.p999; }

/// The renderers over the tessellations of one shape.
analysis::Table tessellation_table(const AccuracyReport& report, const std::string& shape) {
  analysis::Table table;
  table.caption = "Whole ticks on the " + shape + ", against the analytic shape";
  table.header = {"triangles", "probe",           "ns a tick",       "depth um rms",
                  "99.9 %",    "worst",           "angle rms",       "99.9 %",
                  "worst",     "point mm 99.9 %", "force mN 99.9 %", "torque mN m 99.9 %",
                  "lost %"};
  table.n_names = 0;
  for (const char* probe : {"ray", "point"}) {
    for (const evidence::AccuracyRow& row : report.rows) {
      if (row.shape != shape || row.probe != probe || row.method != "tick") continue;
      const evidence::ErrorSummary& e = row.shape_errors;
      table.rows.push_back(
          {thousands(row.triangles), row.probe, significant(row.ns_per_tick),
           significant(1e6 * e.depth.rms), significant(1e6 * e.depth.p999),
           significant(1e6 * e.depth.worst), known(e.normal, e.normal.rms / kDegree),
           known(e.normal, e.normal.p999 / kDegree), known(e.normal, e.normal.worst / kDegree),
           known(e.point, 1e3 * e.point.p999), significant(1e3 * e.force.p999),
           known(e.torque, 1e3 * e.torque.p999), share(e.lost, e.ticks)});
    }
  }
  return table;
}

/// All methods on one tessellation, ray.
analysis::Table method_table(const AccuracyReport& report, const std::string& shape,
                             int triangles) {
  analysis::Table table;
  table.caption = "Methods on the " + shape + " of " + choice(report, shape, triangles) +
                  ", ray, against the exact polyhedron";
  table.header = {"method",       "ns a tick",      "depth m: rms",           "worst",
                  "angle: worst", "point m: worst", "force N: worst",         "lost %",
                  "phantom %",    "not least %",    "shape, depth um: 99.9 %"};
  for (const evidence::AccuracyRow& row : report.rows) {
    if (row.shape != shape || row.triangles != triangles || row.probe != "ray") continue;
    const evidence::ErrorSummary& e = row.polyhedron_errors;
    table.rows.push_back({row.method, significant(row.ns_per_tick), significant(e.depth.rms),
                          significant(e.depth.worst), known(e.normal, e.normal.worst / kDegree),
                          known(e.point, e.point.worst), significant(e.force.worst),
                          share(e.lost, e.ticks), share(e.phantom, e.ticks),
                          share(e.deeper, e.ticks),
                          significant(1e6 * row.shape_errors.depth.p999)});
  }
  return table;
}

analysis::Table first_contact_table(const AccuracyReport& report) {
  analysis::Table table;
  table.caption = "First contact: the paper's test (appendix 7 and 8, to the letter) and palpate's";
  table.header = {
      "shape",         "hand m/s",      "turning rad/s", "entries", "paper: missed in the tick %",
      "never found %", "ours: missed %"};
  for (const FirstContactStudy& study : report.first_contacts) {
    for (const evidence::FirstContactLoss& loss : study.speeds) {
      const auto n = static_cast<std::size_t>(loss.entries);
      table.rows.push_back({study.shape, significant(loss.speed), significant(loss.turning),
                            thousands(loss.entries),
                            share(static_cast<std::size_t>(loss.paper_missed), n),
                            share(static_cast<std::size_t>(loss.paper_never), n),
                            share(static_cast<std::size_t>(loss.exact_missed), n)});
    }
  }
  table.notes.push_back("One test against a cube, all facets and edges: the paper's " +
                        significant(report.paper_test_ns) + " ns, ours " +
                        significant(report.exact_test_ns) + " ns.");
  return table;
}

std::vector<int> tessellations_shown(const AccuracyReport& report, const std::string& shape) {
  std::vector<int> all;
  for (const evidence::AccuracyRow& row : report.rows) {
    if (row.shape == shape && (all.empty() || all.back() != row.triangles)) {
      if (std::find(all.begin(), all.end(), row.triangles) == all.end())
        all.push_back(row.triangles);
    }
  }
  std::vector<int> shown;
  const int device = evidence::triangles_for(report.rows, shape, kDevice);
  if (device > 0) shown.push_back(device);
  if (!all.empty() && all.back() != device) shown.push_back(all.back());
  return shown;
}

analysis::Table extreme_table(const AccuracyReport& report) {
  analysis::Table table;
  table.caption = "Extreme geometry and extreme motions";
  table.header = {"case", "probe", "ticks", "in contact", "worst", "allowed", "", "measured"};
  table.n_names = 2;
  for (const ExtremeRow& row : report.extremes) {
    const evidence::ExtremeResult& r = row.result;
    table.rows.push_back({row.title, row.probe, thousands(static_cast<long long>(r.ticks)),
                          thousands(static_cast<long long>(r.in_contact)), significant(r.worst),
                          significant(r.limit), r.passed ? "holds" : "FAILS", row.measure});
    if (!r.detail.empty()) table.notes.push_back(row.name + ", " + row.probe + ": " + r.detail);
  }
  return table;
}

analysis::Table search_table(const evidence::SearchCounts& c, std::uint64_t seed) {
  analysis::Table table;
  table.caption =
      "Search over random solids and paths, every tick compared with brute force (seed " +
      std::to_string(seed) + ")";
  table.header = {"wrong", "ticks"};
  const auto add = [&](const char* what, std::uint64_t count) {
    table.rows.push_back({what, std::to_string(count)});
  };
  add("missed contacts", c.missed);
  add("passed through", c.passed_through);
  add("phantom contacts", c.phantom);
  add("ideal probe inside by more than 1e-9 of the size", c.penetrating);
  add("ideal probe off the surface", c.floating);
  add("shallower than the penetration depth", c.shallow);
  add("wrong force or torque", c.wrong_force);
  add("not finite", c.not_finite);
  add("walks stopped at their limit of steps", c.endless);
  add("other faults", c.faulted);
  table.notes.push_back("Of " + thousands(static_cast<long long>(c.ticks)) + " ticks in " +
                        thousands(static_cast<long long>(c.walks)) + " walks, " +
                        thousands(static_cast<long long>(c.in_contact)) + " in contact, " +
                        thousands(static_cast<long long>(c.entries)) +
                        " first contacts; deepest ideal probe " + significant(c.worst_penetration) +
                        " of the size.");
  for (const evidence::SearchFault& fault : c.faults) {
    table.notes.push_back("seed " + std::to_string(fault.seed) + " walk " +
                          std::to_string(fault.walk) + " tick " + std::to_string(fault.tick) +
                          ": " + fault.what);
  }
  return table;
}

/// The measurements, the definitions of the numbers, and the methods.
std::vector<std::string> how_to_read(const AccuracyReport& report) {
  const evidence::AccuracySettings& s = report.settings;
  std::vector<std::string> all;
  all.emplace_back(
      "Measured on " + std::to_string(s.paths) + " paths for each shape and probe, " +
      std::to_string(s.contact_ticks) +
      " ticks of contact each: a hand at 0.1 m/s, 1 to 2 mm deep, wandering over the shape "
      "with a stylus of " +
      significant(1e3 * s.length) + " mm (runner/evidence/accuracy/analytic_stroke.h; seeds 1 to " +
      std::to_string(s.paths) +
      "). Sphere of radius 30 mm; cone and cylinder of radius 30 mm, 60 mm high; cube of 60 "
      "mm; box of 80 x 60 x 40 mm. Forces at 800 N/m.");
  all.emplace_back(
      "A result is compared with the exact local minimum of the penetration depth that is nearest "
      "to "
      "it in direction: a god-object keeps to the side by which it entered, which need not be that "
      "of least depth (\"not least\": such ticks). A lost contact counts with its whole depth and "
      "force.");
  all.emplace_back(
      "Depths are along that direction, angles in degrees, forces and torques (about the tip) "
      "differences of vectors, points on the ideal probe. Times are means over the ticks in "
      "contact, the fastest of three runs, on this machine.");
  all.emplace_back(
      "Contact points and torques are compared where the stylus is more than 2 degrees off every "
      "flat that it touches; closer, it is touched along a length and the contact point is a "
      "convention (equation "
      "(2)).");
  all.emplace_back(
      "Worst: about once in 10,000 ticks the contact on a tessellation leaves a side one tick "
      "before "
      "or after that on the shape does.");
  for (const evidence::MethodDefinition& method : evidence::contact_methods()) {
    std::string line = "Method ";
    line += method.name;
    line += ": ";
    line += method.description;
    all.push_back(line + ".");
  }
  for (const evidence::PeerLibrary& library : evidence::peer_libraries()) {
    if (library.make) continue;
    std::string line = "Method ";
    line += library.name;
    all.push_back(line + ": absent from this build (PALPATE_PEERS).");
  }
  return all;
}

constexpr const char* kQuestion =
    "Which tessellation? The coarsest with 99.9 % of ticks below what a hand can feel (force "
    "direction 10 degrees, surface position 1 mm), and below what a device resolves (0.03 mm); "
    "point and ray.";

std::vector<std::string> recommendations(const AccuracyReport& report) {
  std::vector<std::string> all;
  for (const std::string& shape : measured_shapes(report)) {
    all.push_back(recommendation(report, shape));
  }
  return all;
}

// Tables of contact with unions of convex parts.

/// Contact with unions of convex parts, and its search.
analysis::Table union_table(const AccuracyReport& report) {
  analysis::Table table;
  table.caption = "Objects of several convex parts and tools of several segments: three ways";
  table.header = {"case",         "truth",  "method", "ns a tick",  "in contact",
                  "force N: rms", "99.9 %", "worst",  "10 % off %", "inside %"};
  table.n_names = 3;
  for (const evidence::UnionRow& row : report.unions) {
    table.rows.push_back({row.name, row.truth, row.method, significant(row.ns_per_tick),
                          thousands(static_cast<long long>(row.in_contact)),
                          significant(row.force.rms), significant(row.force.p999),
                          significant(row.force.worst), share(row.off_by_a_tenth, row.in_contact),
                          row.one_ideal_tool ? share(row.inside, row.ticks) : "-"});
  }
  const evidence::UnionSettings& s = report.union_settings;
  table.notes.push_back(
      "Each case on " + std::to_string(s.seeds) + " seeds of " +
      thousands(static_cast<long long>(s.ticks)) +
      " ticks. Error: the difference of the force from " + significant(evidence::kStiffness) +
      " N/m times the exact displacement of the ideal tool, as a vector, over all ticks.");
  table.notes.emplace_back(
      "10 % off: of the ticks in contact. Inside: ticks with the ideal tool in a part by more than "
      "1e-12 of its size. Oracle: steepest descent over every facet of every Minkowski sum; where "
      "hands are fast and deep, two ideal tools may have gone different ways.");
  for (const evidence::UnionMethod& method : evidence::union_methods()) {
    std::string note = method.name;
    note += ": ";
    note += method.description;
    table.notes.push_back(note + ".");
  }
  return table;
}

analysis::Table union_search_table(const evidence::UnionCounts& c, std::uint64_t seed) {
  analysis::Table table;
  table.caption =
      "Search over random clusters of 3 to 8 convex parts and tools of 1 to 3 segments (seed " +
      std::to_string(seed) + ")";
  table.header = {"wrong", "ticks"};
  const auto add = [&](const char* what, std::uint64_t count) {
    table.rows.push_back({what, std::to_string(count)});
  };
  add("ideal tool inside a part by more than 1e-12 of the size", c.inside);
  add("not at a minimum of the distance from the virtual tool", c.not_minimal);
  add("wrong force", c.wrong_force);
  add("wrong torque", c.wrong_torque);
  add("deepest contact off tool or object", c.off_place);
  add("not finite", c.not_finite);
  add("other faults", c.faulted);
  const auto count = [](std::uint64_t n) { return thousands(static_cast<long long>(n)); };
  table.notes.push_back("Of " + count(c.ticks) + " ticks in " + count(c.walks) + " walks, " +
                        count(c.in_contact) + " in contact, " + count(c.several) +
                        " at several places; deepest ideal tool " +
                        significant(c.worst_penetration) + " of the size.");
  table.notes.push_back(
      "Of the ticks in contact, " + count(c.lagged) + " with an orientation that lags, " +
      count(c.capped) + " stopped at the limit of rounds, " + count(c.released) +
      " released from a hook, " + count(c.on_edge) + " balanced on an edge exactly, " +
      count(c.in_gap) +
      " held in a gap narrower than 1e-9 of the size, or clamped in a groove of less than 1e-5.");
  table.notes.push_back("Repeated by the oracle from the same last pose: " + count(c.compared) +
                        ", of which " + count(c.elsewhere) +
                        " came to another minimum; torques compared: " + count(c.torques) + ".");
  for (const evidence::SearchFault& fault : c.faults) {
    table.notes.push_back("seed " + std::to_string(fault.seed) + " walk " +
                          std::to_string(fault.walk) + " tick " + std::to_string(fault.tick) +
                          ": " + fault.what);
  }
  return table;
}

/// Soft bodies.
analysis::Table soft_table(const AccuracyReport& report) {
  analysis::Table table;
  table.caption = "Soft bodies: known solutions against the computed ones";
  table.header = {"case",      "truth", "nodes",   "elements", "value",
                  "reference", "unit",  "error %", "ms a step"};
  table.n_names = 2;
  for (const evidence::SoftRow& row : report.soft) {
    table.rows.push_back({row.name, row.truth, thousands(static_cast<long long>(row.nodes)),
                          thousands(static_cast<long long>(row.elements)), significant(row.value),
                          significant(row.reference), row.unit, significant(100 * row.error),
                          row.step_ns > 0 ? significant(1e-6 * row.step_ns) : "-"});
  }
  table.notes.emplace_back(
      "Neo-Hookean solids of hexahedra with a mean dilatation, 20 kPa, Poisson's ratio 0.45 where "
      "none is said (cantilever: 100 kPa, 0.3). Error: of the reference; of the patch test, of the "
      "forces on the outside; of the shape at rest, of its length. A step of the cantilever has up "
      "to three iterations, all others one.");
  return table;
}

// Table of bodies that move and collide.

/// Bodies that move and collide, beside other engines.
analysis::Table body_table(const AccuracyReport& report) {
  analysis::Table table;
  table.caption = "Bodies that move and collide: error and run time beside other engines";
  table.header = {"case", "error in", "engine", "error", "us a step"};
  table.n_names = 3;
  for (const BodyRow& row : report.bodies)
    table.rows.push_back(
        {row.name, row.measure, row.engine, significant(row.error), significant(row.us_per_step)});
  table.notes.emplace_back(
      "Boxes, steps of 1 ms, against closed forms; the error is the largest over all steps for "
      "quantities that must stay constant, else that at the end.");
  const evidence::BodyTickCost& cost = report.body_tick;
  table.notes.push_back(
      "Ten dumbbells and a rocket of nine parts that the probe pushes among each other, " +
      thousands(static_cast<long long>(cost.ticks)) + " ticks: median " + significant(cost.median) +
      " us, 99th percentile " + significant(cost.p99) + " us, worst " + significant(cost.most) +
      " us.");
  return table;
}

}  // namespace

std::string significant(double value) {
  char text[32];
  if (value != 0 && (std::abs(value) < 1e-3 || std::abs(value) >= 1e5)) {
    std::snprintf(text, sizeof text, "%.1e", value);
  } else {
    std::snprintf(text, sizeof text, "%.3g", value);
  }
  return text;
}

std::string thousands(long long n) {
  std::string digits = std::to_string(n);
  for (int at = static_cast<int>(digits.size()) - 3; at > 0; at -= 3) {
    digits.insert(static_cast<std::size_t>(at), ",");
  }
  return digits;
}

std::string share(std::size_t part, std::size_t all) {
  return part == 0 ? "0"
                   : significant(100.0 * static_cast<double>(part) / static_cast<double>(all));
}

std::string recommendation(const AccuracyReport& report, const std::string& shape) {
  const int hand = evidence::triangles_for(report.rows, shape, kHand);
  const int device = evidence::triangles_for(report.rows, shape, kDevice);
  if (is_flat_sided(shape)) {
    const int only =
        std::ranges::find(report.rows, shape, &evidence::AccuracyRow::shape)->triangles;
    return shape + ": its " + choice(report, shape, only) +
           " are the shape itself: there is nothing to choose (errors below " +
           significant(1e3 * worse(report, shape, only, depth_of)) + " mm and " +
           significant(worse(report, shape, only, normal_of) / kDegree) + " degrees).";
  }
  const auto within = [&](int triangles) {
    return significant(worse(report, shape, triangles, normal_of) / kDegree) + " degrees and " +
           significant(1e3 * worse(report, shape, triangles, depth_of)) + " mm";
  };
  std::string text = shape + ": ";
  text += hand == 0 ? "none of these is fine enough for the hand"
                    : choice(report, shape, hand) + " for the hand (within " + within(hand) + ")";
  if (device == 0) return text + "; none is fine enough for the device.";
  if (device == hand) return text + ", which is finer than the device resolves as well.";
  return text + "; " + choice(report, shape, device) +
         " to be finer than the device resolves (within " + within(device) + ").";
}

stimuli::ShapeTraits traits_of_shape(const std::string& name) {
  for (const stimuli::ShapeKind shape : stimuli::kShapes) {
    if (name == stimuli::traits_of(shape).name) return stimuli::traits_of(shape);
  }
  return {};
}

bool is_flat_sided(const std::string& shape) {
  const stimuli::ShapeTraits traits = traits_of_shape(shape);
  return !traits.subdivisions && !traits.segments;
}

std::vector<std::string> measured_shapes(const AccuracyReport& report) {
  std::vector<std::string> all;
  for (const evidence::AccuracyRow& row : report.rows) {
    if (std::find(all.begin(), all.end(), row.shape) == all.end()) all.push_back(row.shape);
  }
  return all;
}

std::vector<analysis::Table> accuracy_tables(const AccuracyReport& report) {
  std::vector<analysis::Table> tables;
  const std::vector<std::string> shapes = measured_shapes(report);
  tables.reserve(shapes.size());
  for (const std::string& shape : shapes) tables.push_back(tessellation_table(report, shape));
  for (const std::string& shape : shapes) {
    for (const int triangles : tessellations_shown(report, shape)) {
      tables.push_back(method_table(report, shape, triangles));
    }
  }
  if (!report.first_contacts.empty()) tables.push_back(first_contact_table(report));
  if (!report.unions.empty()) tables.push_back(union_table(report));
  if (!report.bodies.empty()) tables.push_back(body_table(report));
  if (!report.soft.empty()) tables.push_back(soft_table(report));
  if (!report.scenes.empty()) tables.push_back(scene_table(report.scenes));
  if (!report.extremes.empty()) tables.push_back(extreme_table(report));
  if (report.search) tables.push_back(search_table(*report.search, report.search_seed));
  if (report.union_search)
    tables.push_back(union_search_table(*report.union_search, report.search_seed));
  return tables;
}

void put_wrapped(std::ostream& out, const std::string& text) {
  constexpr std::size_t kColumns = 98;
  for (const std::string& line : analysis::wrapped(
           text, [](std::string_view part) { return analysis::width(part) <= kColumns; })) {
    out << "  " << line << "\n";
  }
}

void put_table(std::ostream& out, const analysis::Table& table) {
  std::vector<std::size_t> widths;
  for (const std::string& name : table.header) widths.push_back(analysis::width(name));
  for (const auto& row : table.rows) {
    for (std::size_t i = 0; i < row.size(); ++i)
      widths[i] = std::max(widths[i], analysis::width(row[i]));
  }
  out << "\n" << table.caption << "\n";
  const auto put = [&](const std::vector<std::string>& cells) {
    std::string line;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      line += "  " + (i < table.n_names ? analysis::pad_right(cells[i], widths[i])
                                        : analysis::pad_left(cells[i], widths[i]));
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out << line << "\n";
  };
  put(table.header);
  for (const auto& row : table.rows) put(row);
  for (const std::string& note : table.notes) out << "  " << note << "\n";
}

std::string accuracy_text(const AccuracyReport& report) {
  std::ostringstream out;
  if (!report.rows.empty()) {
    put_wrapped(out, kQuestion);
    out << "\n";
    for (const std::string& sentence : recommendations(report)) out << "  " << sentence << "\n";
  }
  for (const analysis::Table& table : accuracy_tables(report)) put_table(out, table);
  if (!report.rows.empty()) {
    out << "\nHow to read it\n";
    for (const std::string& note : how_to_read(report)) put_wrapped(out, note);
  }
  return out.str();
}

std::string accuracy_page(const AccuracyReport& report) {
  const bool measured = !report.rows.empty();
  analysis::HtmlPage page(measured ? "How far the forces are from the exact ones, and at what cost"
                                   : "How many random ticks are wrong");
  if (measured) {
    std::vector<std::string> sentences = recommendations(report);
    sentences.insert(sentences.begin(), kQuestion);
    analysis::put_list(page.below_title(), sentences);
    page.put_figure_section(accuracy_figure(report), "Error over time");
    if (!report.scenes.empty()) page.put_figure_section(scene_figure(report.scenes), "Scenes");
  }
  page.begin_section("tables", "The numbers", "Numbers");
  for (const analysis::Table& table : accuracy_tables(report))
    analysis::put_table(page.body(), table);
  page.end_section();
  if (measured) {
    page.begin_section("reading", "How to read it", "How to read it");
    analysis::put_list(page.body(), how_to_read(report));
    page.end_section();
  }
  return page.html("palpate " PALPATE_VERSION ".");
}

}  // namespace palpate::runner::evidence
