#pragma once
// Panels of a figure as SVG, axes (range, ticks and tick labels) and marks, and the common parts of
// the figures of an analysis: title and label, style and legend of renderers, numbers of shapes,
// renderers and comparisons drawn, empty panels, and the functions that make each figure.

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/figures/svg.h"

namespace palpate::analysis {

/// Categorical axis: slot i spans i to i + 1 and has its name in the middle. \param shown number of
/// names shown
FigureAxis names_axis(const std::vector<std::string>& names, std::size_t shown, std::string title);
/// Linear axis with ticks at multiples of 1, 2 or 5 times a power of ten; its ends are ticks, at or
/// beyond low and high.
FigureAxis linear_axis(double low, double high, std::string title);
/// Logarithmic axis: positions are log10 of the values. Ticks at 1, 2 and 5 times powers of ten;
/// above 3.5 decades at powers of ten only, above 9 decades at every second, third ... power.
/// \param low, high log10 of values
FigureAxis log_axis(double low, double high, std::string title);
/// The same with ends at whole powers of ten. \param low, high values, above 0
FigureAxis decades_axis(double low, double high, std::string title);

/// Marks. Coordinates in the units of the axes, sizes in px.
Mark symbol(Role role, MarkerShape shape, double x, double y, double size, std::string text = {});
Mark text_mark(Role role, double x, double y, std::string text, double size = 12);
Mark line_mark(Role role, std::vector<double> x, std::vector<double> y, double width = 2);
Mark rect_mark(Role role, double x0, double y0, double x1, double y1, double opacity,
               std::string text);

/// Vertical interval with end caps; cut at the axis, with an arrowhead.
void add_interval(Panel& panel, Role role, double x, double low, double high, std::string text);
/// The same, horizontal.
void add_interval_across(Panel& panel, Role role, double y, double low, double high,
                         const std::string& text);

/// Corners of right, left, cross and saltire within -1 to 1, y down; empty for the other shapes.
std::vector<std::pair<double, double>> outline_of(MarkerShape shape);

/// Places the labels of data points with the least overlap.
/// The panel's labels (Mark::Kind::label) as texts beside their points: each, in order, at the
/// candidate position (right or left, several heights) that overlaps the fewest points, intervals,
/// lines and labels placed before. \param width px, of the panel as it is drawn
std::vector<Mark> placed_labels(const Panel& panel, double width);

/// px: width of the only panel of a row, and of the panel of one comparison among several.
constexpr double kFullPanelWidth = 850, kComparisonPanelWidth = 370;

/// A figure without panels: id, title, "SIMULATED" label if it applies, numbers of participants and
/// trials.
Figure new_figure(const Analysis& analysis, std::string id, std::string title);

/// Colour and symbol of a renderer.
struct RendererStyle {
  Role role = Role::ink;
  MarkerShape shape = MarkerShape::circle;
};
/// Point and ray have fixed styles; other renderers take the remaining ones in the order of
/// TrialTable::renderers.
RendererStyle style_of(const Analysis& analysis, std::string_view renderer);
/// A renderer's name, cut to 40 bytes.
std::string short_name(const std::string& renderer);
/// Adds the first `shown` renderers to the legend.
void add_renderers(Figure& figure, const Analysis& analysis, std::size_t shown);

/// Numbers of shapes, renderers and comparisons drawn; adds a note to the figure if there are more.
std::size_t shown_shapes(const Analysis& analysis, Figure& figure);
std::size_t shown_renderers(const Analysis& analysis, Figure& figure);
std::size_t shown_comparisons(const Analysis& analysis, Figure& figure);

/// An empty panel for a comparison, titled if there are several. \param slot px for each shape
Panel comparison_panel(const Analysis& analysis, const RendererPair& pair, std::size_t shapes,
                       double slot);
/// Axis title such as "less time with the ray (%)". \param joint as for with_renderer()
std::string gain_title(const Analysis& analysis, const std::string& what, const std::string& joint);

/// "1.25 s"
std::string seconds_text(double seconds);

Figure times_of(const Analysis& analysis);
Figure confusion_of(const Analysis& analysis);
Figure speed_accuracy_of(const Analysis& analysis);
Figure exclusions_of(const Analysis& analysis);
Figure learning_of(const Analysis& analysis);
Figure order_of(const Analysis& analysis);
Figure servo_of(const Analysis& analysis, const StudyRecord& record);

/// A panel at its position in the drawing: px from the upper left corner, y down. x() and y()
/// convert from axis units.
struct PlacedPanel {
  const Panel* panel = nullptr;
  double left = 0, top = 0;  ///< of the area that the axes span
  double width = 0;          ///< of the frame; its height is the panel's

  double x(double value) const {
    return left + (value - panel->x.low) / (panel->x.high - panel->x.low) * width;
  }
  double y(double value) const {
    return top + panel->height -
           (value - panel->y.low) / (panel->y.high - panel->y.low) * panel->height;
  }
};

/// Width in px of the left axis with its labels and title.
double left_axis_width(const Panel& panel);

/// \return height in px of the lower axis with its labels and title
double draw_axes(Svg& svg, const PlacedPanel& placed, const Palette& palette);
void draw_marks(Svg& svg, const PlacedPanel& placed, const Palette& palette);

/// A symbol centred at (x, y). \param half half of its width, px
void draw_symbol(Svg& svg, const Palette& palette, MarkerShape shape, Role role, double x, double y,
                 double half, double opacity = 1);

}  // namespace palpate::analysis
