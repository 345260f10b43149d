#include "runner/commands/accuracy_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <sstream>

#include "analysis/tables.h"
#include "analysis/text.h"
#include "rendering/peers.h"

namespace palpate {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegree = std::numbers::pi / 180;
constexpr const char* kShapes[] = {"sphere", "cone", "cylinder", "cube"};

/// Three significant figures, plain where that is short: "0.0345", "1.2e-17".
std::string figure(double value) {
  char text[32];
  if (value != 0 && (std::abs(value) < 1e-3 || std::abs(value) >= 1e5)) {
    std::snprintf(text, sizeof text, "%.1e", value);
  } else {
    std::snprintf(text, sizeof text, "%.3g", value);
  }
  return text;
}

/// A dash where there was nothing to compare.
std::string known(const ErrorSpread& spread, double value) {
  return spread.count > 0 ? figure(value) : "-";
}

std::string thousands(long long n) {
  std::string digits = std::to_string(n);
  for (int at = static_cast<int>(digits.size()) - 3; at > 0; at -= 3) {
    digits.insert(static_cast<std::size_t>(at), ",");
  }
  return digits;
}

std::string share(std::size_t part, std::size_t all) {
  return part == 0 ? "0" : figure(100.0 * static_cast<double>(part) / static_cast<double>(all));
}

std::string setting_of(const AccuracyRow& row) {
  if (row.shape == "sphere") return "subdivisions " + std::to_string(row.subdivisions);
  if (row.segments > 0) return "segments " + std::to_string(row.segments);
  return "";
}

const AccuracyRow* find(const AccuracyReport& report, const std::string& shape, int triangles,
                        const std::string& probe, const std::string& method) {
  for (const AccuracyRow& row : report.rows) {
    if (row.shape == shape && row.triangles == triangles && row.probe == probe &&
        row.method == method) {
      return &row;
    }
  }
  return nullptr;
}

std::string choice(const AccuracyReport& report, const std::string& shape, int triangles) {
  const AccuracyRow* row = find(report, shape, triangles, "ray", "tick");
  const std::string setting = row ? setting_of(*row) : "";
  return thousands(triangles) + " triangles" + (setting.empty() ? "" : " (" + setting + ")");
}

/// Worse of the two probes.
double worse(const AccuracyReport& report, const std::string& shape, int triangles,
             double (*of)(const ErrorSummary&)) {
  double most = 0;
  for (const char* probe : {"ray", "point"}) {
    const AccuracyRow* row = find(report, shape, triangles, probe, "tick");
    if (row) most = std::max(most, of(row->shape_errors));
  }
  return most;
}

double depth_of(const ErrorSummary& e) { return e.depth.p999; }
double normal_of(const ErrorSummary& e) { return e.normal.p999; }

std::string recommendation(const AccuracyReport& report, const std::string& shape) {
  const int hand = triangles_for(report.rows, shape, kHand);
  const int device = triangles_for(report.rows, shape, kDevice);
  if (shape == "cube") {
    return "cube: its " + choice(report, shape, 12) +
           " are the shape itself: there is nothing to choose (errors below " +
           figure(1e3 * worse(report, shape, 12, depth_of)) + " mm and " +
           figure(worse(report, shape, 12, normal_of) / kDegree) + " degrees).";
  }
  const auto within = [&](int triangles) {
    return figure(worse(report, shape, triangles, normal_of) / kDegree) + " degrees and " +
           figure(1e3 * worse(report, shape, triangles, depth_of)) + " mm";
  };
  std::string text = shape + ": ";
  text += hand == 0 ? "none of these is fine enough for the hand"
                    : choice(report, shape, hand) + " for the hand (within " + within(hand) + ")";
  if (device == 0) return text + "; none is fine enough for the device.";
  if (device == hand) return text + ", which is finer than the device resolves as well.";
  return text + "; " + choice(report, shape, device) +
         " to be finer than the device resolves (within " + within(device) + ").";
}

/// The product over the tessellations of one shape.
Table tessellation_table(const AccuracyReport& report, const std::string& shape) {
  Table table;
  table.caption = "Whole ticks on the " + shape + ", against the analytic shape";
  table.header = {"triangles", "probe",           "ns a tick",       "depth um rms",
                  "99.9 %",    "worst",           "angle rms",       "99.9 %",
                  "worst",     "point mm 99.9 %", "force mN 99.9 %", "torque mN m 99.9 %",
                  "lost %"};
  table.n_names = 0;
  for (const char* probe : {"ray", "point"}) {
    for (const AccuracyRow& row : report.rows) {
      if (row.shape != shape || row.probe != probe || row.method != "tick") continue;
      const ErrorSummary& e = row.shape_errors;
      table.rows.push_back({thousands(row.triangles), row.probe, figure(row.ns_per_tick),
                            figure(1e6 * e.depth.rms), figure(1e6 * e.depth.p999),
                            figure(1e6 * e.depth.worst), known(e.normal, e.normal.rms / kDegree),
                            known(e.normal, e.normal.p999 / kDegree),
                            known(e.normal, e.normal.worst / kDegree),
                            known(e.point, 1e3 * e.point.p999), figure(1e3 * e.force.p999),
                            known(e.torque, 1e3 * e.torque.p999), share(e.lost, e.ticks)});
    }
  }
  return table;
}

/// All methods on one tessellation, ray.
Table method_table(const AccuracyReport& report, const std::string& shape, int triangles) {
  Table table;
  table.caption = "Methods on the " + shape + " of " + choice(report, shape, triangles) +
                  ", ray, against the exact polyhedron";
  table.header = {"method",       "ns a tick",      "depth m: rms",           "worst",
                  "angle: worst", "point m: worst", "force N: worst",         "lost %",
                  "phantom %",    "not least %",    "shape, depth um: 99.9 %"};
  for (const AccuracyRow& row : report.rows) {
    if (row.shape != shape || row.triangles != triangles || row.probe != "ray") continue;
    const ErrorSummary& e = row.polyhedron_errors;
    table.rows.push_back({row.method, figure(row.ns_per_tick), figure(e.depth.rms),
                          figure(e.depth.worst), known(e.normal, e.normal.worst / kDegree),
                          known(e.point, e.point.worst), figure(e.force.worst),
                          share(e.lost, e.ticks), share(e.phantom, e.ticks),
                          share(e.deeper, e.ticks), figure(1e6 * row.shape_errors.depth.p999)});
  }
  return table;
}

Table first_contact_table(const AccuracyReport& report) {
  Table table;
  table.caption = "First contact: the paper's test (appendix 7 and 8, to the letter) and ours";
  table.header = {
      "shape",         "hand m/s",      "turning rad/s", "entries", "paper: missed in the tick %",
      "never found %", "ours: missed %"};
  for (const FirstContactStudy& study : report.first_contacts) {
    for (const FirstContactLoss& loss : study.speeds) {
      const auto n = static_cast<std::size_t>(loss.entries);
      table.rows.push_back({study.shape, figure(loss.speed), figure(loss.turning),
                            thousands(loss.entries),
                            share(static_cast<std::size_t>(loss.paper_missed), n),
                            share(static_cast<std::size_t>(loss.paper_never), n),
                            share(static_cast<std::size_t>(loss.exact_missed), n)});
    }
  }
  return table;
}

std::vector<int> tessellations_shown(const AccuracyReport& report, const std::string& shape) {
  std::vector<int> all;
  for (const AccuracyRow& row : report.rows) {
    if (row.shape == shape && (all.empty() || all.back() != row.triangles)) {
      if (std::find(all.begin(), all.end(), row.triangles) == all.end())
        all.push_back(row.triangles);
    }
  }
  std::vector<int> shown;
  const int device = triangles_for(report.rows, shape, kDevice);
  if (device > 0) shown.push_back(device);
  if (!all.empty() && all.back() != device) shown.push_back(all.back());
  return shown;
}

void put_table(std::ostream& out, const Table& table) {
  std::vector<std::size_t> widths;
  for (const std::string& name : table.header) widths.push_back(width(name));
  for (const auto& row : table.rows) {
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width(row[i]));
  }
  out << "\n" << table.caption << "\n";
  const auto put = [&](const std::vector<std::string>& cells) {
    std::string line;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      line += "  " +
              (i < table.n_names ? pad_right(cells[i], widths[i]) : pad_left(cells[i], widths[i]));
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out << line << "\n";
  };
  put(table.header);
  for (const auto& row : table.rows) put(row);
  for (const std::string& note : table.notes) out << "  " << note << "\n";
}

