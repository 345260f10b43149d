// The frames in which trials were seen: kept with the samples, sealed by their trial's task.

#include <SQLiteCpp/Database.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "data/errors.h"
#include "data/merge/merge.h"
#include "data/store/store.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data {
namespace {

class Frames : public ::testing::Test {
 protected:
  void add(const std::string& code, int trial, std::vector<FrameRecord> frames) {
    Store store = Store::open(path_, Store::Mode::write_or_create);
    const data::Run run =
        store.begin_run(store.enrol(testing::a_protocol(), code), testing::a_run(1));
    TrialRecord record = testing::a_record(trial, 1);
    record.task.task = "rate";
    record.task.block_name = "b";
    record.attempt = store.begin_attempt(run, record, record.onset_ns - 1);
    record.task.intervals = {{}};
    record.samples = {SampleRecord{}};
    if (!frames.empty()) record.task.seen = {static_cast<int>(frames.size()), 0, 0.01, 0.01, 7};
    record.frames = std::move(frames);
    store.finish_attempt(run, record);
  }
  static std::vector<TrialRecord> read(const std::string& path) {
    Store store = Store::open(path, Store::Mode::read_only);
    std::vector<TrialRecord> out;
    store.for_each_trial([&](const StoredTrial& trial) { out.push_back(trial.record); }, true);
    return out;
  }
  int count(const std::string& what) {
    SQLite::Database db(path_, SQLite::OPEN_READONLY);
    return db.execAndGet("SELECT count(*) FROM " + what).getInt();
  }
  const palpate::testing::TemporaryFolder folder_;
  const std::string path_ = folder_ / "s.db";
};

const std::vector<FrameRecord> kSome{{30, 20, 5}, {46, 37, 5}, {-3, -9, 0}};

TEST_F(Frames, ComeBackAsTheyWere) {
  add("P1", 1, kSome);
  const std::vector<TrialRecord> trials = read(path_);
  ASSERT_EQ(trials.size(), 1u);
  ASSERT_EQ(trials[0].frames.size(), kSome.size());
  for (std::size_t i = 0; i < kSome.size(); ++i) {
    EXPECT_EQ(trials[0].frames[i].swap_ns, kSome[i].swap_ns);
    EXPECT_EQ(trials[0].frames[i].pose_ns, kSome[i].pose_ns);
    EXPECT_EQ(trials[0].frames[i].delay_ns, kSome[i].delay_ns);
  }
  EXPECT_EQ(trials[0].task.seen->first_ns, 7);
}

TEST_F(Frames, HaveNoTableWhereNothingWasSeen) {
  add("P1", 1, {});
  EXPECT_EQ(count("sqlite_schema WHERE name = 'frames'"), 0);
  EXPECT_TRUE(read(path_)[0].frames.empty());
}

TEST_F(Frames, ThatWereChangedAreFound) {
  for (const char* change : {"UPDATE frames SET swap_ns = swap_ns - 1 WHERE frame = 2",
                             "DELETE FROM frames WHERE frame = 3", "DROP TABLE frames"}) {
    std::filesystem::remove(path_);
    add("P1", 1, kSome);
    SQLite::Database(path_, SQLite::OPEN_READWRITE).exec(change);
    EXPECT_THROW(read(path_), StoreError) << change;
  }
}

TEST_F(Frames, LeavesFilesOfOtherPrograms) {
  add("P1", 1, {});
  SQLite::Database(path_, SQLite::OPEN_READWRITE).exec("CREATE TABLE frames (a TEXT)");
  EXPECT_THROW(add("P2", 1, kSome), StoreError);
  EXPECT_EQ(count("frames"), 0);
}

TEST_F(Frames, AreForgottenWithTheirParticipant) {
  add("P1", 1, kSome);
  add("P2", 1, kSome);
  Store::open(path_, Store::Mode::write_or_create).forget("P1");
  EXPECT_EQ(count("frames"), static_cast<int>(kSome.size()));
  EXPECT_EQ(read(path_).size(), 1u);
}

TEST_F(Frames, AreMerged) {
  add("P1", 1, kSome);
  const std::string first = folder_ / "first.db";
  std::filesystem::rename(path_, first);
  add("P2", 1, {{100, 90, 0}});
  const std::string both = folder_ / "both.db";
  merge(both, {first, path_}, {}, NumberConflict::renumber);
  const std::vector<TrialRecord> trials = read(both);
  ASSERT_EQ(trials.size(), 2u);
  EXPECT_EQ(trials[0].frames.size() + trials[1].frames.size(), kSome.size() + 1);
}

}  // namespace
}  // namespace palpate::data
