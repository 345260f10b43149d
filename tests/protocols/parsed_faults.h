#pragma once
// The faults of the protocols and scenes of tests.

#include <filesystem>
#include <string>
#include <vector>

#include "protocols/parse.h"

namespace palpate::protocols {

/// Whether a test file is a scene; else it is a protocol.
inline bool is_scene(const std::filesystem::path& path) {
  return path.filename().string().rfind("scene", 0) == 0;
}

/// Reads a scene or a protocol.
inline void parse_file(const std::filesystem::path& path) {
  if (is_scene(path)) {
    parse_scene(path.string());
  } else {
    parse_protocol(path.string());
  }
}

/// The faults of the InputError that `parse` throws; empty if it does not throw.
template <class Parse>
std::vector<Fault> faults_when(Parse&& parse) {
  try {
    parse();
  } catch (const InputError& error) {
    return error.faults();
  }
  return {};
}

}  // namespace palpate::protocols
