#pragma once
// Internal to data/: what is left of a code that was withdrawn.

#include <SQLiteCpp/Database.h>

#include <map>
#include <string>
#include <vector>

namespace palpate {

/// The tombstones of one or more databases. A tombstone is a salted hash that is slow to make
/// (yescrypt): codes are short, and nobody shall find them by trying all of them in a second.
class Tombstones {
 public:
  /// Of an open database; none where its schema is too old to have any. \throws StoreRefused: one
  /// of them is no hash that we make.
  static Tombstones read(SQLite::Database& db, const std::string& path);

  bool holds(const std::string& code) const { return !find(code).empty(); }
  std::string find(const std::string& code) const;  ///< the tombstone of a code, "" for none

  /// The hash to keep of a code. Uses the salt of those there are, so that a code is hashed once to
  /// be compared with all. \throws StoreError: no randomness to be had.
  std::string hash_for(const std::string& code) const;

  bool empty() const { return by_salt_.empty(); }
  void add(const Tombstones& others);
  std::vector<std::string> hashes() const;  ///< sorted

 private:
  std::map<std::string, std::vector<std::string>> by_salt_;
};

}  // namespace palpate
