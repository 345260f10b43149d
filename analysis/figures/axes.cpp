#include "analysis/figures/axes.h"

#include <algorithm>
#include <cmath>

#include "analysis/text.h"

namespace palpate::analysis {

namespace {

/// About a fifth of `span`.
double tick_step(double span) {
  const double power = std::pow(10.0, std::floor(std::log10(span / 5)));
  const double factor = span / 5 / power;
  return power * (factor < 1.5 ? 1 : factor < 3.5 ? 2 : factor < 7.5 ? 5 : 10);
}

}  // namespace

double Axes::y(double value) const {
  return bottom - (std::clamp(value, low, high) - low) / (high - low) * (bottom - top);
}

double Axes::centre(std::size_t shape) const {
  return left + (static_cast<double>(shape) + 0.5) * slot;
}

void Axes::round_ends() {
  step = tick_step(high - low);
  low = step * std::floor(low / step + 1e-9);
  high = step * std::ceil(high / step - 1e-9);
}

void draw_grid(Svg& svg, const Axes& axes) {
  const double step = axes.step;
  const int decimals = step < 1 ? static_cast<int>(std::ceil(-std::log10(step) - 1e-9)) : 0;
  const int count = static_cast<int>(std::lround((axes.high - axes.low) / step));
  for (int i = 0; i <= count; ++i) {
    const double value = axes.low + i * step, y = axes.y(value);
    const bool zero = std::fabs(value) < step / 2;
    svg.line(axes.left, y, axes.left + axes.width, y, zero ? kSoft : kGrid, zero ? 1.2 : 1);
    svg.text(axes.left - 8, y + 4, fixed(value, decimals), {12, kSoft, Svg::Anchor::end});
  }
}

void draw_interval(Svg& svg, const Axes& axes, double x, double low, double high,
                   std::string_view colour) {
  const double top = axes.y(high), bottom = axes.y(low);
  svg.line(x, bottom, x, top, colour, 2);
  if (high > axes.high) {
    svg.triangle(x, top + 4, 5, true, colour);
  } else {
    svg.line(x - 5, top, x + 5, top, colour, 2);
  }
  if (low < axes.low) {
    svg.triangle(x, bottom - 4, 5, false, colour);
  } else {
    svg.line(x - 5, bottom, x + 5, bottom, colour, 2);
  }
}

}  // namespace palpate::analysis
