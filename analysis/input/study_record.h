#pragma once
// What a database records of a study beside responses: servo timing, protocols, devices and builds.
// A CSV table of trials has none of it.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::analysis {

// In how many trials a device that drives force alone left the renderer's torque out.

class TorqueCounts {
 public:
  /// \param driven  missing: unknown, or the renderer gives none
  void add(std::string_view renderer, std::optional<bool> driven);
  /// Adds a sentence for each renderer whose torque was left out in a trial.
  void warn(std::vector<std::string>& warnings) const;

 private:
  struct Count {
    std::size_t trials = 0, left_out = 0;
  };
  std::map<std::string, Count, std::less<>> counts_;
};

/// Servo timing and forces of all completed trials with one renderer, without practice.
struct ServoQuality {
  /// Histogram of the longest servo period of each trial: logarithmic bins from kLowest on, the
  /// last open above.
  static constexpr int kBinsPerDecade = 20, kBins = 100;
  static constexpr double kLowest = 1e-4;  ///< s

  std::string renderer;
  std::size_t n_trials = 0, n_with_missed = 0, n_with_faults = 0, n_started_inside = 0;
  std::uint64_t ticks = 0, missed_ticks = 0;
  std::array<std::size_t, kBins> longest_periods{};  ///< number of trials by bin
  double longest_period = 0;                         ///< s, largest of all trials
  double max_force = 0;                              ///< N, largest of all trials
};

/// What a protocol's text gives as its title; "": none.
std::string title_of_protocol(const std::string& text);

/// A protocol as stored in the database.
struct ProtocolText {
  std::string name, sha256, text;
  std::string title;  ///< empty: none
  std::string seed;   ///< of the trial orders, as written in the protocol; empty: none
};

/// All of it; empty for a table of trials.
struct StudyRecord {
  std::vector<ServoQuality> servo;  ///< one for each renderer, sorted by name; empty: unknown
  std::vector<ProtocolText> protocols;
  std::vector<std::string> devices, builds, response_devices;
  std::vector<std::string> seeds;  ///< of simulated participants, "CODE: SEED"
  std::size_t n_cut_off = 0;       ///< attempts that were interrupted and repeated
  /// How the study was held against its registration; empty: it was not.
  std::string checked;     ///< a sentence
  std::string check_page;  ///< file name of the page beside the report
};

/// \param database path \throws what data::Store::open throws
StudyRecord read_study_record(const std::string& database);

}  // namespace palpate::analysis
