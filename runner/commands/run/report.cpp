#include "runner/commands/run/report.h"

#include <cstdio>
#include <string>

#include "data/base/text.h"

namespace palpate::runner {

void print_participant(const data::Participant& participant, int session, int sessions,
                       bool simulated) {
  std::printf("participant %s has number %d; session %d of %d\n", participant.code.c_str(),
              participant.number, session, sessions);
  std::fflush(stdout);
  if (participant.enrolled_number != participant.number)
    std::fprintf(stderr,
                 "renumbered when databases were merged: the trials are those of number %d\n",
                 participant.enrolled_number);
  if (participant.id == 0)
    std::fprintf(
        stderr, "the participant is enrolled, and the number taken, when the first trial begins\n");
  if (simulated) std::fprintf(stderr, "SIMULATED device: the data are labelled so\n");
}

void print_servo_health(const ServoHealth& health, double elapsed) {
  std::fprintf(stderr,
               "servo: %llu ticks in %.3f s, %llu missed, longest period %.2f ms, lateness p99.9 "
               "%.0f us\n",
               static_cast<unsigned long long>(health.ticks()), elapsed,
               static_cast<unsigned long long>(health.missed_ticks()),
               static_cast<double>(health.longest_period_ns()) * 1e-6,
               static_cast<double>(health.lateness().quantile(0.999)) * 1e-3);
}

void print_outcome(const LiveStation& station, const data::Participant& who,
                   const LiveSession::Outcome& outcome) {
  const std::string number = who.id == 0 ? "not enrolled" : "number " + std::to_string(who.number);
  std::printf("%s, participant %s (%s), session %d: %zu of %zu trials on record; %s\n",
              station.protocol.name.c_str(), who.code.c_str(), number.c_str(),
              station.record.session(), outcome.recorded, outcome.trials,
              data::to_string(outcome.end));
  for (const std::string& note : outcome.unkept)
    std::fprintf(stderr, "not on record, as nobody was enrolled: %s\n",
                 printable_lines(note).c_str());
  if (!outcome.reason.empty())
    std::fprintf(stderr, "%s\n", printable_lines(outcome.reason).c_str());
  if (outcome.end == data::RunEnd::paused || outcome.end == data::RunEnd::aborted)
    std::fprintf(stderr, "the same command resumes from here\n");
  if (station.markers.dropped() > 0)
    std::fprintf(stderr, "%llu markers were not taken by their receivers\n",
                 static_cast<unsigned long long>(station.markers.dropped()));
}

}  // namespace palpate::runner
