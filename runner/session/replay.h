#pragma once
// Renders a recorded trial again, tick by tick.

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "data/record.h"
#include "protocols/protocol.h"
#include "rendering/scene_motion.h"
#include "runner/display/seen.h"
#include "runner/servo/sample.h"
#include "stimuli/shapes.h"

namespace palpate::runner {
class StimulusLibrary;
}  // namespace palpate::runner

namespace palpate::runner::session {

/// The object of each interval, placed in the world as at its beginning; nullopt: no object.
/// \throws std::invalid_argument where protocol and record do not agree
std::vector<std::optional<stimuli::ObjectSpec>> shown_objects(const protocols::Protocol& protocol,
                                                              const data::TrialRecord& recorded);

/// Whether the stimulus of an interval gives forces.
bool is_felt(const protocols::Protocol& protocol, const data::IntervalRecord& recorded);

/// The view of each interval; null: nothing was seen.
/// \throws std::invalid_argument where protocol and record do not agree
std::vector<std::shared_ptr<const display::SeenTrial>> shown_sights(
    const protocols::Protocol& protocol, const data::TrialRecord& recorded);

/// The result of a tick.
struct ReplayedSample : servo::Sample {
  std::optional<rendering::BodyPose> body;  ///< of a moving stimulus
};

/// Runs a recorded trial through the servo and a renderer again, interval by interval.
/// \param recorded  with samples
/// \param other     false: the recorded renderer, which reproduces the recorded forces to the bit;
/// true: the other renderer, along the same path
/// \param visit     gets the interval's number from 0, each recorded tick and its new result
/// \param library   of the protocol, built once for many trials; null: builds what it needs
/// \throws std::invalid_argument where protocol and record do not agree
void replay(
    const protocols::Protocol& protocol, const data::TrialRecord& recorded, bool other,
    const std::function<void(std::size_t, const data::SampleRecord&, const ReplayedSample&)>& visit,
    const StimulusLibrary* library = nullptr);

/// Whether a tick's rendering equals the record, bit by bit (except a zero's sign, which the store
/// does not keep): force, torque, depth, contacts, type of the deepest, the renderer's fault bits;
/// for a moving stimulus also its pose and velocity.
/// \param tick  one of the record's samples
bool equals_record(const data::TrialRecord& recorded, const data::SampleRecord& tick,
                   const ReplayedSample& again);

}  // namespace palpate::runner::session
