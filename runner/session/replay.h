#pragma once
// Renders a recorded trial again, tick by tick, and compares the forces with the record.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "data/record.h"
#include "data/store/store.h"
#include "protocols/protocol.h"
#include "runner/display/seen.h"
#include "runner/servo/device.h"
#include "runner/servo/sample.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/shapes.h"
#include "stimuli/vec.h"

namespace palpate::runner::session {

/// A device that plays a recorded trial back to the servo: recorded poses at the recorded times.
/// Device and clock in one: each tick is one recorded period after the last. Its readings are in
/// the virtual frame, so the servo needs no workspace map. `samples` must outlive it. After the
/// last sample the device is lost.
class ReplayDevice final : public servo::Device, public servo::Clock {
 public:
  /// \param rate  Hz, for samples whose period is not on record
  ReplayDevice(std::span<const data::SampleRecord> samples, double rate);

  const servo::DeviceCapabilities& capabilities() const override { return capabilities_; }
  servo::DeviceReading read() noexcept override;
  void write(const Vec3&, const Vec3&) noexcept override {}  // forces are discarded

  std::int64_t now_ns() noexcept override { return now_ns_; }
  void wait_until(std::int64_t when_ns) noexcept override;

 private:
  std::span<const data::SampleRecord> samples_;
  std::size_t next_ = 0;
  std::int64_t nominal_ns_, now_ns_;
  servo::DeviceCapabilities capabilities_;
};

}  // namespace palpate::runner::session

namespace palpate::runner {
class StimulusLibrary;
}  // namespace palpate::runner

namespace palpate::runner::session {

// A trial of a database with all data for rendering it again: its record, its protocol and the
// materials as its device showed them.

struct RecordedTrial {
  data::StoredTrial stored;
  protocols::Protocol protocol;  ///< materials as limited to the device of its run
  bool limited = false;          ///< some materials were limited
};

/// The completed attempt at a trial.
/// \param protocol     the protocol's name, where the code is enrolled in several; empty: any
/// \param mesh_folder  folder of the mesh files, for an old database that does not contain them
/// \throws StoreRefused: the trial is missing, is in several protocols, has no samples, or its
/// record and protocol disagree; InputError, MeshError: the stored protocol cannot be read
RecordedTrial load_recorded_trial(data::Store& store, const data::TrialName& name,
                                  const std::string& protocol, const std::string& mesh_folder);

/// The protocol that a trial was shown with, its materials limited as its device showed them.
/// \param limited  set if any were limited
/// \throws StoreRefused, InputError, MeshError: the stored protocol cannot be read
protocols::Protocol protocol_as_shown(data::Store& store, const data::StoredTrial& trial,
                                      const std::string& mesh_folder, bool& limited);

/// "P03/1/12"
std::string to_string(const data::TrialName& name);

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

// Comparison of a recorded trial with the present renderers along its path.

/// One renderer's forces along the path.
struct ForceSummary {
  std::string renderer;
  double time_in_contact = 0;           ///< fraction of the ticks
  std::optional<double> first_contact;  ///< s from time zero; none: no contact
  double rms_force = 0, max_force = 0;  ///< N
  double max_depth = 0;                 ///< m, penetration
};

struct RenderedForce {
  Vec3 force, torque;  ///< N, N m, on the hand
  double depth = 0;    ///< m
};

struct ReplayedTick {
  double time = 0;           ///< s from the interval's time zero
  std::size_t interval = 1;  ///< from 1
  const data::SampleRecord* recorded;
  RenderedForce again;  ///< by the recorded renderer
  RenderedForce other;  ///< by the other one, if requested
};

/// An interval as replayed. A trial of version 1 has one.
struct ReplayedInterval {
  std::string stimulus, renderer;  ///< as recorded; no stimulus: no object
  std::optional<double> level = std::nullopt;
  bool standard = false;
  std::size_t ticks = 0, equal_ticks = 0;
};

struct ReplayComparison {
  std::size_t equal_ticks = 0;                    ///< to the bit
  std::optional<std::uint32_t> first_difference;  ///< tick
  std::size_t differing_interval = 1;             ///< its interval
  bool periods_known = true;  ///< the record holds the ticks' periods, on which damping depends
  ForceSummary recorded;
  std::optional<ForceSummary> other;
  double rms_difference = 0, max_difference = 0;  ///< N, of the two renderers' forces
  std::vector<ReplayedTick> ticks;                ///< all, in order
  std::vector<ReplayedInterval> intervals;        ///< all, in order
};

/// \param record         with samples; must outlive the result
/// \param compare_other  whether to run the other renderer along the same path
/// \throws std::invalid_argument where protocol and record do not agree
ReplayComparison compare_with_record(const protocols::Protocol& protocol,
                                     const data::TrialRecord& record, bool compare_other);

}  // namespace palpate::runner::session
