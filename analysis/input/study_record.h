#pragma once
// What a database knows of a study beside its answers: how well the servo kept time, the protocol,
// machines. A table of trials has none of it.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace palpate::analysis {

/// Of all completed trials with one renderer, practice left out.
struct ServoQuality {
  /// Bins of the longest period of a trial: so many for each factor of ten, from kLowest on.
  static constexpr int kBinsPerDecade = 20, kBins = 100;
  static constexpr double kLowest = 1e-4;  ///< s

  std::string renderer;
  std::size_t n_trials = 0, n_with_missed = 0, n_with_faults = 0, n_started_inside = 0;
  std::uint64_t ticks = 0, missed_ticks = 0;
  std::array<std::size_t, kBins> longest_periods{};  ///< trials by longest period
  double longest_period = 0;                         ///< s, of all
  double max_force = 0;                              ///< N
};

struct ProtocolText {
  std::string name, sha256, text;
  std::string title;  ///< the protocol's own; empty: none
  std::string seed;   ///< of its orders, as it stands there; empty: none
};

struct ReportRecord {
  std::vector<ServoQuality> servo;  ///< by renderer, point before ray; empty: not known
  std::vector<ProtocolText> protocols;
  std::vector<std::string> devices, builds, response_devices;
  std::vector<std::string> seeds;  ///< of simulated participants, "CODE: SEED"
  std::size_t n_cut_off = 0;       ///< attempts that were shown again
};

/// \throws what Store::open throws
ReportRecord read_report_record(const std::string& database);

}  // namespace palpate::analysis
