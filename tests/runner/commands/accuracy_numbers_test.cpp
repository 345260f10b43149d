// Every number measured by `palpate accuracy` is in its JSON once, under a name, and its tables
// have their form.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "runner/evidence/accuracy/study.h"
#include "runner/evidence/reports/accuracy_report.h"

namespace palpate::runner::commands {
namespace {
namespace accuracy_numbers {

using Json = nlohmann::ordered_json;

/// Produces numbers that are unique in a report, and remembers their expected names.
class Numbers {
 public:
  /// \param path  of the JSON, below the requested root
  template <class T>
  void set(T& value, const std::string& path) {
    value = static_cast<T>(next_);
    expected[path] = static_cast<double>(next_);
    next_ += 37;
  }
  void spread(evidence::ErrorSpread& to, const std::string& path, const std::string& unit) {
    set(to.count, path + "/count");
    set(to.rms, path + "/rms_" + unit);
    set(to.p999, path + "/p999_" + unit);
    set(to.worst, path + "/worst_" + unit);
  }
  std::map<std::string, double> expected;

 private:
  int next_ = 1'000'003;
};

/// All numbers of a document above a million, by their path. Every key has a name.
void collect(const Json& value, const std::string& path, std::map<std::string, double>& found) {
  if (value.is_object()) {
    for (const auto& [name, member] : value.items()) {
      EXPECT_NE(name, "") << path;
      collect(member, path + "/" + name, found);
    }
  } else if (value.is_array()) {
    for (std::size_t i = 0; i < value.size(); ++i)
      collect(value[i], path + "/" + std::to_string(i), found);
  } else if (value.is_number() && value.get<double>() > 1e6) {
    found[path] = value.get<double>();
  } else if (value.is_string()) {
    EXPECT_NE(value.get<std::string>(), "") << path;
  }
}

void fill_searches(evidence::AccuracyReport& report, Numbers& n) {
  evidence::SearchCounts& c = report.search.emplace();
  for (auto& [value, name] :
       std::vector<std::pair<std::uint64_t*, const char*>>{{&c.ticks, "ticks"},
                                                           {&c.walks, "walks"},
                                                           {&c.in_contact, "in_contact"},
                                                           {&c.entries, "entries"},
                                                           {&c.missed, "missed"},
                                                           {&c.passed_through, "passed_through"},
                                                           {&c.phantom, "phantom"},
                                                           {&c.penetrating, "penetrating"},
                                                           {&c.floating, "floating"},
                                                           {&c.shallow, "shallow"},
                                                           {&c.wrong_force, "wrong_force"},
                                                           {&c.not_finite, "not_finite"},
                                                           {&c.endless, "endless"},
                                                           {&c.faulted, "faulted"}})
    n.set(*value, std::string("/search/") + name);
  n.set(c.worst_penetration, "/search/worst_penetration_of_size");
  n.expected["/search/wrong"] = static_cast<double>(c.wrong());
  evidence::UnionCounts& u = report.union_search.emplace();
  for (auto& [value, name] :
       std::vector<std::pair<std::uint64_t*, const char*>>{{&u.ticks, "ticks"},
                                                           {&u.walks, "walks"},
                                                           {&u.in_contact, "in_contact"},
                                                           {&u.several, "several_contacts"},
                                                           {&u.inside, "inside"},
                                                           {&u.not_minimal, "not_minimal"},
                                                           {&u.wrong_force, "wrong_force"},
                                                           {&u.wrong_torque, "wrong_torque"},
                                                           {&u.off_place, "off_place"},
                                                           {&u.not_finite, "not_finite"},
                                                           {&u.faulted, "faulted"},
                                                           {&u.lagged, "lagged"},
                                                           {&u.capped, "capped"},
                                                           {&u.released, "released"},
                                                           {&u.on_edge, "on_edge"},
                                                           {&u.in_gap, "in_gap"},
                                                           {&u.torques, "torques_compared"},
                                                           {&u.compared, "compared_with_oracle"},
                                                           {&u.elsewhere, "at_another_minimum"}})
    n.set(*value, std::string("/union_search/") + name);
  n.set(u.worst_penetration, "/union_search/worst_penetration_of_size");
  n.set(u.worst_descent, "/union_search/worst_descent_of_size");
  n.expected["/union_search/wrong"] = static_cast<double>(u.wrong());
  n.set(report.search_seed, "/search/seed");
  n.expected["/union_search/seed"] = n.expected["/search/seed"];
}

void fill_studies(evidence::AccuracyReport& report, Numbers& n) {
  evidence::UnionRow& one = report.unions.emplace_back();
  one.name = "a case", one.truth = "a truth", one.method = "law", one.one_ideal_tool = true;
  n.set(one.segments, "/unions/rows/0/segments");
  n.set(one.ns_per_tick, "/unions/rows/0/ns_per_tick");
  n.set(one.ticks, "/unions/rows/0/ticks");
  n.set(one.in_contact, "/unions/rows/0/in_contact");
  n.set(one.inside, "/unions/rows/0/inside");
  n.set(one.off_by_a_tenth, "/unions/rows/0/off_by_a_tenth");
  n.spread(one.force, "/unions/rows/0/force", "n");
  evidence::SoftRow& soft = report.soft.emplace_back();
  soft.name = "a case", soft.truth = "a truth", soft.unit = "mm";
  n.set(soft.nodes, "/soft/0/nodes");
  n.set(soft.elements, "/soft/0/elements");
  n.set(soft.value, "/soft/0/value");
  n.set(soft.reference, "/soft/0/reference");
  n.set(soft.error, "/soft/0/error");
  n.set(soft.step_ns, "/soft/0/ns_per_step");
  evidence::BodyRow& body = report.bodies.emplace_back();
  body.name = "a case", body.measure = "speed", body.engine = "palpate";
  n.set(body.error, "/bodies/rows/0/error");
  n.set(body.us_per_step, "/bodies/rows/0/us_per_step");
  n.set(report.body_tick.median, "/bodies/eleven_us/median");
  n.set(report.body_tick.p99, "/bodies/eleven_us/p99");
  n.set(report.body_tick.most, "/bodies/eleven_us/max");
  evidence::ExtremeRow& extreme = report.extremes.emplace_back();
  extreme = {"sliver", "a sliver", "depth, m", "ray", {}};
  extreme.result.detail = "a detail";
  n.set(extreme.result.ticks, "/extremes/0/ticks");
  n.set(extreme.result.in_contact, "/extremes/0/in_contact");
  n.set(extreme.result.worst, "/extremes/0/worst");
  n.set(extreme.result.limit, "/extremes/0/allowed");
  evidence::FirstContactStudy& first = report.first_contacts.emplace_back();
  first.shape = "cube";
  evidence::FirstContactLoss& loss = first.speeds.emplace_back();
  n.set(loss.speed, "/first_contact/rows/0/speed_m_per_s");
  n.set(loss.turning, "/first_contact/rows/0/turning_rad_per_s");
  n.set(loss.entries, "/first_contact/rows/0/entries");
  n.set(loss.paper_missed, "/first_contact/rows/0/paper_missed");
  n.set(loss.paper_never, "/first_contact/rows/0/paper_never");
  n.set(loss.paper_early, "/first_contact/rows/0/paper_early");
  n.set(loss.exact_missed, "/first_contact/rows/0/exact_missed");
  n.set(report.paper_test_ns, "/first_contact/paper_test_ns");
  n.set(report.exact_test_ns, "/first_contact/exact_test_ns");
}

void fill_errors(evidence::ErrorSummary& errors, const std::string& path, Numbers& n) {
  n.set(errors.ticks, path + "/ticks");
  n.set(errors.lost, path + "/lost");
  n.set(errors.gave_up, path + "/gave_up");
  n.set(errors.phantom, path + "/phantom");
  n.set(errors.deeper, path + "/not_least");
  n.spread(errors.depth, path + "/depth", "m");
  n.spread(errors.normal, path + "/direction", "rad");
  n.spread(errors.point, path + "/contact_point", "m");
  n.spread(errors.force, path + "/force", "n");
  n.spread(errors.torque, path + "/torque", "nm");
}

TEST(AccuracyJson, HasEveryNumberExactlyOnceUnderItsName) {
  evidence::AccuracyReport report;
  Numbers n;
  evidence::AccuracyRow& row = report.rows.emplace_back();
  row.shape = "sphere", row.probe = "ray", row.method = "tick";
  n.set(row.triangles, "/rows/0/triangles");
  n.set(row.facets, "/rows/0/facets");
  n.set(row.edges, "/rows/0/edges");
  n.set(row.subdivisions, "/rows/0/subdivisions");
  n.set(row.segments, "/rows/0/segments");
  n.set(row.ns_per_tick, "/rows/0/ns_per_tick");
  fill_errors(row.shape_errors, "/rows/0/against_shape", n);
  fill_errors(row.polyhedron_errors, "/rows/0/against_polyhedron", n);
  fill_studies(report, n);
  fill_searches(report, n);
  std::map<std::string, double> found;
  collect(evidence::accuracy_json(report), "", found);
  for (const auto& [path, value] : n.expected) EXPECT_EQ(found[path], value) << path;
  for (const auto& [path, value] : found) EXPECT_TRUE(n.expected.contains(path)) << path;
}

bool is_number(const std::string& cell) {
  return !cell.empty() && cell.find_first_not_of("0123456789.,-+e") == std::string::npos;
}

TEST(AccuracyTables, HaveTheirFormWithNamesBeforeNumbers) {
  evidence::AccuracyReport report;
  Numbers n;
  for (const char* const probe : {"ray", "point"}) {
    for (const int triangles : {20, 80}) {
      evidence::AccuracyRow& row = report.rows.emplace_back();
      row.shape = "sphere", row.probe = probe, row.method = "tick", row.triangles = triangles;
      row.ns_per_tick = 50;
      fill_errors(row.shape_errors, "", n);
    }
  }
  fill_studies(report, n);
  fill_searches(report, n);
  const std::vector<analysis::Table> tables = evidence::accuracy_tables(report);
  EXPECT_GE(tables.size(), 6U);
  for (const analysis::Table& table : tables) {
    EXPECT_FALSE(table.caption.empty());
    EXPECT_LE(table.n_names, table.header.size()) << table.caption;
    EXPECT_FALSE(table.rows.empty()) << table.caption;
    // "holds" needs no name above it.
    EXPECT_LE(std::ranges::count(table.header, ""), table.caption.starts_with("Extreme") ? 1 : 0)
        << table.caption;
    for (const auto& row : table.rows) {
      ASSERT_EQ(row.size(), table.header.size()) << table.caption;
      for (std::size_t c = 0; c < std::min(table.n_names, row.size()); ++c)
        EXPECT_FALSE(is_number(row[c])) << table.caption << ": " << row[c];
    }
  }
}

}  // namespace accuracy_numbers
}  // namespace
}  // namespace palpate::runner::commands
