#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>
#include <crypt.h>
#include <gtest/gtest.h>

#include "data/merge/merge.h"
#include "data/store/forget.h"
#include "data/store/schema.h"
#include "tests/data/store/forget_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;

TEST(Tombstone, CodesCannotBeGuessedWithoutTheSecret) {
  const TemporaryFolder folder;
  const std::string path = folder / "s.db";
  {
    Store store = Store::open(path, Store::Mode::write_or_create);
    store.enrol(a_protocol(), "P07");
    store.enrol(a_protocol(), "P08");
    store.forget("P07");
    store.forget("P08");
  }
  SQLite::Database db(path, SQLite::OPEN_READWRITE);
  EXPECT_EQ(db.execAndGet("SELECT count(*) FROM tombstone_secrets").getInt(), 1);
  EXPECT_TRUE(Tombstones::read(db, path).holds("P07"));
  EXPECT_FALSE(Tombstones::read(db, path).holds("P09"));
  db.exec("UPDATE tombstone_secrets SET secret = randomblob(32)");
  EXPECT_FALSE(Tombstones::read(db, path).holds("P07"));
}

TEST(Tombstone, MergesOfMergesHonourAllStations) {
  const TemporaryFolder folder;
  const std::string a = folder / "a.db", b = folder / "b.db", c = folder / "c.db";
  for (const auto& [path, gone, number] : {std::tuple(a, "P1", 1), std::tuple(b, "P2", 2)}) {
    Store store = Store::open(path, Store::Mode::write_or_create);
    store.enrol(a_protocol(), gone, number);
    store.forget(gone);
  }
  {
    Store store = Store::open(c, Store::Mode::write_or_create);
    for (const char* code : {"P1", "P2", "P3"}) store.enrol(a_protocol(), code);
  }
  merge(folder / "ab.db", {a, b});
  const MergeResult done = merge(folder / "all.db", {folder / "ab.db", c});
  EXPECT_EQ(done.excluded.size(), 2u);
  EXPECT_EQ(done.counts.participants, 1);
  Store all = Store::open(folder / "all.db", Store::Mode::write_or_create);
  for (const char* code : {"P1", "P2"}) {
    EXPECT_THROW(all.enrol(a_protocol(), code), StoreRefused) << code;
  }
}

TEST(Tombstone, GetsAMissingSecretWhenForgottenAgain) {
  const TemporaryFolder folder;
  const std::string path = folder / "s.db";
  {
    Store store = Store::open(path, Store::Mode::write_or_create);
    store.enrol(a_protocol(), "P1");
    store.forget("P1");
  }
  std::string unkeyed;
  {
    SQLite::Database db(path, SQLite::OPEN_READWRITE);
    const std::string salt =
        db.execAndGet("SELECT substr(code_hash, 1, 29) FROM tombstones").getString();
    unkeyed = crypt("P1", salt.c_str());
    db.exec("UPDATE tombstones SET secret_id = NULL, code_hash = '" + unkeyed + "'");
    EXPECT_TRUE(Tombstones::read(db, path).holds("P1"));
  }
  Store::open(path, Store::Mode::write_or_create).forget("P1");
  SQLite::Database db(path, SQLite::OPEN_READWRITE);
  EXPECT_TRUE(Tombstones::read(db, path).holds("P1"));
  EXPECT_EQ(db.execAndGet("SELECT count(*) FROM tombstones WHERE secret_id IS NULL").getInt(), 0);
  EXPECT_NE(db.execAndGet("SELECT code_hash FROM tombstones").getString(), unkeyed);
}

}  // namespace
}  // namespace palpate::data
