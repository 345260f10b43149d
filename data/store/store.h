#pragma once
// The study's database: one SQLite file (schema.sql), one writer, any number of readers. Sessions
// write it, analysis and exports read it.
//
// Durability: a writing call is committed and synced to disk when it returns (WAL mode,
// synchronous=FULL); when it throws, its transaction is rolled back and the trial in hand is not
// saved. After a crash or power cut every acknowledged trial is there, and the session resumes at
// the first trial without a record. A commit takes milliseconds: never on the servo thread. A Store
// belongs to one thread at a time. Local disks only: WAL needs shared memory.
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

/// An open run: the part of a session that this process shows.
struct Run {
  std::int64_t id = 0, session_id = 0;  ///< row ids
  int session = 1;
};

/// The stored state of a session, from which it is resumed.
struct SessionProgress {
  std::vector<TrialRecord> completed;  ///< by trial number, without samples
  std::optional<RunEnd> last_end;      ///< of its latest run; none: never begun
  int cut_off = 0;                     ///< attempts that were cut off
  ClockStamp clock;                    ///< of its first run; a simulated session continues it
  std::string observer_sha256;         ///< settings of the simulated participant, else ""
  std::int64_t latest_ns = 0;          ///< session clock: latest response, 0 if there is none
};

/// A trial with its participant, protocol and run.
struct StoredTrial {
  Participant participant;
  std::string protocol_name, protocol_sha256;
  RunInfo run;         ///< the run that showed this attempt
  TrialRecord record;  ///< of a cut-off attempt: identity, orientation and onset (its begin) only
  std::string cut_off_reason;  ///< "" when completed
};

/// Identifies a trial, in every protocol that the code is enrolled in.
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

struct StoredPageAnswer {
  Participant participant;
  std::string protocol_name;
  int session = 1;
  std::string utc;
  PageAnswer answer;
  std::int64_t unix_ns = 0;  ///< the same as utc
  bool replaced = false;     ///< a later answer of the session to the same question is in force
};

/// A run and how it ended, for reports.
struct StoredRun {
  Participant participant;
  std::string protocol_sha256;
  RunInfo info;
  RunEnd end = RunEnd::running;
};

/// The rows and files of one participant code, in all protocols.
struct ParticipantSummary {
  bool withdrawn_before = false;  ///< the code has a tombstone
  std::int64_t protocols = 0;     ///< in which it is enrolled
  std::int64_t sessions = 0, trials = 0, cut_off = 0;
  std::int64_t mentions = 0;                  ///< notes on other participants that contain the code
  std::vector<ExportRecord> exports;          ///< that hold it, also those before a withdrawal
  std::vector<std::string> remaining_copies;  ///< files and folders that contain the code
};

/// The backups of migrations, after a withdrawal.
struct Withdrawal {
  std::vector<std::string> backups_removed;
  std::vector<std::string> backups_left;  ///< could not be read or removed
};

struct StoreCounts {
  std::int64_t protocols = 0, participants = 0, sessions = 0, runs = 0, completed = 0, cut_off = 0,
               interrupted_runs = 0, sampled = 0;  ///< sampled: attempts with servo samples
  std::int64_t withdrawn = 0;                      ///< codes removed by forget(), of all protocols
};

class Store {
 public:
  enum class Mode {
    /// The one writer; creates the file (0600) where there is none. Migrates an older version after
    /// a backup beside it (FILE.v<N>.backup). Marks runs of crashed processes as `interrupted` and
    /// their open attempts as cut off.
    write_or_create,
    /// Any number of readers, also beside a writer: a snapshot of the committed state.
    read_only,
    /// The same for an export, which is recorded while its reader is open: turns on the write-ahead
    /// log that a copy by VACUUM INTO or .recover lacks.
    read_for_export,
  };

  /// \throws StoreRefused: not a palpate database, of a newer version, truncated, damaged, missing
  /// (read_only) or open for writing elsewhere; StoreError: cannot be read or written.
  static Store open(const std::string& path, Mode mode);

  Store(Store&&) noexcept;
  Store& operator=(Store&&) noexcept;
  ~Store();

  const std::string& path() const;

  // --- writing -------------------------------------------------------------------------------

  /// Finds `code` in this protocol or enrols it, with `wanted_number` or the smallest unused
  /// number. Protocols are identified by SHA-256. \throws StoreRefused: a code that is not 1 to 32
  /// letters and digits, or is withdrawn; a number below 1 or of another code; a known code with
  /// another number or seed, or simulated instead of real.
  Participant enrol(const ProtocolInfo& protocol, const std::string& code,
                    std::optional<int> wanted_number = std::nullopt, bool simulated = false,
                    std::optional<std::uint64_t> seed = std::nullopt);

  /// The result of enrol, without writing: id 0 and the number to be assigned, if `code` is not in
  /// this protocol yet. \throws as enrol.
  Participant look_up(const ProtocolInfo& protocol, const std::string& code,
                      std::optional<int> wanted_number = std::nullopt, bool simulated = false,
                      std::optional<std::uint64_t> seed = std::nullopt);

  /// The checks of begin_run that need no database. \throws StoreRefused
  void validate_run(const Participant& participant, const RunInfo& info) const;
  /// Those of add_note. \throws StoreRefused
  void validate_note(const std::string& note) const;

