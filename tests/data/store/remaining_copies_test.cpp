#include "data/store/remaining_copies.h"

#include <gtest/gtest.h>

#include "tests/data/store/forget_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;

TEST(RemainingCopies, CopiesTablesAndReportsBesideTheDatabaseAreNamed) {
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
      (std::vector<std::string>{folder / "bids", folder / "report.html", folder / "s.db.bak",
                                folder / "trials.csv"}));
}

TEST(RemainingCopies, OfTextsAreLookedForUpTo256MiB) {
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
