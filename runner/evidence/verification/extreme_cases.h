#pragma once
// Extreme geometry and extreme motions: named cases, each with a measure and its limit. Tests run
// them, `palpate accuracy` lists them. For checks, not for the servo.

#include <span>
#include <string>

#include "rendering/renderer.h"

namespace palpate::runner::evidence {

struct ExtremeResult {
  bool passed = false;
  double worst = 0;         ///< the measure, in the case's unit
  double limit = 0;         ///< largest allowed
  std::uint64_t ticks = 0;  ///< compared with the reference
  std::uint64_t in_contact = 0;
  std::string detail;  ///< the error, with numbers; empty if it passed
};

struct ExtremeCase {
  const char* name;     ///< "sliver"; letters, digits and -
  const char* title;    ///< the case in one line
  const char* measure;  ///< meaning of `worst`, with its unit
  ExtremeResult (*run)(const rendering::Renderer& renderer);
};

/// All cases. Each takes well below a second, except "million-triangles": some seconds, mostly to
/// build the mesh.
std::span<const ExtremeCase> extreme_cases();

}  // namespace palpate::runner::evidence
