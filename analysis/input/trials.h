#pragma once
// The trials that are analysed, read from a CSV file (columns of data/export/columns.cpp) or a
// database.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::analysis {

/// One completed trial that is not practice. Names are indices into the lists of TrialTable.
struct TrialRow {
  std::uint32_t participant = 0;  ///< index into TrialTable::participants
  std::uint16_t renderer = 0;     ///< index into TrialTable::renderers
  std::uint16_t shape = 0;        ///< index into TrialTable::shapes
  std::int32_t answer = -1;       ///< index into TrialTable::answers; -1: none
  bool correct = false;           ///< false for a time-out
  bool timed_out = false;
  double response_time =
      0;  ///< s, from the first servo tick with forces on; of a time-out the limit
  /// Rank in the order of session, block and trial, from 1: position among all trials of the
  /// participant, exposure among those with this renderer.
  std::uint32_t position = 0, exposure = 0;
};

/// Whether the participants are simulated.
enum class Simulated { no, yes, mixed };

/// Origin of the rows; empty: unknown.
struct Provenance {
  std::string source;  ///< path as the user gave it
  std::string protocol_name;
  std::vector<std::string> protocol_sha256;   ///< of all protocols in the table
  std::vector<std::string> program_versions;  ///< of the programs that recorded the rows
  std::string observer_sha256;                ///< settings of the simulated participants
};

/// All trials of a study, and the levels of participant, renderer, shape and answer.
struct TrialTable {
  std::vector<std::string> participants;  ///< in order of first appearance
  std::vector<std::string> renderers;     ///< point, ray, then in order of first appearance
  /// Shapes that were shown: sphere, cone, cylinder, cube, then in the order of the protocol or of
  /// first appearance.
  std::vector<std::string> shapes;
  std::vector<std::string> answers;  ///< shapes, then names that occur only as answers
  std::vector<TrialRow> rows;        ///< in the order of the source
  std::size_t n_practice = 0;        ///< practice trials that were left out
  Simulated simulated = Simulated::no;
  Provenance provenance;
  std::vector<std::string> warnings;  ///< contradictions and replacements that are no errors
};

/// Reads trials from CSV: the first nine columns of data/export/columns.cpp in any order,
/// `practice`, `timed_out`, `simulated`, `protocol_sha256` and `program_version` where they exist;
/// others are ignored. \throws protocols::InputError with every fault (beyond kMaxFaults their
/// number).
TrialTable read_trials_csv(const std::string& path);

/// Reads the completed trials of a database. \throws protocols::InputError if there are none, and
/// what data::Store::open throws.
TrialTable read_trials_store(const std::string& path);

/// Number of faults that are listed; further ones are counted.
constexpr std::size_t kMaxFaults = 50;

}  // namespace palpate::analysis
