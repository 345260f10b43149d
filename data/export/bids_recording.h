#pragma once
// Internal to data/export: the servo samples of a BIDS run as one physiological recording
// (https://bids-specification.readthedocs.io, "Physiological recordings"), or one of motion, with
// the files beside it ("Motion").

#include <array>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "data/export/dataset_description.h"
#include "data/export/exported_columns.h"
#include "data/files/text_sink.h"
#include "data/store/store.h"

namespace palpate::data {

/// Name of the tracking system in files: tracksys-stylus.
inline constexpr const char* kTrackingSystem = "stylus";

/// The trials of a recording, and their intervals if they have several.
class MotionEvents {
 public:
  /// \param slot  of the trial's onset, in servo periods from the start of the run
  void add(const StoredTrial& trial, std::int64_t slot);
  /// ..._events.tsv. \param first_row  slot of the recording's first row
  std::string table(std::int64_t first_row, const ProtocolFacts& facts) const;
  static nlohmann::ordered_json description(const ProtocolFacts& facts);

 private:
  struct Event {
    std::int64_t slot = 0;
    double since = 0;  ///< s, from the slot
    double duration = 0;
    int trial = 0, interval = 0;  ///< interval 0: the trial as a whole
    std::string renderer, shape, response;
    std::optional<double> level;
    std::optional<bool> correct;
    std::array<double, 4> orientation_wxyz{};
    std::optional<double> seen_on, sound;  ///< s, from the onset
  };
  std::vector<Event> events_;
};

/// ..._channels.tsv: one row per column of the recording. Tip, tail and a moving stimulus are
/// tracked points; BIDS has no type for forces, so they are MISC with their units.
std::string motion_channels(const std::vector<Column>& columns);
/// ..._channels.json: the reference frame of the channels.
nlohmann::ordered_json motion_frames();

/// A TSV without header, gzipped except for motion (as BIDS requires), one row per servo period
/// from the first sample to the last. BIDS requires a constant sampling frequency: periods between
/// trials and missed ticks are rows of n/a. Time is relative to the onset of the first trial of the
/// run.
class BidsRecording {
 public:
  struct File {
    /// \param jobs  threads that compress; 0: not compressed
    File(const std::string& path, int jobs) : sink(path) {
      if (jobs > 0) gzip.emplace(sink, jobs);
    }
    void close() {
      if (gzip) gzip->finish();
      sink.close(false);
    }
    void write(const std::string& row) {
      if (gzip)
        gzip->write(row);
      else
        sink.write(row);
    }
    FileSink sink;
    std::optional<GzipSink> gzip;
  };

  /// Starts with this trial, which need not have samples. \param study of the protocol
  BidsRecording(const StoredTrial& first, const StudyLabel& study, const ExportSettings& settings);

  /// Whether a trial belongs to the same recording: shown by the same process, later than the last
  /// one, and by at most a minute (longer gaps would be more n/a than data).
  bool continues_with(const StoredTrial& trial) const;
  /// \param path of the file, which is created with the first samples
  /// \throws StoreRefused: the samples are damaged.
  void add(const StoredTrial& trial, const std::string& path);
  /// \return the file, to be closed; null: no trial had samples
  std::unique_ptr<File> finish();
  /// After finish(): the JSON beside a physiological recording.
  nlohmann::ordered_json physio_sidecar() const;
  /// After finish(): the JSON beside a motion recording.
  nlohmann::ordered_json motion_sidecar() const;
  /// Rows and stimulus of each trial; BIDS allows no such keys beside motion.
  void put_trials(nlohmann::ordered_json& sidecar) const;
  const std::vector<Column>& columns() const { return columns_; }
  /// ..._events.tsv of a motion recording.
  std::string motion_events() const;
  /// Time of the first row, ns since 1970.
  std::int64_t first_row_ns() const;

 private:
  std::optional<std::int64_t> slot_of(std::int64_t unix_ns) const;

  const StudyLabel& study_;
  const ExportSettings& settings_;
  const RunInfo run_;
  const bool simulated_;
  const std::vector<Column> columns_;
  const std::int64_t begin_ns_;                // since 1970
  std::int64_t free_ = 0;                      // the first slot after all trials so far
  std::int64_t first_row_ = 0, next_row_ = 0;  // slots
  std::unique_ptr<File> file_;
  nlohmann::ordered_json trials_ = nlohmann::ordered_json::array();
  MotionEvents events_;
};

}  // namespace palpate::data
