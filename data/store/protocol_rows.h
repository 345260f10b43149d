#pragma once
// Protocols in the database, with the files that they name (meshes). Texts and files are stored
// byte for byte and identified by SHA-256.

#include <SQLiteCpp/Database.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "data/record.h"

namespace palpate::data {

/// The row id of a protocol, if it is stored. \throws StoreRefused: its text or a file differs from
/// the stored one.
std::optional<std::int64_t> find_protocol(SQLite::Database& db, const std::string& path,
                                          const ProtocolInfo& protocol);

/// The same; inserts an absent protocol. Adds the files if an earlier version stored the protocol
/// without them.
std::int64_t insert_protocol_if_absent(SQLite::Database& db, const std::string& path,
                                       const ProtocolInfo& protocol);

/// By name.
std::vector<ProtocolFile> protocol_files(SQLite::Database& db, std::int64_t protocol_id);

/// One checksum for all files of a protocol: SHA-256 of, for each file by name, its name, a zero
/// byte, its SHA-256 as 64 digits and a line feed. "" without files.
std::string files_checksum(SQLite::Database& db, std::int64_t protocol_id);

/// Verifies that the text of every protocol and every file still has its stored checksum.
/// \param version  of the schema. \throws StoreRefused.
void verify_protocol_checksums(SQLite::Database& db, const std::string& path, int version);

}  // namespace palpate::data
