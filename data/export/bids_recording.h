#pragma once
// Internal to data/export: the servo samples of a BIDS run as one physiological recording
// (https://bids-specification.readthedocs.io, "Physiological recordings"), or one of motion.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "data/export/bids_motion.h"
#include "data/export/dataset_description.h"
#include "data/files/text_sink.h"
#include "data/store/store.h"

namespace palpate::data {

/// A TSV without header, gzipped unless it is of motion (BIDS has it so), one row per servo period
/// from the first sample to the last. BIDS requires a constant sampling frequency: periods between
/// trials and missed ticks are rows of n/a. Time is relative to the onset of the first trial of the
/// run.
class BidsRecording {
 public:
  /// Starts with this trial, which need not have samples. \param study of the protocol
  BidsRecording(const StoredTrial& first, const StudyLabel& study, const ExportSettings& settings);

  /// Whether a trial belongs to the same recording: shown by the same process, later than the last
  /// one, and by at most a minute (longer gaps would be more n/a than data).
  bool continues_with(const StoredTrial& trial) const;
  /// \param path of the file, which is created with the first samples
  /// \throws StoreRefused: the samples are damaged.
  void add(const StoredTrial& trial, const std::string& path);
  /// Closes the file. \return false where no trial had samples: there is none.
  bool finish();
  /// After finish(): the JSON beside a physiological recording.
  nlohmann::ordered_json physio_sidecar() const;
  /// After finish(): of one of motion.
  nlohmann::ordered_json motion_sidecar() const;
  /// Where each trial stands and what was felt; BIDS allows no such keys beside motion.
  void put_trials(nlohmann::ordered_json& sidecar) const;
  const std::vector<Column>& columns() const { return columns_; }
  /// Of one of motion: ..._events.tsv.
  std::string motion_events() const;
  /// Of its first row, ns since 1970.
  std::int64_t first_row_ns() const;

 private:
  struct File {
    File(const std::string& path, bool zipped) : sink(path) {
      if (zipped) gzip.emplace(sink);
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
  std::optional<std::int64_t> slot_of(std::int64_t unix_ns) const;

  const StudyLabel& study_;
  const ExportSettings& settings_;
  const RunInfo run_;
  const bool simulated_;
  const std::vector<Column> columns_;
  const std::int64_t begin_ns_;                // since 1970
  std::int64_t free_ = 0;                      // the first slot after all trials so far
  std::int64_t first_row_ = 0, next_row_ = 0;  // slots
  std::optional<File> file_;
  nlohmann::ordered_json trials_ = nlohmann::ordered_json::array();
  MotionEvents events_;
};

}  // namespace palpate::data
