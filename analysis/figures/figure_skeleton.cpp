#include "analysis/figures/figure_skeleton.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "analysis/statistics/conclusions.h"
#include "analysis/text.h"

namespace palpate::analysis {

Figure new_figure(const Analysis& analysis, std::string id, std::string title) {
  Figure figure;
  figure.id = std::move(id);
  figure.title = std::move(title);
  figure.label = simulated_label(analysis.table.simulated);
  const Counts& counts = analysis.description.counts;
  figure.subtitle = counted(counts.n_participants, "participant", "participants") + ", " +
                    counted(counts.n_trials, "trial", "trials");
  return figure;
}

RendererStyle style_of(const Analysis& analysis, std::string_view renderer) {
  constexpr std::array<RendererStyle, kShownRenderers> kStyles{
      {{Role::point, MarkerShape::circle},
       {Role::ray, MarkerShape::square},
       {Role::third, MarkerShape::right},
       {Role::fourth, MarkerShape::cross},
       {Role::fifth, MarkerShape::left},
       {Role::sixth, MarkerShape::saltire}}};
  const auto own = [](std::string_view name) {
    return name == "point" ? 0U : name == "ray" ? 1U : kShownRenderers;
  };
  if (own(renderer) < kShownRenderers) return kStyles[own(renderer)];
  std::array<bool, kShownRenderers> taken{};
  std::size_t before = 0;  // renderers without a fixed style that precede this one
  for (const std::string& name : analysis.table.renderers) {
    if (name == renderer) break;
    if (own(name) < kShownRenderers) {
      taken[own(name)] = true;
    } else {
      ++before;
    }
  }
  for (std::size_t i = 0; i < kShownRenderers; ++i) {
    if (!taken[i] && before-- == 0) return kStyles[i];
  }
  return kStyles.back();
}

std::string short_name(const std::string& renderer) { return stimuli::printable(renderer, 40); }

void add_renderers(Figure& figure, const Analysis& analysis, std::size_t shown) {
  for (std::size_t r = 0; r < shown; ++r) {
    const std::string& renderer = analysis.table.renderers[r];
    const RendererStyle style = style_of(analysis, renderer);
    figure.legend.push_back({stimuli::printable(renderer, 200), style.role, style.shape});
  }
}

std::size_t shown_shapes(const Analysis& analysis, Figure& figure) {
  const std::size_t n = analysis.table.shapes.size();
  if (n <= kShownShapes) return n;
  figure.notes.push_back("The first " + std::to_string(kShownShapes) + " of " + std::to_string(n) +
                         " shapes; the tables and the JSON file have all.");
  return kShownShapes;
}

std::size_t shown_renderers(const Analysis& analysis, Figure& figure) {
  const std::size_t n = analysis.table.renderers.size();
  if (n <= kShownRenderers) return n;
  figure.notes.push_back("The first " + std::to_string(kShownRenderers) + " of " +
                         std::to_string(n) + " renderers; the tables and the JSON file have all.");
  return kShownRenderers;
}

std::size_t shown_comparisons(const Analysis& analysis, Figure& figure) {
  return std::min(analysis.comparisons.size(),
                  std::max<std::size_t>(shown_renderers(analysis, figure), 2) - 1);
}

Panel comparison_panel(const Analysis& analysis, const RendererPair& pair, std::size_t shapes,
                       double slot) {
  const bool alone = analysis.comparisons.size() == 1;
  Panel panel;
  constexpr std::size_t kLongest = 24;  // bytes of each name, so that two fit above a narrow panel
  if (!alone) {
    panel.title = stimuli::printable(pair.renderer, kLongest) + " − " +
                  stimuli::printable(pair.reference, kLongest);
  }
  panel.width =
      std::max(alone ? kFullPanelWidth : kComparisonPanelWidth, slot * static_cast<double>(shapes));
  return panel;
}

std::string gain_title(const Analysis& analysis, const std::string& what,
                       const std::string& joint) {
  return shortened(what + " " + with_renderer(analysis, joint), 58) + " (%)";
}

std::string seconds_text(double seconds) { return fixed(seconds, seconds < 10 ? 2 : 1) + " s"; }

std::vector<Figure> figures_of(const Analysis& analysis, const StudyRecord& record) {
  std::vector<Figure> figures{
      figure15_of(analysis),  speedup_of(analysis),        times_of(analysis),
      confusion_of(analysis), speed_accuracy_of(analysis), learning_of(analysis),
      order_of(analysis),     servo_of(analysis, record),  exclusions_of(analysis)};
  std::erase_if(figures, [](const Figure& figure) { return figure.panels.empty(); });
  return figures;
}

}  // namespace palpate::analysis
