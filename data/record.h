#pragma once
// What is kept of a session and of every trial. Plain values; SI units; times are int64
// nanoseconds.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::data {

/// One servo tick of a trial, as it is kept when the protocol asks for samples.
struct SampleRecord {
  std::uint32_t tick = 0;               ///< from time zero of the trial
  std::int64_t period_ns = 0;           ///< since the tick before; 0: not known (older records)
  std::int64_t lateness_ns = 0;         ///< behind the time at which the tick was due
  std::int64_t compute_ns = 0;          ///< from the device's reading to the command for it
  std::array<double, 3> tip{}, tail{};  ///< m, world frame
  std::array<double, 3> force{};        ///< N, on the hand, as rendered
  std::array<double, 3> torque{};       ///< N m, about the virtual tip, as rendered
  /// N, as commanded after the limits, to the device at the tip and to that at the tail
  std::array<double, 3> device1{}, device2{};
  double depth = 0;  ///< m, deepest contact
  std::uint8_t contacts = 0;
  std::uint8_t contact_type = 0;
  std::uint8_t buttons = 0;
  std::uint32_t faults = 0;  ///< fault bits of the tick
};

/// One presentation of one trial. Every number is finite; -0.0 comes back from the store as 0.
struct TrialRecord {
  int session = 1, block = 1, trial = 1;
  int attempt = 1;
  std::string renderer, shape, response;  ///< response empty: none
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
  std::uint32_t faults = 0;           ///< or of all ticks' fault bits
  bool started_inside = false;        ///< the stylus was inside an object at time zero
  double max_force = 0;               ///< N
  std::vector<SampleRecord> samples;  ///< empty unless asked for
};

/// A file that a protocol names, such as a mesh.
struct ProtocolFile {
  std::string name;   ///< as the protocol names it
  std::string bytes;  ///< as they were read
};

/// The protocol a participant is enrolled in.
struct ProtocolInfo {
  std::string name;
  std::string text;                      ///< the file as it was read, byte for byte
  std::string sha256;                    ///< of text, 64 lower-case hexadecimal digits
  std::vector<ProtocolFile> files = {};  ///< that it names, each once
};

/// Somebody, or a simulated somebody, enrolled in one protocol. Pseudonyms only.
struct Participant {
  std::int64_t id = 0;  ///< the store's own key
  std::string code;     ///< 1 to 32 letters and digits
  int number = 0;       ///< 1, 2, ...: unique within the protocol
  /// Orders the counterbalancing: number, unless a merge had to give another one since.
  int enrolled_number = 0;
  bool simulated = false;
  std::optional<std::uint64_t> seed;  ///< of a simulated participant
};

/// Whether a participant can have this code: 1 to 32 ASCII letters and digits.
bool is_participant_code(std::string_view code);

/// One instant on both clocks; ties a run's times to the calendar.
struct ClockStamp {
  std::int64_t utc_ns = 0;        ///< since 1970-01-01T00:00:00Z
  std::int64_t monotonic_ns = 0;  ///< session clock (CLOCK_MONOTONIC; virtual when simulated)
};

/// How a run, one process's part of a session, ended.
enum class RunEnd {
  running,      ///< it has not
  done,         ///< every trial of the session has a record
  paused,       ///< to be continued another day
  aborted,      ///< by the experimenter or by a fault
  withdrawn,    ///< by the participant
  interrupted,  ///< the process died; only the store says so
};
const char* to_string(RunEnd end);                           ///< "running", "done", ...
std::optional<RunEnd> parse_run_end(std::string_view text);  ///< the inverse of to_string

/// What is recorded when a process starts or resumes a session. Empty texts: not known.
struct RunInfo {
  int session = 1;
  ClockStamp clock;
  std::string program_version;             ///< "0.1.0"
  std::string build;                       ///< compiler and flags
  std::string device;                      ///< as in --device
  std::string device_calibration;          ///< the device's own text
  std::string response_device;             ///< "keyboard", ...
  std::optional<double> response_latency;  ///< s, measured; none: unknown. Never subtracted
  std::string observer_sha256;             ///< of the settings of a simulated participant
  std::string consent_version;
  std::optional<std::int64_t> consent_utc_ns;
  std::string hand;  ///< "left", "right"
  /// The participant has withdrawn and asks to take part again: else no session of theirs that was
  /// withdrawn is begun. Not stored by itself.
  bool after_withdrawal = false;
  /// Of the protocol that the run was shown with, where only its texts differ from that of the
  /// participant; "": the participant's own.
  std::string protocol_sha256;
  /// Of the files of that protocol, as the store knows them; "": none, or recorded by a palpate
  /// that did not keep them. The store fills it in.
  std::string files_sha256;
};

}  // namespace palpate::data
