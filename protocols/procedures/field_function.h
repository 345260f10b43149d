#pragma once
// Psychometric functions of levels of several dimensions: the probability of a success over a
// point.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "protocols/procedures/psychometric.h"

namespace palpate::protocols {

/// Values of a level's dimensions, in their order, each in its unit.
using LevelPoint = std::vector<double>;

/// z75 is 0.6745, the place where Phi is 0.75; x is the comparison's level and S the standard's.
///   weber  Phi(z75 (x - S) / (w (S + c))): the JND is w (S + c), Weber's law with an intercept
///   power  Phi(z75 (x - S) / (w S^a)): the JND is w S^a
///   threshold_line      F(slope (x1 - t)), t = a + b x2, x1 and x2 on their scales
///   threshold_parabola  the same with t = a + b x2 + c x2^2
///   cues   Phi((x - S - (w - 1/2) D) / s): w weighs a conflict D of two cues
enum class FieldForm { weber, power, threshold_line, threshold_parabola, cues };

/// "weber", ...
const char* to_string(FieldForm form);
/// The form's own parameters, in their order: "w", "c". Rates are not among them.
std::vector<std::string> parameter_names(FieldForm form);
/// Whether a success is that the comparison was chosen: a random answer then moves both ends of the
/// function alike, p = lapse + (1 - 2 lapse) F. Otherwise p = guess + (1 - guess - lapse) F.
bool has_two_lapses(FieldForm form);

/// A form, and the dimensions that its numbers are.
struct FieldFunction {
  FieldForm form = FieldForm::weber;
  /// threshold forms: F as in PsychometricFunction; weibull: x1 has a logarithmic scale. Others:
  /// normal.
  PsychometricShape shape = PsychometricShape::normal;
  Easier easier = Easier::higher;  ///< lower: of x - S or x1 - t the negative
  std::size_t x = 1;               ///< dimension x; threshold forms: x1
  std::size_t other = 0;           ///< S; threshold forms: x2
  std::size_t conflict = 2;        ///< cues: D
  LevelScale x_scale = LevelScale::linear, other_scale = LevelScale::linear;  ///< threshold forms

  bool operator==(const FieldFunction&) const = default;
};

/// The dimension over which the form's location changes: S, x2 or D.
std::size_t place_dimension(const FieldFunction& function);
/// The form's location where that dimension has a value: JND, threshold on the scale of x1, shift.
double field_location(const FieldFunction& function, const std::vector<double>& parameters,
                      double at);
/// The parameter that is no part of the location: of threshold forms the slope, of cues s; none:
/// nullopt.
std::optional<std::size_t> width_parameter(FieldForm form);
/// F at a point, whatever the location there. \param width  value of that parameter
double field_share_at(const FieldFunction& function, const LevelPoint& point, double location,
                      double width);

/// F, without guess and lapse, at a point. \param parameters  as parameter_names
double field_share(const FieldFunction& function, const std::vector<double>& parameters,
                   const LevelPoint& point);
/// The probability of a success. \param parameters  the form's, then guess (unless the form has two
/// lapses) and lapse
double field_success(const FieldFunction& function, const std::vector<double>& parameters,
                     const LevelPoint& point);
/// The JND at a standard, in its unit. \pre weber or power
double field_jnd(FieldForm form, const std::vector<double>& parameters, double standard);

}  // namespace palpate::protocols
