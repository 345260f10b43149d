#include "protocols/procedures/psychometric_names.h"

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

}  // namespace palpate::protocols
