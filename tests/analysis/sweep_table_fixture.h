#pragma once
// Sweeps that are made up: any design, any function of the parameters.

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "analysis/input/sweep_table.h"

namespace palpate::analysis::testing {

/// A gain and its standard error, percent.
struct Outcome {
  double gain = 0, error = 0;
};

/// Points from 1, with parameters x1, x2, ... and the shape "cone".
inline SweepTable table_of(const std::string& design,
                           const std::vector<std::vector<double>>& points,
                           const std::function<Outcome(const std::vector<double>&)>& outcome) {
  SweepTable table;
  table.design = design;
  table.planned = static_cast<std::int64_t>(points.size());
  table.participants = table.repetitions = 1;
  table.shapes = {"cone"};
  table.renderers = {"point", "ray"};
  for (std::size_t p = 0; p < points.front().size(); ++p)
    table.parameters.push_back("x" + std::to_string(p + 1));
  table.columns = table.parameters;
  table.columns.insert(table.columns.end(), {"gain_cone", "gain_se_cone"});
  table.estimates = {{"gain_cone", "gain_se_cone"}};
  table.values.resize(table.columns.size());
  table.words.resize(table.parameters.size());
  for (const std::vector<double>& point : points) {
    table.points.push_back(static_cast<std::int64_t>(table.points.size()) + 1);
    table.failed.push_back(false);
    for (std::size_t p = 0; p < point.size(); ++p) table.values[p].push_back(point[p]);
    const Outcome one = outcome(point);
    table.values[point.size()].push_back(one.gain);
    table.values[point.size() + 1].push_back(one.error);
  }
  return table;
}

/// All combinations of `levels` equally spaced values from 0 to 1.
inline std::vector<std::vector<double>> grid_points(std::size_t parameters, std::size_t levels) {
  std::vector<std::vector<double>> points{{}};
  for (std::size_t p = 0; p < parameters; ++p) {
    std::vector<std::vector<double>> longer;
    for (const std::vector<double>& point : points) {
      for (std::size_t level = 0; level < levels; ++level) {
        longer.push_back(point);
        longer.back().push_back(static_cast<double>(level) / static_cast<double>(levels - 1));
      }
    }
    points = longer;
  }
  return points;
}

/// A, B, and A with each parameter of B, of independent base points. \param draw  uniform in [0, 1)
template <class Draw>
std::vector<std::vector<double>> saltelli_points(std::size_t parameters, std::size_t base_points,
                                                 Draw draw) {
  std::vector<std::vector<double>> points;
  for (std::size_t base = 0; base < base_points; ++base) {
    std::vector<double> a(parameters), b(parameters);
    for (double& x : a) x = draw();
    for (double& x : b) x = draw();
    points.push_back(a);
    points.push_back(b);
    for (std::size_t p = 0; p < parameters; ++p) {
      points.push_back(a);
      points.back()[p] = b[p];
    }
  }
  return points;
}

}  // namespace palpate::analysis::testing