Json spread_json(const ErrorSpread& s, const char* unit) {
  const std::string u(unit);
  return {{"count", s.count}, {"rms_" + u, s.rms}, {"p999_" + u, s.p999}, {"worst_" + u, s.worst}};
}

Json errors_json(const ErrorSummary& e) {
  return {{"ticks", e.ticks},
          {"lost", e.lost},
          {"gave_up", e.gave_up},
          {"phantom", e.phantom},
          {"not_least", e.deeper},
          {"depth", spread_json(e.depth, "m")},
          {"direction", spread_json(e.normal, "rad")},
          {"contact_point", spread_json(e.point, "m")},
          {"force", spread_json(e.force, "n")},
          {"torque", spread_json(e.torque, "nm")}};
}

}  // namespace

std::vector<std::string> recommendations(const AccuracyReport& report) {
  std::vector<std::string> all;
  for (const char* shape : kShapes) all.push_back(recommendation(report, shape));
  return all;
}

std::string search_text(const SearchCounts& c, std::uint64_t seed) {
  std::ostringstream out;
  out << "\nSearch over random solids and paths, every tick against brute force (seed " << seed
      << ")\n"
      << "  " << thousands(static_cast<long long>(c.ticks)) << " ticks in "
      << thousands(static_cast<long long>(c.walks)) << " walks, "
      << thousands(static_cast<long long>(c.in_contact)) << " in contact, "
      << thousands(static_cast<long long>(c.entries)) << " first contacts\n"
      << "  missed contacts        " << c.missed << "\n"
      << "  passed through         " << c.passed_through << "\n"
      << "  contacts out of air    " << c.phantom << "\n"
      << "  ideal probe inside     " << c.penetrating << " (worst " << figure(c.worst_penetration)
      << " of the size; allowed 1e-9)\n"
      << "  ideal probe floating   " << c.floating << "\n"
      << "  shallower than exact   " << c.shallow << "\n"
      << "  wrong force or torque  " << c.wrong_force << "\n"
      << "  not finite             " << c.not_finite << "\n"
      << "  walks without end      " << c.endless << "\n"
      << "  other faults           " << c.faulted << "\n";
  for (const SearchFault& fault : c.faults) {
    out << "  seed " << fault.seed << " walk " << fault.walk << " tick " << fault.tick << ": "
        << fault.what << "\n";
  }
  return out.str();
}

