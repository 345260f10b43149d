#pragma once
// Internal to data/: names of the temporary files and folders that a program writes before it gives
// them their final name by an atomic rename, and removal of those that killed programs left.

#include <string>

namespace palpate::data {

/// ".NAME.palpate-" beside the target: how the names of all drafts for it begin; six letters
/// follow.
std::string temporary_prefix(const std::string& target);

/// Removes drafts for `target`, files and folders, that are ours and that nobody holds a lock on:
/// their program is dead.
void remove_stale_temporaries(const std::string& target);
/// The same for all targets in a folder.
void remove_stale_temporaries_in(const std::string& folder);

/// Six random characters, as mkstemp puts at the end of a name.
std::string random_letters();

}  // namespace palpate::data
