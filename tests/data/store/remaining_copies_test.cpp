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
  EXPECT_EQ(
      Store::open(path, Store::Mode::write_or_create).participant_summary("P07").remaining_copies,
      (std::vector<std::string>{folder / "bids", folder / "report.html", folder / "s.db.bak",
                                folder / "trials.csv"}));
}

}  // namespace
}  // namespace palpate::data
