#pragma once
// Records of a session and of every trial: plain values, filled by sessions, kept by the store,
// read by exports and analysis. SI units; times are int64 nanoseconds.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace palpate::data {

/// State of a moving stimulus, named as the columns of `palpate render --bodies`. World frame.
struct BodyRecord {
  std::array<double, 3> centre{};  ///< m, of mass
  std::array<double, 4> orientation_wxyz{1, 0, 0, 0};
  std::array<double, 3> velocity{}, spin{};  ///< m/s, of the centre of mass; rad/s
};

/// One servo tick of a trial; recorded if the protocol has samples = true.
struct SampleRecord {
  std::uint32_t tick = 0;               ///< from time zero of the trial
  std::int64_t period_ns = 0;           ///< since the previous tick; 0: unknown (older records)
  std::int64_t lateness_ns = 0;         ///< behind the scheduled time of the tick
  std::int64_t compute_ns = 0;          ///< from reading the device to commanding its force
  std::array<double, 3> tip{}, tail{};  ///< m, world frame
  std::array<double, 3> force{};        ///< N, on the hand, as rendered
  std::array<double, 3> torque{};       ///< N m, about the virtual tip, as rendered
  /// N, as commanded after the limits, to the device at the tip and to that at the tail
  std::array<double, 3> device1{}, device2{};
  double depth = 0;  ///< m, deepest contact
  std::uint8_t contacts = 0;
  std::uint8_t contact_type = 0;
  std::uint8_t buttons = 0;
  std::uint8_t bodies = 0;   ///< 1: the stimulus moves; body_of() is its state after the tick
  std::uint32_t faults = 0;  ///< fault bits of the tick
};

/// One presentation within a trial of a block of tasks.
struct IntervalRecord {
  std::string stimulus;  ///< "": nothing was shown
  std::string renderer;
  /// Of several dimensions: the value at the path of the one that answers are about. None: the
  /// stimulus unchanged from the protocol.
  std::optional<double> level;
  bool standard = false;
  std::int64_t onset_ns = 0, end_ns = 0;  ///< forces on, forces off; session clock; 0: not yet
};

/// A movement from home to a target, and its measures from the recorded samples
/// (runner/session/reach_measures.h). None: it has no such measure.
struct ReachRecord {
  std::string kind;                         ///< "field", "catch", "clamp"
  std::optional<double> duration;           ///< s
  std::optional<double> peak_speed;         ///< m/s
  std::optional<double> deviation;          ///< m, sideways, at peak speed
  std::optional<double> largest_deviation;  ///< m, sideways
  std::optional<double> path_ratio;         ///< length of the path over that of its chord
  std::optional<double> endpoint_error;     ///< m, from the target
  std::optional<double> side_force;         ///< N, sideways on the hand, at peak speed
  std::optional<double> adaptation;         ///< clamp: slope of that force on the field's
};

/// A frame in which something of a trial was drawn, on the session clock.
struct FrameRecord {
  std::int64_t swap_ns = 0;   ///< after the driver had drawn it
  std::int64_t pose_ns = 0;   ///< of the tick whose pose is drawn
  std::int64_t delay_ns = 0;  ///< intended, between both
};

/// When what was seen of a trial was on the screen, by the clock of the program: a screen and a
/// compositor add to it. After the intended delay.
struct SeenRecord {
  int frames = 0;                  ///< drawn
  int dropped = 0;                 ///< missing between them, by their median distance
  double lag = 0;                  ///< s, median from the tick whose pose is drawn to the swap
  double lag_p99 = 0;              ///< s, likewise
  std::int64_t first_ns = 0;       ///< session clock, swap of the first; 0: an older version's
  std::string frames_sha256 = {};  ///< of TrialRecord::frames; "": they are not kept

  /// s; half of what people notice between sight and touch (45 ms, Vogels 2004).
  static constexpr double kMostLag = 0.0225;
};

