// Functions of several dimensions: what a form says of each participant, over the other dimension.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/figures/panel_drawing.h"
#include "analysis/statistics/task_analysis.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

constexpr std::size_t kCurvePoints = 60;
constexpr double kFieldPanelWidth = 420, kFieldPanelHeight = 300;

struct PlaceRange {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

std::string with_unit(const std::string& words, const std::string& unit) {
  return unit.empty() || unit == "1" ? words : words + " (" + printable(unit) + ")";
}

const FieldAnalysis::Dimension& other_of(const FieldAnalysis& field) {
  return field.dimensions[place_dimension(field.function)];
}

/// The meaning of the curves.
std::string location_title(const FieldAnalysis& field) {
  if (field.has_jnd()) return with_unit("JND", unit_of_parameter(field, "jnd"));
  if (field.function.form == protocols::FieldForm::cues)
    return with_unit("shift of equality", unit_of_parameter(field, "s"));
  return with_unit("threshold of " + printable(field.dimensions[field.function.x].name),
                   field.dimensions[field.function.x].unit);
}

/// A threshold is drawn in its unit, whatever its scale.
double drawn(const FieldAnalysis& field, double location) {
  if (has_two_lapses(field.function.form)) return location;
  return protocols::level_at(field.function.x_scale, location);
}

Panel field_panel(const TaskCell& cell) {
  const FieldAnalysis& field = *cell.field;
  PlaceRange x, y;
  for (const ParticipantField& one : field.participants) {
    for (const PointCount& count : one.counts) x.add(count.point[place_dimension(field.function)]);
  }
  Panel panel;
  panel.title = printable(cell.renderer, 40);
  panel.width = kFieldPanelWidth;
  panel.height = kFieldPanelHeight;
  const Role role = cell.renderer == "ray" ? Role::ray : Role::point;
  std::vector<double> places, means(kCurvePoints + 1, 0);
  for (std::size_t i = 0; i <= kCurvePoints; ++i)
    places.push_back(x.low + (x.high - x.low) * static_cast<double>(i) / kCurvePoints);
  std::size_t curves = 0;
  for (const ParticipantField& one : field.participants) {
    if (!one.fit.undefined.empty()) continue;
    const std::vector<double> values = one.fit.values(field.function.form);
    Mark curve = line_mark(Role::soft, {}, {}, 1);
    curve.opacity = 0.6;
    curve.participant = printable(one.participant, 40);
    curve.text = curve.participant;
    for (const FieldParameter& parameter : one.fit.parameters)
      curve.text += ", " + parameter.name + " " + short_number(parameter.value);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const double location = field_location(field.function, values, places[i]);
      means[i] += field.has_jnd() ? std::log(location) : location;
      curve.x.push_back(places[i]);
      curve.y.push_back(drawn(field, location));
      y.add(curve.y.back());
    }
    ++curves;
    panel.marks.push_back(std::move(curve));
    if (!one.fit.misfit.undefined.empty()) continue;
    for (const FieldMisfit::Place& place : one.fit.misfit.places) {
      const double free = drawn(field, place.free);
      // A JND that no answer limits would hide all others.
      if (!std::isfinite(free) || place.free > 5 * std::abs(place.fitted)) continue;
      Mark dot = symbol(Role::soft, MarkerShape::circle, place.at, free, 2.4,
                        printable(one.participant, 40) + " at " + short_number(place.at) + ": " +
                            short_number(free) + " by its own " +
                            counted(static_cast<std::size_t>(place.trials), "trial", "trials"));
      dot.participant = printable(one.participant, 40);
      y.add(free);
      panel.marks.push_back(std::move(dot));
    }
  }
  if (curves > 1) {
    Mark mean = line_mark(role, places, {}, 3);
    for (const double sum : means) {
      const double middle = sum / static_cast<double>(curves);
      mean.y.push_back(drawn(field, field.has_jnd() ? std::exp(middle) : middle));
    }
    panel.marks.push_back(std::move(mean));
  }
  const bool from_zero = field.has_jnd() || y.low >= 0;
  panel.x = linear_axis(field.has_jnd() ? std::min(0.0, x.low) : x.low,
                        x.high > x.low ? x.high : x.low + 1,
                        with_unit(printable(other_of(field).name), other_of(field).unit));
  panel.y = linear_axis(from_zero ? 0 : y.low, y.high > y.low ? y.high : y.low + 1,
                        location_title(field));
  return panel;
}

}  // namespace

std::vector<Figure> field_figures(const StudyAnalysis& analysis) {
  std::vector<Figure> figures;
  for (const TaskCell& cell : analysis.cells) {
    if (!cell.field || !cell.field->undefined.empty()) continue;
    const bool fitted = std::ranges::any_of(
        cell.field->participants, [](const auto& one) { return one.fit.undefined.empty(); });
    if (!fitted) continue;
    const std::string shown =
        ": " + cell.task + ", " + printable(cell.block_name) + ", " + printable(cell.shape);
    const std::string title =
        (cell.field->has_jnd() ? "JND over the standard" : "The form over its other dimension") +
        shown;
    auto figure = std::ranges::find(figures, title, &Figure::title);
    if (figure == figures.end()) {
      figure = figures.insert(figures.end(), Figure());
      figure->id = "field" + std::to_string(figures.size());
      figure->title = title;
      figure->subtitle = counted(cell.participants.size(), "participant", "participants");
      if (analysis.table.simulated) figure->label = "SIMULATED PARTICIPANTS";
      figure->notes.push_back(std::string("Thin: the function of each participant, form ") +
                              to_string(cell.field->function.form) +
                              ". Circles: the same from the trials at that place alone. Bold: " +
                              (cell.field->has_jnd() ? "geometric mean" : "mean") +
                              " of the participants.");
    }
    figure->panels.push_back(field_panel(cell));
    figure->description += printable(cell.renderer) + ": ";
    for (const ParticipantField& one : cell.field->participants) {
      figure->description += printable(one.participant);
      for (const FieldParameter& parameter : one.fit.parameters)
        figure->description += " " + parameter.name + " " + short_number(parameter.value);
      figure->description += ". ";
    }
  }
  return figures;
}

}  // namespace palpate::analysis