std::string accuracy_text(const AccuracyReport& report) {
  std::ostringstream out;
  if (!report.rows.empty()) {
    out << "Which tessellation? The coarsest with 99.9 % of ticks below what a hand can feel "
           "(force "
           "direction\n10 degrees, surface position 1 mm), and below what a device resolves (0.03 "
           "mm); point and ray.\n";
    for (const std::string& sentence : recommendations(report)) out << "  " << sentence << "\n";
    const AccuracySettings& s = report.settings;
    out << "\nMeasured on " << s.paths << " paths for each shape and probe, " << s.contact_ticks
        << " ticks of contact each: a hand at 0.1 m/s, 1 to 2 mm deep,\nwandering over the shape "
           "with "
           "a stylus of "
        << figure(1e3 * s.length) << " mm (rendering/hand_path.h; seeds 1 to " << s.paths
        << "). Sphere of radius 30 mm;\ncone "
           "and cylinder of radius 30 mm, 60 mm high; cube of 60 mm. Forces at 800 N/m.\n";
    for (const char* shape : kShapes) put_table(out, tessellation_table(report, shape));
    for (const char* shape : kShapes) {
      for (const int triangles : tessellations_shown(report, shape)) {
        put_table(out, method_table(report, shape, triangles));
      }
    }
    out << "\nMethods\n";
    for (const MethodKind& method : accuracy_methods()) {
      out << "  " << pad_right(method.name, 12) << method.description << "\n";
    }
    for (const PeerLibrary& library : peer_libraries()) {
      if (!library.make)
        out << "  " << pad_right(library.name, 12) << "absent from this build (PALPATE_PEERS)\n";
    }
    out << "\nHow to read it\n"
           "  An answer is held against the exact way out of the object that is nearest to it in "
           "direction: a\n  god-object keeps to the side that it came in by, which need not be the "
           "least way out (\"not\n  least\": ticks held so). A lost contact counts with its whole "
           "depth and force.\n"
           "  Depths are along the way out, angles in degrees, forces and torques (about the tip) "
           "differences of\n  vectors, points on the ideal probe. Times are means over the ticks "
           "in "
           "contact, the fastest of three\n  runs, on this machine.\n"
           "  Contact points and torques are compared where the stylus is more than 2 degrees off "
           "every flat\n  that it touches; nearer, where it is touched along a length is a "
           "convention (equation (2)).\n"
           "  Worst: once in some 10,000 ticks a tessellation lets go of a side one tick before or "
           "after the\n  shape does.\n";
  }
  if (!report.first_contacts.empty()) {
    put_table(out, first_contact_table(report));
    out << "  A try against a cube, everything looked at: the paper's "
        << figure(report.paper_test_ns) << " ns, ours " << figure(report.exact_test_ns) << " ns.\n";
  }
  if (report.search) out << search_text(*report.search, report.search_seed);
  return out.str();
}

