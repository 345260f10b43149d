#include "data/store/export_log.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <gtest/gtest.h>

#include "data/base/input_file.h"
#include "tests/data/store/forget_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;

TEST_F(Forgetting, ListsTheParticipantsExportsAlsoAfterwards) {
  Store store = open();
  const auto people = store.participants(a_protocol().sha256);
  ASSERT_EQ(people[0].code, kGone);
  log_export(path_, {folder_ / "both.csv", "csv", 1}, {people[0].id, people[1].id});
  log_export(path_, {folder_ / "one", "bids", 2}, {people[1].id});
  log_export(path_, {folder_ / (std::string(kGone) + ".csv"), "csv", 3}, {people[0].id});
  ASSERT_EQ(store.participant_summary(kGone).exports.size(), 2u);
  EXPECT_EQ(store.participant_summary(kGone).exports[0].path, "both.csv");
  EXPECT_EQ(store.participant_summary(kGone).exports[0].format, "csv");
  EXPECT_EQ(store.participant_summary(kGone).exports[0].made_utc_ns, 1);
  EXPECT_EQ(store.participant_summary(kStays).exports.size(), 2u);
  store.forget(kGone);
  const auto exports = store.participant_summary(kGone).exports;
  ASSERT_EQ(exports.size(), 2u);
  EXPECT_EQ(exports[0].path, "both.csv");
  EXPECT_EQ(exports[1].path, "....csv (export 3)") << "the path said the code";
  expect_gone_while_open();
  log_export(path_, {folder_ / "both.csv", "csv", 4}, {people[1].id});
  EXPECT_EQ(store.participant_summary(kGone).exports.size(), 1u)
      << "it was made anew without the participant";
}

TEST_F(Forgetting, RecordsExportsWithoutTheComputersFolders) {
  Store store = open();
  const auto people = store.participants(a_protocol().sha256);
  const TemporaryFolder other, third;
  log_export(path_, {folder_ / "sub/study-bids/", "bids", 1}, {people[0].id});
  log_export(path_, {other / "trials.csv", "csv", 2}, {people[0].id});
  log_export(path_, {third / "trials.csv", "csv", 3}, {people[0].id});
  log_export(path_, {other / "trials.csv", "csv", 4}, {people[0].id});
  {  // as earlier versions kept it
    SQLite::Database db(path_, SQLite::OPEN_READWRITE);
    db.exec("UPDATE exports SET path = '" + folder_ / "sub/study-bids" + "' WHERE format = 'bids'");
  }
  log_export(path_, {folder_ / "last.csv", "csv", 5}, {people[0].id});
  const auto exports = store.participant_summary(kGone).exports;
  ASSERT_EQ(exports.size(), 4u);
  EXPECT_EQ(exports[0].path, "sub/study-bids");
  EXPECT_TRUE(exports[1].path.starts_with("trials.csv (elsewhere, ")) << exports[1].path;
  EXPECT_TRUE(exports[2].path.starts_with("trials.csv (elsewhere, ")) << exports[2].path;
  EXPECT_NE(exports[1].path, exports[2].path);
  EXPECT_EQ(exports[2].made_utc_ns, 4) << "the same place again";
  EXPECT_EQ(exports[3].path, "last.csv");
}

TEST_F(Forgetting, RecordsExportsOfCopiesWithoutWriteAheadLog) {
  const std::string copy = folder_ / "copy.db";
  open();
  SQLite::Database(path_, SQLite::OPEN_READWRITE).exec("VACUUM INTO '" + copy + "'");
  const std::string as_copied = read_whole(copy, 10 << 20);
  Store::open(copy, Store::Mode::read_only).codes();
  EXPECT_EQ(read_whole(copy, 10 << 20), as_copied) << "reading changes nothing";
  {
    Store exported = Store::open(copy, Store::Mode::read_for_export);
    const auto people = exported.participants(a_protocol().sha256);
    log_export(copy, {folder_ / "all.csv", "csv", 1}, {people[0].id});
  }
  Store store = Store::open(copy, Store::Mode::read_only);
  EXPECT_EQ(store.participant_summary(kGone).exports.size(), 1u);
}

TEST_F(Forgetting, TwoNamesRecordNoExport) {
  std::int64_t person = open().participants(a_protocol().sha256)[0].id;
  std::filesystem::create_hard_link(path_, folder_ / "second.db");
  const std::string before = contents_of(path_);
  const auto record = [&] { log_export(path_, {folder_ / "all.csv", "csv", 1}, {person}); };
  EXPECT_TRUE(contains(error_of(record), "has 2 names"));
  EXPECT_EQ(contents_of(path_), before);
}

TEST_F(Forgetting, AnExportMadeMeanwhileIsRefused) {
  Store store = open();
  const auto people = store.participants(a_protocol().sha256);
  store.forget(kGone);
  EXPECT_TRUE(
      contains(error_of([&] {
                 log_export(path_, {folder_ / "late.csv", "csv", 1}, {people[1].id, people[0].id});
               }),
               "was withdrawn while"));
  EXPECT_TRUE(store.participant_summary(kStays).exports.empty());
}

}  // namespace
}  // namespace palpate::data
