#pragma once
// Internal to data/export: what stands beside the samples of a BIDS run that is written as motion
// (https://bids-specification.readthedocs.io, "Motion").

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "data/export/dataset_description.h"
#include "data/store/store.h"

namespace palpate::data {

/// Name of the tracking system in files: tracksys-stylus.
inline constexpr const char* kTrackingSystem = "stylus";

/// ..._channels.tsv: a row a column of the recording. Tip, tail and a stimulus that moves are
/// tracked points; BIDS has no type for forces, so they are MISC with their units.
std::string motion_channels(const std::vector<Column>& columns);
/// ..._channels.json: the frame that the channels are in.
nlohmann::ordered_json motion_frames();
/// What BIDS asks of ..._motion.json besides the task. \param rows of the recording
nlohmann::ordered_json motion_facts(const std::vector<Column>& columns, double rate,
                                    std::int64_t rows, const RunInfo& run);

/// The trials of a recording, and where they have several intervals those as well.
class MotionEvents {
 public:
  /// \param slot  of the trial's onset, servo periods from the begin of the run
  void add(const StoredTrial& trial, std::int64_t slot);
  /// ..._events.tsv. \param first_row  slot of the recording's first row
  std::string table(std::int64_t first_row, double rate) const;
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
  };
  std::vector<Event> events_;
};

}  // namespace palpate::data
