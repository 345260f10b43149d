#pragma once
// Names of the temporary files and folders that are renamed to their final name when they are
// complete, and removal of those that killed processes left.

#include <string>

namespace palpate::data {

/// ".NAME.palpate-" in the folder of the target; six random characters follow.
std::string temporary_prefix(const std::string& target);

/// Removes the temporary files and folders for `target` that belong to this user and that no
/// process has locked: their process has ended.
void remove_stale_temporaries(const std::string& target);
/// The same for all targets in a folder.
void remove_stale_temporaries_in(const std::string& folder);

/// Six random characters, as mkstemp puts at the end of a name.
std::string random_letters();

}  // namespace palpate::data
