// Files and folders that appear complete or not at all, and leave nothing behind.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <iterator>
#include <set>
#include <string>

#include "data/files/atomic_file.h"
#include "data/files/atomic_folder.h"
#include "data/files/output_check.h"
#include "data/merge/merge.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;
namespace fs = std::filesystem;

std::ptrdiff_t open_descriptors() {
  return std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator());
}

std::set<std::string> names_in(const std::string& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    names.insert(entry.path().filename().string());
  return names;
}

class AtomicFiles : public ::testing::Test {
 protected:
  const TemporaryFolder folder_;
  const std::string target_ = folder_ / "t";
};

TEST_F(AtomicFiles, EveryDescriptorIsClosedWhateverHappens) {
  const std::ptrdiff_t before = open_descriptors();
  { const AtomicFolder dropped(target_); }
  {
    AtomicFolder kept(target_);
    write_file(kept.prepare("deep/down.txt"), "x");
    kept.commit(false);
  }
  {
    AtomicFolder other(target_);
    write_file(other / "up.txt", "y");
    EXPECT_THROW(other.commit(false), StoreError) << "the target is not empty";
  }
  EXPECT_THROW(AtomicFolder(folder_ / "none/t"), StoreError);
  EXPECT_EQ(open_descriptors(), before) << "of folders";
  { AtomicFile(folder_ / "dropped").write("x"); }
  {
    AtomicFile kept(folder_ / "kept");
    kept.write("x");
    kept.sync();
    kept.commit(false);
  }
  {
    AtomicFile undone(folder_ / "kept");
    undone.write("other");
    undone.commit(true);
    undone.roll_back();
  }
  EXPECT_THROW(AtomicFile(folder_ / "none/kept"), StoreError);
  EXPECT_EQ(contents_of(folder_ / "kept"), "x");
  EXPECT_EQ(open_descriptors(), before) << "of files";
  const std::string db = folder_ / "study.db";
  {
    Store store = Store::open(db, Store::Mode::write_or_create);
    EXPECT_THROW(Store::open(db, Store::Mode::write_or_create), StoreRefused);
    Store::open(db, Store::Mode::read_only).counts();
  }
  merge(folder_ / "all.db", {db});
  EXPECT_THROW(merge(folder_ / "all.db", {db}), StoreError);
  write_file(folder_ / "text.db", "no database");
  EXPECT_THROW(Store::open(folder_ / "text.db", Store::Mode::read_only), StoreError);
  EXPECT_THROW(Store::open(folder_ / "text.db", Store::Mode::write_or_create), StoreError);
  EXPECT_EQ(open_descriptors(), before) << "of databases";
  EXPECT_EQ(names_in(folder_.path()),
            (std::set<std::string>{"all.db", "kept", "study.db", "t", "text.db"}));
  EXPECT_EQ(names_in(target_), (std::set<std::string>{"deep"}));
}

TEST_F(AtomicFiles, ClearsOnlyKilledProcessesLeftoversForTheTarget) {
  // A folder in use is locked; the folder of a killed process is not.
  std::string writing;
  {
    const AtomicFolder under_way(target_);
    write_file(under_way.prepare("a/b"), "x");
    for (const std::string& name : names_in(folder_.path())) writing = name;
    EXPECT_EQ(::access(target_.c_str(), F_OK), -1) << "nothing under its name yet";
    struct stat found {};
    ASSERT_EQ(::stat((folder_ / writing).c_str(), &found), 0);
    EXPECT_EQ(found.st_mode & 0777U, 0700U);
    const AtomicFolder second(target_);
    EXPECT_EQ(names_in(folder_.path()).size(), 2U) << "the first is still being written";
    EXPECT_EQ(contents_of(under_way / "a/b"), "x");
  }
  EXPECT_TRUE(names_in(folder_.path()).empty());
  const std::string of_other = ".u" + writing.substr(2);
  fs::create_directories(folder_ / writing + "/a");
  fs::create_directories(folder_ / of_other);
  write_file(folder_ / writing + "/a/b", "left");
  write_file(folder_ / "mine.palpate-abcdef", "mine");
  { const AtomicFolder next(target_); }
  EXPECT_EQ(names_in(folder_.path()), (std::set<std::string>{of_other, "mine.palpate-abcdef"}));
}

