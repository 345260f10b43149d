#include "runner/registration/verify_descriptions.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <utility>

#include "data/base/json_text.h"
#include "data/export/csv.h"
#include "runner/registration/sealed_folder.h"
#include "runner/study/export_settings.h"

namespace palpate::runner::registration {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCodebook = "data/codebook.csv";
constexpr const char* kOtherwise = " is described in another way than by the protocols";
// Their rows follow from the sessions, not from the protocols.
constexpr const char* kOfSessions = "torque_driven";

/// The codebook as an export makes it for these protocols.
TextTable codebook_of(const std::vector<analysis::ProtocolText>& protocols) {
  data::ExportSettings settings = study::export_settings();
  settings.times = data::Times::relative;
  std::vector<data::ProtocolInfo> infos;
  infos.reserve(protocols.size());
  for (const analysis::ProtocolText& one : protocols)
    infos.push_back({one.name, one.text, one.sha256});
  TextTable out;
  for (const data::CodebookRow& row : data::codebook_of(infos, settings))
    out.rows.emplace_back(row.begin(), row.end());
  out.header = std::move(out.rows.front());
  out.rows.erase(out.rows.begin());
  return out;
}

/// Of a column of a table: its unit, its description, and the meanings of its values.
struct Described {
  std::string unit, description;
  std::map<std::string, std::string> values;
  bool operator==(const Described&) const = default;
};
using Codebook = std::map<std::pair<std::string, std::string>, Described>;

Codebook read_codebook(const TextTable& table, std::vector<std::string>& faults) {
  Codebook out;
  if (table.header != std::vector<std::string>{"table", "column", "unit", "value", "meaning"}) {
    faults.push_back(std::string(kCodebook) + ": has other columns than a codebook");
    return out;
  }
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const auto& row = table.rows[i];
    if (row[1] == kOfSessions) continue;
    const auto [at, added] = out.try_emplace({row[0], row[1]});
    Described& described = at->second;
    const bool again =
        row[3].empty() ? !added : !described.values.try_emplace(row[3], row[4]).second;
    if (again || (!row[3].empty() && row[2] != described.unit))
      faults.push_back(std::string(kCodebook) + ", row " + std::to_string(i + 1) + ": describes " +
                       row[1] + " a second time, or in another unit");
    if (row[3].empty() && added) described = {row[2], row[4], {}};
  }
  return out;
}

void compare_codebooks(const Codebook& stored, const Codebook& made,
                       std::vector<std::string>& faults) {
  const auto fault = [&](const auto& name, const std::string& words) {
    faults.push_back(std::string(kCodebook) + ": " + name.first + ", " + name.second + ": " +
                     words);
  };
  for (const auto& [name, described] : made) {
    const auto at = stored.find(name);
    if (at == stored.end()) {
      fault(name, "is missing");
    } else if (at->second.description != described.description ||
               at->second.unit != described.unit) {
      fault(name, "has another meaning or unit than by the protocols");
    } else if (at->second.values != described.values) {
      fault(name, "its values have other meanings than by the protocols");
    }
  }
  for (const auto& [name, described] : stored)
    if (!made.contains(name)) fault(name, "is no column by the protocols");
}

/// "Values: 0 = no; 1 = yes." is in a text for each value.
bool says_values(const std::string& text, const Described& described) {
  return std::ranges::all_of(described.values, [&](const auto& value) {
    const std::string said = " " + value.first + " = " + value.second;
    return text.find(said + ";") != std::string::npos || text.ends_with(said + ".");
  });
}

/// A text of an object; "": there is none.
std::string text_of(const nlohmann::json& object, const char* key) {
  const auto at = object.find(key);
  return at == object.end() || !at->is_string() ? "" : at->get<std::string>();
}

/// variableMeasured of Psych-DS: one for each name, in the words of any of the tables.
void compare_variables(const nlohmann::json& json, const std::string& file, const Codebook& made,
                       std::vector<std::string>& faults) {
  if (!json.is_object() || !json.contains("variableMeasured") ||
      !json["variableMeasured"].is_array())
    return faults.push_back(file + ": has no list variableMeasured");
  std::set<std::string> names;
  for (const nlohmann::json& one : json["variableMeasured"]) {
    const std::string name = one.is_object() ? text_of(one, "name") : "";
    if (!names.insert(name).second) faults.push_back(file + ": describes " + name + " twice");
    bool known = false, fits = false;
    for (const auto& [key, described] : made) {
      if (key.second != name) continue;
      known = true;
      const std::string text = text_of(one, "description");
      fits |= text.starts_with(described.description) &&
              text_of(one, "unitText") == described.unit && says_values(text, described);
    }
    if (known && !fits) faults.push_back(file + ": " + name + kOtherwise);
  }
  for (const auto& [key, described] : made)
    if (key.first == "trials" && !names.contains(key.second))
      faults.push_back(file + ": does not describe " + key.second);
}

/// A sidecar of BIDS: {"column": {"Description": ..., "Units": ..., "Levels": ...}}.
/// \param one_protocol  the codebook is of the sidecar's protocol alone
void compare_sidecar(const nlohmann::json& json, const std::string& file, const Codebook& made,
                     bool one_protocol, std::vector<std::string>& faults) {
  if (!json.is_object()) return faults.push_back(file + ": is no object");
  for (const auto& [key, described] : made) {
    // Of a column of another protocol it says nothing.
    const auto at = key.first == "trials" ? json.find(key.second) : json.end();
    if (at == json.end()) continue;
    bool fits = at->is_object() && text_of(*at, "Description") == described.description &&
                text_of(*at, "Units") == described.unit;
    std::size_t explained = 0;
    for (const char* const values : {"Levels", "Bits"}) {
      if (!fits || !at->contains(values)) continue;
      const nlohmann::json& levels = (*at)[values];
      fits = levels.is_object();
      for (const auto& [value, meaning] : levels.items()) {
        const auto known = described.values.find(value);  // none: what sessions were run with
        if (known == described.values.end()) continue;
        fits &= meaning == known->second;
        ++explained;
      }
    }
    if (one_protocol) fits &= explained == described.values.size();
    if (!fits) faults.push_back(file + ": " + key.second + kOtherwise);
  }
}

}  // namespace

std::vector<std::string> description_faults(const std::string& folder, const BundleFacts& facts) {
  std::vector<std::string> faults;
  const Codebook made = read_codebook(codebook_of(facts.record.protocols), faults);
  try {
    read_member(folder, kCodebook);  // refuses links
    const TextTable stored = read_text_table((fs::path(folder) / kCodebook).string());
    compare_codebooks(read_codebook(stored, faults), made, faults);
  } catch (const std::runtime_error& error) {  // UsageError and InputError, too
    faults.emplace_back(error.what());
  }
  const bool one_protocol = facts.record.protocols.size() == 1;
  for (const std::string& name : files_below(folder)) {
    if (!name.starts_with("data/" + facts.format + "/")) continue;
    if (name.ends_with("_beh.json"))
      compare_sidecar(json_or_discarded(read_member(folder, name)), name, made, one_protocol,
                      faults);
    if (facts.format == "psych-ds" && name.ends_with("/dataset_description.json"))
      compare_variables(json_or_discarded(read_member(folder, name)), name, made, faults);
  }
  return faults;
}

}  // namespace palpate::runner::registration
