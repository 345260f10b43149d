#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "runner/commands/accuracy/report.h"

namespace palpate::runner {

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

namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// A dash where there was nothing to compare.
std::string known(const rendering::ErrorSpread& spread, double value) {
  return spread.count > 0 ? significant(value) : "-";
}

std::string setting_of(const rendering::AccuracyRow& row) {
  if (traits_of_shape(row.shape).subdivisions)
    return "subdivisions " + std::to_string(row.subdivisions);
  if (row.segments > 0) return "segments " + std::to_string(row.segments);
  return "";
}

const rendering::AccuracyRow* find(const AccuracyReport& report, const std::string& shape,
                                   int triangles, const std::string& probe,
                                   const std::string& method) {
  for (const rendering::AccuracyRow& row : report.rows) {
    if (row.shape == shape && row.triangles == triangles && row.probe == probe &&
        row.method == method) {
      return &row;
    }
  }
  return nullptr;
}

std::string choice(const AccuracyReport& report, const std::string& shape, int triangles) {
  const rendering::AccuracyRow* row = find(report, shape, triangles, "ray", "tick");
  const std::string setting = row ? setting_of(*row) : "";
  return thousands(triangles) + " triangles" + (setting.empty() ? "" : " (" + setting + ")");
}

/// Worse of the two probes.
double worse(const AccuracyReport& report, const std::string& shape, int triangles,
             double (*of)(const rendering::ErrorSummary&)) {
  double most = 0;
  for (const char* probe : {"ray", "point"}) {
    const rendering::AccuracyRow* row = find(report, shape, triangles, probe, "tick");
    if (row) most = std::max(most, of(row->shape_errors));
  }
  return most;
}

double depth_of(const rendering::ErrorSummary& e) { return e.depth.p999; }
double normal_of(const rendering::ErrorSummary& e) { return e.normal.p999; }

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
    for (const rendering::AccuracyRow& row : report.rows) {
      if (row.shape != shape || row.probe != probe || row.method != "tick") continue;
      const rendering::ErrorSummary& e = row.shape_errors;
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
  for (const rendering::AccuracyRow& row : report.rows) {
    if (row.shape != shape || row.triangles != triangles || row.probe != "ray") continue;
    const rendering::ErrorSummary& e = row.polyhedron_errors;
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
    for (const rendering::FirstContactLoss& loss : study.speeds) {
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
  for (const rendering::AccuracyRow& row : report.rows) {
    if (row.shape == shape && (all.empty() || all.back() != row.triangles)) {
      if (std::find(all.begin(), all.end(), row.triangles) == all.end())
        all.push_back(row.triangles);
    }
  }
  std::vector<int> shown;
  const int device = rendering::triangles_for(report.rows, shape, kDevice);
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
    const rendering::ExtremeResult& r = row.result;
    table.rows.push_back({row.title, row.probe, thousands(static_cast<long long>(r.ticks)),
                          thousands(static_cast<long long>(r.in_contact)), significant(r.worst),
                          significant(r.limit), r.passed ? "holds" : "FAILS", row.measure});
    if (!r.detail.empty()) table.notes.push_back(row.name + ", " + row.probe + ": " + r.detail);
  }
  return table;
}

analysis::Table search_table(const rendering::SearchCounts& c, std::uint64_t seed) {
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
  for (const rendering::SearchFault& fault : c.faults) {
    table.notes.push_back("seed " + std::to_string(fault.seed) + " walk " +
                          std::to_string(fault.walk) + " tick " + std::to_string(fault.tick) +
                          ": " + fault.what);
  }
  return table;
}

}  // namespace

std::string recommendation(const AccuracyReport& report, const std::string& shape) {
  const int hand = rendering::triangles_for(report.rows, shape, kHand);
  const int device = rendering::triangles_for(report.rows, shape, kDevice);
  if (is_flat_sided(shape)) {
    const int only =
        std::ranges::find(report.rows, shape, &rendering::AccuracyRow::shape)->triangles;
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
  for (const rendering::AccuracyRow& row : report.rows) {
    if (std::find(all.begin(), all.end(), row.shape) == all.end()) all.push_back(row.shape);
  }
  return all;
}

std::vector<std::string> recommendations(const AccuracyReport& report) {
  std::vector<std::string> all;
  for (const std::string& shape : measured_shapes(report)) {
    all.push_back(recommendation(report, shape));
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
  if (!report.extremes.empty()) tables.push_back(extreme_table(report));
  if (report.search) tables.push_back(search_table(*report.search, report.search_seed));
  if (report.union_search)
    tables.push_back(union_search_table(*report.union_search, report.search_seed));
  return tables;
}

}  // namespace palpate::runner
