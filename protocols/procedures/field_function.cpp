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

double field_threshold(FieldForm form, const std::vector<double>& parameters, double x2) {
  const double bend = form == FieldForm::threshold_parabola ? parameters[3] : 0;
  return parameters[1] + parameters[2] * x2 + bend * x2 * x2;
}

double field_share(const FieldFunction& function, const std::vector<double>& parameters,
                   const LevelPoint& point) {
  const double sign = function.easier == Easier::higher ? 1 : -1;
  const double x = point[function.x], other = point[function.other];
  switch (function.form) {
    case FieldForm::weber:
    case FieldForm::power:
      return portable_normal_cdf(sign * kUpperQuartile * (x - other) /
                                 field_jnd(function.form, parameters, other));
    case FieldForm::cues:
      return portable_normal_cdf(
          sign * (x - other - (parameters[0] - 0.5) * point[function.conflict]) / parameters[1]);
    case FieldForm::threshold_line:
    case FieldForm::threshold_parabola:
      break;
  }
  const double t =
      field_threshold(function.form, parameters, scale_position(function.other_scale, other));
  const PsychometricFunction along{function.shape, function.x_scale, function.easier};
  return psychometric_share(along, sign * (scale_position(function.x_scale, x) - t), parameters[0]);
}

double field_success(const FieldFunction& function, const std::vector<double>& parameters,
                     const LevelPoint& point) {
  const double lapse = parameters.back();
  const double guess = has_two_lapses(function.form) ? lapse : parameters[parameters.size() - 2];
  return guess + (1 - guess - lapse) * field_share(function, parameters, point);
}

}  // namespace palpate::protocols
