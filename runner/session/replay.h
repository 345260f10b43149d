#pragma once
// Renders a recorded trial again, tick by tick.

#include <functional>

#include "data/record.h"
#include "protocols/protocol.h"
#include "runner/servo/sample.h"

namespace palpate::runner {

/// Puts a recorded trial through the servo and a renderer again.
/// \param recorded  with samples
/// \param renderer  the recorded one gives the recorded forces, to the bit; the other what it would
///                  have shown along the same path
/// \param visit     each recorded tick and what comes of it now, in order
/// \throws std::invalid_argument where the protocol has no such stimulus
void replay(const protocols::Protocol& protocol, const data::TrialRecord& recorded,
            protocols::RendererKind renderer,
            const std::function<void(const data::SampleRecord&, const Sample&)>& visit);

/// Whether a tick's rendering is what is on record, bit by bit (a zero's sign aside, which the
/// store does not keep): force, torque, depth, contacts, type of the deepest, the renderer's fault
/// bits.
bool equals_record(const data::SampleRecord& recorded, const Sample& again);

}  // namespace palpate::runner
