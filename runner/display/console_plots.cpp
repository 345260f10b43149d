#include <algorithm>
#include <cmath>

#include "runner/display/console_panels.h"
#include "runner/display/console_widgets.h"
#include "runner/display/console_words.h"

namespace palpate::runner {
namespace {

constexpr ImU32 kAxisColour = IM_COL32(153, 163, 176, 255);

/// The area of a plot within its titled frame, px.
struct Plot {
  ImVec2 from, to;
  ImDrawList* list;
};

/// \param top  largest value of the axis; 0: no axis
Plot plot_frame(const char* name, float width, float height, double top = 0,
                const char* unit = "") {
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float size = ImGui::GetFontSize();
  ImDrawList* const list = ImGui::GetWindowDrawList();
  list->AddRectFilled(at, {at.x + width, at.y + height}, ImGui::GetColorU32(ImGuiCol_FrameBg), 6);
  list->PushClipRect(at, {at.x + width, at.y + height}, true);
  list->AddText({at.x + 0.6F * size, at.y + 0.4F * size}, kAxisColour, name);
  list->PopClipRect();
  const Plot plot{{at.x + 3.6F * size, at.y + 2.0F * size},
                  {at.x + width - 0.8F * size, at.y + height - 0.8F * size},
                  list};
  for (int i = 0; i <= 2 && top > 0; ++i) {
    const float y = plot.to.y + (plot.from.y - plot.to.y) * static_cast<float>(i) / 2;
    list->AddLine({plot.from.x, y}, {plot.to.x, y}, IM_COL32(255, 255, 255, 26));
    const std::string label = axis_label(top * i / 2) + (i == 2 ? unit : "");
    const float wide = ImGui::CalcTextSize(label.c_str()).x;
    list->AddText({plot.from.x - wide - 6, y - size / 2}, kAxisColour, label.c_str());
  }
  ImGui::Dummy({width, height});
  return plot;
}

/// The next of 1, 2 or 5 times a power of ten.
double round_up(double value) {
  const double power = std::pow(10, std::floor(std::log10(std::max(value, 1e-3))));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (value <= step * power) return step * power;
  }
  return 10 * power;
}

}  // namespace

void draw_forces(const std::deque<ForcePoint>& forces, float width, float height) {
  double most = 1;
  for (const ForcePoint& point : forces) most = std::max(most, point.force);
  const double top = round_up(most);
  const Plot plot = plot_frame("Force on the hand, last 10 s", width, height, top, " N");
  if (forces.size() < 2) return;
  std::vector<ImVec2> line;
  line.reserve(forces.size());
  for (const ForcePoint& point : forces) {
    const auto ago = static_cast<float>((forces.back().time - point.time) / 10);
    const auto high = static_cast<float>(point.force / top);
    line.emplace_back(plot.to.x - ago * (plot.to.x - plot.from.x),
                      plot.to.y - high * (plot.to.y - plot.from.y));
  }
  plot.list->AddPolyline(line.data(), static_cast<int>(line.size()), IM_COL32(247, 199, 66, 255), 0,
                         1.8F);
}

void draw_times(const std::vector<double>& times, float width, float height) {
  double most = 1;
  for (const double time : times) most = std::max(most, std::isfinite(time) ? time : 0);
  const double top = round_up(most);
  const Plot plot = plot_frame("Identification times so far", width, height, top, " s");
  const auto count = static_cast<float>(std::max<std::size_t>(times.size(), 20));
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (!std::isfinite(times[i])) continue;
    const float x =
        plot.from.x + (static_cast<float>(i) + 0.5F) / count * (plot.to.x - plot.from.x);
    const float y =
        plot.to.y - static_cast<float>(std::max(times[i], 0.0) / top) * (plot.to.y - plot.from.y);
    plot.list->AddCircleFilled({x, y}, (times.size() > 200 ? 0.12F : 0.22F) * ImGui::GetFontSize(),
                               IM_COL32(116, 170, 217, 255));
  }
}

void draw_scores(const std::vector<ShapeScore>& scores, float width, float height) {
  const Plot plot = plot_frame("Correct, without practice", width, height);
  const float line = ImGui::GetTextLineHeight();
  const float each =
      std::min(1.5F * line, (plot.to.y - plot.from.y) /
                                static_cast<float>(std::max<std::size_t>(scores.size(), 1)));
  const float left = plot.from.x - 2.8F * line, wide = plot.to.x - left;
  for (std::size_t i = 0; i < scores.size(); ++i) {
    const ShapeScore& score = scores[i];
    const float y = plot.from.y + static_cast<float>(i) * each;
    const float fraction =
        score.shown > 0 ? static_cast<float>(score.right) / static_cast<float>(score.shown) : 0;
    plot.list->AddRectFilled({left, y}, {left + fraction * wide, y + 0.86F * each},
                             IM_COL32(60, 92, 120, 255), 3);
    const float size = std::min(line, 0.86F * each);
    const auto write = [&](float x, const std::string& words) {
      plot.list->AddText(ImGui::GetFont(), size, {x, y + (0.86F * each - size) / 2},
                         IM_COL32(235, 233, 226, 255), words.c_str());
    };
    write(left + 6, score.shape);
    const std::string count = std::to_string(score.right) + " of " + std::to_string(score.shown);
    write(plot.to.x - ImGui::CalcTextSize(count.c_str()).x * size / line - 6, count);
  }
}

}  // namespace palpate::runner
