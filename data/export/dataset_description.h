#pragma once
// Internal to data/export: the texts and JSON with which dataset folders describe themselves:
// labels of protocols, names, columns.

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

/// A protocol and its names in the files of a dataset.
struct StudyLabel {
  std::string label;  ///< letters and digits only, unique within the dataset
  ProtocolInfo protocol;
  ProtocolFacts facts;
  std::map<std::string, std::string> files = {};  ///< named in the protocol -> name in the dataset
};

/// SHA-256 -> label, of all protocols of the database. Labels are the names without other
/// characters than letters and digits; equal ones get their checksum appended.
std::map<std::string, StudyLabel> label_protocols(Store& store, const ExportSettings& settings);

/// Writes the files that a protocol names to `folder`/LABEL/ in the dataset.
void write_protocol_files(Store& store, const StudyLabel& study, const std::string& folder,
                          const AtomicFolder& draft);

/// \throws StoreRefused: two codes differ in case only (on case-insensitive file systems their
/// files would collide), or there is no completed trial.
void require_exportable(Store& store);

/// "ho2000", or "ho2000 (SIMULATED participants)".
std::string dataset_name(const std::map<std::string, StudyLabel>& labels, bool simulated);
/// A sentence on the task and the participants.
std::string dataset_description(const std::map<std::string, StudyLabel>& labels, bool simulated);

/// In every description of data with simulated participants.
inline constexpr const char* kSimulatedSentence =
    "The participants marked simulated = 1 are SIMULATED: a mechanistic model of a hand and an "
    "observer, no people.";

/// Value -> meaning, including the names of stimuli as they are in the table; null: the values are
/// no codes.
nlohmann::ordered_json column_levels(const Column& column, const ProtocolFacts& facts);
/// As the protocols say where theirs is the only one.
std::string unit_of(const Column& column, const ProtocolFacts& facts);
/// Fault bit -> meaning for the columns of fault bits; null for others.
nlohmann::ordered_json column_bits(const Column& column,
                                   const std::vector<FaultMeaning>& fault_bits);
/// {"Description": ..., "Units": ..., "Levels": ..., "Bits": ...}
nlohmann::ordered_json describe_column(const Column& column, const ProtocolFacts& facts,
                                       const std::vector<FaultMeaning>& fault_bits);
/// The stimuli of all protocols together.
ProtocolFacts all_facts(const std::map<std::string, StudyLabel>& labels);
/// A text as it is in a table: with a guard against formulas where it needs one.
std::string guarded_text(std::string_view text);

/// Explains relative times.
inline constexpr const char* kRelativeSentence =
    "Dates are shifted: the first trial of every participant is at 1900-01-01T00:00:00Z, and "
    "elapsed "
    "counts\nthe seconds from it. Intervals are true. palpate export --times absolute tells the "
    "true dates.\n\n";

/// Explains how to read guarded texts.
inline constexpr const char* kGuardSentence =
    "A text that begins with = + - @, a tab or a line break has a ' in front, so that no "
    "spreadsheet runs it;\nso has one that begins with '= and the like. Take the ' away to get the "
    "text; palpate analyze --csv does.\n";

/// JSON as the text of a file. Invalid UTF-8 is replaced.
std::string json_text(const nlohmann::ordered_json& json);

}  // namespace palpate::data
