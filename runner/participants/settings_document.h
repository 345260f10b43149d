#pragma once
// The settings of simulated participants as JSON: frozen versions, what an older version does not
// say, patches and the checksum.

#include <nlohmann/json.hpp>
#include <string>

namespace palpate::runner {

/// The frozen settings of a version with every key: switches that it did not know say what it did.
/// \throws std::invalid_argument where there is no such version
nlohmann::json complete_settings(int version);

/// Changes settings by the JSON merge patch (RFC 7396) in a file.
/// \throws protocols::InputError naming unknown keys and wrong values
void patch_settings(nlohmann::json& settings, const std::string& path);

/// Why a setting cannot have that value, as "must be ..."; empty: it can.
/// \param pointer  JSON pointer into the complete settings
/// \param now  what stands there: a number stays a number
std::string setting_fault(const std::string& pointer, const nlohmann::json& value,
                          const nlohmann::json& now);

/// \throws protocols::InputError where a key is missing, unknown or of a wrong value
void check_settings(const nlohmann::json& settings);

/// SHA-256 of complete settings. Keys that their version did not know count only where they differ
/// from what it did: the checksum of unpatched settings is that of the frozen file without spaces.
std::string settings_checksum(nlohmann::json settings);

}  // namespace palpate::runner
