#pragma once
// Internal to data/store: copies of a participant's data that a withdrawal does not remove.

#include <string>
#include <vector>

namespace palpate::data {

/// Files beside the database, beside its exports and in the folders there that hold `code` or may:
///
/// * other palpate databases, whatever their names, with their logs;
/// * texts (tables, reports, figures) with the code in their name or content;
/// * files that are named after the database and cannot be searched (compressed, not readable,
/// above
///   256 MiB).
///
/// A folder with the code in the name of a file in it, as in a dataset, is named as a whole. Leaves
/// out the database and its -wal, -shm, -journal, and `known`. Follows no links. After 100,000
/// entries or 8 GiB it ends and names the folder that it was in.
std::vector<std::string> find_remaining_copies(const std::string& database, const std::string& code,
                                               const std::vector<std::string>& known);

/// Whether `text` contains `code` as a word of its own.
bool mentions(const std::string& text, const std::string& code);

}  // namespace palpate::data
