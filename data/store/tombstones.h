#pragma once
// Internal to data/: what is left of a code that was withdrawn.

#include <SQLiteCpp/Database.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace palpate::data {

/// The tombstones of one or more databases. A tombstone is a salted hash that is slow to make
/// (yescrypt), of the code keyed with a secret (HMAC-SHA256): nobody finds a short code by trying
/// all of them who has the tombstone alone. The secret is in the database, or merge could not
/// honour its tombstones: who has the whole database can still try codes, a few hundred a second.
class Tombstones {
 public:
  struct Tombstone {
    std::string hash;
    std::string secret;  ///< 32 bytes; "": of a palpate that had none, the code was hashed as it is
    bool operator==(const Tombstone&) const = default;
  };

  /// Of an open database; \throws StoreRefused: one
  /// of them is no hash that we make.
  static Tombstones read(SQLite::Database& db, const std::string& path);

  bool holds(const std::string& code) const { return !find(code).hash.empty(); }
  Tombstone find(const std::string& code) const;  ///< of a code; without a hash: there is none

  /// What to keep of a code. Uses a secret and salt that are there, so that a code is hashed once
  /// to be compared with all of them. \throws StoreError: no randomness to be had.
  Tombstone made_for(const std::string& code) const;
  /// Within a transaction. \param cleared  as the column of that name.
  static void put(SQLite::Database& db, const Tombstone& tombstone, bool cleared);

  bool empty() const { return by_key_.empty(); }
  void add(const Tombstones& others);
  std::vector<Tombstone> all() const;  ///< sorted

 private:
  struct Key {
    std::string secret, salt;
    auto operator<=>(const Key&) const = default;
  };
  std::map<Key, std::vector<std::string>> by_key_;
};

}  // namespace palpate::data
