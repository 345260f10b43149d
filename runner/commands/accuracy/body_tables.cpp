// Table of bodies that move and collide.

#include "runner/commands/accuracy/report.h"

namespace palpate::runner {

analysis::Table body_table(const AccuracyReport& report) {
  analysis::Table table;
  table.caption = "Bodies that move and collide: error and run time beside other engines";
  table.header = {"case", "error in", "engine", "error", "us a step"};
  table.n_names = 3;
  for (const rendering::BodyRow& row : report.bodies)
    table.rows.push_back(
        {row.name, row.measure, row.engine, significant(row.error), significant(row.us_per_step)});
  table.notes.emplace_back(
      "Boxes, steps of 1 ms, against closed forms; the largest error over all steps where "
      "something "
      "is to stay as it is, else that at the end.");
  const rendering::BodyTickCost& cost = report.body_tick;
  table.notes.push_back(
      "Ten dumbbells and a rocket of nine parts that the probe pushes among each other, " +
      thousands(static_cast<long long>(cost.ticks)) + " ticks: median " + significant(cost.median) +
      " us, 99th percentile " + significant(cost.p99) + " us, worst " + significant(cost.most) +
      " us.");
  return table;
}

}  // namespace palpate::runner
