#include <gtest/gtest.h>

#include "data/store/forget.h"
#include "tests/data/store/forget_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;

TEST(RemainingCopies, NamesCopiesTablesAndReportsBesideTheDatabase) {
  const TemporaryFolder folder;
  const std::string path = folder / "s.db";
  {
    Store store = Store::open(path, Store::Mode::write_or_create);
    store.enrol(a_protocol(), "P07");
  }
  std::filesystem::copy_file(path, folder / "s.db.bak");
  Store::open(folder / "other.db", Store::Mode::write_or_create).enrol(a_protocol(), "P08");
  write_file(folder / "trials.csv", "participant_id\r\nP07\r\n");
  write_file(folder / "report.html", "<td>P07</td>");
  write_file(folder / "unrelated.txt", "P070, XP07");
  std::filesystem::create_directories(folder / "bids/sub-P07");
  std::filesystem::create_directories(folder / "other/sub-P070");
  write_file(folder / "damaged.db", std::string("SQLite format 3\0 P07", 20));
  EXPECT_EQ(
      Store::open(path, Store::Mode::write_or_create).participant_summary("P07").remaining_copies,
      (std::vector<std::string>{folder / "bids", folder / "damaged.db", folder / "report.html",
                                folder / "s.db.bak", folder / "trials.csv"}));
}

TEST(RemainingCopies, FindsFiguresInFoldersAndRenamedBackups) {
  const TemporaryFolder folder;
  const std::string path = folder / "v2.db";
  Store store = Store::open(path, Store::Mode::write_or_create);
  store.enrol(a_protocol(), "P07");
  store.enrol(a_protocol(), "P08");
  std::filesystem::create_directories(folder / "figures/more");
  write_file(folder / "figures/figure15.svg", "<text>P07</text>");
  write_file(folder / "figures/figure16.svg", "<text>P08</text>");
  write_file(folder / "figures/more/plot.svg", "<text>P07</text>");
  // Copied while open: the rows are in the log.
  ASSERT_GT(std::filesystem::file_size(path + "-wal"), 0U);
  std::filesystem::copy_file(path, folder / "backup-v2.db");
  std::filesystem::copy_file(path + "-wal", folder / "backup-v2.db-wal");
  const std::string log = contents_of(path + "-wal");
  EXPECT_NE(log.find("P07"), std::string::npos);
  write_file(folder / "v2.db~", std::string("SQLite format 3\0damaged P07a", 28));
  write_file(folder / "v2.db.gz", "\x1f\x8b\x08");
  write_file(folder / "other.zip", "PK\x03\x04");
  write_file(folder / "v2.db.csv", "participant_id\r\nP08\r\n");
  const ParticipantSummary found = store.participant_summary("P07");
  EXPECT_EQ(found.remaining_copies,
            (std::vector<std::string>{folder / "backup-v2.db-wal", folder / "figures/figure15.svg",
                                      folder / "figures/more/plot.svg", folder / "v2.db.gz",
                                      folder / "v2.db~"}));
}

TEST(RemainingCopies, SearchesTextsUpTo256MiB) {
  const TemporaryFolder folder;
  const std::string path = folder / "s.db";
  Store store = Store::open(path, Store::Mode::write_or_create);
  store.enrol(a_protocol(), "P07");
  write_file(folder / "huge.txt", "P07 is a participant");
  std::filesystem::resize_file(folder / "huge.txt", (1ULL << 28U) + 1);
  EXPECT_EQ(store.participant_summary("P07").remaining_copies, std::vector<std::string>{});
  std::filesystem::resize_file(folder / "huge.txt", 1U << 20U);
  EXPECT_EQ(store.participant_summary("P07").remaining_copies,
            std::vector<std::string>{folder / "huge.txt"});
}

}  // namespace
}  // namespace palpate::data
