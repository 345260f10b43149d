#pragma once
// The description of a bundle as RO-Crate 1.2 (https://w3id.org/ro/crate/1.2).

#include <cstdint>
#include <string>
#include <vector>

#include "data/export/study_about.h"

namespace palpate::runner::registration {

struct CrateFile {
  std::string name;  ///< in the bundle, folders separated by '/'
  std::uint64_t bytes = 0;
  std::string sha256;       ///< "": neither checksum nor size is stated
  std::string description;  ///< "" for none
};

struct CrateFacts {
  std::string name, description;
  std::string date;  ///< "2026-11-25"
  std::string program_version;
  data::StudyAbout about;  ///< with a license
  std::vector<CrateFile> files;
  /// How one file was made from others: name, sources, results.
  struct Action {
    std::string id, name;
    std::vector<std::string> sources, results;
  };
  std::vector<Action> actions;
};

/// ro-crate-metadata.json
std::string ro_crate_json(const CrateFacts& facts);

}  // namespace palpate::runner::registration
