#include "data/store/tombstones.h"

#include <SQLiteCpp/Statement.h>
#include <crypt.h>
#include <nettle/hmac.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>

#include "data/errors.h"
#include "data/files/checksum.h"
#include "data/store/statement_values.h"

namespace palpate::data {
namespace {

// yescrypt with this cost takes some 5 ms. A hash with another cost is refused: a forged one could
// take days to compute.
constexpr const char* kPrefix = "$y$";
constexpr unsigned long kCost = 3;

std::string new_salt() {
  std::array<char, CRYPT_GENSALT_OUTPUT_SIZE> text{};
  if (::crypt_gensalt_rn(kPrefix, kCost, nullptr, 0, text.data(), text.size()) == nullptr) {
    throw StoreError("cannot make a salt: the system gives no random numbers");
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
  if (hash == nullptr || hash[0] == '*') throw StoreError("cannot hash a participant code");
  return hash;
}

std::string new_secret() {
  std::string secret(32, '\0');
  if (::getrandom(secret.data(), secret.size(), 0) != static_cast<ssize_t>(secret.size())) {
    throw StoreError("cannot make a secret: the system gives no random numbers");
  }
  return secret;
}

/// The input of crypt(): HMAC-SHA256 as 64 digits.
std::string keyed(const std::string& code, const std::string& secret) {
  if (secret.empty()) return code;
  hmac_sha256_ctx context;
  hmac_sha256_set_key(&context, secret.size(),
                      reinterpret_cast<const unsigned char*>(secret.data()));
  hmac_sha256_update(&context, code.size(), reinterpret_cast<const unsigned char*>(code.data()));
  Checksum sum;
  hmac_sha256_digest(&context, sum.size(), sum.data());
  return to_hex(sum);
}

}  // namespace

Tombstones Tombstones::read(SQLite::Database& db, const std::string& path) {
  Tombstones all;
  const std::string cost = cost_of(new_salt());
  SQLite::Statement find(db,
                         "SELECT t.code_hash, s.secret FROM tombstones t LEFT JOIN "
                         "tombstone_secrets s ON s.id = t.secret_id");
  while (find.executeStep()) {
    std::string hash;
    std::optional<std::string> secret;
    RowReader(find) >> hash >> secret;
    const std::string salt = salt_of(hash);
    const bool clean = std::all_of(hash.begin(), hash.end(), [](char c) {
      return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') ||
             c == '$' || c == '.' || c == '/';
    });
    if (!clean || cost_of(salt) != cost || salt.size() == hash.size() || hash.size() > 200) {
      throw StoreRefused(path + ": holds a tombstone that palpate did not make; restore a backup");
    }
    all.by_key_[{secret.value_or(""), salt}].push_back(hash);
  }
  return all;
}

Tombstones::Tombstone Tombstones::find(const std::string& code) const {
  for (const auto& [key, hashes] : by_key_) {
    std::string hash = hash_with(keyed(code, key.secret), key.salt);
    if (std::find(hashes.begin(), hashes.end(), hash) != hashes.end()) return {hash, key.secret};
  }
  return {};
}

Tombstones::Tombstone Tombstones::made_for(const std::string& code) const {
  const auto known = std::find_if(by_key_.begin(), by_key_.end(),
                                  [](const auto& one) { return !one.first.secret.empty(); });
  const Key key = known != by_key_.end() ? known->first : Key{new_secret(), new_salt()};
  return {hash_with(keyed(code, key.secret), key.salt), key.secret};
}

void Tombstones::put(SQLite::Database& db, const Tombstone& tombstone, bool cleared) {
  std::optional<std::int64_t> secret;
  if (!tombstone.secret.empty()) {
    const auto bind = [&](SQLite::Statement& statement) {
      statement.bind(1, static_cast<const void*>(tombstone.secret.data()),
                     static_cast<int>(tombstone.secret.size()));
    };
    SQLite::Statement keep(
        db, "INSERT INTO tombstone_secrets (secret) VALUES (?) ON CONFLICT DO NOTHING");
    bind(keep);
    keep.exec();
    SQLite::Statement find(db, "SELECT id FROM tombstone_secrets WHERE secret = ?");
    bind(find);
    find.executeStep();
    secret = find.getColumn(0).getInt64();
  }
  SQLite::Statement add(db,
                        "INSERT INTO tombstones (code_hash, secret_id, cleared) VALUES (?, ?, ?) "
                        "ON CONFLICT (code_hash) DO UPDATE SET cleared = excluded.cleared, "
                        "secret_id = excluded.secret_id");
  Binder(add) << tombstone.hash << secret << cleared;
  add.exec();
}

void Tombstones::add(const Tombstones& others) {
  for (const auto& [key, hashes] : others.by_key_) {
    auto& mine = by_key_[key];
    for (const auto& hash : hashes) {
      if (std::find(mine.begin(), mine.end(), hash) == mine.end()) mine.push_back(hash);
    }
  }
}

std::vector<Tombstones::Tombstone> Tombstones::all() const {
  std::vector<Tombstone> all;
  for (const auto& [key, hashes] : by_key_) {
    for (const auto& hash : hashes) all.push_back({hash, key.secret});
  }
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.hash < b.hash; });
  return all;
}

}  // namespace palpate::data