TEST_F(AtomicFiles, AnExistingFileIsReplacedOnlyWhenAsked) {
  write_file(target_, "mine");
  {
    AtomicFile file(target_);
    file.write("yours");
    EXPECT_THROW(file.commit(false), StoreError);
  }
  EXPECT_EQ(contents_of(target_), "mine");
  {
    AtomicFile file(target_);
    file.write("you");
    file.write("rs");
    struct stat found {};
    ASSERT_EQ(::fstat(file.descriptor(), &found), 0);
    EXPECT_EQ(found.st_mode & 0777U, 0600U);
    EXPECT_EQ(contents_of(target_), "mine") << "until it is complete";
    file.commit(true);
  }
  EXPECT_EQ(contents_of(target_), "yours");
  EXPECT_EQ(names_in(folder_.path()), std::set<std::string>{"t"});
  // A file is renamed to a free name only.
  write_file(folder_ / "u", "third");
  EXPECT_FALSE(rename_if_absent(folder_ / "u", target_));
  EXPECT_EQ(contents_of(target_), "yours");
  EXPECT_TRUE(rename_if_absent(folder_ / "u", folder_ / "v"));
  EXPECT_EQ(names_in(folder_.path()), (std::set<std::string>{"t", "v"}));
}

TEST_F(AtomicFiles, RefusesToOverwriteProtectedFilesWithTheReason) {
  const std::string db = folder_ / "study.db", input = folder_ / "in.csv";
  { Store::open(db, Store::Mode::write_or_create); }
  write_file(input, "a,b\n");
  fs::create_symlink(input, folder_ / "link.csv");
  fs::create_hard_link(input, folder_ / "twin.csv");
  ProtectedFiles taken;
  taken.add(input, "--csv reads it");
  taken.add(db, "--db reads it");
  for (const char* const name : {"in.csv", "link.csv", "twin.csv", "./in.csv"})
    EXPECT_EQ(taken.reason(folder_ / name), "--csv reads it") << name;
  for (const char* const name : {"study.db", "study.db-wal", "study.db-shm", "study.db-journal"})
    EXPECT_TRUE(taken.reason(folder_ / name).ends_with("--db reads it")) << name;
  EXPECT_EQ(taken.reason(folder_ / "other.csv"), "");
  EXPECT_EQ(write_refusal(folder_ / "new.csv", false, taken), "");
  write_file(folder_ / "old.csv", "old");
  EXPECT_NE(write_refusal(folder_ / "old.csv", false, taken), "");
  EXPECT_EQ(write_refusal(folder_ / "old.csv", true, taken), "") << "--force";
  for (const char* const name : {"in.csv", "study.db", "study.db-wal", ""})
    EXPECT_NE(write_refusal(folder_ / name, true, taken), "") << name;
  EXPECT_NE(write_refusal(db, true), "") << "a database, whoever reads it";
  EXPECT_EQ(write_refusal("/dev/null", false, taken), "");
  EXPECT_TRUE(may_be_database(db));
  EXPECT_FALSE(may_be_database(input));
  EXPECT_TRUE(belongs_to_database(db + "-wal"));
  EXPECT_FALSE(belongs_to_database(input + "-wal")) << "there is no such database";
  EXPECT_EQ(descriptor_of_path("/dev/stdout"), 1);
  EXPECT_EQ(descriptor_of_path("/dev/fd/63"), 63);
  EXPECT_EQ(descriptor_of_path(input), std::nullopt);
}

}  // namespace
}  // namespace palpate::data
