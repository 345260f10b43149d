#pragma once
// Settings and results that all export formats share.

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "data/export/study_about.h"
#include "data/record.h"

namespace palpate::data {

struct StimulusFacts {
  std::string name;
  std::string object;  ///< JSON of the protocol, without the name
};

/// A block of a protocol of version 2.
struct BlockFacts {
  std::string name, task;
  std::string level_path;  ///< JSON pointer of the varied number; "" for none
  std::string level_unit;
  /// Of a level of several numbers, in place of both.
  struct Dimension {
    std::string name, path, unit;
  };
  std::vector<Dimension> dimensions = {};
};

/// Facts from a protocol that an export needs; the caller parses them, because data/ cannot.
struct ProtocolFacts {
  std::string title = {};    ///< "" for none
  double servo_rate = 1000;  ///< Hz
  bool seen = false;         ///< something of a stimulus may be seen
  bool heard = false;        ///< contacts of a stimulus may be heard
  std::vector<StimulusFacts> stimuli = {};
  std::vector<BlockFacts> blocks = {};                              ///< empty: version 1
  std::vector<std::pair<std::string, std::string>> questions = {};  ///< "PAGE, ITEM" -> its text
};

/// Meaning of a bit of the columns `faults`.
struct FaultMeaning {
  std::uint32_t bit = 0;
  std::string text;
};

struct StoredTrial;

/// Where the deepest contact of a tick was, and the surface's direction there. World frame.
struct TickContact {
  std::array<double, 3> point{};   ///< m, on the ideal probe
  std::array<double, 3> normal{};  ///< unit, out of the object
};

struct DerivedColumn {
  std::string name, description;
  std::string unit;  ///< "1": a pure number
};

/// Numbers derived from the samples of each trial, for separate tables.
struct DerivedMeasures {
  struct Values {
    std::vector<std::optional<double>> numbers;  ///< one per column; empty: all missing
    std::string missing;                         ///< reason why all are missing
  };
  std::string name;  ///< of the tables, "movement"
  std::string how;   ///< a sentence on the settings
  std::vector<DerivedColumn> columns;
  std::function<Values(const StoredTrial&)> of;
};

enum class Times {
  absolute,  ///< on the calendar
  /// Seconds from the participant's first trial; dates are shifted so that this trial is at the
  /// beginning of 1900 (BIDS: years before 1925 mark shifted dates).
  relative,
};

struct ExportSettings {
  bool force = false;                ///< replace an existing export
  std::string program_version = {};  ///< "0.1.0"
  Times times = Times::absolute;
  std::string codebook = {};  ///< csv: a file that describes the columns; "" for none
  std::vector<FaultMeaning> fault_bits = {};  ///< lowest first
  StudyAbout about = {};                      ///< BIDS and Psych-DS: goes into their descriptions
  bool pages = false;  ///< with the answers to pages, which are personal data
  /// BIDS: samples as a motion recording in place of a physiological one.
  bool motion = false;
  int jobs = 1;  ///< BIDS: threads that compress samples; the files do not depend on it
  /// Contacts of each sample of a trial, for the columns of contacts. An empty result: they are
  /// missing in this trial.
  std::function<std::vector<std::optional<TickContact>>(const StoredTrial&)> contacts = {};
  std::optional<DerivedMeasures> derived = {};  ///< BIDS and Psych-DS: tables of them as well
  /// Parses the text of a protocol; called by exports with descriptions only. May throw.
  std::function<ProtocolFacts(const ProtocolInfo&)> facts = {};
  /// Called regularly with the number of trials so far; may throw to stop the export, which then
  /// leaves no file.
  std::function<void(std::int64_t)> progress = {};
  /// Path that the database records, where the export will be moved to; "": that of the export.
  std::string recorded_as = {};
};

struct ExportResult {
  std::int64_t trials = 0;    ///< rows written
  std::int64_t attempts = 0;  ///< that were cut off; 0: no file of them was written
  std::int64_t samples = 0;   ///< servo ticks
  bool simulated = false;     ///< contains simulated participants
  std::string attempts_path;  ///< csv only
  std::int64_t answers = 0;   ///< to pages
  std::string pages_path;     ///< csv only
  /// Why the export could not be recorded in the database (forget will not list it), or "".
  std::string not_recorded;
};

/// Counts trials; calls `progress` every 16th.
class ProgressCounter {
 public:
  explicit ProgressCounter(const ExportSettings& settings) : settings_(settings) {}
  void next() {
    constexpr std::int64_t kOften = 16;
    if (++trials_ % kOften == 0 && settings_.progress) settings_.progress(trials_);
  }

 private:
  const ExportSettings& settings_;
  std::int64_t trials_ = 0;
};

}  // namespace palpate::data
