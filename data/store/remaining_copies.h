#pragma once
// Internal to data/: what a withdrawal does not reach.

#include <string>
#include <vector>

namespace palpate::data {

/// Files and folders beside the database and beside its exports that hold `code`: copies and other
/// databases of palpate, and texts (tables, reports, figures) that name it, in their name or
/// content. Not the database with its log, nor `known`. Looks into no file of more than 256 MiB but
/// databases.
std::vector<std::string> find_remaining_copies(const std::string& database, const std::string& code,
                                               const std::vector<std::string>& known);

/// Whether `text` says `code` as a word of its own.
bool mentions(const std::string& text, const std::string& code);

}  // namespace palpate::data
