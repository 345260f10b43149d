#pragma once
// Internal to data/store: copies of a participant's data that a withdrawal does not remove.

#include <string>
#include <vector>

namespace palpate::data {

/// Files and folders beside the database and beside its exports that contain `code`: other palpate
/// databases, and texts (tables, reports, figures) with the code in their name or content. Leaves
/// out the database and its -wal, -shm, -journal, and `known`. Files above 256 MiB are searched
/// only if they are databases.
std::vector<std::string> find_remaining_copies(const std::string& database, const std::string& code,
                                               const std::vector<std::string>& known);

/// Whether `text` contains `code` as a word of its own.
bool mentions(const std::string& text, const std::string& code);

}  // namespace palpate::data
