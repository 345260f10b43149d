#pragma once
// The study's database: one SQLite file (schema.sql), one writer, any number of readers.
//
// A writing call has reached the disk when it returns (WAL, synchronous=FULL); when it throws, its
// change is not in the database and the trial in hand is not saved. A store belongs to one thread
// at a time. Local disks only: SQLite's WAL needs shared memory.
//
// Live session:                          Simulated session:
//   look_up, progress                      enrol, progress, begin_run
//   first trial: enrol, begin_run
//   each trial: begin_attempt, show,       every so many trials: record_simulated
//               finish_attempt             end_run
//   end_run

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "data/errors.h"
#include "data/record.h"
#include "data/store/export_log.h"

namespace palpate::data {

/// A run under way: one process's part of one session.
struct Run {
  std::int64_t id = 0, session_id = 0;  ///< the store's own keys
  int session = 1;
};

/// What a session already holds.
struct SessionProgress {
  std::vector<TrialRecord> completed;  ///< by trial number, without samples
  std::optional<RunEnd> last_end;      ///< how its latest run ended; none: it was never begun
  int cut_off = 0;                     ///< attempts that were cut off
  ClockStamp clock;                    ///< of its first run: a simulated session goes on with it
  std::int64_t latest_ns = 0;          ///< session clock: latest response, 0 if there is none
};

/// A trial with what ties it to its person, protocol and machine.
struct StoredTrial {
  Participant participant;
  std::string protocol_name, protocol_sha256;
  RunInfo run;  ///< the run in which this attempt was shown
  TrialRecord
      record;  ///< of a cut-off attempt: identity, orientation and onset (when it was begun) only
  std::string cut_off_reason;  ///< "" when completed
};

/// Which trial, in whatever protocols the code is enrolled in.
struct TrialName {
  std::string code;
  int session = 1, trial = 1;
};

struct StoredNote {
  Participant participant;
  int session = 1;
  ClockStamp run_clock;  ///< of the run that it belongs to
  std::string utc, text;
};

/// A run and how it ended, for reports.
struct StoredRun {
  Participant participant;
  std::string protocol_sha256;
  RunInfo info;
  RunEnd end = RunEnd::running;
};

/// What a database holds of one code, in all its protocols.
struct ParticipantSummary {
  bool withdrawn_before = false;  ///< the code has a tombstone
  std::int64_t protocols = 0;     ///< it is enrolled in
  std::int64_t sessions = 0, trials = 0, cut_off = 0;
  std::int64_t mentions = 0;           ///< notes on others that say the code
  std::vector<ExportRecord> exports;   ///< that hold it, also those of before a withdrawal
  std::vector<std::string> elsewhere;  ///< files and folders beside it that name the code
};

/// What was done about backups when a participant was forgotten.
struct Withdrawal {
  std::vector<std::string> backups_removed;
  std::vector<std::string> backups_left;  ///< could not be read, or not removed
};

struct StoreCounts {
  std::int64_t protocols = 0, participants = 0, sessions = 0, runs = 0, completed = 0, cut_off = 0,
               interrupted_runs = 0, sampled = 0;  ///< sampled: attempts with servo samples
};

class Store {
 public:
  enum class Mode {
    /// The one writer; creates the file (0600) where there is none. Migrates an older version after
    /// a backup copy beside it (FILE.v<N>.backup). What a dead process left running is marked: its
    /// runs `interrupted`, their open attempts cut off.
    write_or_create,
    /// Any number of them, also beside a writer: a snapshot of what was committed at this moment.
    read_only,
  };

  /// \throws StoreRefused: not a palpate database, of a newer version, truncated, damaged, missing
  /// (read_only) or open for writing elsewhere; StoreError: cannot be read or written.
  static Store open(const std::string& path, Mode mode);

  Store(Store&&) noexcept;
  Store& operator=(Store&&) noexcept;
  ~Store();

  const std::string& path() const;

  // --- writing -------------------------------------------------------------------------------

  /// Finds `code` in this protocol or adds it, with `wanted_number` or the smallest unused number.
  /// Protocols are told apart by SHA-256. \throws StoreRefused: a code that is not 1 to 32 letters
  /// and digits, one that was withdrawn, a number below 1 or another code's, a code with another
  /// number, a code that is simulated here and real there, or with another seed.
  Participant enrol(const ProtocolInfo& protocol, const std::string& code,
                    std::optional<int> wanted_number = std::nullopt, bool simulated = false,
                    std::optional<std::uint64_t> seed = std::nullopt);

