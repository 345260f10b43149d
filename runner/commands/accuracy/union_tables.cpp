// Tables of contact with unions of convex parts.

#include "runner/commands/accuracy/report.h"

namespace palpate::runner {

analysis::Table union_table(const AccuracyReport& report) {
  analysis::Table table;
  table.caption = "Objects of several convex parts and tools of several segments: three ways";
  table.header = {"case",         "truth",  "method", "ns a tick",  "in contact",
                  "force N: rms", "99.9 %", "worst",  "10 % off %", "inside %"};
  table.n_names = 3;
  for (const rendering::UnionRow& row : report.unions) {
    table.rows.push_back({row.name, row.truth, row.method, significant(row.ns_per_tick),
                          thousands(static_cast<long long>(row.in_contact)),
                          significant(row.force.rms), significant(row.force.p999),
                          significant(row.force.worst), share(row.off_by_a_tenth, row.in_contact),
                          row.one_ideal_tool ? share(row.inside, row.ticks) : "-"});
  }
  const rendering::UnionSettings& s = report.union_settings;
  table.notes.push_back(
      "Each case on " + std::to_string(s.seeds) + " seeds of " +
      thousands(static_cast<long long>(s.ticks)) +
      " ticks. Error: the difference of the force from " + significant(rendering::kStiffness) +
      " N/m times the exact displacement of the ideal tool, as a vector, over all ticks.");
  table.notes.emplace_back(
      "10 % off: of the ticks in contact. Inside: ticks with the ideal tool in a part by more than "
      "1e-12 of its size. Oracle: steepest descent over every facet of every Minkowski sum; where "
      "hands are fast and deep, two ideal tools may have gone different ways.");
  for (const rendering::UnionMethod& method : rendering::union_methods()) {
    std::string note = method.name;
    note += ": ";
    note += method.description;
    table.notes.push_back(note + ".");
  }
  return table;
}

analysis::Table union_search_table(const rendering::UnionCounts& c, std::uint64_t seed) {
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
  for (const rendering::SearchFault& fault : c.faults) {
    table.notes.push_back("seed " + std::to_string(fault.seed) + " walk " +
                          std::to_string(fault.walk) + " tick " + std::to_string(fault.tick) +
                          ": " + fault.what);
  }
  return table;
}

analysis::Table soft_table(const AccuracyReport& report) {
  analysis::Table table;
  table.caption = "Soft bodies: what is known of them against what is computed";
  table.header = {"case",      "truth", "nodes",   "elements", "value",
                  "reference", "unit",  "error %", "ms a step"};
  table.n_names = 2;
  for (const rendering::SoftRow& row : report.soft) {
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

}  // namespace palpate::runner
