#include "data/export/exported_columns.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>

#include "data/base/json_text.h"
#include "data/export/column_values.h"
#include "data/export/delimited_row.h"
#include "data/store/store.h"

namespace palpate::data {
namespace {

const Column kParticipant{"participant_id", "Pseudonym of the participant"};
const Column kGroup{"group", "Group of the participant; missing: the protocol has no groups"};
const Column kSession{"session", "Session of the participant, from 1", "1"};
const Column kBlock{"block", "Block, from 1 through all sessions of the participant", "1"};
const Column kTrial{"trial", "Trial within the session, from 1", "1"};
const Column kAttempt{"attempt", "Number of the attempt: above 1 if earlier attempts were cut off",
                      "1"};
const Column kRenderer{"renderer",
                       "Rendering of the stylus",
                       "",
                       {{"point", "only its tip"}, {"ray", "tip and side, as force and torque"}}};
const Column kShape{"shape", "Name of the stimulus that was shown", "", {}, Column::Names::stimuli};
const Column kPractice{
    "practice",
    "Practice or warm-up",
    "",
    {{"0", "a trial that counts"}, {"1", "practice or warm-up, not to be analysed"}}};
const Column kDevice{"device", "Force-feedback device"};
const Column kSimulated{
    "simulated",
    "Person or simulated participant",
    "",
    {{"0", "a person"}, {"1", "SIMULATED: not a person, or not a real device"}}};
const Column kProtocol{"protocol_sha256", "SHA-256 of the protocol's text"};
const Column kProgramVersion{"program_version", "Version of palpate that recorded the trial"};
const Column kNumber{"participant_number",
                     "Orders the counterbalancing; two stations may have given the same one", "1"};
const Column kOrientation[] = {
    {"orientation_w", "Orientation of the stimulus, unit quaternion, w", "1"},
    {"orientation_x", "Orientation of the stimulus, unit quaternion, x", "1"},
    {"orientation_y", "Orientation of the stimulus, unit quaternion, y", "1"},
    {"orientation_z", "Orientation of the stimulus, unit quaternion, z", "1"},
};

std::vector<Column> make_trials() {
  std::vector<Column> columns = {
      kParticipant,
      kSession,
      kBlock,
      kTrial,
      kRenderer,
      kShape,
      {"response",
       "Name of the stimulus given as the answer; missing: no answer",
       "",
       {},
       Column::Names::stimuli},
      {"correct",
       "Whether response is shape",
       "",
       {{"0", "wrong, or no answer in time"}, {"1", "correct"}}},
      {"response_time",
       "From the first tick with forces on to the response; in a time-out, the limit. The latency "
       "of the response device is not subtracted",
       "s"},
      kOrientation[0],
      kOrientation[1],
      kOrientation[2],
      kOrientation[3],
      kPractice,
      {"timed_out",
       "Whether the time for an answer ran out",
       "",
       {{"0", "answered"}, {"1", "no answer in time"}}},
      {"first_contact_time",
       "From the first tick with forces on to the first contact; missing: no contact", "s"},
      {"onset_utc", "First tick with forces on, ISO 8601, UTC", "ISO 8601"},
      kDevice,
      kSimulated,
      {"missed_ticks", "Servo ticks that came too late", "1"},
      kAttempt,
      kProtocol,
      kProgramVersion,
      kNumber,
      {"started_inside",
       "Whether the stylus was inside an object when forces went on",
       "",
       {{"0", "outside"}, {"1", "inside: that object gave no force until the stylus had left it"}}},
      {"ticks", "Servo ticks of the trial", "1"},
      {"longest_period", "Longest time between two servo ticks", "s"},
      {"faults", "Fault bits of all ticks, or-ed; 0 for none", "1"},
      {"max_force", "Largest force on the hand", "N"},
      {"observer_sha256",
       "SHA-256 of the settings of a simulated participant; missing for a person"},
      {"before_contact",
       "Whether the answer came before the first contact",
       "",
       {{"0", "after it, or no answer"}, {"1", "before it: nothing had been felt"}}},
      {"response_device",
       "Device of the response; missing: not known",
       "",
       {{"keyboard", "keys, also of a numeric pad"},
        {"device buttons", "buttons of the force-feedback device"},
        {"simulated", "a SIMULATED participant"}}},
  };
  for (const MeasuredColumn& column : kMeasured) {
    if (*column.description) columns.push_back({column.name, column.description, column.unit});
  }
  return columns;
}

/// A column's texts, which live as long as the program.
const char* kept(const std::string& text) {
  static std::set<std::string> texts;
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  return texts.insert(text).first->c_str();
}

/// Adds the columns of trials of protocol version 2.
void describe_tasks(std::vector<Column>& columns, const ExportClock& clock) {
  for (Column& column : columns) {
    const std::string_view name = column.name;
    if (name == "shape") {
      column.description =
          "Name of the stimulus that was shown; compare, adjust: the stimulus "
          "compared with or adjusted to the standard; detect: the stimulus to "
          "detect, also in catch trials";
    } else if (name == "response") {
      column.description =
          "Answer: identify: a stimulus; compare: the interval, or same or different; detect: yes "
          "or no; rate: a number; adjust: the level that was set; missing: no answer";
      column.names = Column::Names::answers;
    } else if (name == "correct") {
      column.description =
          "Whether the answer was right; missing for rate and adjust, as no answer is right or "
          "wrong";
    }
  }
  const std::vector<Column> more = {
      {"task",
       "Task; missing: a study of version 1, in which shapes are identified",
       "",
       {{"identify", "which stimulus was it?"},
        {"compare", "which interval held the comparison, or were they the same?"},
        {"detect", "was there a stimulus?"},
        {"rate", "a number for the magnitude"},
        {"adjust", "set a level that equals the standard"}}},
      {"block_name", "Name of the block in the protocol", "", {}, Column::Names::blocks},
      {"track", "Stimulus, renderer and procedure within the block, from 1", "1"},
      {"level",
       "The varied number of the stimulus; adjust: its start value; missing in catch trials and "
       "if nothing is varied",
       Column::kLevelUnit},
      {"standard_level", "The same number of the standard", Column::kLevelUnit},
      {"catch_trial",
       "Catch trial",
       "",
       {{"0", "no"}, {"1", "yes: nothing to detect, or no difference"}}},
      {"success",
       "Outcome that procedures count",
       "",
       {{"0", "another answer, or none"},
        {"1", "the comparison was chosen; different; yes; the right stimulus"}}},
      {"number", "rate: the number answered; adjust: the level that was set"},
      {"confidence", "Confidence of the participant, a number on the protocol's scale"},
      {"confidence_delay", "From the response to the answer about confidence", "s"},
      {"comparison_interval", "compare: which interval held the comparison, from 1", "1"},
      {"interval_onsets",
       "First tick with forces on of each interval felt, from that of the first, s, separated by "
       "semicolons; onset_utc, response_time and contact are those of the last interval (adjust: "
       "onset_utc and response_time of the first)"},
      {"interval_ends", "When the forces of each interval went off, in the same form"},
      {"interval_levels", "Level of each interval felt; empty: the stimulus unchanged, or nothing"},
  };
  columns.insert(columns.end(), more.begin(), more.end());
  for (const std::string& name : clock.dimensions())
    columns.push_back({kept(name),
                       "Dimension of the varied level; missing in catch trials and if the block "
                       "does not vary it",
                       Column::kLevelUnit});
}

/// Adds the columns of movements to targets, and what the others mean of them.
void describe_reaches(std::vector<Column>& columns, const ExportClock&) {
  for (Column& column : columns) {
    const std::string_view name = column.name;
    if (name == "task") {
      column.levels.emplace_back("reach", "move from the start to a target");
    } else if (name == "level") {
      column.description =
          "The varied number of the stimulus; adjust: its start value; reach: number of the target "
          "in the protocol, from 1; missing in catch trials and if nothing is varied";
    } else if (name == "response") {
      column.description =
          "Answer: identify: a stimulus; compare: the interval, or same or different; detect: yes "
          "or no; rate: a number; adjust: the level that was set; reach: in_time, fast or slow; "
          "missing: no answer";
    }
  }
  const std::vector<Column> more = {
      {"reach_kind",
       "reach: what was felt on the way",
       "",
       {{"field", "the fields of the stimulus"},
        {"catch", "nothing, unannounced"},
        {"clamp", "a channel from the start to the target"}}},
      {"movement_duration",
       "reach: from the first tick at 20 mm/s or faster before the peak speed to the first tick at "
       "rest in the target",
       "s"},
      {"peak_speed", "reach: largest speed of the tip, over 20 ms", "m/s"},
      {"deviation",
       "reach: sideways place of the tip at peak speed, from the line of the movement's begin to "
       "the target; positive: to the left of the line seen from +z (of a line along z: towards +y)",
       "m"},
      {"largest_deviation", "reach: the sideways place that is farthest from the line", "m"},
      {"path_ratio", "reach: length of the path over the distance of its ends", "1"},
      {"endpoint_error", "reach: distance of the tip from the target at the end", "m"},
      {"side_force", "reach: sideways force on the hand at peak speed, as rendered", "N"},
      {"adaptation",
       "reach, clamp trials: slope of the channel's sideways force on that of the field at the "
       "same velocity, through 0; 1: the hand pushes as the field would have needed; missing: no "
       "clamp trial, or the field gives no sideways force",
       "1"},
  };
  columns.insert(columns.end(), more.begin(), more.end());
}

void describe_sight(std::vector<Column>& columns, const ExportClock&) {
  const std::vector<Column> more = {
      {"seen_lag_ms",
       "From the tick whose pose was drawn to the swap of its frame, by the program's clock, "
       "beyond the intended delay: median of the trial's frames; missing: nothing was drawn",
       "ms"},
      {"seen_lag_p99_ms", "The same: 99 % of the frames are not above", "ms"},
      {"frames_dropped", "Frames missing between those drawn, by their median distance", "1"},
  };
  columns.insert(columns.end(), more.begin(), more.end());
}

void describe_sound(std::vector<Column>& columns, const ExportClock&) {
  columns.push_back(
      {"sound_lag_ms",
       "From the tick of a contact to its sound, by the program's clock, beyond the intended delay "
       "and without what the sound card adds: median of the trial's knocks; missing: there was "
       "none",
       "ms"});
}

void describe_torque(std::vector<Column>& columns, const ExportClock&) {
  columns.push_back(
      {"torque_driven",
       "Whether the device drove the torque of the renderer; missing: the renderer gives no torque",
       "",
       {{"0", "the device drives force alone: the force was felt at the grip, without torque"},
        {"1", "driven, as the renderer gave it"}}});
}

/// After the participant.
std::vector<Column> with_group(std::vector<Column> columns) {
  columns.insert(columns.begin() + 1, kGroup);
  return columns;
}

std::vector<Column> make_attempts() {
  return {kParticipant,
          kSession,
          kBlock,
          kTrial,
          kAttempt,
          kRenderer,
          kShape,
          kOrientation[0],
          kOrientation[1],
          kOrientation[2],
          kOrientation[3],
          kPractice,
          {"began_utc", "When the attempt was begun, ISO 8601, UTC", "ISO 8601"},
          {"reason", "Why the attempt was cut off; its trial was shown again"},
          kDevice,
          kSimulated,
          kProtocol,
          kProgramVersion,
          kNumber};
}

std::vector<Column> make_samples() {
  return {
      {"tick", "Servo tick, from the first one with forces on (0)", "1"},
      {"tip_x", "Tip of the stylus, world frame, x", "m"},
      {"tip_y", "Tip of the stylus, world frame, y", "m"},
      {"tip_z", "Tip of the stylus, world frame, z", "m"},
      {"tail_x", "Tail of the stylus, world frame, x", "m"},
      {"tail_y", "Tail of the stylus, world frame, y", "m"},
      {"tail_z", "Tail of the stylus, world frame, z", "m"},
      {"force_x", "Force on the hand as rendered, world frame, x", "N"},
      {"force_y", "Force on the hand as rendered, world frame, y", "N"},
      {"force_z", "Force on the hand as rendered, world frame, z", "N"},
      {"torque_x", "Torque about the virtual tip, world frame, x", "N m"},
      {"torque_y", "Torque about the virtual tip, world frame, y", "N m"},
      {"torque_z", "Torque about the virtual tip, world frame, z", "N m"},
      {"device1_x", "Force commanded to the device at the tip, after the limits, x", "N"},
      {"device1_y", "Force commanded to the device at the tip, after the limits, y", "N"},
      {"device1_z", "Force commanded to the device at the tip, after the limits, z", "N"},
      {"device2_x", "Force commanded to the device at the tail, after the limits, x", "N"},
      {"device2_y", "Force commanded to the device at the tail, after the limits, y", "N"},
      {"device2_z", "Force commanded to the device at the tail, after the limits, z", "N"},
      {"depth", "Penetration depth of the deepest contact, 0 in free space", "m"},
      {"contacts", "Contacts of the stylus", "1"},
      {"contact_type",
       "Type of the deepest contact",
       "",
       {{"0", "none"}, {"1", "point-polygon"}, {"2", "segment-edge"}, {"3", "segment-face"}}},
      {"buttons", "Buttons of the device, one bit each", "1"},
      {"faults", "Fault bits of the tick; 0 for none", "1"},
      {"period", "Time since the previous tick; 0: not known", "s"},
      {"lateness", "Delay of the tick's start after its due time", "s"},
      {"compute", "From reading the device to commanding it", "s"},
  };
}

/// Names as in `palpate render --bodies`.
std::vector<Column> make_bodies() {
  return {
      {"body_x", "Centre of mass of the stimulus after the tick, world frame, x", "m"},
      {"body_y", "Centre of mass of the stimulus after the tick, world frame, y", "m"},
      {"body_z", "Centre of mass of the stimulus after the tick, world frame, z", "m"},
      {"body_qw", "Orientation of the stimulus's axes after the tick, unit quaternion, w", "1"},
      {"body_qx", "Orientation of the stimulus's axes after the tick, unit quaternion, x", "1"},
      {"body_qy", "Orientation of the stimulus's axes after the tick, unit quaternion, y", "1"},
      {"body_qz", "Orientation of the stimulus's axes after the tick, unit quaternion, z", "1"},
      {"body_vx", "Velocity of its centre of mass, world frame, x", "m/s"},
      {"body_vy", "Velocity of its centre of mass, world frame, y", "m/s"},
      {"body_vz", "Velocity of its centre of mass, world frame, z", "m/s"},
      {"body_wx", "Its spin (angular velocity), world frame, x", "rad/s"},
      {"body_wy", "Its spin (angular velocity), world frame, y", "rad/s"},
      {"body_wz", "Its spin (angular velocity), world frame, z", "rad/s"},
  };
}

/// Names as in `palpate render`.
std::vector<Column> make_contacts() {
  return {
      {"contact_x", "Position of the deepest contact, by rendering the trial again, world frame, x",
       "m"},
      {"contact_y", "Position of the deepest contact, by rendering the trial again, world frame, y",
       "m"},
      {"contact_z", "Position of the deepest contact, by rendering the trial again, world frame, z",
       "m"},
      {"normal_x", "Normal of the surface there, out of the object, world frame, x", "1"},
      {"normal_y", "Normal of the surface there, out of the object, world frame, y", "1"},
      {"normal_z", "Normal of the surface there, out of the object, world frame, z", "1"},
  };
}

/// With shifted dates, and the column elapsed.
std::vector<Column> made_relative(std::vector<Column> columns) {
  for (Column& column : columns) {
    const std::string_view name = column.name;
    if (name == "onset_utc") {
      column.description =
          "First tick with forces on, ISO 8601, shifted: the participant's first trial is at "
          "1900-01-01T00:00:00Z; intervals are true";
    } else if (name == "began_utc") {
      column.description =
          "When the attempt was begun, ISO 8601, shifted: the participant's first trial is at "
          "1900-01-01T00:00:00Z; intervals are true";
    }
  }
  columns.push_back({"elapsed", "Time of the row, from the participant's first trial", "s"});
  return columns;
}

Column column_of(const StoredFactor& factor) {
  Column out{kept(factor.name), "Level of a factor; missing: the trial's block does not cross it"};
  for (const auto& [level, sets] : factor.levels)
    out.levels.emplace_back(kept(level), kept("sets " + sets));
  return out;
}

std::vector<Column> with_factors(std::vector<Column> columns,
                                 const std::vector<StoredFactor>& factors) {
  const auto place = std::ranges::find_if(
      columns, [](const Column& one) { return std::string_view(one.name) == "practice"; });
  std::vector<Column> more;
  more.reserve(factors.size());
  for (const StoredFactor& factor : factors) more.push_back(column_of(factor));
  columns.insert(place + 1, more.begin(), more.end());
  return columns;
}

/// The columns from `task` on.
struct TaskValues {
  explicit TaskValues(const TrialRecord& record);
  std::string task, block_name;
  std::optional<int> track;
  std::optional<double> level, standard_level;
  std::optional<bool> catch_trial, success;
  std::optional<double> number, confidence, confidence_delay;  // s
  std::optional<int> comparison_interval;
  std::string onsets, ends, levels;
  std::vector<std::pair<std::string, double>> dimensions;

