#pragma once
// Internal to data/store: the table of when, and by whom, masked groups were unmasked. Only
// databases in which they were have it.

#include <SQLiteCpp/Database.h>

#include <string>
#include <vector>

#include "data/record.h"

namespace palpate::data {

/// In the order of time. \throws StoreRefused: another program's table of this name
std::vector<Unmasking> read_unmaskings(SQLite::Database& db, const std::string& path);
/// Adds one that is not there yet.
void write_unmasking(SQLite::Database& db, const std::string& path, const Unmasking& one);

}  // namespace palpate::data
