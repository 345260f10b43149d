#pragma once
// What all figures of an analysis have in common: title and label, style and legend of renderers,
// how many shapes, renderers and comparisons are drawn, empty panels, and the functions that make
// each figure. Internal to analysis/figures/.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/figures/axes.h"
#include "analysis/figures/figures.h"
#include "analysis/figures/marks.h"

namespace palpate::analysis {

/// px: width of the only panel of a row, and of the panel of one comparison among several.
constexpr double kFullPanelWidth = 850, kComparisonPanelWidth = 370;

/// A figure without panels: id, title, "SIMULATED" label where it applies, numbers of participants
/// and trials.
Figure new_figure(const Analysis& analysis, std::string id, std::string title);

/// Colour and symbol of a renderer.
struct RendererStyle {
  Role role = Role::ink;
  MarkerShape shape = MarkerShape::circle;
};
/// Point and ray have fixed styles; the others take the free ones in the order of
/// TrialTable::renderers.
RendererStyle style_of(const Analysis& analysis, std::string_view renderer);
/// A renderer's name, cut to 40 bytes.
std::string short_name(const std::string& renderer);
/// Adds the first `shown` renderers to the legend.
void add_renderers(Figure& figure, const Analysis& analysis, std::size_t shown);

/// How many shapes, renderers and comparisons are drawn; adds a note to the figure where there are
/// more.
std::size_t shown_shapes(const Analysis& analysis, Figure& figure);
std::size_t shown_renderers(const Analysis& analysis, Figure& figure);
std::size_t shown_comparisons(const Analysis& analysis, Figure& figure);

/// An empty panel for a comparison, titled where there are several. \param slot px for each shape
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

}  // namespace palpate::analysis
