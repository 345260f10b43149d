#pragma once
// What `palpate run` prints before and after a session.

#include "runner/commands/run/settings.h"
#include "runner/session/live_session.h"
#include "runner/session/station.h"

namespace palpate::runner {

/// \param simulated  by its device
void print_participant(const data::Participant& participant, int session, int sessions,
                       bool simulated);
/// \param elapsed  s, since the servo thread began
void print_servo_health(const ServoHealth& health, double elapsed);
/// \param who  as the store holds them now
void print_outcome(const LiveStation& station, const data::Participant& who,
                   const LiveSession::Outcome& outcome);

}  // namespace palpate::runner
