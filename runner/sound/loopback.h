#pragma once
// Measures how late contacts are heard: an output's cable leads back into an input.

#include <cstddef>
#include <string>

#include "runner/servo/heard_tick.h"
#include "runner/sound/player.h"
#include "runner/sound/sound_output.h"

namespace palpate::runner::sound {

/// s, from the tick of a contact to its sound at the input, whose own delay is part of it.
struct LoopbackTiming {
  int clicks = 0;  ///< played
  int missed = 0;  ///< of them not heard
  double median = 0, p99 = 0;
};

/// Makes contacts, each in another phase of the output's blocks. Takes about 0.2 s each.
/// \param player  with `ticks`, and nothing else to be heard. \throws SoundError
LoopbackTiming measure_loopback(SoundPlayer& player, servo::HeardTicks& ticks, SoundInput& input,
                                int clicks);

}  // namespace palpate::runner::sound