/// When contacts of a trial were heard, by the clock of the program: what a sound card adds is not
/// in it (palpate devices --loopback measures that). After the intended delay.
struct HeardRecord {
  int knocks = 0;
  double lag = 0;             ///< s, median from the tick of contact
  std::int64_t first_ns = 0;  ///< session clock, when the first of them was heard

  /// s; half of what people notice between sound and touch (24 ms, Adelstein et al. 2003).
  static constexpr double kMostLag = 0.012;
};

/// The task of a trial. Onset, response time and contact of its record are those of the last
/// interval felt.
struct TaskRecord {
  /// "identify", "compare", "detect", "rate", "adjust", "external", "reach"
  std::string task = "identify";
  std::string block_name;       ///< "": the protocol has no blocks (version 1)
  int track = 1;                ///< stimulus, renderer and procedure
  std::optional<double> level;  ///< of the trial; adjust: start value; reach: the target, from 1
  std::optional<double> standard_level;  ///< of the standard, if it has one
  /// Of a level of several dimensions, in the protocol's order: name and value. Empty: none, or a
  /// catch trial.
  std::vector<std::pair<std::string, double>> dimensions = {};
  bool catch_trial = false;
  /// In order; adjust: one for each stimulus felt. Empty: one, without a level (intervals_of).
  std::vector<IntervalRecord> intervals;
  /// The outcome that procedures count: the comparison was chosen, "yes", "different", the right
  /// stimulus.
  bool success = false;
  std::optional<double> number;  ///< rate: as answered; adjust: the level that was set
  std::optional<double> confidence;
  std::optional<std::int64_t> confidence_ns;  ///< session clock
  std::optional<ReachRecord> reach = std::nullopt;
  std::optional<SeenRecord> seen;    ///< none: nothing was drawn
  std::optional<HeardRecord> heard;  ///< none: no contact was heard

  bool of_block() const { return !block_name.empty(); }
};

/// An answer to a question of a page, or the consent given. Personal data: exported on request
/// only.
struct PageAnswer {
  std::string page, item;   ///< names; consent: item "consent"
  std::string version;      ///< of a consent
  std::string text_sha256;  ///< of the text shown
  std::string answer;       ///< "": left out
  std::int64_t at_ns = 0;   ///< session clock
};

/// One presentation of one trial. All numbers are finite; the store returns -0.0 as 0.
struct TrialRecord {
  int session = 1, block = 1, trial = 1;
  int attempt = 1;
  std::string renderer, shape, response;  ///< response "": none
  bool correct = false, practice = false, timed_out = false;
  std::array<double, 4> orientation_wxyz{1, 0, 0, 0};
  double response_time = 0;                  ///< s, from time zero
  std::optional<double> first_contact_time;  ///< s, from time zero
  std::int64_t onset_ns = 0;     ///< session clock (CLOCK_MONOTONIC; virtual when simulated)
  std::int64_t response_ns = 0;  ///< session clock
  std::string
      onset_utc;  ///< ISO 8601, UTC, microseconds; the store derives it from the run's clock stamp
  std::array<double, 3> start_tip{}, start_tail{};  ///< m, at time zero
  std::uint64_t ticks = 0, missed_ticks = 0;
  std::int64_t longest_period_ns = 0;
  std::uint32_t faults = 0;     ///< bitwise or of all ticks' fault bits
  bool started_inside = false;  ///< the stylus was inside an object at time zero
  double max_force = 0;         ///< N
  /// How the object was touched (runner/session/live_forces.h): share of the ticks with contact,
  /// and s with contact near an edge. None: recorded by a version without them; edge_dwell also if
  /// the stimulus has too many edges.
  std::optional<double> contact_share, edge_dwell;
  std::vector<SampleRecord> samples;  ///< empty unless recorded and requested
  TaskRecord task = {};               ///< stored if it belongs to a block
  /// One for each sample; empty: nothing moves in any of them.
  std::vector<BodyRecord> bodies = {};
  std::vector<FrameRecord> frames = {};  ///< in which something was drawn; kept with the samples
};

