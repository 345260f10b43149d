#pragma once
// The rows that the analysis works on, from a CSV file (the columns of data/export/columns.cpp) or
// a database.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::analysis {

/// One completed trial that is not practice. Names are kept once, in TrialTable.
struct TrialRow {
  std::uint32_t participant = 0;  ///< index into TrialTable::participants
  std::uint16_t renderer = 0;     ///< index into TrialTable::renderers
  std::uint16_t shape = 0;        ///< index into TrialTable::shapes
  std::int32_t answer = -1;       ///< index into TrialTable::answers; -1: none
  bool correct = false;           ///< never for a time-out
  bool timed_out = false;
  double response_time = 0;  ///< s, from time zero; the limit for a time-out
  /// Place in the order of session, block and trial, from 1: among all of the participant's trials,
  /// and among those with this renderer.
  std::uint32_t position = 0, exposure = 0;
};

enum class Simulated { no, yes, mixed };

/// Where the rows come from, as far as it is known; empty: unknown.
struct Provenance {
  std::string source;  ///< path as the user gave it
  std::string protocol_name;
  std::vector<std::string> protocol_sha256;   ///< several: several protocols in one table
  std::vector<std::string> program_versions;  ///< that recorded the rows
  std::string observer_sha256;                ///< settings of the simulated participants
};

struct TrialTable {
  std::vector<std::string> participants;  ///< in order of first appearance
  std::vector<std::string> renderers;     ///< those shown: point, ray, then as they appear
  /// Those shown: sphere, cone, cylinder, cube, then as the protocol lists them or as they appear.
  std::vector<std::string> shapes;
  std::vector<std::string> answers;  ///< shapes, then names that were answered but never shown
  std::vector<TrialRow> rows;        ///< in the order of the source
  std::size_t n_practice = 0;        ///< rows that were left out as practice
  Simulated simulated = Simulated::no;
  Provenance provenance;
  std::vector<std::string> warnings;  ///< odd, but no fault
};

/// Reads trials from CSV: the first nine columns of data/export/columns.cpp in any order,
/// `practice`, `timed_out`, `simulated`, `protocol_sha256` and `program_version` where they exist;
/// others are ignored. Any names of renderers. \throws InputError with every fault (a count of the
/// rest past kMaxFaults); never half a table.
TrialTable read_trials_csv(const std::string& path);

/// Reads the completed trials of a database. \throws InputError where there are none, what
/// Store::open throws where it is no database of ours.
TrialTable read_trials_store(const std::string& path);

/// Faults that are listed one by one before they are only counted.
constexpr std::size_t kMaxFaults = 50;

}  // namespace palpate::analysis
