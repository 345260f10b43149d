#include "protocols/procedures/psychometric.h"

#include <array>
#include <charconv>
#include <cmath>

#include "protocols/procedures/portable_math.h"

namespace palpate::protocols {

const char* to_string(LevelScale scale) {
  switch (scale) {
    case LevelScale::linear:
      return "linear";
    case LevelScale::log10:
      return "log";
    case LevelScale::decibel:
      return "db";
  }
  return "";
}

const char* to_string(PsychometricShape shape) {
  switch (shape) {
    case PsychometricShape::logistic:
      return "logistic";
    case PsychometricShape::normal:
      return "normal";
    case PsychometricShape::weibull:
      return "weibull";
  }
  return "";
}

namespace {

constexpr double kLn10 = 2.302585092994045684;
constexpr int kDigitsOfLevels = 12;

double twelve_digits(double value) {
  if (!std::isfinite(value)) return value;
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value,
                                 std::chars_format::scientific, kDigitsOfLevels - 1);
  double rounded = value;
  std::from_chars(text.data(), end.ptr, rounded);
  return rounded;
}

/// A distance on the scale in units of log10.
double in_log10(LevelScale scale, double distance) {
  return scale == LevelScale::decibel ? distance / 20 : distance;
}

/// z with F(z) = share, by bisection: F rises.
double normal_quantile(double share) {
  double low = -9, high = 9;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (portable_normal_cdf(middle) < share ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

double scale_position(LevelScale scale, double level) {
  if (scale == LevelScale::linear) return level;
  const double log10 = portable_log(level) / kLn10;
  return scale == LevelScale::decibel ? 20 * log10 : log10;
}

double level_at(LevelScale scale, double position) {
  if (scale == LevelScale::linear) return twelve_digits(position);
  return twelve_digits(portable_exp(in_log10(scale, position) * kLn10));
}

double psychometric_share(const PsychometricFunction& function, double distance, double slope) {
  switch (function.shape) {
    case PsychometricShape::logistic:
      return 1 / (1 + portable_exp(-slope * distance));
    case PsychometricShape::normal:
      return portable_normal_cdf(slope * distance);
    case PsychometricShape::weibull:
      return 1 - portable_exp(-portable_exp(slope * in_log10(function.scale, distance) * kLn10));
  }
  return 0;
}

double psychometric_core(const PsychometricFunction& function, double level, double threshold,
                         double slope) {
  const double above =
      scale_position(function.scale, level) - scale_position(function.scale, threshold);
  return psychometric_share(function, function.easier == Easier::higher ? above : -above, slope);
}

double psychometric_probability(const PsychometricFunction& function,
                                const PsychometricParameters& parameters, double level) {
  const auto& [threshold, slope, guess, lapse] = parameters;
  return guess + (1 - guess - lapse) * psychometric_core(function, level, threshold, slope);
}

double psychometric_level(const PsychometricFunction& function,
                          const PsychometricParameters& parameters, double share) {
  double distance = 0;
  switch (function.shape) {
    case PsychometricShape::logistic:
      distance = portable_log(share / (1 - share)) / parameters.slope;
      break;
    case PsychometricShape::normal:
      distance = normal_quantile(share) / parameters.slope;
      break;
    case PsychometricShape::weibull:
      distance = portable_log(-portable_log(1 - share)) / kLn10 / parameters.slope;
      if (function.scale == LevelScale::decibel) distance *= 20;
      break;
  }
  if (function.easier == Easier::lower) distance = -distance;
  return level_at(function.scale, scale_position(function.scale, parameters.threshold) + distance);
}

}  // namespace palpate::protocols