/// The intervals as presented, in order.
std::vector<IntervalRecord> intervals_of(const TrialRecord& record);

/// State of the stimulus after the tick; none: it did not move, or there was none.
/// \param sample  an element of record.samples
std::optional<BodyRecord> body_of(const TrialRecord& record, const SampleRecord& sample);

/// First tick with forces on in the first interval felt, session clock.
std::int64_t first_onset_ns(const TrialRecord& record);

/// Whether an answer to the trial can be right or wrong. False for a number, a level that was set,
/// and a choice between two intervals of the same level.
bool has_right_answer(const TrialRecord& record);

/// A file that a protocol names, such as a mesh.
struct ProtocolFile {
  std::string name;   ///< as the protocol names it
  std::string bytes;  ///< content, unchanged
};

/// A protocol as it was read from its file.
struct ProtocolInfo {
  std::string name;
  std::string text;                      ///< of the file, byte for byte
  std::string sha256;                    ///< of text, 64 lower-case hexadecimal digits
  std::vector<ProtocolFile> files = {};  ///< named in the text, each once
};

/// A person or a simulated participant, enrolled in one protocol. Pseudonyms only.
struct Participant {
  std::int64_t id = 0;  ///< row id in the database
  std::string code;     ///< 1 to 32 letters and digits
  int number = 0;       ///< 1, 2, ...: unique within the protocol
  /// Selects the counterbalanced order: equals `number` unless a merge has changed that one.
  int enrolled_number = 0;
  bool simulated = false;
  std::optional<std::uint64_t> seed;  ///< of a simulated participant
};

/// When the groups of a study were unmasked (base/group_assignment.h).
struct Unmasking {
  std::int64_t utc_ns = 0;  ///< since 1970
  std::string person;       ///< who did it
  std::string program_version;
  int participants = 0;  ///< of masked protocols, with a completed trial at that time
};

/// Whether a participant can have this code: 1 to 32 ASCII letters and digits.
bool is_participant_code(std::string_view code);

/// One instant on both clocks; converts the times of a run to UTC.
struct ClockStamp {
  std::int64_t utc_ns = 0;        ///< since 1970-01-01T00:00:00Z
  std::int64_t monotonic_ns = 0;  ///< session clock (CLOCK_MONOTONIC; virtual when simulated)
};

/// How a run ended. A run is the part of a session that one process showed.
enum class RunEnd {
  running,      ///< it has not ended
  done,         ///< every trial of the session has a record
  paused,       ///< to be resumed another day
  aborted,      ///< by the experimenter or by a fault
  withdrawn,    ///< by the participant
  interrupted,  ///< the process died; set by the next writer only
};
const char* to_string(RunEnd end);                           ///< "running", "done", ...
std::optional<RunEnd> parse_run_end(std::string_view text);  ///< the inverse of to_string

/// Recorded when a process begins or resumes a session. Empty texts: unknown.
struct RunInfo {
  int session = 1;
  ClockStamp clock;
  std::string program_version;             ///< "0.1.0"
  std::string build;                       ///< compiler and flags
  std::string device;                      ///< as in --device
  std::string device_calibration;          ///< as the device reports it
  std::string response_device;             ///< "keyboard", ...
  std::optional<double> response_latency;  ///< s, measured; none: unknown. Never subtracted
  std::string observer_sha256;             ///< of the settings of a simulated participant
  std::string consent_version;
  std::optional<std::int64_t> consent_utc_ns;
  std::string hand;  ///< "left", "right"
  /// Allows begin_run to resume a session that ended as `withdrawn`: the participant asks to take
  /// part again. Not stored.
  bool after_withdrawal = false;
  /// SHA-256 of the protocol that the run showed, if its texts differ from the participant's; "":
  /// the participant's own.
  std::string protocol_sha256;
  /// Of the stored files of that protocol (files_checksum); "": none, or recorded by a version that
  /// did not store them. Set by the store.
  std::string files_sha256;
};

}  // namespace palpate::data
