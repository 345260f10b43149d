#include "protocols/procedures/field_function.h"

#include <array>

#include "protocols/procedures/portable_math.h"

namespace palpate::protocols {
namespace {

constexpr double kUpperQuartile = 0.6744897501960817;  // Phi is 0.75 there

}  // namespace

const char* to_string(FieldForm form) {
  static constexpr std::array kNames = {"weber", "power", "threshold_line", "threshold_parabola",
                                        "cues"};
  return kNames[static_cast<std::size_t>(form)];
}

std::vector<std::string> parameter_names(FieldForm form) {
  switch (form) {
    case FieldForm::weber:
      return {"w", "c"};
    case FieldForm::power:
      return {"w", "a"};
    case FieldForm::threshold_line:
      return {"slope", "a", "b"};
    case FieldForm::threshold_parabola:
      return {"slope", "a", "b", "c"};
    case FieldForm::cues:
      return {"w", "s"};
  }
  return {};
}

bool has_two_lapses(FieldForm form) {
  return form != FieldForm::threshold_line && form != FieldForm::threshold_parabola;
}

double field_jnd(FieldForm form, const std::vector<double>& parameters, double standard) {
  if (form == FieldForm::weber) return parameters[0] * (standard + parameters[1]);
  return parameters[0] * portable_exp(parameters[1] * portable_log(standard));
}

std::size_t place_dimension(const FieldFunction& function) {
  return function.form == FieldForm::cues ? function.conflict : function.other;
}

double field_location(const FieldFunction& function, const std::vector<double>& parameters,
                      double at) {
  switch (function.form) {
    case FieldForm::weber:
    case FieldForm::power:
      return field_jnd(function.form, parameters, at);
    case FieldForm::cues:
      return (parameters[0] - 0.5) * at;
    case FieldForm::threshold_line:
    case FieldForm::threshold_parabola:
      break;
  }
  const double x2 = scale_position(function.other_scale, at);
  const double bend = function.form == FieldForm::threshold_parabola ? parameters[3] : 0;
  return parameters[1] + parameters[2] * x2 + bend * x2 * x2;
}

std::optional<std::size_t> width_parameter(FieldForm form) {
  if (form == FieldForm::weber || form == FieldForm::power) return std::nullopt;
  return form == FieldForm::cues ? 1 : 0;
}

double field_share_at(const FieldFunction& function, const LevelPoint& point, double location,
                      double width) {
  const double sign = function.easier == Easier::higher ? 1 : -1;
  const double x = point[function.x], other = point[function.other];
  switch (function.form) {
    case FieldForm::weber:
    case FieldForm::power:
      return portable_normal_cdf(sign * kUpperQuartile * (x - other) / location);
    case FieldForm::cues:
      return portable_normal_cdf(sign * (x - other - location) / width);
    case FieldForm::threshold_line:
    case FieldForm::threshold_parabola:
      break;
  }
  const PsychometricFunction along{function.shape, function.x_scale, function.easier};
  return psychometric_share(along, sign * (scale_position(function.x_scale, x) - location), width);
}

double field_share(const FieldFunction& function, const std::vector<double>& parameters,
                   const LevelPoint& point) {
  const std::optional<std::size_t> width = width_parameter(function.form);
  return field_share_at(function, point,
                        field_location(function, parameters, point[place_dimension(function)]),
                        width ? parameters[*width] : 1);
}

double field_success(const FieldFunction& function, const std::vector<double>& parameters,
                     const LevelPoint& point) {
  const double lapse = parameters.back();
  const double guess = has_two_lapses(function.form) ? lapse : parameters[parameters.size() - 2];
  return guess + (1 - guess - lapse) * field_share(function, parameters, point);
}

}  // namespace palpate::protocols
