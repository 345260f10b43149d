#pragma once
// Remains of a withdrawal: copies that it does not remove, and tombstones (salted hashes of
// withdrawn codes). enrol refuses and merge excludes a code with a tombstone.

#include <SQLiteCpp/Database.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace palpate::data {

/// The tombstones of one or more databases. A tombstone is crypt(HMAC-SHA256(secret, code)) with
/// yescrypt, which is salted and slow (crypt(5)): without the secret, a short code cannot be found
/// by trying all codes. The secret is in the database, because merge needs it to recognise codes:
/// with the whole database, some hundred codes a second can still be tried.
class Tombstones {
 public:
  struct Tombstone {
    std::string hash;
    std::string secret;  ///< 32 bytes; "": made by schema version 2, without HMAC
    bool operator==(const Tombstone&) const = default;
  };

  /// All of an open database. \throws StoreRefused: one is not a hash that palpate makes.
  static Tombstones read(SQLite::Database& db, const std::string& path);

  bool holds(const std::string& code) const { return !find(code).hash.empty(); }
  Tombstone find(const std::string& code) const;  ///< empty hash: none

  /// A tombstone for a code. Reuses an existing secret and salt, so that comparing a code with all
  /// tombstones takes one hash. \throws StoreError: the system has no random numbers.
  Tombstone made_for(const std::string& code) const;
  /// Inserts or updates, within a transaction of the caller. \param cleared value of that column
  static void put(SQLite::Database& db, const Tombstone& tombstone, bool cleared);

  bool empty() const { return by_key_.empty(); }
  void add(const Tombstones& others);
  std::vector<Tombstone> all() const;  ///< sorted

 private:
  struct Key {
    std::string secret, salt;
    auto operator<=>(const Key&) const = default;  // NOLINT(modernize-use-nullptr): clang-tidy 14
  };
  std::map<Key, std::vector<std::string>> by_key_;
};

/// Internal to data/store: copies of a participant's data that a withdrawal does not remove.
/// Whether `text` contains `code` as a separate word.
bool mentions(const std::string& text, const std::string& code);

}  // namespace palpate::data
