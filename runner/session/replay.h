#pragma once
// Renders a recorded trial again, tick by tick.

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "data/record.h"
#include "protocols/protocol.h"
#include "runner/servo/sample.h"
#include "stimuli/shapes.h"

namespace palpate::runner {

class StimulusLibrary;

/// The samples of each interval of a trial, in order: what was recorded begins with tick 0 in each.
/// A trial of version 1 has one.
std::vector<std::span<const data::SampleRecord>> samples_of_intervals(
    const data::TrialRecord& recorded);

/// What each interval of a trial showed, as it stood in the world at its beginning; none: nothing.
/// \throws std::invalid_argument where protocol and record do not agree
std::vector<std::optional<stimuli::ObjectSpec>> shown_objects(const protocols::Protocol& protocol,
                                                              const data::TrialRecord& recorded);

/// What a tick has come to.
struct ReplayedSample : Sample {
  std::optional<rendering::BodyPose> body;  ///< of a stimulus that moves
};

/// Puts a recorded trial through the servo and a renderer again, interval by interval.
/// \param recorded  with samples
/// \param other     false: the recorded renderer, which gives the recorded forces, to the bit;
/// true:
///                  the other one, as it would have shown the same path
/// \param visit     number of the interval from 0, each recorded tick and what comes of it now
/// \throws std::invalid_argument where protocol and record do not agree
void replay(const protocols::Protocol& protocol, const data::TrialRecord& recorded, bool other,
            const std::function<void(std::size_t, const data::SampleRecord&,
                                     const ReplayedSample&)>& visit);

/// A trial of version 1 by its own renderer, as above, with stimuli that were built once for many.
/// \param library  of the protocol
void replay(const protocols::Protocol& protocol, const StimulusLibrary& library,
            const data::TrialRecord& recorded,
            const std::function<void(std::size_t, const data::SampleRecord&,
                                     const ReplayedSample&)>& visit);

/// Whether a tick's rendering is what is on record, bit by bit (a zero's sign aside, which the
/// store does not keep): force, torque, depth, contacts, type of the deepest, the renderer's fault
/// bits; of a stimulus that moves, where it is and how fast it goes.
/// \param tick  of the record's samples
bool equals_record(const data::TrialRecord& recorded, const data::SampleRecord& tick,
                   const ReplayedSample& again);

}  // namespace palpate::runner
