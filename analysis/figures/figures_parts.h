#pragma once
// Pieces that the figures are made of. Internal to analysis/figures*.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/figures/axes.h"
#include "analysis/figures/figures.h"
#include "analysis/figures/marks.h"

namespace palpate::analysis {

/// Width of a panel that stands alone, and of one of several comparisons, px.
constexpr double kWide = 850, kHalfWide = 370;

/// Everything that figures have in common: label, subtitle.
Figure new_figure(const Analysis& analysis, std::string id, std::string title);

/// How a renderer is drawn: told apart by colour and without.
struct Look {
  Role role = Role::ink;
  Shape shape = Shape::circle;
};
/// Point and ray have their own; others, in their order, what these leave.
Look look_of(const Analysis& analysis, std::string_view renderer);
/// A renderer's name where there is little room.
std::string short_name(const std::string& renderer);
/// Renderers in a legend, the first `shown`.
void add_renderers(Figure& figure, const Analysis& analysis, std::size_t shown);

/// Shapes, renderers and comparisons that are drawn, and a note where there are more.
std::size_t shown_shapes(const Analysis& analysis, Figure& figure);
std::size_t shown_renderers(const Analysis& analysis, Figure& figure);
std::size_t shown_comparisons(const Analysis& analysis, Figure& figure);

/// A panel for one of the comparisons, `slot` px for each shape: named where there are several.
Panel comparison_panel(const Analysis& analysis, const RendererPair& pair, std::size_t shapes,
                       double slot);
/// Title of an axis for what a comparison gains or changes: "less time with the ray (%)".
std::string gain_title(const Analysis& analysis, const std::string& what, const std::string& joint);

/// "1.25 s"
std::string seconds_text(double seconds);

Figure times_of(const Analysis& analysis);
Figure confusion_of(const Analysis& analysis);
Figure speed_accuracy_of(const Analysis& analysis);
Figure exclusions_of(const Analysis& analysis);
Figure learning_of(const Analysis& analysis);
Figure order_of(const Analysis& analysis);
Figure servo_of(const Analysis& analysis, const ReportRecord& record);

}  // namespace palpate::analysis