Json accuracy_json(const AccuracyReport& report) {
  Json json;
  json["version"] = 1;
  json["program_version"] = PALPATE_VERSION;
  if (!report.rows.empty()) {
    const AccuracySettings& s = report.settings;
    json["settings"] = {{"paths", s.paths},
                        {"contact_ticks", s.contact_ticks},
                        {"stylus_length_m", s.length},
                        {"most_triangles", s.most_triangles},
                        {"stiffness_n_per_m", kStiffness},
                        {"least_flat_angle_rad", kFlat}};
    for (const MethodKind& method : accuracy_methods()) {
      json["methods"].push_back({{"name", method.name},
                                 {"description", method.description},
                                 {"keeps_its_side", method.follows_side}});
    }
  }
  for (const PeerLibrary& library : peer_libraries()) {
    json["peers"].push_back({{"name", library.name},
                             {"present", library.make != nullptr},
                             {"version", library.make ? Json(library.version) : Json()}});
  }
  if (!report.rows.empty()) {
    for (const char* shape : kShapes) {
      const int hand = triangles_for(report.rows, shape, kHand);
      const int device = triangles_for(report.rows, shape, kDevice);
      json["recommended"].push_back({{"shape", shape},
                                     {"triangles_for_hand", hand ? Json(hand) : Json()},
                                     {"triangles_for_device", device ? Json(device) : Json()},
                                     {"sentence", recommendation(report, shape)}});
    }
  }
  json["rows"] = Json::array();
  for (const AccuracyRow& row : report.rows) {
    json["rows"].push_back(
        {{"shape", row.shape},
         {"triangles", row.triangles},
         {"facets", row.facets},
         {"edges", row.edges},
         {"subdivisions", row.shape == "sphere" ? Json(row.subdivisions) : Json()},
         {"segments", row.segments ? Json(row.segments) : Json()},
         {"probe", row.probe},
         {"method", row.method},
         {"ns_per_tick", row.ns_per_tick},
         {"against_shape", errors_json(row.shape_errors)},
         {"against_polyhedron", errors_json(row.polyhedron_errors)}});
  }
  for (const FirstContactStudy& study : report.first_contacts) {
    for (const FirstContactLoss& loss : study.speeds) {
      json["first_contact"]["rows"].push_back({{"shape", study.shape},
                                               {"speed_m_per_s", loss.speed},
                                               {"turning_rad_per_s", loss.turning},
                                               {"entries", loss.entries},
                                               {"paper_missed", loss.paper_missed},
                                               {"paper_never", loss.paper_never},
                                               {"paper_early", loss.paper_early},
                                               {"exact_missed", loss.exact_missed}});
    }
  }
  if (!report.first_contacts.empty()) {
    json["first_contact"]["paper_test_ns"] = report.paper_test_ns;
    json["first_contact"]["exact_test_ns"] = report.exact_test_ns;
  }
  if (report.search) {
    const SearchCounts& c = *report.search;
    json["search"] = {{"seed", report.search_seed},
                      {"ticks", c.ticks},
                      {"walks", c.walks},
                      {"in_contact", c.in_contact},
                      {"entries", c.entries},
                      {"missed", c.missed},
                      {"passed_through", c.passed_through},
                      {"phantom", c.phantom},
                      {"penetrating", c.penetrating},
                      {"worst_penetration_of_size", c.worst_penetration},
                      {"floating", c.floating},
                      {"shallow", c.shallow},
                      {"wrong_force", c.wrong_force},
                      {"not_finite", c.not_finite},
                      {"endless", c.endless},
                      {"faulted", c.faulted},
                      {"wrong", c.wrong()}};
  }
  return json;
}

}  // namespace palpate
