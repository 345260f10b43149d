#pragma once
// Records of a study other than responses: servo timing, protocols, devices and builds. Only a
// database has them, not a CSV table.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::data {
class Store;
}

namespace palpate::analysis {

/// Counts the trials in which the renderer's torque was left out, because the device drives force
/// alone.
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
  /// The check against the registration; empty: not checked.
  std::string checked;     ///< a sentence
  std::string check_page;  ///< file name of the page beside the report
};

/// As a trial of a table of trials has it.
struct ServoTrial {
  std::string_view renderer;
  std::uint64_t ticks = 0, missed_ticks = 0;
  double longest_period = 0;  ///< s
  bool faults = false, started_inside = false;
  double max_force = 0;  ///< N
};
/// Adds a trial to the servo quality of its renderer; the list stays sorted.
void add_trial(const ServoTrial& trial, std::vector<ServoQuality>& servo);

/// \param protocol  the one that is wanted (is_protocol)
StudyRecord read_study_record(data::Store& store, const std::string& protocol = "");

}  // namespace palpate::analysis