  /// Missing: the trial's block has no such dimension, or it is a catch trial.
  std::optional<double> dimension(const std::string& name) const;
};

void add_to_list(std::string& list, std::optional<double> value, bool first) {
  if (!first) list += ';';
  char text[32];
  if (value) list.append(text, std::to_chars(text, text + sizeof text, *value).ptr);
}

TaskValues::TaskValues(const TrialRecord& record) {
  const TaskRecord& from = record.task;
  task = from.task;
  block_name = from.block_name;
  track = from.track;
  level = from.level;
  standard_level = from.standard_level;
  catch_trial = from.catch_trial;
  success = from.success;
  number = from.number;
  confidence = from.confidence;
  dimensions = from.dimensions;
  if (from.confidence_ns)
    confidence_delay = static_cast<double>(*from.confidence_ns - record.response_ns) / 1e9;
  for (std::size_t i = 0; i < from.intervals.size(); ++i) {
    const IntervalRecord& interval = from.intervals[i];
    const std::int64_t zero = from.intervals.front().onset_ns;
    add_to_list(onsets, static_cast<double>(interval.onset_ns - zero) / 1e9, i == 0);
    add_to_list(ends, static_cast<double>(interval.end_ns - zero) / 1e9, i == 0);
    add_to_list(levels, interval.level, i == 0);
    if (from.task == "compare" && !interval.standard) comparison_interval = static_cast<int>(i) + 1;
  }
}

std::optional<double> TaskValues::dimension(const std::string& name) const {
  const auto found = std::ranges::find(dimensions, name, &std::pair<std::string, double>::first);
  if (found == dimensions.end()) return std::nullopt;
  return found->second;
}

void put_task(DelimitedRow& row, const StoredTrial& trial, const ExportClock& clock) {
  const TaskValues task(trial.record);
  row << task.task << task.block_name << task.track << task.level << task.standard_level
      << task.catch_trial << task.success << task.number << task.confidence << task.confidence_delay
      << task.comparison_interval << task.onsets << task.ends << task.levels;
  for (const std::string& name : clock.dimensions()) row << task.dimension(name);
}

void put_reach(DelimitedRow& row, const StoredTrial& trial, const ExportClock&) {
  const ReachRecord reach = trial.record.task.reach.value_or(ReachRecord());
  row << reach.kind << reach.duration << reach.peak_speed << reach.deviation
      << reach.largest_deviation << reach.path_ratio << reach.endpoint_error << reach.side_force
      << reach.adaptation;
}

void put_sight(DelimitedRow& row, const StoredTrial& trial, const ExportClock&) {
  const auto& seen = trial.record.task.seen;
  const auto milliseconds = [&](double SeenRecord::*value) {
    return seen ? std::optional(1000 * (*seen).*value) : std::nullopt;
  };
  row << milliseconds(&SeenRecord::lag) << milliseconds(&SeenRecord::lag_p99)
      << (seen ? std::optional(seen->dropped) : std::nullopt);
}

void put_sound(DelimitedRow& row, const StoredTrial& trial, const ExportClock&) {
  const auto& heard = trial.record.task.heard;
  row << (heard ? std::optional(1000 * heard->lag) : std::nullopt);
}

void put_torque(DelimitedRow& row, const StoredTrial& trial, const ExportClock& clock) {
  row << clock.torque().driven(trial);
}

bool has_reaches(const StoredProtocol& protocol) {
  return std::ranges::find(protocol.blocks, "reach", &StoredBlock::task) != protocol.blocks.end();
}

/// Columns of trials that only some protocols need, in their order. They are missing in rows of
/// other protocols.
struct TrialPart {
  bool (*of)(const StoredProtocol&, const ExportClock&);
  void (*describe)(std::vector<Column>&, const ExportClock&);
  void (*put)(DelimitedRow&, const StoredTrial&, const ExportClock&);
};
using Clock = ExportClock;
constexpr std::array<TrialPart, 5> kParts{
    {{[](const StoredProtocol& p, const Clock&) { return !p.blocks.empty(); }, describe_tasks,
      put_task},
     {[](const StoredProtocol& p, const Clock&) { return has_reaches(p); }, describe_reaches,
      put_reach},
     {[](const StoredProtocol& p, const Clock&) { return p.has_view; }, describe_sight, put_sight},
     {[](const StoredProtocol& p, const Clock&) { return p.has_sound; }, describe_sound, put_sound},
     {[](const StoredProtocol&, const Clock& clock) { return clock.torque().any(); },
      describe_torque, put_torque}}};

bool has(const ExportClock& clock, const TrialPart& part) {
  return std::ranges::any_of(clock.protocols(),
                             [&](const auto& one) { return part.of(one.second, clock); });
}

void leave_out(DelimitedRow& row, const TrialPart& part, const ExportClock& clock) {
  std::vector<Column> columns;
  part.describe(columns, clock);
  for (std::size_t i = 0; i < columns.size(); ++i) row << "";
}

/// Which columns a table has.
struct ColumnSets {
  bool cut_off = false;  ///< of attempts that were cut off
  std::array<bool, kParts.size()> parts{};
  bool relative = false, groups = false;
  std::vector<std::pair<std::string, std::string>> levels = {};  ///< of factors
  std::vector<std::string> dimensions = {};
  bool operator<(const ColumnSets& other) const { return all() < other.all(); }