  /// Begins session `info.session` or resumes it. \param shown_with a protocol that differs from
  /// the participant's in its texts only; nullptr: the participant's own. \throws StoreRefused: the
  /// session is done, withdrawn, or running, or was simulated with other observer settings.
  Run begin_run(const Participant& participant, const RunInfo& info,
                const ProtocolInfo* shown_with = nullptr);

  /// To be called BEFORE the stimulus is shown; on disk when it returns. Stores session, block,
  /// trial, renderer, shape, practice and orientation of `planned`.
  /// \param began_ns session clock
  /// \return attempt number 1, 2, ...: belongs into the record.
  /// \throws StoreRefused: the trial has a record, or an attempt of this run is open.
  int begin_attempt(const Run& run, const TrialRecord& planned, std::int64_t began_ns);

  /// Completes the open attempt of this run; on disk when it returns.
  /// \throws StoreRefused: the record is of another trial or attempt, or is invalid (NUL in a text,
  /// numbers that are not finite).
  void finish_attempt(const Run& run, const TrialRecord& record);

  /// Ends the open attempt without a record; its trial is shown again. \param reason "device fault"
  void cut_off_attempt(const Run& run, const std::string& reason);

  /// Stores finished trials of a simulated run in one transaction; `attempt` must be 1. Trials that
  /// were not committed when the process died are simulated again. \throws StoreRefused: as
  /// finish_attempt; a participant who is not simulated.
  void record_simulated(const Run& run, const std::vector<TrialRecord>& records);

  /// Stores answers to questions, together; on disk when it returns. A second answer to a question
  /// in a session replaces the first one, which stays on record. Personal data.
  void add_page_answers(const Run& run, const std::vector<PageAnswer>& answers);

  /// Stores an experimenter's note. \param at_ns session clock
  void add_note(const Run& run, std::int64_t at_ns, const std::string& text);

  /// \param ended_ns session clock. Cuts off an open attempt. \throws StoreRefused: the run
  /// has ended, or reason is `running` or `interrupted`.
  void end_run(const Run& run, RunEnd reason, std::int64_t ended_ns);

  /// Shows the names of masked groups from now on, on record. \throws StoreRefused: a name of the
  /// person that is empty, too long or has control characters
  void unmask(const std::string& person, const std::string& program_version, std::int64_t utc_ns);

  /// Withdrawal: removes all data of a participant, in all protocols. Deletes the rows with
  /// secure_delete, truncates the -wal, rebuilds the file (VACUUM) and deletes backups beside it
  /// that hold the participant. A salted hash of the code stays (forget.h), with which enrol and
  /// merge refuse it. After a crash the same call completes the withdrawal. \throws StoreRefused:
  /// no such participant; StoreError: another program reads (the rows are deleted, but the -wal
  /// still holds them), or the disk fails.
  Withdrawal forget(const std::string& code);

  // --- reading -------------------------------------------------------------------------------

  /// Empty if the session was never begun.
  SessionProgress progress(const Participant& participant, int session);

  /// In order of insertion, without their files; includes those of RunInfo::protocol_sha256.
  std::vector<ProtocolInfo> protocols();
  /// The files that a protocol names, by name.
  std::vector<ProtocolFile> files(const std::string& protocol_sha256);
  std::vector<Participant> participants(const std::string& protocol_sha256);  ///< by number
  std::vector<std::string> codes();  ///< of all participants, in the order of insertion
  std::vector<StoredRun> runs();     ///< by protocol, participant number, session, start
  std::vector<StoredNote> notes();   ///< in the same order
  /// Answers to pages, in the same order, with the replaced ones.
  std::vector<StoredPageAnswer> page_answers();
  /// The answers in force of a session, in the order in which the questions were first answered.
  std::vector<PageAnswer> answers_in_force(const Participant& participant, int session);
  /// The latest recorded time of live sessions, ns since 1970; simulated sessions use a virtual
  /// clock. Used to detect a clock that was set back.
  std::optional<std::int64_t> latest_recorded_time();
  StoreCounts counts();
  /// When masked groups were unmasked, and by whom, in the order of time; empty: they are masked.
  std::vector<Unmasking> unmaskings();
  ParticipantSummary participant_summary(const std::string& code);
  bool has_samples(const Participant& participant, int session);
  /// Code -> onset of its first completed trial in any protocol (without one: begin of the first
  /// attempt), ns since 1970.
  std::map<std::string, std::int64_t, std::less<>> first_onsets();

  /// Completed trials by protocol, participant number, session and trial, one at a time, so that
  /// they need not fit into memory. `visit` must not write to this store.
  void for_each_trial(const std::function<void(const StoredTrial&)>& visit,
                      bool with_samples = false);
  /// The same, with samples only for trials that `samples_wanted` selects; it is called before each
  /// visit. So several threads, each with its own store, can share the work.
  void for_each_trial(const std::function<void(const StoredTrial&)>& visit,
                      const std::function<bool(const StoredTrial&)>& samples_wanted);
  /// Attempts that were cut off, in the same order, then by attempt.
  void for_each_cut_off(const std::function<void(const StoredTrial&)>& visit);
  /// All attempts of one trial with their samples: those that were cut off, then the completed one,
  /// each by protocol.
  std::vector<StoredTrial> attempts(const TrialName& name);

 private:
  struct Impl;
  explicit Store(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate::data
