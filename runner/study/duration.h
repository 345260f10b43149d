#pragma once
// How long a study takes.

#include "protocols/protocol.h"

namespace palpate::runner::study {

/// s, all sessions of a participant together, without breaks and pages.
struct Duration {
  double usual = 0;    ///< at a typical time for each stimulus felt
  double longest = 0;  ///< if every answer took until its limit
};
Duration duration_of(const protocols::Protocol& protocol);

}  // namespace palpate::runner::study
