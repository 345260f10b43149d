#pragma once
// Internal to data/: protocols with the files that they name.

#include <SQLiteCpp/Database.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "data/record.h"

namespace palpate::data {

/// The id of a protocol; none where it is not there. \throws StoreRefused: its text or a file
/// differs from what is stored.
std::optional<std::int64_t> find_protocol(SQLite::Database& db, const std::string& path,
                                          const ProtocolInfo& protocol);

/// The same; it is added where it is not there yet. One that came from a version without files gets
/// them.
std::int64_t insert_protocol_if_absent(SQLite::Database& db, const std::string& path,
                                       const ProtocolInfo& protocol);

/// By name.
std::vector<ProtocolFile> protocol_files(SQLite::Database& db, std::int64_t protocol_id);

/// One checksum for all files of a protocol: SHA-256 of, for each by name, its name, a zero byte,
/// its SHA-256 as 64 digits and a line feed. "" where there are none.
std::string files_checksum(SQLite::Database& db, std::int64_t protocol_id);

/// Every protocol's text and every file has the checksum that it had when it was stored.
/// \param version  of the schema. \throws StoreRefused.
void verify_protocol_checksums(SQLite::Database& db, const std::string& path, int version);

}  // namespace palpate::data