  /// Who `code` is in this protocol, or would be by enrol: with id 0, and the number that would be
  /// given. Writes nothing. \throws as enrol.
  Participant look_up(const ProtocolInfo& protocol, const std::string& code,
                      std::optional<int> wanted_number = std::nullopt, bool simulated = false,
                      std::optional<std::uint64_t> seed = std::nullopt);

  /// \throws StoreRefused: what begin_run would not take of it, whatever is in the database.
  void require_sound(const Participant& participant, const RunInfo& info) const;
  /// \throws StoreRefused: what add_note would not take.
  void require_sound(const std::string& note) const;

  /// Starts session `info.session` or goes on with it. \param shown_with a protocol that differs
  /// from the participant's in its texts only; nullptr: the participant's own. \throws
  /// StoreRefused: the session is done or withdrawn, already running in this store, or was
  /// simulated with other observer settings.
  Run begin_run(const Participant& participant, const RunInfo& info,
                const ProtocolInfo* shown_with = nullptr);

  /// To be called BEFORE the stimulus is shown; on disk when it returns. Takes session, block,
  /// trial, renderer, shape, practice and orientation from `planned`.
  /// \param began_ns session clock
  /// \return attempt number 1, 2, ...; put it into the record.
  /// \throws StoreRefused: the trial has its record, or an attempt of this run is still open.
  int begin_attempt(const Run& run, const TrialRecord& planned, std::int64_t began_ns);

  /// The attempt begun last in this run is complete; on disk when it returns.
  /// \throws StoreRefused: the record is of another trial or attempt than was begun, or holds what
  /// no database keeps (NUL in a text, numbers that are not finite).
  void finish_attempt(const Run& run, const TrialRecord& record);

  /// The attempt begun last will be shown again: `reason` is kept ("device fault", ...).
  void cut_off_attempt(const Run& run, const std::string& reason);

  /// Many finished trials of a simulated run in one transaction, all or none. `attempt` must be 1.
  /// A simulated trial that was not committed has been shown to nobody: it is run again and leaves
  /// no trace. \throws StoreRefused: as finish_attempt; a participant who is not simulated.
  void record_simulated(const Run& run, const std::vector<TrialRecord>& records);

  /// Experimenter's note. \param at_ns session clock
  void add_note(const Run& run, std::int64_t at_ns, const std::string& text);

  /// \param ended_ns session clock. An attempt still open is cut off. \throws StoreRefused: the run
  /// has ended, or reason is `running` or `interrupted`.
  void end_run(const Run& run, RunEnd reason, std::int64_t ended_ns);

  /// Removes everything of a participant, in all protocols: rows with secure_delete, then the log
  /// is emptied and the file rebuilt, and backups beside it that hold the participant are deleted.
  /// A salted hash of the code stays: enrol and merge refuse it for good. Stopped at any moment,
  /// all is as before or the same call finishes it. \throws StoreRefused: no such participant;
  /// StoreError: another program reads (the rows are gone, but not yet from the log), the disk
  /// fails.
  Withdrawal forget(const std::string& code);

  // --- reading -------------------------------------------------------------------------------

  /// What the session holds; empty where it was never begun.
  SessionProgress progress(const Participant& participant, int session);

  /// In the order they came, without their files; also those that only runs were shown with.
  std::vector<ProtocolInfo> protocols();
  /// The files that a protocol names, by name.
  std::vector<ProtocolFile> files(const std::string& protocol_sha256);
  std::vector<Participant> participants(const std::string& protocol_sha256);  ///< by number
  std::vector<std::string> codes();  ///< of all participants, in the order they came
  std::vector<StoredRun> runs();     ///< by protocol, participant number, session, start
  std::vector<StoredNote> notes();   ///< same order
  /// When the last that is on record of live sessions happened, ns since 1970. Simulated studies
  /// keep a calendar of their own.
  std::optional<std::int64_t> latest_recorded_time();
  StoreCounts counts();
  ParticipantSummary participant_summary(const std::string& code);
  bool has_samples(const Participant& participant, int session);
  /// Code -> its first completed trial in any protocol (where there is none: the first attempt), ns
  /// since 1970.
  std::map<std::string, std::int64_t, std::less<>> first_onsets();

  /// Completed trials by protocol, participant number, session and trial, one at a time: they need
  /// not fit into memory. `visit` must not write to this store.
  void for_each_trial(const std::function<void(const StoredTrial&)>& visit,
                      bool with_samples = false);
  /// Attempts that were cut off, same order, then by attempt.
  void for_each_cut_off(const std::function<void(const StoredTrial&)>& visit);
  /// What is on record of one trial: the attempts that were cut off, then the completed one with
  /// its samples, each by protocol.
  std::vector<StoredTrial> attempts(const TrialName& name);

 private:
  struct Impl;
  explicit Store(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate::data
