#pragma once
// Which class of lines (shape_lines.h) measures to which kind of shape.

#include <type_traits>
#include <utility>

#include "runner/participants/shape_lines.h"
#include "stimuli/object_spec.h"

namespace palpate::runner {

/// Calls visit(std::type_identity<ShapeLine>()) with the class of the kind.
template <class Visit>
void visit_line_class(stimuli::ShapeKind kind, Visit&& visit) {
  switch (kind) {
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
    case stimuli::ShapeKind::mesh:
    case stimuli::ShapeKind::compound:
      break;  // ShapeHypotheses refuses them
  }
}

}  // namespace palpate::runner
