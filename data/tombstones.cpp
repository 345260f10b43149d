#include "data/tombstones.h"

#include <SQLiteCpp/Statement.h>
#include <crypt.h>

#include <algorithm>
#include <array>
#include <memory>

#include "data/store.h"

namespace palpate {
namespace {

// yescrypt with this cost takes some 5 ms. A hash that asks for another cost is not ours: a made-up
// one could keep us busy for days.
constexpr const char* kPrefix = "$y$";
constexpr unsigned long kCost = 3;

std::string new_salt() {
  std::array<char, CRYPT_GENSALT_OUTPUT_SIZE> text{};
  if (::crypt_gensalt_rn(kPrefix, kCost, nullptr, 0, text.data(), text.size()) == nullptr) {
    throw StoreError("no salt can be made: the system gives no random numbers");
  }
  return text.data();
}

/// "$y$COST$SALT" of a salt or of a whole hash.
std::string salt_of(const std::string& hash) {
  std::size_t end = 0;
  for (int dollars = 0; end < hash.size() && dollars < 4; ++end) dollars += hash[end] == '$';
  return hash.substr(0, end < hash.size() ? end - 1 : hash.size());
}

std::string cost_of(const std::string& salt) { return salt.substr(0, salt.rfind('$')); }

std::string hash_with(const std::string& code, const std::string& salt) {
  const auto work = std::make_unique<crypt_data>();
  const char* hash = ::crypt_r(code.c_str(), salt.c_str(), work.get());
  if (hash == nullptr || hash[0] == '*') throw StoreError("a code cannot be hashed");
  return hash;
}

}  // namespace

Tombstones Tombstones::read(SQLite::Database& db, const std::string& path) {
  Tombstones all;
  if (!db.tableExists("tombstones")) return all;
  const std::string cost = cost_of(new_salt());
  SQLite::Statement find(db, "SELECT code_hash FROM tombstones");
  while (find.executeStep()) {
    const std::string hash = find.getColumn(0).getString(), salt = salt_of(hash);
    const bool clean = std::all_of(hash.begin(), hash.end(), [](char c) {
      return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') ||
             c == '$' || c == '.' || c == '/';
    });
    if (!clean || cost_of(salt) != cost || salt.size() == hash.size() || hash.size() > 200) {
      throw StoreRefused(path + ": a tombstone is none of palpate's; restore a backup");
    }
    all.by_salt_[salt].push_back(hash);
  }
  return all;
}

std::string Tombstones::find(const std::string& code) const {
  for (const auto& [salt, hashes] : by_salt_) {
    std::string hash = hash_with(code, salt);
    if (std::find(hashes.begin(), hashes.end(), hash) != hashes.end()) return hash;
  }
  return "";
}

std::string Tombstones::hash_for(const std::string& code) const {
  return hash_with(code, by_salt_.empty() ? new_salt() : by_salt_.begin()->first);
}

void Tombstones::add(const Tombstones& others) {
  for (const auto& [salt, hashes] : others.by_salt_) {
    auto& mine = by_salt_[salt];
    for (const auto& hash : hashes) {
      if (std::find(mine.begin(), mine.end(), hash) == mine.end()) mine.push_back(hash);
    }
  }
}

std::vector<std::string> Tombstones::hashes() const {
  std::vector<std::string> all;
  for (const auto& salted : by_salt_) {
    all.insert(all.end(), salted.second.begin(), salted.second.end());
  }
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace palpate
