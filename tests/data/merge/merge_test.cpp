#include "data/merge/merge.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <stdexcept>

#include "tests/data/merge/merge_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;
namespace fs = std::filesystem;

TEST_F(Merging, HoldsWhatTheStationsHold) {
  {
    Store a = open_station(a_), b = open_station(b_);
    record_session(a, "P1", 1);
    record_session(a, "P3", 3);
    record_session(b, "P2", 2);
    record_session(b, "P2", 2, 2);
    record_session(b, "P4", 4);
  }
  Lines parts = exported(a_, export_folder_), rest = notes_runs_and_samples(a_);
  parts.merge(exported(b_, export_folder_));
  rest.merge(notes_runs_and_samples(b_));
  const std::string recorded_a = contents_of(a_), recorded_b = contents_of(b_);
  const MergeResult done = merge(out_, {a_, b_});
  EXPECT_EQ(done.counts.participants, 4);
  EXPECT_EQ(done.counts.sessions, 5);
  EXPECT_EQ(done.counts.runs, 10);
  EXPECT_EQ(done.counts.completed, 15);
  EXPECT_EQ(done.counts.cut_off, 5);
  EXPECT_EQ(done.counts.sampled, 10);
  EXPECT_TRUE(done.excluded.empty());
  EXPECT_EQ(exported(out_, export_folder_), parts);
  EXPECT_EQ(notes_runs_and_samples(out_), rest);
  EXPECT_EQ(contents_of(a_), recorded_a) << "an input was written to";
  EXPECT_EQ(contents_of(b_), recorded_b) << "an input was written to";
  struct stat found {};
  ASSERT_EQ(::stat(out_.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777, 0600u);
  expect_no_temporaries();
  EXPECT_EQ(open_station(out_).enrol(a_protocol(), "P5").number, 5) << "and can be continued";
}

TEST_F(Merging, RepeatedOrReorderedGivesTheSameBytes) {
  {
    Store a = open_station(a_), b = open_station(b_);
    record_session(a, "P1", 1);
    record_session(b, "P2", 2);
    record_session(b, "P3", 3);
    b.forget("P3");
    record_session(b, "O1", 1, 1, 'b');
    record_session(a, "O2", 2, 1, 'b');
  }
  // Two protocols of one name, known to both stations.
  merge(out_, {a_, b_});
  merge(folder_ / "other-order.db", {b_, a_});
  merge(folder_ / "again.db", {out_, a_, out_, b_, a_});
  merge(folder_ / "alone.db", {out_});
  const std::string all = contents_of(out_);
  EXPECT_TRUE(contents_of(folder_ / "other-order.db") == all);
  EXPECT_TRUE(contents_of(folder_ / "again.db") == all);
  EXPECT_TRUE(contents_of(folder_ / "alone.db") == all);
}

TEST_F(Merging, AnotherSessionOfTheSameParticipantIsAdded) {
  {
    Store a = open_station(a_), b = open_station(b_);
    record_session(a, "P1", 1);
    record_session(b, "P1", 1);  // a copy of the first day, then the second
    record_session(b, "P1", 1, 2);
  }
  EXPECT_EQ(merge(out_, {a_, b_}).counts.sessions, 2);
}

TEST_F(Merging, RenumbersDuplicatesOnRequestKeepingOrderOfTrials) {
  const std::string c = folder_ / "c.db", again = folder_ / "again.db";
  {
    Store a = open_station(a_), b = open_station(b_), third = open_station(c);
    record_session(a, "P1", 1);
    record_session(a, "P2", 2, 2);  // a day later than the other number 2
    record_session(b, "Q1", 1);
    record_session(b, "Q2", 2);
    record_session(third, "R1", 4);
  }
  const std::string message = refusal({a_, b_});
  EXPECT_TRUE(contains(message, "number 1 is that of participant P1 and of participant Q1"));
  EXPECT_TRUE(contains(message, "number 2 is that of participant Q2 and of participant P2"));
  EXPECT_TRUE(contains(message, "--renumber"));
  EXPECT_TRUE(contains(message, "run --number"));
  EXPECT_FALSE(contains(message, "forget")) << "nobody has to go";

  Lines parts = exported(a_, export_folder_);
  parts.merge(exported(b_, export_folder_));
  const MergeResult done = merge(out_, {b_, a_}, {}, NumberConflict::renumber);
  ASSERT_EQ(done.renumbered.size(), 2u);
  EXPECT_EQ(done.renumbered[0].code + done.renumbered[0].other, "Q1P1");
  EXPECT_EQ(done.renumbered[0].from, 1);
  EXPECT_EQ(done.renumbered[0].to, 3);
  EXPECT_EQ(done.renumbered[1].code + done.renumbered[1].other, "P2Q2");
  EXPECT_EQ(done.renumbered[1].to, 4);
  EXPECT_EQ(exported(out_, export_folder_), parts) << "also the number that ordered the trials";
  {
    Store all = open_station(out_);
    const Participant person = all.look_up(a_protocol(), "P2");
    EXPECT_EQ(person.number, 4);
    EXPECT_EQ(person.enrolled_number, 2);
    EXPECT_EQ(all.look_up(a_protocol(), "NEW").number, 5);
  }
  // Merging the merged database with its parts again, in any order, changes nothing and needs no
  // option.
  const MergeResult repeated = merge(again, {a_, out_, b_});
  EXPECT_TRUE(repeated.renumbered.empty());
  EXPECT_EQ(exported(again, export_folder_), parts);
  EXPECT_EQ(open_station(again).look_up(a_protocol(), "Q1").number, 3);
  fs::remove(again);
  // A number assigned by a merge yields to a station that counted up to it.
  const MergeResult more = merge(again, {out_, c}, {}, NumberConflict::renumber);
  ASSERT_EQ(more.renumbered.size(), 1u);
  EXPECT_EQ(more.renumbered[0].code + more.renumbered[0].other, "P2R1");
  EXPECT_EQ(more.renumbered[0].from, 2);
  EXPECT_EQ(more.renumbered[0].to, 5);
}

TEST_F(Merging, WithdrawnParticipantsStayExcluded) {
  {
    Store a = open_station(a_), b = open_station(b_);
    record_session(a, "P1", 1);
    record_session(a, "P2", 2);
    record_session(b, "P2", 2);
    record_session(b, "P3", 3);
    a.forget("P2");
  }
  const MergeResult done = merge(out_, {b_, a_});
  EXPECT_EQ(done.counts.participants, 2);
  ASSERT_EQ(done.excluded.size(), 1u);
  EXPECT_EQ(done.excluded[0].code, "P2");
  EXPECT_EQ(done.excluded[0].path, b_);
  EXPECT_TRUE(
      contains(error_of([&] { open_station(out_).enrol(a_protocol(), "P2"); }), "withdrawn"));
  EXPECT_EQ(merge(folder_ / "later.db", {out_, b_}).excluded.size(), 1u)
      << "nor from a later merge";
  open_station(b_).forget("P3");
  EXPECT_EQ(merge(folder_ / "two.db", {out_, b_}).counts.participants, 1);
  EXPECT_TRUE(contains(
      error_of([&] { open_station(folder_ / "two.db").enrol(a_protocol(), "P2"); }), "with"));
  EXPECT_TRUE(contains(
      error_of([&] { open_station(folder_ / "two.db").enrol(a_protocol(), "P3"); }), "with"));
}

TEST_F(Merging, AStoppedMergeLeavesNoFile) {
  make_station(a_, "P1", 1);
  EXPECT_THROW(
      merge(out_, {a_}, [](std::int64_t, std::int64_t) { throw std::runtime_error("stopped"); }),
      std::runtime_error);
  EXPECT_FALSE(fs::exists(out_));
  expect_no_temporaries();
}

}  // namespace
}  // namespace palpate::data
