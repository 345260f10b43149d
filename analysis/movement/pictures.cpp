#include "analysis/movement/pictures.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>
#include <optional>

namespace palpate::analysis {
namespace {

double median_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n == 0 ? 0 : (values[(n - 1) / 2] + values[n / 2]) / 2;
}

/// Rows of a renderer and shape that have measures.
std::vector<std::size_t> rows_of(const MovementTable& table, std::size_t renderer,
                                 std::size_t shape) {
  static const std::size_t duration = measure_named("duration");
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < table.values.size(); ++i) {
    const TrialRow& row = table.trials.rows[i];
    if (row.renderer == renderer && row.shape == shape && table.values[i][duration])
      rows.push_back(i);
  }
  return rows;
}

std::vector<double> durations_of(const MovementTable& table, const std::vector<std::size_t>& rows) {
  static const std::size_t duration = measure_named("duration");
  std::vector<double> all;
  all.reserve(rows.size());
  for (const std::size_t i : rows) all.push_back(*table.values[i][duration]);
  return all;
}

CoverageCurve curve_of(const MovementTable& table, const std::vector<std::size_t>& rows,
                       const std::vector<TrialTally>& tallies) {
  struct Sum {
    std::size_t n = 0;
    std::array<double, TrialTally::kSteps> shares{};
  };
  std::map<std::uint32_t, Sum> by_participant;
  for (const std::size_t i : rows) {
    if (tallies[i].coverage.empty()) continue;
    Sum& sum = by_participant[table.trials.rows[i].participant];
    ++sum.n;
    for (std::size_t k = 0; k < TrialTally::kSteps; ++k) sum.shares[k] += tallies[i].coverage[k];
  }
  CoverageCurve curve;
  curve.participants = by_participant.size();
  curve.median_duration = median_of(durations_of(table, rows));
  if (by_participant.empty()) return curve;
  curve.mean.resize(TrialTally::kSteps);
  for (const auto& [participant, sum] : by_participant) {
    for (std::size_t k = 0; k < TrialTally::kSteps; ++k)
      curve.mean[k] += sum.shares[k] / static_cast<double>(sum.n * by_participant.size());
  }
  return curve;
}

ContactMap map_of(const std::vector<std::size_t>& rows, const std::vector<TrialTally>& tallies,
                  const ShapeOutline& outline) {
  ContactMap map;
  if (outline.places.empty()) return map;
  std::vector<double> area(SurfaceMap::kCells), contact(SurfaceMap::kCells);
  const Vec3 middle = outline.middle();
  for (const Vec3& place : outline.places)
    area[SurfaceMap::cell_of(place - middle)] += 1 / static_cast<double>(outline.places.size());
  for (const std::size_t i : rows) {
    if (tallies[i].contact.empty()) continue;
    ++map.trials;
    for (std::size_t c = 0; c < SurfaceMap::kCells; ++c) contact[c] += tallies[i].contact[c];
  }
  if (map.trials == 0) return map;
  // A cell seen at an angle may hold only one or two places.
  const double least = 2 / static_cast<double>(outline.places.size());
  for (std::size_t c = 0; c < SurfaceMap::kCells; ++c)
    map.density.push_back(contact[c] / static_cast<double>(map.trials) / std::max(area[c], least));
  return map;
}

}  // namespace

std::array<double, 2> SurfaceMap::place_of(const Vec3& from_middle) {
  const double length = glm::length(from_middle);
  const double height = length > 0 ? from_middle.z / length : 0;
  const double angle = std::atan2(from_middle.y, from_middle.x) / (2 * std::numbers::pi) + 0.5;
  return {angle * static_cast<double>(kColumns), (height + 1) / 2 * static_cast<double>(kRows)};
}

std::size_t SurfaceMap::cell_of(const Vec3& from_middle) {
  const auto [column, row] = place_of(from_middle);
  return std::min(kRows - 1, static_cast<std::size_t>(row)) * kColumns +
         std::min(kColumns - 1, static_cast<std::size_t>(column));
}

Vec3 ShapeOutline::middle() const {
  Vec3 sum(0);
  for (const Vec3& place : places) sum += place;
  return places.empty() ? sum : sum / static_cast<double>(places.size());
}

TrialTally tally_of(const MovementTrial& trial, const TouchedSurface& surface) {
  TrialTally tally;
  const Vec3 middle = ShapeOutline{surface.places(), {}}.middle();
  const std::vector<double> covered = coverage_by_tick(trial, surface);
  if (!covered.empty()) {
    tally.contact.resize(SurfaceMap::kCells);
    const float share = 1.0F / static_cast<float>(covered.size());
    for (std::size_t i = 0; i < trial.tip.size(); ++i) {
      if (trial.contact[i]) tally.contact[SurfaceMap::cell_of(trial.point[i] - middle)] += share;
    }
  }
  std::size_t ticks = 0, in_contact = 0;
  for (std::size_t k = 0; k < TrialTally::kSteps; ++k) {
    const double until = static_cast<double>(k) * TrialTally::kStep * trial.rate;
    for (; ticks < trial.tip.size() && static_cast<double>(ticks) < until; ++ticks)
      in_contact += trial.contact[ticks];
    tally.coverage.push_back(in_contact == 0 ? 0.0F : static_cast<float>(covered[in_contact - 1]));
  }
  return tally;
}

std::vector<std::size_t> typical_rows(const MovementTable& table) {
  std::vector<std::size_t> typical;
  for (std::size_t s = 0; s < table.trials.shapes.size(); ++s) {
    for (std::size_t r = 0; r < table.trials.renderers.size(); ++r) {
      const std::vector<std::size_t> rows = rows_of(table, r, s);
      const std::vector<double> durations = durations_of(table, rows);
      const double median = median_of(durations);
      std::optional<std::size_t> nearest;
      double least = 0;
      for (std::size_t i = 0; i < rows.size(); ++i) {
        if (!table.trials.rows[rows[i]].correct) continue;
        const double off = std::abs(durations[i] - median);
        if (nearest && off >= least) continue;
        nearest = rows[i];
        least = off;
      }
      if (nearest) typical.push_back(*nearest);
    }
  }
  return typical;
}

void add_up(const MovementTable& table, const std::vector<TrialTally>& tallies,
            MovementPictures& pictures) {
  pictures.outlines.resize(table.trials.shapes.size());
  for (std::size_t r = 0; r < table.trials.renderers.size(); ++r) {
    auto& curves = pictures.coverage.emplace_back();
    auto& maps = pictures.contact.emplace_back();
    for (std::size_t s = 0; s < table.trials.shapes.size(); ++s) {
      const std::vector<std::size_t> rows = rows_of(table, r, s);
      curves.push_back(curve_of(table, rows, tallies));
      maps.push_back(map_of(rows, tallies, pictures.outlines[s]));
    }
  }
}

}  // namespace palpate::analysis
