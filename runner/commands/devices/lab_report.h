#pragma once
// `palpate devices --report FILE`: the facts about a lab's device that palpate's developers need,
// in one file without personal data.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace palpate::runner::commands {

/// Kernel, processor and real-time rights, without names of computers or users.
nlohmann::ordered_json machine_facts();

/// Removes personal data from all texts: a serial number keeps its last two letters, a path its
/// file name; names of the user, the home folder and the computer are left out.
/// \param serials  requested ones, besides those in the findings
nlohmann::ordered_json without_personal_data(nlohmann::ordered_json findings,
                                             std::vector<std::string> serials);

}  // namespace palpate::runner::commands