 private:
  std::tuple<bool, const decltype(parts)&, bool, bool, const decltype(levels)&,
             const decltype(dimensions)&>
  all() const {
    return {cut_off, parts, relative, groups, levels, dimensions};
  }
};

/// \param cut_off  of attempts that were cut off
std::span<const Column> columns_for(const ExportClock& clock, bool cut_off) {
  ColumnSets sets{.cut_off = cut_off, .relative = clock.relative(), .groups = clock.groups().any()};
  for (std::size_t i = 0; i < kParts.size(); ++i) sets.parts[i] = !cut_off && has(clock, kParts[i]);
  for (const StoredFactor& factor : clock.factors()) {
    sets.levels.emplace_back(factor.name, "");
    sets.levels.insert(sets.levels.end(), factor.levels.begin(), factor.levels.end());
  }
  if (!cut_off) sets.dimensions = clock.dimensions();
  static std::map<ColumnSets, std::vector<Column>> tables;
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  const auto [table, is_new] = tables.try_emplace(sets);
  std::vector<Column>& columns = table->second;
  if (!is_new) return columns;
  columns = cut_off ? make_attempts() : make_trials();
  for (std::size_t i = 0; i < kParts.size(); ++i) {
    if (sets.parts[i]) kParts[i].describe(columns, clock);
  }
  if (sets.relative) columns = made_relative(std::move(columns));
  if (sets.groups) columns = with_group(std::move(columns));
  if (!clock.factors().empty()) columns = with_factors(std::move(columns), clock.factors());
  return columns;
}

}  // namespace

std::span<const Column> trial_columns(const ExportClock& clock) {
  return columns_for(clock, false);
}

std::span<const Column> columns_of_trial(const ExportClock& clock) {
  return trial_columns(clock).subspan(clock.groups().any() ? 2 : 1);
}

std::span<const Column> attempt_columns(const ExportClock& clock) {
  return columns_for(clock, true);
}

const Column& group_column() { return kGroup; }

const DatasetForm& dataset_form(const ProtocolFacts& facts) {
  static const DatasetForm of_shapes{"Identification of shapes", {}};
  static const DatasetForm of_blocks{
      "Judgements of objects",
      {{"interval", "Interval of the trial, from 1, to which the tick belongs", "1"}}};
  return facts.blocks.empty() ? of_shapes : of_blocks;
}

std::span<const Column> sample_columns() {
  static const std::vector<Column> all = make_samples();
  return all;
}

std::span<const Column> contact_columns() {
  static const std::vector<Column> all = make_contacts();
  return all;
}

std::span<const Column> body_columns() {
  static const std::vector<Column> all = make_bodies();
  return all;
}

void put_columns_of_trial(DelimitedRow& row, const StoredTrial& trial, const ExportClock& clock) {
  put_plain_columns(row, trial, clock);
  const StoredProtocol& protocol = clock.protocols().at(trial.protocol_sha256);
  for (const TrialPart& part : kParts) {
    if (part.of(protocol, clock))
      part.put(row, trial, clock);
    else if (has(clock, part))
      leave_out(row, part, clock);
  }
  if (clock.relative()) row << clock.elapsed(trial);
}

void put_trial(DelimitedRow& row, const StoredTrial& trial, const ExportClock& clock) {
  row << trial.participant.code;
  if (clock.groups().any()) row << clock.groups().of(trial.participant, trial.protocol_sha256);
  put_columns_of_trial(row, trial, clock);
}

void put_attempt(DelimitedRow& row, const StoredTrial& attempt, const ExportClock& clock) {
  const TrialRecord& record = attempt.record;
  row << attempt.participant.code;
  if (clock.groups().any()) row << clock.groups().of(attempt.participant, attempt.protocol_sha256);
  row << record.session << record.block << record.trial << record.attempt << record.renderer
      << base_name(record.shape);
  for (const double q : record.orientation_wxyz) row << q;
  row << record.practice;
  put_factors(row, record, clock);
  row << clock.onset_utc(attempt) << attempt.cut_off_reason << attempt.run.device
      << attempt.participant.simulated << attempt.protocol_sha256 << attempt.run.program_version
      << attempt.participant.enrolled_number;
  if (clock.relative()) row << clock.elapsed(attempt);
}

void put_interval(DelimitedRow& row, std::span<const Column> columns, int interval) {
  for (std::size_t i = 0; i < columns.size(); ++i) row << interval;
}

void put_sample(DelimitedRow& row, const SampleRecord& sample) {
  row << sample.tick;
  constexpr int kNanometre = 9, kMicronewton = 6;  // decimals
  for (const auto& vector : {sample.tip, sample.tail}) {
    for (const double x : vector) row.rounded(x, kNanometre);
  }
  for (const auto& vector : {sample.force, sample.torque, sample.device1, sample.device2}) {
    for (const double x : vector) row.rounded(x, kMicronewton);
  }
  row.rounded(sample.depth, kNanometre);
  row << unsigned{sample.contacts} << unsigned{sample.contact_type} << unsigned{sample.buttons}
      << sample.faults << static_cast<double>(sample.period_ns) / 1e9
      << static_cast<double>(sample.lateness_ns) / 1e9
      << static_cast<double>(sample.compute_ns) / 1e9;
}

void put_contact(DelimitedRow& row, const std::optional<TickContact>& contact) {
  constexpr int kDecimals = 9;
  for (std::size_t k = 0; k < contact_columns().size(); ++k) {
    if (contact)
      row.rounded(k < 3 ? contact->point[k] : contact->normal[k - 3], kDecimals);
    else
      row << "";
  }
}

bool has_bodies(const ProtocolFacts& facts) {
  return std::any_of(facts.stimuli.begin(), facts.stimuli.end(), [](const StimulusFacts& stimulus) {
    return read_json(stimulus.object).contains("body");
  });
}

void put_body(DelimitedRow& row, const TrialRecord& record, const SampleRecord& sample) {
  const std::optional<BodyRecord> body = body_of(record, sample);
  if (!body) {
    for (std::size_t k = 0; k < body_columns().size(); ++k) row << "";
    return;
  }
  constexpr int kDecimals = 9;
  for (const double x : body->centre) row.rounded(x, kDecimals);
  for (const double x : body->orientation_wxyz) row.rounded(x, kDecimals);
  for (const auto& vector : {body->velocity, body->spin}) {
    for (const double x : vector) row.rounded(x, kDecimals);
  }
}

}  // namespace palpate::data
