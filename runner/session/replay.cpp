#include "runner/session/replay.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include "protocols/groups.h"
#include "protocols/parse.h"
#include "protocols/session_plan.h"
#include "runner/participants/seen_trial.h"
#include "runner/scene_builder.h"
#include "runner/servo/servo.h"
#include "runner/session/device_check.h"
#include "runner/session/run_record.h"
#include "runner/session/session_scenes.h"
#include "stimuli/shapes.h"

namespace palpate::runner::session {
namespace {

Vec3 vec(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

/// Whether the protocol matches by name or by the first digits of its SHA-256.
bool is_named(const data::StoredTrial& trial, const std::string& protocol) {
  constexpr std::size_t kDigits = 6;
  return protocol.empty() || trial.protocol_name == protocol ||
         (protocol.size() >= kDigits && trial.protocol_sha256.starts_with(protocol));
}

/// Names the trials on record in place of a missing one: "; of P03 there are 1/1 to 1/304".
/// \param protocol  the one that is wanted
std::string what_there_is(data::Store& store, const data::TrialName& name,
                          const std::string& protocol) {
  constexpr std::size_t kMostNamed = 8;
  std::map<int, std::pair<int, int>> trials;  // the first and the last of each session
  std::set<std::string> codes;
  store.for_each_trial([&](const data::StoredTrial& trial) {
    if (!is_named(trial, protocol)) return;
    codes.insert(trial.participant.code);
    if (trial.participant.code != name.code) return;
    const int number = trial.record.trial;
    auto& [first, last] = trials.try_emplace(trial.record.session, number, number).first->second;
    first = std::min(first, number);
    last = std::max(last, number);
  });
  if (codes.empty()) return "; it has no finished trial";
  std::string text;
  if (trials.empty()) {
    std::size_t named = 0;
    for (const std::string& code : codes) {
      if (named++ == kMostNamed) return "; finished trials are of" + text + " and others";
      text += (text.empty() ? " " : ", ") + code;
    }
    return "; finished trials are of" + text;
  }
  for (const auto& [session, range] : trials) {
    text += (text.empty() ? " " : ", ") + to_string({name.code, session, range.first});
    if (range.second > range.first) text += " to " + std::to_string(range.second);
  }
  return "; there are" + text;
}

data::StoredTrial find_trial(data::Store& store, const data::TrialName& name,
                             const std::string& protocol) {
  std::optional<data::StoredTrial> found;
  bool cut_off = false;
  std::string protocols;
  for (data::StoredTrial& trial : store.attempts(name)) {
    if (!is_named(trial, protocol)) continue;
    if (!trial.cut_off_reason.empty()) {
      cut_off = true;
      continue;
    }
    protocols += (protocols.empty() ? "" : ", ") + trial.protocol_name + " " +
                 trial.protocol_sha256.substr(0, 12);
    if (found) {
      throw data::StoreRefused(
          "--trial " + to_string(name) + ": there is one in each of several protocols (" +
          protocols + "); say which with --protocol and its name or the beginning of its checksum");
    }
    found = std::move(trial);
  }
  const std::string place = store.path() + ": " + to_string(name);
  if (!found) {
    throw data::StoreRefused(
        place + (cut_off
                     ? " was cut off before an answer: nothing of it was kept to replay"
                     : " is not on record" + (protocol.empty() ? "" : " in protocol " + protocol) +
                           what_there_is(store, name, protocol)));
  }
  if (found->record.samples.empty()) {
    throw data::StoreRefused(place +
                             " was recorded without servo samples; a protocol with \"samples\": "
                             "true keeps them");
  }
  return std::move(*found);
}

/// The text that was shown, where a run used another text that differs in words only.
protocols::Protocol stored_protocol(data::Store& store, const data::StoredTrial& trial,
                                    const std::string& mesh_folder) {
  std::string text;
  for (const data::ProtocolInfo& info : store.protocols()) {
    if (info.sha256 == trial.protocol_sha256) text = info.text;
  }
  protocols::StoredFiles files;
  for (data::ProtocolFile& file : store.files(trial.protocol_sha256))
    files.emplace(file.name, std::move(file.bytes));
  const std::filesystem::path place =
      std::filesystem::path(mesh_folder) / (trial.protocol_name + ".json");
  const protocols::Protocol all = protocols::parse_protocol_text(text, place.string(), files);
  return protocols::protocol_of(all, trial.participant.enrolled_number);
}

/// Scales the materials down to the limits of the device of the trial's run. True: there were any
/// limits.
bool limit_as_recorded(protocols::Protocol& protocol, data::Store& store,
                       const data::StoredTrial& trial) {
  for (const data::StoredNote& note : store.notes()) {
    const data::ClockStamp &noted = note.run_clock, &shown = trial.run.clock;
    if (note.participant.id != trial.participant.id || note.session != trial.record.session ||
        noted.utc_ns != shown.utc_ns || noted.monotonic_ns != shown.monotonic_ns) {
      continue;
    }
    try {
      // A simulated session that was resumed repeats the same event.
      if (session::limit_as_recorded(protocol, note.text)) return true;
    } catch (const std::invalid_argument& error) {
      throw data::StoreRefused(store.path() + ": " + error.what());
    }
  }
  return false;
}

using protocols::RendererKind;

/// A renderer, and its scene for the recorded trial.
struct ShownInterval {
  RendererKind renderer;
  rendering::Scene scene;
};

RendererKind kind_of(const std::string& name, bool other) {
  const bool ray = (name == protocols::to_string(RendererKind::ray)) != other;
  return ray ? RendererKind::ray : RendererKind::point;
}

int stimulus_named(const protocols::Protocol& protocol, const std::string& name) {
  for (std::size_t i = 0; i < protocol.stimuli.size(); ++i) {
    if (protocol.stimuli[i].name == name) return static_cast<int>(i);
  }
  throw std::invalid_argument("the protocol has no stimulus named " + name);
}

protocols::Trial trial_of(const protocols::Protocol& protocol, const data::TrialRecord& recorded) {
  protocols::Trial trial;
  trial.session = recorded.session;
  trial.block = recorded.block;
  trial.trial = recorded.trial;
  trial.practice = recorded.practice;
  const auto& q = recorded.orientation_wxyz;
  trial.orientation = Quat(q[0], q[1], q[2], q[3]);
  trial.stimulus = stimulus_named(protocol, recorded.shape);
  const auto block =
      std::ranges::find(protocol.blocks, recorded.task.block_name, &protocols::TaskBlock::name);
  if (block == protocol.blocks.end())
    throw std::invalid_argument("the protocol has no block named " + recorded.task.block_name);
  trial.task_block = static_cast<int>(block - protocol.blocks.begin());
  return trial;
}

protocols::Interval interval_of(const protocols::Protocol& protocol,
                                const data::IntervalRecord& recorded, bool other) {
  protocols::Interval one;
  one.stimulus = recorded.stimulus.empty() ? -1 : stimulus_named(protocol, recorded.stimulus);
  one.renderer = kind_of(recorded.renderer, other);
  one.level = recorded.level;
  one.standard = recorded.standard;
  return one;
}

/// Of a level of several dimensions, the point takes the place of the recorded level.
void put_point(const protocols::Protocol& protocol, const protocols::Trial& trial,
               const data::TaskRecord& task, protocols::Interval& interval) {
  const protocols::TaskBlock& block = protocols::block_of(protocol, trial);
  if (block.dimensions.empty()) return;
  interval.level.reset();
  if (task.dimensions.size() != block.dimensions.size() || interval.stimulus < 0) return;
  for (const auto& [name, value] : task.dimensions) interval.point.push_back(value);
}

ReplayedInterval interval_of(const data::TrialRecord& record, std::size_t number) {
  const data::IntervalRecord interval = data::intervals_of(record)[number];
  return {interval.stimulus, interval.renderer, interval.level, interval.standard};
}

std::vector<ShownInterval> scenes_of(const protocols::Protocol& protocol,
                                     const data::TrialRecord& recorded, bool other,
                                     const StimulusLibrary* library) {
  const protocols::Trial trial = trial_of(protocol, recorded);
  std::vector<ShownInterval> shown;
  SessionScenes scenes(protocol, library);
  for (const data::IntervalRecord& interval : data::intervals_of(recorded)) {
    protocols::Interval one = interval_of(protocol, interval, other);
    put_point(protocol, trial, recorded.task, one);
    shown.push_back({one.renderer, scenes.scene(trial, one)});
  }
  return shown;
}

bool equal(const std::array<double, 3>& recorded, const Vec3& again) {
  return recorded[0] == again.x && recorded[1] == again.y && recorded[2] == again.z;
}

double length(const std::array<double, 3>& v) { return std::hypot(v[0], v[1], v[2]); }

/// Takes a renderer's forces tick by tick.
class Summarizer {
 public:
  explicit Summarizer(std::string renderer) { sum_.renderer = std::move(renderer); }

  void add(double time, double force, double depth, int contacts) {
    if (contacts > 0 && !sum_.first_contact) sum_.first_contact = time;
    in_contact_ += contacts > 0;
    square_sum_ += force * force;
    sum_.max_force = std::max(sum_.max_force, force);
    sum_.max_depth = std::max(sum_.max_depth, depth);
  }
  ForceSummary over(std::size_t ticks) {
    sum_.time_in_contact = static_cast<double>(in_contact_) / static_cast<double>(ticks);
    sum_.rms_force = std::sqrt(square_sum_ / static_cast<double>(ticks));
    return sum_;
  }

 private:
  ForceSummary sum_;
  std::size_t in_contact_ = 0;
  double square_sum_ = 0;  // N^2
};

std::string other_renderer(const std::string& renderer, bool other) {
  const char* const ray = protocols::to_string(RendererKind::ray);
  const char* const point = protocols::to_string(RendererKind::point);
  return (renderer == ray) != other ? ray : point;
}

RenderedForce rendered(const servo::Sample& sample) {
  const rendering::Rendering& r = sample.rendering;
  return {r.force, r.torque, r.deepest.depth};
}

/// The renderers of the intervals: "point", "ray" or, in order of appearance, "point, ray".
std::string renderers_of(const data::TrialRecord& record, bool other) {
  std::string all;
  for (const data::IntervalRecord& interval : data::intervals_of(record)) {
    const std::string one = other_renderer(interval.renderer, other);
    if (all.find(one) == std::string::npos) all += (all.empty() ? "" : ", ") + one;
  }
  return all;
}

ForceSummary render_again(const protocols::Protocol& protocol, const data::TrialRecord& record,
                          ReplayComparison& out) {
  Summarizer shown(renderers_of(record, false));
  double time = 0;
  out.ticks.reserve(record.samples.size());
  replay(protocol, record, false,
         [&](std::size_t interval, const data::SampleRecord& was, const ReplayedSample& is) {
           if (interval == out.intervals.size()) {
             out.intervals.push_back(interval_of(record, interval));
             time = 0;
           } else {
             time += static_cast<double>(is.period_ns) * 1e-9;
           }
           if (was.period_ns <= 0) out.periods_known = false;
           ReplayedInterval& now = out.intervals.back();
           ++now.ticks;
           if (equals_record(record, was, is)) {
             ++out.equal_ticks;
             ++now.equal_ticks;
           } else if (!out.first_difference) {
             out.first_difference = was.tick;
             out.differing_interval = interval + 1;
           }
           shown.add(time, length(was.force), was.depth, was.contacts);
           out.ticks.push_back({time, interval + 1, &was, rendered(is), {}});
         });
  return shown.over(out.ticks.size());
}

ForceSummary render_other(const protocols::Protocol& protocol, const data::TrialRecord& record,
                          ReplayComparison& out) {
  Summarizer shown(renderers_of(record, true));
  double square_sum = 0;  // N^2
  auto tick = out.ticks.begin();
  replay(
      protocol, record, true,
      [&](std::size_t, const data::SampleRecord& was, const servo::Sample& is) {
        const rendering::Rendering& r = is.rendering;
        shown.add(tick->time, glm::length(r.force), r.deepest.depth, static_cast<int>(r.contacts));
        const double apart = glm::length(r.force - Vec3(was.force[0], was.force[1], was.force[2]));
        square_sum += apart * apart;
        out.max_difference = std::max(out.max_difference, apart);
        tick->other = rendered(is);
        ++tick;
      });
  out.rms_difference = std::sqrt(square_sum / static_cast<double>(out.ticks.size()));
  return shown.over(out.ticks.size());
}

/// The samples of each interval of a trial, in order; the record begins with tick 0 in each. A
/// trial of version 1 has one interval.
std::vector<std::span<const data::SampleRecord>> samples_of_intervals(
    const data::TrialRecord& recorded) {
  std::vector<std::span<const data::SampleRecord>> intervals;
  const std::span<const data::SampleRecord> all(recorded.samples);
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= all.size(); ++i) {
    if (i < all.size() && all[i].tick > all[i - 1].tick) continue;
    intervals.push_back(all.subspan(begin, i - begin));
    begin = i;
  }
  return intervals;
}

}  // namespace

ReplayDevice::ReplayDevice(std::span<const data::SampleRecord> samples, double rate)
    : samples_(samples), nominal_ns_(std::llround(1e9 / rate)), now_ns_(nominal_ns_) {
  capabilities_.name = "replay";
  capabilities_.sensed_freedom = capabilities_.actuated_freedom = 5;
  // Replay compares the rendered force, without the limits of the recorded device.
  capabilities_.max_force = capabilities_.max_stiffness = std::numeric_limits<double>::max();
  capabilities_.max_rate = rate;
}

servo::DeviceReading ReplayDevice::read() noexcept {
  servo::DeviceReading reading;
  if (next_ >= samples_.size()) {
    reading.lost = true;
    return reading;
  }
  const data::SampleRecord& sample = samples_[next_++];
  reading.stylus = {vec(sample.tip), vec(sample.tail)};
  reading.buttons = sample.buttons;
  return reading;
}

void ReplayDevice::wait_until(std::int64_t when_ns) noexcept {
  const bool known = next_ < samples_.size() && samples_[next_].period_ns > 0;
  // The period before the first tick of a trial is not on record.
  if (known && next_ > 0) {
    now_ns_ += samples_[next_].period_ns;
  } else {
    now_ns_ = when_ns > now_ns_ ? when_ns : now_ns_;
  }
}

protocols::Protocol protocol_as_shown(data::Store& store, const data::StoredTrial& trial,
                                      const std::string& mesh_folder, bool& limited) {
  protocols::Protocol protocol = stored_protocol(store, trial, mesh_folder);
  limited = limit_as_recorded(protocol, store, trial);
  return protocol;
}

std::string to_string(const data::TrialName& name) {
  return name.code + "/" + std::to_string(name.session) + "/" + std::to_string(name.trial);
}

RecordedTrial load_recorded_trial(data::Store& store, const data::TrialName& name,
                                  const std::string& protocol, const std::string& mesh_folder) {
  RecordedTrial trial;
  trial.stored = find_trial(store, name, protocol);
  trial.protocol = stored_protocol(store, trial.stored, mesh_folder);
  const std::string& shape = trial.stored.record.shape;
  const auto& stimuli = trial.protocol.stimuli;
  if (std::none_of(stimuli.begin(), stimuli.end(),
                   [&](const auto& stimulus) { return stimulus.name == shape; })) {
    throw data::StoreRefused(store.path() + ": trial " + to_string(name) + " shows '" + shape +
                             "', which its protocol " + trial.stored.protocol_name +
                             " does not have; expected one of its stimuli");
  }
  trial.limited = limit_as_recorded(trial.protocol, store, trial.stored);
  return trial;
}

std::vector<std::optional<stimuli::ObjectSpec>> shown_objects(const protocols::Protocol& protocol,
                                                              const data::TrialRecord& recorded) {
  const protocols::Trial trial = trial_of(protocol, recorded);
  std::vector<std::optional<stimuli::ObjectSpec>> shown;
  for (const data::IntervalRecord& recorded_one : data::intervals_of(recorded)) {
    const protocols::Interval one = interval_of(protocol, recorded_one, false);
    shown.push_back(one.stimulus < 0 ? std::nullopt
                                     : std::optional(shown_object(protocol, trial, one)));
  }
  return shown;
}

bool is_felt(const protocols::Protocol& protocol, const data::IntervalRecord& recorded) {
  const int stimulus = interval_of(protocol, recorded, false).stimulus;
  return stimulus >= 0 && protocol.stimuli[static_cast<std::size_t>(stimulus)].felt;
}

std::vector<std::shared_ptr<const display::SeenTrial>> shown_sights(
    const protocols::Protocol& protocol, const data::TrialRecord& recorded) {
  const protocols::Trial trial = trial_of(protocol, recorded);
  std::vector<std::shared_ptr<const display::SeenTrial>> seen;
  for (const data::IntervalRecord& recorded_one : data::intervals_of(recorded))
    seen.push_back(
        participants::seen_trial_of(protocol, trial, interval_of(protocol, recorded_one, false)));
  return seen;
}

void replay(
    const protocols::Protocol& protocol, const data::TrialRecord& recorded, bool other,
    const std::function<void(std::size_t, const data::SampleRecord&, const ReplayedSample&)>& visit,
    const StimulusLibrary* library) {
  const std::vector<ShownInterval> shown = scenes_of(protocol, recorded, other, library);
  const auto intervals = samples_of_intervals(recorded);
  // An interval whose time was over before it began has no samples.
  const std::size_t least = shown.size() - (recorded.timed_out ? 1 : 0);
  if (intervals.size() > shown.size() || intervals.size() < least)
    throw std::invalid_argument("samples of " + std::to_string(shown.size()) +
                                " intervals are expected, found " +
                                std::to_string(intervals.size()));
  servo::ForceLimits limits;
  limits.max_force = limits.max_change = std::numeric_limits<double>::max();
  // The record begins with the stylus at rest in the home zone.
  constexpr servo::HomeZone kAnywhere{0, 0};
  // For an extended probe the record has the virtual stylus; the forces at the hand follow from it.
  const std::optional<rendering::Reach> reach = workspace_of(protocol).reach;
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    ReplayDevice device(intervals[i], protocol.servo_rate);
    servo::Servo servo(device, device, protocol.servo_rate, limits);
    servo.prepare(shown[i].scene, renderer_for(shown[i].renderer), kAnywhere);
    for (const data::SampleRecord& sample : intervals[i]) {
      servo.hold_steps((sample.faults & rendering::render_fault::kSoftLate) != 0);
      ReplayedSample again;
      static_cast<servo::Sample&>(again) = servo.tick();
      if (again.bodies > 0) again.body = servo.bodies().front();
      if (reach) again.rendering = rendering::felt(*reach, again.rendering);
      visit(i, sample, again);
    }
    servo.stop();
  }
}

bool equals_record(const data::TrialRecord& recorded, const data::SampleRecord& tick,
                   const ReplayedSample& again) {
  const rendering::Rendering& r = again.rendering;
  const std::optional<data::BodyRecord> body = data::body_of(recorded, tick);
  if (body && !(again.body && same_body(*body, body_record(*again.body)))) return false;
  return equal(tick.force, r.force) && equal(tick.torque, r.torque) &&
         tick.depth == r.deepest.depth && tick.contacts == servo::recorded_contacts(r.contacts) &&
         tick.contact_type == static_cast<std::uint8_t>(r.deepest.type) &&
         (tick.faults & rendering::kAllRenderFaults) == (r.faults & rendering::kAllRenderFaults);
}

ReplayComparison compare_with_record(const protocols::Protocol& protocol,
                                     const data::TrialRecord& record, bool compare_other) {
  ReplayComparison out;
  out.recorded = render_again(protocol, record, out);
  if (compare_other) out.other = render_other(protocol, record, out);
  return out;
}

}  // namespace palpate::runner::session
