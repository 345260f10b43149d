#pragma once
// The trials to analyse, read from a CSV file (columns of data/export/delimited_row.cpp) or a
// database.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "analysis/input/study_trial.h"

namespace palpate::data {
class Store;
}

namespace palpate::analysis {

/// A renderer and its reference; all differences are `renderer` minus `reference`.
struct RendererPair {
  std::string reference, renderer;
  /// Indices into TrialTable::renderers; none: no trial with it.
  std::optional<std::size_t> reference_at, renderer_at;

  bool in_data() const { return reference_at && renderer_at; }
  /// Whether this is the comparison of Ho, Basdogan & Srinivasan (2000); only this is shown with
  /// their results.
  bool is_ray_minus_point() const { return reference == "point" && renderer == "ray"; }
};

/// Every further renderer with the first as reference. A single renderer is paired with the other
/// one of point and ray or with "another renderer", without trials: in_data() is false. \param
/// renderers of a TrialTable
std::vector<RendererPair> renderer_pairs(const std::vector<std::string>& renderers);

/// "the point", "the ray"; other names without article.
std::string with_article(const std::string& renderer);

/// "ray − point"
std::string difference_name(const RendererPair& pair);

/// One completed trial that is not practice. Names are indices into the lists of TrialTable.
struct TrialRow {
  std::uint32_t participant = 0;  ///< index into TrialTable::participants
  std::uint16_t renderer = 0;     ///< index into TrialTable::renderers
  std::uint16_t shape = 0;        ///< index into TrialTable::shapes
  std::int32_t answer = -1;       ///< index into TrialTable::answers; -1: none
  bool correct = false;           ///< false for a time-out
  bool timed_out = false;
  double response_time =
      0;  ///< s, from the first servo tick with forces on; for a time-out, the limit
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
  std::vector<std::string> warnings;  ///< contradictions and replacements that are not errors
};

/// Reads trials from CSV: the first nine trial columns of data/export/delimited_row.cpp in any
/// order, and `practice`, `timed_out`, `simulated`, `protocol_sha256` and `program_version` if
/// present; others are ignored. \param protocol  at least six digits that the SHA-256 of the wanted
/// one begins with; "": all \throws protocols::InputError with every fault (beyond kMaxFaults their
/// number).
TrialTable read_trials_csv(const std::string& path, const std::string& protocol = "");
/// The same, of several protocols together. \param protocols  empty: all
TrialTable read_trials_csv(const std::string& path, const std::vector<std::string>& protocols);

/// Puts the shapes into this order; does nothing if it has other names. A table from CSV has them
/// in another order than one from a database, which knows the protocol's.
void order_shapes(TrialTable& table, const std::vector<std::string>& order);

/// A warning: "Trials of 2 different protocols (a, b) are pooled; --protocol chooses one."
std::string pooled_protocols(const Provenance& provenance);

/// Whether `wanted` is the protocol's name, or at least six digits that its SHA-256 begins with.
/// Empty: any protocol is wanted.
bool is_protocol(std::string_view wanted, std::string_view name, std::string_view sha256);

/// Reads the completed trials of a database. \param protocol  the one that is wanted
/// \throws protocols::InputError if there are none.
TrialTable read_trials_store(data::Store& store, const std::string& protocol = "");

/// Number of faults listed; further ones are counted.
constexpr std::size_t kMaxFaults = 50;

/// Missing values as R, pandas, BIDS and spreadsheets write them; a name may be NA.
bool is_missing(std::string_view text);

/// 1, 0, and true and false as R (TRUE), Python (True) and JSON write them; nullopt: another text.
std::optional<bool> truth_of(std::string_view text);

/// Warns of names that differ in case, spaces around them or leading zeros only, as spreadsheets
/// change them: "Participants '1' and '01' look alike; they count as different."
/// \param what  "Participants"
void warn_of_alike(const std::string& what, const std::deque<std::string>& names,
                   std::vector<std::string>& warnings);

/// Adds a value that is new and not empty.
void note_once(const std::string& value, std::vector<std::string>& known);
/// For values that are displayed only: made printable, at most eight are kept.
void note_shown(std::string_view value, std::vector<std::string>& known);

/// Numbers distinct names, from 0, in order of first appearance (string interning).
class Interner {
 public:
  std::uint32_t number(std::string_view name);
  /// Whether the name has a number.
  bool contains(std::string_view name) const {
    return (!names_.empty() && names_[last_] == name) || numbers_.contains(name);
  }
  const std::deque<std::string>& names() const { return names_; }

 private:
  std::deque<std::string> names_;  // a deque: the views in numbers_ stay valid
  std::unordered_map<std::string_view, std::uint32_t> numbers_;
  std::uint32_t last_ = 0;
};

/// Turns rows into a TrialTable: drops practice, numbers and orders the levels of renderer and
/// shape, and warns of contradictions.
class TrialTableBuilder {
 public:
  /// \param trial  of identification; practice is counted and left out
  void add(const StudyTrial& trial);
  /// \param listed the stimuli in the protocol's order; empty: unknown
  /// \throws std::runtime_error: there are only practice trials, or a row is repeated exactly
  TrialTable finish(Provenance provenance, const std::vector<std::string>& listed = {});

 private:
  /// Identifies a trial; with its index in rows_.
  struct TrialKey {
    std::uint32_t participant;
    std::int32_t session, block, trial;
    std::uint32_t protocol, row;
    bool operator<(const TrialKey& other) const {
      return std::tie(participant, session, block, trial, protocol, row) <
             std::tie(other.participant, other.session, other.block, other.trial, other.protocol,
                      other.row);
    }
  };
  /// Sorts keys_ and sets TrialRow::position and exposure.
  void number_trials();
  void check_repeated_trials(TrialTable& table);
  /// " (lines 2 and 7, 3 and 8, and 4 more)": pairs of rows with the same key.
  std::string lines_of(const std::vector<std::pair<std::uint32_t, std::uint32_t>>& rows) const;
  /// Replaces unknown times of time-outs by the largest known limit, else by the longest time of
  /// all trials.
  void fill_times(TrialTable& table);

  Interner participants_, renderers_, stimuli_, protocols_;
  /// By number of the stimulus: order of first presentation from 1; 0: only answered, never shown.
  std::vector<std::uint32_t> shown_;
  std::uint32_t n_shown_ = 0;
  std::vector<TrialRow> rows_;
  std::vector<std::uint32_t> lines_;  ///< of each row, if the source has lines
  std::vector<TrialKey> keys_;
  std::size_t n_practice_ = 0, n_simulated_ = 0, n_contradicting_ = 0, n_late_answers_ = 0;
};

}  // namespace palpate::analysis
