#include "runner/registration/verify_descriptions.h"

#include <stdlib.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <system_error>
#include <tuple>

#include "data/base/json_text.h"
#include "data/export/csv.h"
#include "data/store/store.h"
#include "runner/registration/sealed_folder.h"
#include "runner/study/export_settings.h"
#include "runner/usage_error.h"

namespace palpate::runner::registration {
namespace {

namespace fs = std::filesystem;
using PlainJson = nlohmann::json;

constexpr const char* kCodebook = "data/codebook.csv";
// Their rows follow from the sessions, not from the protocols.
constexpr const char* kOfSessions = "torque_driven";

/// A folder that is removed with what is in it.
class Scratch {
 public:
  Scratch() : path_((fs::temp_directory_path() / "palpate-verify-XXXXXX").string()) {
    if (::mkdtemp(path_.data()) == nullptr)
      throw UsageError(path_ + ": no folder can be made here for the comparison; set TMPDIR");
  }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  std::string file(const char* name) const { return (fs::path(path_) / name).string(); }

 private:
  std::string path_;
};

/// The codebook as an export makes it of a database with these protocols.
TextTable codebook_of(const std::vector<analysis::ProtocolText>& protocols) {
  const Scratch scratch;
  const std::string path = scratch.file("codebook.csv");
  data::ExportSettings settings = study::export_settings();
  settings.times = data::Times::relative;
  data::Store store =
      data::Store::open(scratch.file("protocols.db"), data::Store::Mode::write_or_create);
  for (const analysis::ProtocolText& one : protocols)
    store.enrol({one.name, one.text, one.sha256}, "P1", std::nullopt, true);
  data::export_codebook(store, path, settings);
  return read_text_table(path);
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

/// variableMeasured of Psych-DS: one for each name, in the words of any of the tables.
void compare_variables(const PlainJson& json, const std::string& file, const Codebook& made,
                       std::vector<std::string>& faults) {
  const PlainJson list =
      json.is_object() ? json.value("variableMeasured", PlainJson()) : PlainJson();
  if (!list.is_array()) return faults.push_back(file + ": has no variableMeasured");
  for (const PlainJson& one : list) {
    if (!one.is_object() || !one.contains("name") || !one["name"].is_string()) continue;
    const std::string name = one["name"];
    const std::string text = one.value("description", ""), unit = one.value("unitText", "");
    bool known = false, fits = false;
    for (const auto& [key, described] : made) {
      if (key.second != name || key.first == "pages") continue;
      known = true;
      fits |= text.starts_with(described.description) && unit == described.unit &&
              says_values(text, described);
    }
    if (known && !fits)
      faults.push_back(file + ": " + name + " is described in another way than by the protocols");
  }
}

/// A sidecar of BIDS: {"column": {"Description": ..., "Units": ..., "Levels": ...}}.
void compare_sidecar(const PlainJson& json, const std::string& file, const Codebook& made,
                     std::vector<std::string>& faults) {
  if (!json.is_object()) return faults.push_back(file + ": is no object");
  for (const auto& [key, described] : made) {
    if (key.first != "trials" || !json.contains(key.second)) continue;
    const PlainJson& one = json[key.second];
    const bool same_words = one.is_object() &&
                            one.value("Description", PlainJson()) == described.description &&
                            one.value("Units", "") == described.unit;
    const PlainJson levels =
        one.is_object() ? one.value("Levels", one.value("Bits", PlainJson::object())) : PlainJson();
    // A sidecar is of one protocol, the codebook of all; what a run was made with is added there.
    const bool same_values = std::ranges::all_of(levels.items(), [&](const auto& level) {
      const auto at = described.values.find(level.key());
      return at == described.values.end() || level.value() == at->second;
    });
    if (!same_words || !same_values)
      faults.push_back(file + ": " + key.second +
                       " is described in another way than by the protocols");
  }
}

}  // namespace

std::vector<std::string> description_faults(const std::string& folder, const BundleFacts& facts) {
  std::vector<std::string> faults;
  const Codebook made = read_codebook(codebook_of(facts.record.protocols), faults);
  const std::string path = (fs::path(folder) / kCodebook).string();
  read_member(folder, kCodebook);  // refuses links
  compare_codebooks(read_codebook(read_text_table(path), faults), made, faults);
  for (const std::string& name : files_below(folder)) {
    if (!name.starts_with("data/" + facts.format + "/")) continue;
    if (name.ends_with("_beh.json"))
      compare_sidecar(json_or_discarded(read_member(folder, name)), name, made, faults);
    if (facts.format == "psych-ds" && name.ends_with("/dataset_description.json"))
      compare_variables(json_or_discarded(read_member(folder, name)), name, made, faults);
  }
  return faults;
}

}  // namespace palpate::runner::registration
