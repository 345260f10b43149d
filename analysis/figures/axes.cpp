#include "analysis/figures/axes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "analysis/text.h"

namespace palpate::analysis {

namespace {

/// Distance of ticks: 1, 2 or 5 times a power of ten, near a fifth of `span`.
double round_step(double span) {
  const double power = std::pow(10.0, std::floor(std::log10(span / 5)));
  const double factor = span / 5 / power;
  return power * (factor < 1.5 ? 1 : factor < 3.5 ? 2 : factor < 7.5 ? 5 : 10);
}

/// "0.02", "500", "10⁻⁶", "2·10⁻⁶". \param factor 1, 2 or 5, times 10 to the `exponent`
std::string log_tick_text(int factor, int exponent) {
  constexpr int kFewDecimals = 3, kFewZeros = 4;
  if (exponent >= -kFewDecimals && exponent <= kFewZeros) {
    return fixed(factor * std::pow(10.0, exponent), std::max(0, -exponent));
  }
  constexpr const char* kRaised[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = factor == 1 ? "" : std::to_string(factor) + "·";
  text += exponent < 0 ? "10⁻" : "10";
  for (const char digit : std::to_string(std::abs(exponent))) text += kRaised[digit - '0'];
  return text;
}

}  // namespace

FigureAxis names_axis(const std::vector<std::string>& names, std::size_t shown, std::string title) {
  FigureAxis axis;
  axis.title = std::move(title);
  axis.high = static_cast<double>(std::max<std::size_t>(shown, 1));
  axis.grid = false;
  axis.names = true;
  for (std::size_t i = 0; i < shown; ++i) {
    axis.ticks.push_back({static_cast<double>(i) + 0.5, stimuli::printable(names[i], 160)});
  }
  return axis;
}

FigureAxis linear_axis(double low, double high, std::string title) {
  if (!(high > low)) high = low + 1;
  const double step = round_step(high - low);
  FigureAxis axis;
  axis.title = std::move(title);
  axis.low = step * std::floor(low / step + 1e-9);
  axis.high = step * std::ceil(high / step - 1e-9);
  const int decimals = step < 1 ? static_cast<int>(std::ceil(-std::log10(step) - 1e-9)) : 0;
  const auto count = std::lround((axis.high - axis.low) / step);
  for (long i = 0; i <= count; ++i) {
    const double at = axis.low + static_cast<double>(i) * step;
    axis.ticks.push_back({at, fixed(at, decimals)});
  }
  return axis;
}

FigureAxis log_axis(double low, double high, std::string title) {
  constexpr double kMostWithFactors = 3.5;  // decades; beyond, no ticks at 2 and 5
  constexpr double kMostTicks = 9;          // beyond, every second, third ... power of ten
  if (!(high > low)) {
    low -= 0.1;
    high += 0.1;
  }
  FigureAxis axis;
  axis.title = std::move(title);
  axis.low = low;
  axis.high = high;
  const int last = static_cast<int>(std::ceil(high));
  const int step = std::max(1, static_cast<int>(std::ceil((high - low) / kMostTicks)));
  for (int exponent = static_cast<int>(std::floor(low)); exponent <= last; ++exponent) {
    if (exponent % step != 0) continue;
    for (const int factor : {1, 2, 5}) {
      const double at = exponent + std::log10(factor);
      if (factor > 1 && high - low > kMostWithFactors) continue;
      if (at < low - 1e-9 || at > high + 1e-9) continue;
      axis.ticks.push_back({at, log_tick_text(factor, exponent)});
    }
  }
  return axis;
}

FigureAxis decades_axis(double low, double high, std::string title) {
  const double first = std::floor(std::log10(low) + 1e-9);
  const double last = std::ceil(std::log10(high) - 1e-9);
  return log_axis(first, std::max(last, first + 1), std::move(title));
}

}  // namespace palpate::analysis
