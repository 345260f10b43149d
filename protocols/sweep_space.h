#pragma once
// The space of a sweep: the varied values of the simulated participant and of the protocol, each
// with its distribution. Meaning of the keys: sweep_space.schema.json.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace palpate::protocols {

enum class SweptDocument { participant, protocol };
enum class DistributionKind { uniform, log_uniform, normal, choice };
const char* to_string(DistributionKind kind);  ///< as in the file

struct SweepParameter {
  std::string name;  ///< unique; letters, digits, '_' and '-'
  SweptDocument of = SweptDocument::participant;
  std::string group;               ///< participant: of this group alone; "": of all
  std::vector<std::string> paths;  ///< JSON pointers; all get the same value
  DistributionKind distribution = DistributionKind::uniform;
  double low = 0, high = 1;            ///< limits; normal: truncated there, not clipped
  double mean = 0, sd = 1;             ///< normal, before truncation; a limit within 37 sd
  std::vector<nlohmann::json> values;  ///< choice: numbers, words, true or false; equally likely

  /// The quantile for a share `u` of the distribution, 0 <= u <= 1. choice: the value whose part of
  /// [0, 1) contains u.
  nlohmann::json value_at(double u) const;
};

struct SweepSpace {
  int version = 1;
  std::vector<SweepParameter> parameters;  ///< at least one
  std::string source_text;                 ///< the file, byte for byte
};

/// Reads and checks a space. Does not check that its pointers lead anywhere.
/// \throws InputError with every fault.
SweepSpace parse_sweep_space(const std::string& path);
SweepSpace parse_sweep_space_text(const std::string& text, const std::string& file_name);

}  // namespace palpate::protocols
