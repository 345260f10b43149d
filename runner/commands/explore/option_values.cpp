#include "runner/commands/explore/option_values.h"

#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

#include "data/base/text.h"
#include "runner/commands/shared/command.h"
#include "runner/display/scene/painter.h"

namespace palpate::runner {
namespace {

constexpr double kShortest = 0.001, kLongest = 3600;  // s, between pictures
constexpr double kSteepest = 85;                      // degrees
constexpr double kLeastZoom = 0.01, kMostZoom = 100;

/// The whole text as a number.
template <class Number>
std::optional<Number> number_of(std::string_view text) {
  Number out{};
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, out);
  if (error != std::errc{} || stop != end) return std::nullopt;
  if (!std::isfinite(static_cast<double>(out))) return std::nullopt;
  return out;
}

std::vector<std::string_view> split(std::string_view text, char at) {
  std::vector<std::string_view> out;
  for (;;) {
    const std::size_t end = text.find(at);
    out.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return out;
    text.remove_prefix(end + 1);
  }
}

[[noreturn]] void refuse_value(const char* option, const std::string& expected,
                               const std::string& text) {
  throw UsageError("--" + std::string(option) + ": expected " + expected + ", found '" +
                   printable(text, 60) + "'");
}

}  // namespace

PictureSize parse_size(const std::string& text) {
  const auto parts = split(text, 'x');
  const auto side = [&](std::size_t i) {
    const auto value = number_of<int>(parts[i]);
    const bool good =
        value && *value >= ScenePainter::kLeastSide && *value <= ScenePainter::kMostSide;
    return good ? *value : 0;
  };
  if (parts.size() == 2 && side(0) > 0 && side(1) > 0) return {side(0), side(1)};
  refuse_value("size",
               "width and height of " + std::to_string(ScenePainter::kLeastSide) + " to " +
                   std::to_string(ScenePainter::kMostSide) + " px, such as 1280x720",
               text);
}

double parse_every(const std::string& text) {
  std::string_view number = text;
  double unit = 0;
  if (number.ends_with("ms")) {
    unit = 0.001;
    number.remove_suffix(2);
  } else if (number.ends_with('s')) {
    unit = 1;
    number.remove_suffix(1);
  }
  const auto value = number_of<double>(number);
  const double seconds = value ? unit * *value : 0;
  if (seconds >= kShortest && seconds <= kLongest) return seconds;
  refuse_value("every", "a time from 1ms to 3600s with its unit, such as 16ms or 0.5s", text);
}

ViewAngles parse_view(const std::string& text) {
  const auto parts = split(text, ',');
  const char* const expected =
      "degrees to the right and up (-85 to 85), and if need be how many times as large (0.01 to "
      "100), such as 30,20 or 30,20,1.5";
  std::vector<double> values;
  for (const std::string_view part : parts) {
    const auto value = number_of<double>(part);
    if (!value) refuse_value("view", expected, text);
    values.push_back(*value);
  }
  const bool two_or_three = values.size() == 2 || values.size() == 3;
  if (!two_or_three || std::abs(values[0]) > 360 || std::abs(values[1]) > kSteepest)
    refuse_value("view", expected, text);
  const double closer = values.size() == 3 ? values[2] : 1;
  if (closer < kLeastZoom || closer > kMostZoom) refuse_value("view", expected, text);
  constexpr double kRadPerDegree = M_PI / 180;
  return {static_cast<float>(kRadPerDegree * values[0]),
          static_cast<float>(kRadPerDegree * values[1]), static_cast<float>(closer)};
}

}  // namespace palpate::runner
