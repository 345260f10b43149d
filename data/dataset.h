#pragma once
// Internal to data/: what the exports that are folders say about themselves.

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "data/columns.h"
#include "data/export.h"
#include "data/store.h"

namespace palpate {

/// How a protocol is named in the files of a dataset.
struct StudyLabel {
  std::string label;  ///< letters and digits only, unique within the dataset
  ProtocolInfo protocol;
  ProtocolFacts facts;
};

/// SHA-256 -> label, of all protocols of the database. Labels come from the names; two that would
/// be alike get the beginning of their checksum.
std::map<std::string, StudyLabel> label_protocols(Store& store, const ExportSettings& settings);

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

/// {"0": "...", ...}; stimulus names where the column holds such; null for none.
nlohmann::ordered_json levels_of(const Column& column, const ProtocolFacts& facts);

/// JSON as the text of a file. Bytes that are no UTF-8 are replaced.
std::string json_text(const nlohmann::ordered_json& json);

}  // namespace palpate
