// Files that a store opens, its locks, and the files that it leaves.

#include <SQLiteCpp/Database.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "data/store/schema.h"
#include "data/store/store.h"
#include "tests/data/store/child_process.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;
namespace fs = std::filesystem;

class StoreOpen : public ::testing::Test {
 protected:
  static Store write(const std::string& path) {
    return Store::open(path, Store::Mode::write_or_create);
  }
  static Store read(const std::string& path) { return Store::open(path, Store::Mode::read_only); }
  /// Refused for reading and for writing, naming the file; the file is left as it was.
  void expect_refused(const std::string& reason) {
    const std::string before = contents_of(path_);
    for (const auto mode : {Store::Mode::write_or_create, Store::Mode::read_only}) {
      try {
        Store::open(path_, mode);
        ADD_FAILURE() << "taken: " << reason;
      } catch (const StoreRefused& error) {
        EXPECT_TRUE(contains(error.what(), path_)) << error.what();
        EXPECT_TRUE(contains(error.what(), reason)) << error.what();
      }
    }
    EXPECT_EQ(contents_of(path_), before);
    EXPECT_EQ(files(), 1) << "something was left beside it";
  }
  std::ptrdiff_t files() const {
    return std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator());
  }
  void make_study(int trials = 300) {
    Store store = write(path_);
    const palpate::data::Run run =
        store.begin_run(store.enrol(a_protocol(), "S1", {}, true, 1), a_run());
    std::vector<TrialRecord> records;
    for (int i = 1; i <= trials; ++i) records.push_back(a_record(i));
    store.record_simulated(run, records);
    store.end_run(run, RunEnd::done, 1);
  }
  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "study.db";
};

TEST_F(StoreOpen, LeavesOneFileReadableByItsOwnerOnly) {
  const auto mode_of = [](const std::string& path) {
    struct stat found {};
    return ::stat(path.c_str(), &found) == 0 ? found.st_mode & 0777 : 0;
  };
  const mode_t before = ::umask(0);
  {
    Store store = write(path_);
    store.enrol(a_protocol(), "A");
    for (const char* end : {"", "-wal", "-shm", ".palpate-lock"})
      EXPECT_EQ(mode_of(path_ + end), 0600u) << end;
    read(path_);
  }
  ::umask(before);
  EXPECT_EQ(files(), 1);
  read(path_);
  EXPECT_EQ(files(), 1);
}

TEST_F(StoreOpen, IsWhatTheSchemaSays) {
  make_study();
  SQLite::Database db(path_, SQLite::OPEN_READWRITE);
  EXPECT_EQ(db.execAndGet("PRAGMA application_id").getInt(), 0x504C5054);
  EXPECT_EQ(db.execAndGet("PRAGMA user_version").getInt(), kSchemaVersion);
  EXPECT_EQ(db.execAndGet("PRAGMA journal_mode").getString(), "wal");
  EXPECT_EQ(db.execAndGet("PRAGMA integrity_check").getString(), "ok");
  EXPECT_EQ(
      db.execAndGet("SELECT count(*) FROM pragma_table_list WHERE schema = 'main' AND strict = 0 "
                    "AND name NOT LIKE 'sqlite_%'")
          .getInt(),
      0);
  EXPECT_EQ(
      db.execAndGet("SELECT sql FROM sqlite_schema WHERE name = 'runs'").getString().substr(0, 12),
      "CREATE TABLE");
}

