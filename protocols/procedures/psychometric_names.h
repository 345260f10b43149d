#pragma once

#include "protocols/procedures/psychometric.h"

namespace palpate::protocols {

const char* to_string(LevelScale scale);         ///< as protocols say it: "linear", "log", "db"
const char* to_string(PsychometricShape shape);  ///< "logistic", ...

}  // namespace palpate::protocols
