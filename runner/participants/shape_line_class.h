#pragma once
// Which class of lines (shape_lines.h, solid_line.h) measures to which stimulus.

#include <type_traits>
#include <utility>

#include "runner/participants/shape_lines.h"
#include "runner/participants/solid_line.h"
#include "stimuli/shapes.h"

namespace palpate::runner {

/// Calls visit(std::type_identity<ShapeLine>()) with the class of the stimulus.
template <class Visit>
void visit_line_class(const ShapeHypotheses::Shape& shape, Visit&& visit) {
  if (shape.field) {
    std::forward<Visit>(visit)(std::type_identity<SolidLine>());
    return;
  }
  switch (shape.kind) {
    case stimuli::ShapeKind::cone:
      std::forward<Visit>(visit)(std::type_identity<AxialLine<ConeProfile>>());
      break;
    case stimuli::ShapeKind::cylinder:
      std::forward<Visit>(visit)(std::type_identity<AxialLine<CylinderProfile>>());
      break;
    case stimuli::ShapeKind::cube:
      std::forward<Visit>(visit)(std::type_identity<CubeLine>());
      break;
    case stimuli::ShapeKind::sphere:
      std::forward<Visit>(visit)(std::type_identity<SphereLine>());
      break;
    case stimuli::ShapeKind::box:
    case stimuli::ShapeKind::mesh:
    case stimuli::ShapeKind::compound:
      break;  // have a field
  }
}

}  // namespace palpate::runner
