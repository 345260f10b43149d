#include "runner/commands/shared/log_panel.h"

#include <algorithm>
#include <cmath>

#include "analysis/figures/axes.h"

namespace palpate::runner {
namespace {

double share(double value, double low, double high) {
  if (!(value > 0)) return 0;
  return std::clamp(std::log(value / low) / std::log(high / low), 0.0, 1.0);
}

/// "1", "100", else a power of ten: "10⁻⁶".
std::string power(int exponent) {
  if (exponent >= 0 && exponent <= 3) {
    std::string text = "1";
    text.append(static_cast<std::size_t>(exponent), '0');
    return text;
  }
  static constexpr const char* kRaised[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = exponent < 0 ? "10⁻" : "10";
  for (const char digit : std::to_string(std::abs(exponent))) text += kRaised[digit - '0'];
  return text;
}

int decade(double value) { return static_cast<int>(std::lround(std::log10(value))); }

}  // namespace

double LogPanel::x(double value) const { return left + width * share(value, x_low, x_high); }
double LogPanel::y(double value) const { return top + height * (1 - share(value, y_low, y_high)); }

void LogPanel::round_ends() {
  const auto widen = [](double& low, double& high) {
    low = std::pow(10.0, std::floor(std::log10(low) + 1e-9));
    high = std::pow(10.0, std::ceil(std::log10(high) - 1e-9));
    if (!(high > low)) high = 10 * low;
  };
  widen(x_low, x_high);
  widen(y_low, y_high);
}

void draw_panel(analysis::Svg& svg, const LogPanel& panel, const PanelTitles& titles) {
  constexpr double kSmall = 11;
  const double right = panel.left + panel.width, bottom = panel.top + panel.height;
  svg.rect(panel.left, panel.top, panel.width, panel.height, "none", analysis::kGrid);
  const auto every = [](int first, int last, double room) {  // decades between figures
    return std::max(1, static_cast<int>(std::ceil((last - first + 1) * 26.0 / room)));
  };
  const int x0 = decade(panel.x_low), x1 = decade(panel.x_high);
  const int y0 = decade(panel.y_low), y1 = decade(panel.y_high);
  for (int e = x0; e <= x1; ++e) {
    const double x = panel.x(std::pow(10.0, e));
    svg.line(x, panel.top, x, bottom, analysis::kGrid);
    if ((e - x0) % every(x0, x1, panel.width) != 0) continue;
    svg.text(x, bottom + 16, power(e),
             {kSmall, analysis::kSoft, analysis::Svg::Anchor::middle, false, 0});
  }
  for (int e = y0; e <= y1; ++e) {
    const double y = panel.y(std::pow(10.0, e));
    svg.line(panel.left, y, right, y, analysis::kGrid);
    if ((e - y0) % every(y0, y1, panel.height) != 0) continue;
    svg.text(panel.left - 7, y + 4, power(e),
             {kSmall, analysis::kSoft, analysis::Svg::Anchor::end, false, 0});
  }
  svg.text(panel.left, panel.top - 9, titles.panel,
           {13, analysis::kInk, analysis::Svg::Anchor::start, true, 0});
  svg.text(panel.left + panel.width / 2, bottom + 34, titles.x,
           {12, analysis::kSoft, analysis::Svg::Anchor::middle, false, 0});
  if (titles.y.empty()) return;
  svg.text(panel.left - 44, panel.top + panel.height / 2, titles.y,
           {12, analysis::kSoft, analysis::Svg::Anchor::middle, false, -90});
}

void draw_path(analysis::Svg& svg, const LogPanel& panel,
               const std::vector<std::pair<double, double>>& points, std::string_view colour,
               double width) {
  for (std::size_t i = 1; i < points.size(); ++i) {
    svg.line(panel.x(points[i - 1].first), panel.y(points[i - 1].second), panel.x(points[i].first),
             panel.y(points[i].second), colour, width);
  }
}

void draw_level(analysis::Svg& svg, const LogPanel& panel, double level, std::string_view name) {
  const double y = panel.y(level), right = panel.left + panel.width;
  constexpr double kDash = 5;
  for (double x = panel.left; x < right; x += 2 * kDash) {
    svg.line(x, y, std::min(x + kDash, right), y, analysis::kSoft);
  }
  svg.text(right - 4, y - 5, name, {11, analysis::kSoft, analysis::Svg::Anchor::end, false, 0});
}

}  // namespace palpate::runner
