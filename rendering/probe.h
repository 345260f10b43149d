#pragma once

#include "stimuli/vec.h"

namespace palpate::rendering {

/// The virtual probe as the device reports it: a segment from tip to tail. World frame, m.
struct LineProbe {
  Vec3 tip, tail;
};

}  // namespace palpate::rendering
