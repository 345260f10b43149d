#pragma once
// Psychometric functions: the probability of a success over the level of a stimulus.

#include "data/base/random.h"

namespace palpate::protocols {

/// How levels are spaced: as they are, by their log10, or in dB (20 log10).
enum class LevelScale { linear, log10, decibel };
enum class PsychometricShape { logistic, normal, weibull };
/// The levels that give more successes.
enum class Easier { higher, lower };

/// Place of a level on a scale; on a logarithmic one, level 0 is at -infinity.
double scale_position(LevelScale scale, double level);
/// The level at a place, to 12 significant digits: clean numbers, the same on every machine.
double level_at(LevelScale scale, double position);

/// p(level) = guess + (1 - guess - lapse) F(slope (x - t)), x and t being level and threshold on
/// the scale (with Easier::lower: t - x).
///   logistic  F(z) = 1 / (1 + exp(-z)), threshold at F = 0.5
///   normal    F(z) = Phi(z), threshold at F = 0.5; 1 / slope is the standard deviation
///   weibull   F = 1 - exp(-(level / threshold)^slope), threshold at F = 1 - 1/e; not on the linear
///             scale, and its slope is the exponent on both others
struct PsychometricFunction {
  PsychometricShape shape = PsychometricShape::logistic;
  LevelScale scale = LevelScale::linear;
  Easier easier = Easier::higher;
};

struct PsychometricParameters {
  double threshold = 0;  ///< a level, in its unit
  double slope = 1;      ///< > 0; per unit of the level, per log10 unit, per dB, or the exponent
  double guess = 0;      ///< share of successes without a stimulus
  double lapse = 0;      ///< share of failures at the easiest; guess + lapse < 1
};

/// F, without guess and lapse, at a distance from the threshold on the scale, positive towards the
/// easier levels.
double psychometric_share(const PsychometricFunction& function, double distance, double slope);
/// F at a level.
double psychometric_core(const PsychometricFunction& function, double level, double threshold,
                         double slope);
double psychometric_probability(const PsychometricFunction& function,
                                const PsychometricParameters& parameters, double level);
/// The level at which F (without guess and lapse) has a value, 0 < share < 1.
double psychometric_level(const PsychometricFunction& function,
                          const PsychometricParameters& parameters, double share);

/// A simulated participant who answers with the probability of a psychometric function.
struct PsychometricParticipant {
  PsychometricFunction function;
  PsychometricParameters parameters;

  bool succeeds(double level, Random& random) const {
    return random.unit() < psychometric_probability(function, parameters, level);
  }
};

const char* to_string(LevelScale scale);         ///< as in protocols: "linear", "log", "db"
const char* to_string(PsychometricShape shape);  ///< "logistic", ...

}  // namespace palpate::protocols
