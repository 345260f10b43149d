#include "data/store/protocol_rows.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "data/base/checksum.h"
#include "data/base/json_text.h"
#include "data/errors.h"
#include "data/store/statement.h"

namespace palpate::data {
namespace {

constexpr int kFilesSince = 3;  // schema version

std::string abbreviated(const std::string& sha256) { return sha256.substr(0, 12) + "..."; }

std::int64_t insert_file_if_absent(SQLite::Database& db, const std::string& bytes) {
  const std::string sha256 = checksum_hex(bytes);
  SQLite::Statement find(db, "SELECT id FROM files WHERE sha256 = ?");
  Binder(find) << sha256;
  if (find.executeStep()) return find.getColumn(0).getInt64();
  SQLite::Statement add(db, "INSERT INTO files (sha256, bytes) VALUES (?, ?)");
  Binder(add) << sha256;
  add.bindNoCopy(2, static_cast<const void*>(bytes.data()), static_cast<int>(bytes.size()));
  add.exec();
  return db.getLastInsertRowid();
}

/// Name and checksum of each file of a protocol, by name.
std::vector<std::pair<std::string, std::string>> file_checksums(SQLite::Database& db,
                                                                std::int64_t protocol_id) {
  std::vector<std::pair<std::string, std::string>> all;
  SQLite::Statement find(db,
                         "SELECT p.name, f.sha256 FROM protocol_files p JOIN files f ON f.id = "
                         "p.file_id WHERE p.protocol_id = ? ORDER BY p.name");
  Binder(find) << protocol_id;
  while (find.executeStep()) {
    auto& [name, sha256] = all.emplace_back();
    RowReader(find) >> name >> sha256;
  }
  return all;
}

void require_same_files(SQLite::Database& db, const std::string& path, std::int64_t protocol_id,
                        const ProtocolInfo& protocol) {
  const auto stored = file_checksums(db, protocol_id);
  for (const ProtocolFile& file : protocol.files) {
    const auto known = std::find_if(stored.begin(), stored.end(),
                                    [&](const auto& one) { return one.first == file.name; });
    const std::string sha256 = checksum_hex(file.bytes);
    if (known == stored.end() || known->second == sha256) continue;
    throw StoreRefused(path + ": " + file.name + " is not the file with which protocol " +
                       protocol.name + " was begun in this database (SHA-256 " +
                       abbreviated(sha256) + ", stored " + abbreviated(known->second) +
                       "): participants would touch another shape; restore the file (an "
                       "export holds it), or name the changed one differently in the protocol, "
                       "which creates another protocol");
  }
}

/// \throws StoreRefused: such a text was never stored by palpate, and cannot be compared.
void require_shallow(const std::string& path, const ProtocolInfo& protocol) {
  try {
    read_json(protocol.text);
  } catch (const JsonError& error) {
    if (error.byte) return;
    throw StoreRefused(path + ": text of protocol " + protocol.name + ": " + error.what());
  }
}

}  // namespace

std::optional<std::int64_t> find_protocol(SQLite::Database& db, const std::string& path,
                                          const ProtocolInfo& protocol) {
  SQLite::Statement find(db, "SELECT id, text FROM protocols WHERE sha256 = ?");
  Binder(find) << protocol.sha256;
  if (!find.executeStep()) return std::nullopt;
  std::int64_t id = 0;
  std::string text;
  RowReader(find) >> id >> text;
  if (text != protocol.text) {
    throw StoreRefused(path + ": holds another protocol text under the same SHA-256 " +
                       protocol.sha256);
  }
  require_same_files(db, path, id, protocol);
  return id;
}

std::int64_t insert_protocol_if_absent(SQLite::Database& db, const std::string& path,
                                       const ProtocolInfo& protocol) {
  std::optional<std::int64_t> id = find_protocol(db, path, protocol);
  if (!id) {
    SQLite::Statement add(db, "INSERT INTO protocols (sha256, name, text) VALUES (?, ?, ?)");
    Binder(add) << protocol.sha256 << protocol.name << protocol.text;
    add.exec();
    id = db.getLastInsertRowid();
  }
  for (const ProtocolFile& file : protocol.files) {
    SQLite::Statement add(db,
                          "INSERT INTO protocol_files (protocol_id, name, file_id) VALUES (?, ?, "
                          "?) ON CONFLICT DO NOTHING");
    Binder(add) << *id << file.name << insert_file_if_absent(db, file.bytes);
    add.exec();
  }
  return *id;
}

std::vector<ProtocolFile> protocol_files(SQLite::Database& db, std::int64_t protocol_id) {
  std::vector<ProtocolFile> all;
  SQLite::Statement find(db,
                         "SELECT p.name, f.bytes FROM protocol_files p JOIN files f ON f.id = "
                         "p.file_id WHERE p.protocol_id = ? ORDER BY p.name");
  Binder(find) << protocol_id;
  while (find.executeStep()) {
    ProtocolFile& file = all.emplace_back();
    RowReader(find) >> file.name >> file.bytes;
  }
  return all;
}

std::string files_checksum(SQLite::Database& db, std::int64_t protocol_id) {
  std::string lines;
  for (const auto& [name, sha256] : file_checksums(db, protocol_id)) {
    lines += name + '\0' + sha256 + '\n';
  }
  return lines.empty() ? "" : checksum_hex(lines);
}

void verify_protocol_checksums(SQLite::Database& db, const std::string& path, int version) {
  const auto refuse = [&](const std::string& what) {
    throw StoreRefused(path + ": " + what +
                       " does not match its SHA-256: it was changed after it was stored; restore a "
                       "backup");
  };
  SQLite::Statement texts(db, "SELECT name, text, sha256 FROM protocols");
  while (texts.executeStep()) {
    ProtocolInfo one;
    RowReader(texts) >> one.name >> one.text >> one.sha256;
    if (checksum_hex(one.text) != one.sha256) refuse("the text of protocol " + one.name);
    require_shallow(path, one);
  }
  if (version < kFilesSince) return;
  SQLite::Statement files(db,
                          "SELECT coalesce((SELECT min(name) FROM protocol_files WHERE file_id = "
                          "f.id), '(of no protocol)'), f.bytes, f.sha256 FROM files f");
  while (files.executeStep()) {
    std::string name, bytes, sha256;
    RowReader(files) >> name >> bytes >> sha256;
    if (checksum_hex(bytes) != sha256) refuse("the stored file " + name);
  }
}

}  // namespace palpate::data
