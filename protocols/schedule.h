#pragma once

#include <stdexcept>
#include <vector>

#include "protocols/protocol.h"

namespace palpate {

/// One scheduled presentation. Numbers count from 1; `trial` counts within the session.
struct Trial {
  int session = 1, block = 1, trial = 1;
  RendererKind renderer = RendererKind::point;
  int stimulus = 0;  ///< index into Protocol::stimuli
  Quat orientation{1, 0, 0, 0};
  bool practice = false;
};

/// The constraint on the order of trials cannot be met; what() says why and what would help.
class ScheduleError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The trials of participant number 1, 2, ... in order. Depends on the protocol's seed and the
/// number alone. \throws ScheduleError where the constraints have no solution.
std::vector<Trial> schedule(const Protocol& protocol, int participant_number);

}  // namespace palpate
