#pragma once
// Internal to data/: what the exports that are folders say about themselves.

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "data/export/column_definitions.h"
#include "data/export/settings.h"
#include "data/files/atomic_folder.h"
#include "data/store/store.h"

namespace palpate::data {

/// How a protocol is named in the files of a dataset.
struct StudyLabel {
  std::string label;  ///< letters and digits only, unique within the dataset
  ProtocolInfo protocol;
  ProtocolFacts facts;
  std::map<std::string, std::string> files = {};  ///< named in the protocol -> name in the dataset
};

/// SHA-256 -> label, of all protocols of the database. Labels come from the names; two that would
/// be alike get the beginning of their checksum.
std::map<std::string, StudyLabel> label_protocols(Store& store, const ExportSettings& settings);

/// Writes the files that a protocol names to `folder`/LABEL/ in the dataset.
void write_protocol_files(Store& store, const StudyLabel& study, const std::string& folder,
                          const AtomicFolder& draft);

/// \throws StoreRefused: two codes differ in case only (datasets forbid it: some disks could not
/// hold both), or there is no trial to export.
void require_exportable(Store& store);

/// "ho2000", with a mark in capitals where participants are simulated.
std::string dataset_name(const std::map<std::string, StudyLabel>& labels, bool simulated);
/// A sentence on what the data are and who took part.
std::string dataset_description(const std::map<std::string, StudyLabel>& labels, bool simulated);

/// The sentence that stands wherever simulated participants are in the data.
inline constexpr const char* kSimulatedSentence =
    "The participants marked simulated = 1 are SIMULATED: a mechanistic model of a hand and an "
    "observer, no people.";

/// {"0": "...", ...}; stimulus names where the column holds such, as they stand in tables; null for
/// none.
nlohmann::ordered_json column_levels(const Column& column, const ProtocolFacts& facts);
/// {"16": "...", ...} where the column holds fault bits; null for others.
nlohmann::ordered_json column_bits(const Column& column,
                                   const std::vector<FaultMeaning>& fault_bits);
/// {"Description": ..., "Units": ..., "Levels": ..., "Bits": ...}
nlohmann::ordered_json describe(const Column& column, const ProtocolFacts& facts,
                                const std::vector<FaultMeaning>& fault_bits);
/// Those of all protocols in one, for what describes all of a database.
ProtocolFacts all_facts(const std::map<std::string, StudyLabel>& labels);
/// A text as it stands in a table.
std::string guarded_text(std::string_view text);

/// On dates that are none.
inline constexpr const char* kRelativeSentence =
    "Dates are shifted: the first trial of every participant is at 1900-01-01T00:00:00Z, and "
    "elapsed "
    "counts\nthe seconds from it. Intervals are true. palpate export --times absolute tells the "
    "true dates.\n\n";

/// How guarded texts are read, for the notes of every export.
inline constexpr const char* kGuardSentence =
    "A text that begins with = + - @, a tab or a line break has a ' in front, so that no "
    "spreadsheet runs it;\nso has one that begins with '= and the like. Take the ' away to get the "
    "text; palpate analyze --csv does.\n";

/// JSON as the text of a file. Bytes that are no UTF-8 are replaced.
std::string json_text(const nlohmann::ordered_json& json);

}  // namespace palpate::data
