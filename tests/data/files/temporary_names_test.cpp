// Which leftovers of killed processes are cleared, and which files stay.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <filesystem>
#include <set>
#include <string>

#include "data/files/atomic_file.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;
namespace fs = std::filesystem;

class StaleTemporaries : public ::testing::Test {
 protected:
  std::set<std::string> left() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_.path()))
      names.insert(entry.path().filename().string());
    return names;
  }
  void write(const std::string& name) const { write_file(folder_ / name, "left"); }
  const TemporaryFolder folder_;
};

TEST_F(StaleTemporaries, AreClearedForATargetWithoutAFolder) {
  write(".t.palpate-abcdef");
  write(".u.palpate-abcdef");
  const fs::path before = fs::current_path();
  fs::current_path(folder_.path());
  remove_stale_temporaries("t");
  const std::set<std::string> after_one = left();
  remove_stale_temporaries_in("");
  fs::current_path(before);
  EXPECT_EQ(after_one, std::set<std::string>{".u.palpate-abcdef"});
  EXPECT_EQ(left(), std::set<std::string>{});
}

TEST_F(StaleTemporaries, HaveSixLettersAfterTheMark) {
  const std::set<std::string> others = {".t.palpate-abcde", ".t.palpate-abcdefg", ".palpate-abcdef",
                                        "t.palpate-abcdef", ".t.palpat-abcdef"};
  for (const std::string& name : others) write(name);
  write(".t.palpate-abcdef");
  remove_stale_temporaries(folder_ / "t");
  EXPECT_EQ(left(), others);
  write(".t.palpate-abcdef");
  write(".u.palpate-A-_9zZ");
  remove_stale_temporaries_in(folder_.path());
  EXPECT_EQ(left(), others);
}

TEST_F(StaleTemporaries, StayWhileAProcessHasThemLocked) {
  write(".t.palpate-abcdef");
  const int held = ::open((folder_ / ".t.palpate-abcdef").c_str(), O_RDONLY | O_CLOEXEC);
  ASSERT_GE(held, 0);
  ASSERT_EQ(::flock(held, LOCK_EX), 0);
  remove_stale_temporaries(folder_ / "t");
  EXPECT_EQ(left().size(), 1U);
  ::close(held);
  remove_stale_temporaries(folder_ / "t");
  EXPECT_EQ(left().size(), 0U);
}

TEST_F(StaleTemporaries, AreFilesOfOneNameAndFoldersOnly) {
  write("mine");
  fs::create_symlink("mine", folder_ / ".t.palpate-aaaaaa");
  fs::create_hard_link(folder_ / "mine", folder_ / ".t.palpate-bbbbbb");
  fs::create_directories(folder_ / ".t.palpate-cccccc/deep");
  remove_stale_temporaries(folder_ / "t");
  EXPECT_EQ(left(), (std::set<std::string>{"mine", ".t.palpate-aaaaaa", ".t.palpate-bbbbbb"}));
}

TEST_F(StaleTemporaries, FitTheLimitForLongNames) {
  const std::string stem = fs::path(temporary_prefix(std::string(255, 'n'))).filename().string();
  EXPECT_LE(stem.size() + random_letters().size(), 255U);
  EXPECT_EQ(temporary_prefix("a/b/t"), "a/b/.t.palpate-");
  EXPECT_EQ(temporary_prefix("t"), ".t.palpate-");
  std::set<std::string> drawn;
  for (int k = 0; k < 100; ++k) drawn.insert(random_letters());
  EXPECT_GE(drawn.size(), 99U);  // of 64^6
  for (const std::string& letters : drawn) EXPECT_EQ(letters.size(), 6U);
}

}  // namespace
}  // namespace palpate::data