TEST_F(StoreOpen, OtherFilesAreRefusedAndLeftAlone) {
  write_file(path_, "");
  expect_refused("is empty");
  write_file(path_, "participant_id,session\n");
  expect_refused("not a palpate database");
  write_file(path_, std::string(100'000, 'x'));
  expect_refused("not a palpate database");
  fs::remove(path_);
  {
    SQLite::Database(path_, SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE)
        .exec("CREATE TABLE bookmarks (url)");
  }
  expect_refused("another program's");
  fs::remove(path_);
  {
    SQLite::Database(path_, SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE)
        .exec("PRAGMA journal_mode = WAL; PRAGMA user_version = 1; CREATE TABLE bookmarks (url)");
  }
  expect_refused("another program's");
}

TEST_F(StoreOpen, OtherVersionsAreRefusedNeverGuessed) {
  make_study();
  for (const int version : {0, kSchemaVersion + 1, 1000, -1}) {
    SQLite::Database(path_, SQLite::OPEN_READWRITE)
        .exec("PRAGMA user_version = " + std::to_string(version));
    expect_refused("schema version " + std::to_string(version));
  }
  SQLite::Database(path_, SQLite::OPEN_READWRITE)
      .exec("PRAGMA user_version = " + std::to_string(kSchemaVersion));
  EXPECT_EQ(read(path_).counts().completed, 300);
}

TEST_F(StoreOpen, ATruncatedFileIsRefused) {
  make_study();
  const std::string whole = contents_of(path_);
  for (const std::size_t size :
       {std::size_t{1}, std::size_t{50}, std::size_t{100}, std::size_t{4096}, std::size_t{5000},
        whole.size() / 2, whole.size() - 4096, whole.size() - 1}) {
    write_file(path_, whole.substr(0, size));
    for (const auto mode : {Store::Mode::write_or_create, Store::Mode::read_only}) {
      EXPECT_TRUE(contains(error_of([&] { Store::open(path_, mode); }), path_)) << size;
    }
  }
}

TEST_F(StoreOpen, FindsDamagedPagesOnOpening) {
  make_study();
  const std::string whole = contents_of(path_);
  const std::size_t pages = whole.size() / 4096;
  std::vector<std::size_t> unseen;
  for (std::size_t page = 0; page < pages; ++page) {
    std::string damaged = whole;
    std::fill_n(damaged.begin() + static_cast<std::ptrdiff_t>(page * 4096), 4096, '\x5A');
    write_file(path_, damaged);
    try {
      read(path_);
      unseen.push_back(page);
    } catch (const StoreRefused& error) {
      EXPECT_TRUE(contains(error.what(), page == 0 ? "not a palpate database" : "damaged"))
          << error.what();
    }
  }
  EXPECT_GT(pages, 20u);
  EXPECT_LE(unseen.size(), 1u) << "only the samples are not looked at";
}

TEST_F(StoreOpen, PathsThatAreNotFiles) {
  EXPECT_TRUE(contains(error_of([&] { write(folder_.path()); }), "is not a file"));
  EXPECT_TRUE(contains(error_of([&] { read(path_); }), "no such file"));
  EXPECT_TRUE(contains(error_of([&] { write(folder_ / "none/study.db"); }), "folder exists"));
  EXPECT_THROW(write(""), StoreRefused);
  EXPECT_EQ(files(), 0);
}

TEST_F(StoreOpen, OddNamesAndLinksAreOrdinaryFiles) {
  const std::string odd = folder_ / "a%20b?mode=ro#c 'd\".db";
  write(odd).enrol(a_protocol(), "A");
  EXPECT_EQ(read(odd).counts().participants, 1);
  const std::string link = folder_ / "link.db";
  fs::create_symlink(odd, link);
  Store held = write(link);
  EXPECT_TRUE(contains(error_of([&] { write(odd); }), "open for writing"))
      << "one file under two names";
}

TEST_F(StoreOpen, RefusesASecondWriterNamingTheHolder) {
  ChildProcess holder({"hold", path_});
  ASSERT_EQ(holder.read_line(), "held");
  const std::string error = error_of([&] { write(path_); });
  EXPECT_TRUE(contains(error, "open for writing in process " + std::to_string(holder.pid())))
      << error;
  EXPECT_NO_THROW(read(path_));
  holder.kill();
  EXPECT_NO_THROW(write(path_)) << "the lock dies with its process";
  EXPECT_NO_THROW(write(path_)) << "and ends with the store";
}

TEST_F(StoreOpen, ADatabaseOfTwoNamesIsReadOnly) {
  make_study(1);
  const std::string second = folder_ / "second.db";
  fs::create_hard_link(path_, second);
  const std::string before = contents_of(path_);
  for (const std::string& name : {path_, second}) {
    const std::string error = error_of([&] { write(name); });
    EXPECT_TRUE(contains(error, "has 2 names")) << error;
    EXPECT_EQ(read(name).counts().participants, 1);
    EXPECT_EQ(contents_of(name), before);
  }
  fs::remove(second);
  EXPECT_NO_THROW(write(path_));
}

TEST_F(StoreOpen, AReaderOfTwoNamesLeavesTheLog) {
  make_study(1);
  {
    ChildProcess writer({"hold", path_});
    ASSERT_EQ(writer.read_line(), "held");
    writer.kill();
  }
  write_file(path_ + "-wal", "");
  fs::permissions(path_ + "-wal", fs::perms::owner_read | fs::perms::owner_write);
  fs::create_hard_link(path_, folder_ / "second.db");
  EXPECT_EQ(read(path_).counts().participants, 1);
  EXPECT_TRUE(fs::exists(path_ + "-wal")) << "it may belong to the other name";
}

TEST_F(StoreOpen, RefusesANewNameWhileOpen) {
  make_study(1);
  ChildProcess holder({"hold", path_});
  ASSERT_EQ(holder.read_line(), "held");
  const std::string moved = folder_ / "moved.db";
  fs::rename(path_, moved);
  const std::string error = error_of([&] { write(moved); });
  EXPECT_TRUE(contains(error, "under another name")) << error;
  EXPECT_FALSE(fs::exists(moved + ".palpate-lock"));
  const auto export_it = [&] { Store::open(moved, Store::Mode::read_for_export); };
  EXPECT_TRUE(contains(error_of(export_it), "under another name"));
  fs::rename(moved, path_);
  EXPECT_NO_THROW(Store::open(path_, Store::Mode::read_for_export));
  holder.kill();
  EXPECT_NO_THROW(write(path_));
}

TEST_F(StoreOpen, LinksMadeMeanwhileLoseNoTrial) {
  const std::string second = folder_ / "second.db";
  {
    Store store = write(path_);
    const palpate::data::Run run = store.begin_run(store.enrol(a_protocol(), "A"), a_run());
    for (int trial = 1; trial <= 3; ++trial) {
      if (trial == 2) fs::create_hard_link(path_, second);
      TrialRecord record = a_record(trial);
      record.attempt = store.begin_attempt(run, record, record.onset_ns - 1);
      store.finish_attempt(run, record);
      if (trial > 1) {
        EXPECT_TRUE(contains(error_of([&] { write(second); }), "under another name"));
      }
    }
  }
  EXPECT_EQ(read(path_).counts().completed, 3);
  EXPECT_EQ(read(second).counts().completed, 3);
  EXPECT_TRUE(contains(error_of([&] { write(path_); }), "has 2 names"));
}

TEST_F(StoreOpen, ReadersSeeWhatWasCommittedAtOpening) {
  Store writer = write(path_);
  const palpate::data::Run run = writer.begin_run(writer.enrol(a_protocol(), "A"), a_run());
  writer.begin_attempt(run, a_record(1), 1);
  Store before = read(path_);
  writer.finish_attempt(run, a_record(1));
  Store after = read(path_);
  writer.begin_attempt(run, a_record(2), 1);
  writer.finish_attempt(run, a_record(2));
  EXPECT_EQ(before.counts().completed, 0);
  EXPECT_EQ(after.counts().completed, 1);
  EXPECT_EQ(read(path_).counts().completed, 2);
  EXPECT_EQ(writer.counts().completed, 2);
}

TEST_F(StoreOpen, AReaderDoesNotWrite) {
  make_study(1);
  Store reader = read(path_);
  const Participant person = reader.participants(a_protocol().sha256).at(0);
  EXPECT_TRUE(contains(error_of([&] { reader.enrol(a_protocol(), "B"); }), "reading only"));
  EXPECT_THROW(reader.begin_run(person, a_run(2)), StoreRefused);
  EXPECT_THROW(reader.add_note({}, 1, "x"), StoreRefused);
}

TEST_F(StoreOpen, NewDatabaseDoesNotRecoverAStrayWal) {
  make_study();
  {
    Store store = write(path_);
    store.enrol(a_protocol(), "A");
    fs::copy_file(path_ + "-wal", folder_ / "log");
  }
  fs::remove(path_);
  fs::rename(folder_ / "log", path_ + "-wal");
  EXPECT_TRUE(contains(error_of([&] { write(path_); }), "is missing, but its log"));
  EXPECT_FALSE(fs::exists(path_));
}

TEST_F(StoreOpen, AnInterruptedCreationIsRepeated) {
  const std::string temporary = folder_ / ".study.db.palpate-abcdef";
  fs::create_directory(temporary);
  write_file(temporary + "/new.db", "half a database");
  write_file(temporary + "/new.db-wal", "half a log");
  for (const char* text : {"", "palpate 12345\n"}) {
    write_file(path_ + ".palpate-lock", text);
    fs::permissions(path_ + ".palpate-lock", fs::perms::owner_read | fs::perms::owner_write);
    EXPECT_EQ(write(path_).counts().protocols, 0);
    EXPECT_EQ(files(), 1);
  }
}

TEST_F(StoreOpen, KeepsFilesThatOnlyResembleItsOwn) {
  const std::vector<std::string> others = {path_ + ".lock", path_ + ".palpate-new",
                                           path_ + ".palpate-new-wal"};
  for (const std::string& other : others) write_file(other, "mine");
  write(path_);
  for (const std::string& other : others) EXPECT_EQ(contents_of(other), "mine") << other;
  const std::string lock = path_ + ".palpate-lock";
  write_file(lock, "mine");
  fs::permissions(lock, fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_TRUE(contains(error_of([&] { write(path_); }), lock));
  EXPECT_EQ(contents_of(lock), "mine");
  fs::remove(lock);
  fs::create_symlink(path_ + ".lock", lock);
  EXPECT_TRUE(contains(error_of([&] { write(path_); }), lock));
  EXPECT_EQ(contents_of(path_ + ".lock"), "mine");
}

TEST_F(StoreOpen, OneOfManyWritersHoldsTheLock) {
  for (int round = 0; round < 5; ++round) {
    // First without a lock file, then with the lock file of a killed process.
    std::vector<std::unique_ptr<ChildProcess>> all;
    for (int i = 0; i < 6; ++i) {
      all.push_back(std::make_unique<ChildProcess>(std::vector<std::string>{"hold", path_}));
    }
    int holders = 0;
    for (const auto& one : all) holders += one->read_line() == "held" ? 1 : 0;
    EXPECT_EQ(holders, 1);
    for (const auto& one : all) one->kill();
    EXPECT_TRUE(fs::exists(path_ + ".palpate-lock"));
  }
  write(path_);
  EXPECT_EQ(files(), 1);
}

TEST_F(StoreOpen, ATruncatedWalIndexLosesNothing) {
  constexpr int kTrials = 12;
  {
    Store store = write(path_);
    const palpate::data::Run run = store.begin_run(store.enrol(a_protocol(), "A"), a_run());
    std::optional<Store> reader;
    for (int trial = 1; trial <= kTrials; ++trial) {
      const std::string index = path_ + "-shm";
      if (trial % 2 == 0) fs::resize_file(index, (trial / 2 - 1) * 5000 % 20000);
      TrialRecord record = a_record(trial);
      record.attempt = store.begin_attempt(run, record, 1);
      if (trial % 3 == 0) fs::resize_file(index, 0);
      store.finish_attempt(run, record);
      EXPECT_EQ(read(path_).counts().completed, trial) << "a reader beside it";
      if (trial == 5) reader.emplace(read(path_));
    }
    EXPECT_EQ(reader->counts().completed, 5) << "an old snapshot";
    reader.reset();
    fs::resize_file(path_ + "-shm", 0);
  }
  EXPECT_EQ(write(path_).counts().completed, kTrials);
  EXPECT_EQ(files(), 1);
}

TEST_F(StoreOpen, RefusesNamesOfAnotherDatabasesSqliteFiles) {
  make_study(1);
  for (const char* end : {"-wal", "-shm", "-journal", ".palpate-lock"}) {
    EXPECT_TRUE(contains(error_of([&] { write(path_ + end); }), path_ + end));
  }
  EXPECT_EQ(files(), 1);
}

}  // namespace
}  // namespace palpate::data
