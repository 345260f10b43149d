#pragma once
// Internal to data/store: the table of the frames in which trials were seen. Only databases in
// which something was seen have it. The task of its trial, which is sealed, has a checksum of them.

#include <SQLiteCpp/Database.h>

#include <cstdint>
#include <string>
#include <vector>

#include "data/record.h"

namespace palpate::data {

/// \throws StoreRefused: another program's table of this name
bool has_frames(SQLite::Database& db, const std::string& path);
void write_frames(SQLite::Database& db, std::int64_t attempt,
                  const std::vector<FrameRecord>& frames);
/// In order; empty where there is no such table.
std::vector<FrameRecord> read_frames(SQLite::Database& db, std::int64_t attempt);
/// SHA-256 in hex.
std::string frames_checksum(const std::vector<FrameRecord>& frames);

}  // namespace palpate::data
