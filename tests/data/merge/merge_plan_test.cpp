// Conflicts between stations.

#include <gtest/gtest.h>

#include "data/merge/merge.h"
#include "tests/data/merge/merge_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;
namespace fs = std::filesystem;

TEST_F(Merging, ListsEveryConflictAndWritesNothing) {
  {
    Store a = open_station(a_), b = open_station(b_);
    record_session(a, "P1", 1);
    record_session(a, "P2", 2);
    record_session(a, "P3", 3);
    record_session(a, "P4", 4);
    a.enrol(a_protocol(), "S5", 5, true, 1);
    record_session(b, "P1", 1);
    b.add_note(b.begin_run(b.enrol(a_protocol(), "P9", 9), a_run()), 1, "alone");
    record_session(b, "P7", 2);     // number 2 again
    record_session(b, "P3", 8);     // another number
    record_session(b, "P4", 4, 1);  // equal so far
    b.enrol(a_protocol(), "S5", 5, true, 2);
  }
  record_otherwise(
      b_,
      "UPDATE attempts SET response_time = 9 WHERE trial = 3 AND session_id = (SELECT s.id FROM "
      "sessions s JOIN participants p ON p.id = s.participant_id WHERE p.code = 'P4')");
  record_otherwise(a_, "SELECT 1");
  const std::string message = refusal({a_, b_});
  EXPECT_TRUE(contains(message, "number 2 is that of participant P2 and of participant P7"));
  EXPECT_TRUE(contains(message, "participant P3 has number 3 and number 8"));
  EXPECT_TRUE(contains(message, "participant P4: session 1 is not the same"));
  EXPECT_TRUE(contains(message, "participant S5 is simulated at one station"));
  EXPECT_FALSE(contains(message, "participant P1")) << message;
  EXPECT_FALSE(contains(message, "participant P9")) << message;
  EXPECT_TRUE(contains(message, a_) && contains(message, b_));
  EXPECT_TRUE(contains(message, "Leave one of the databases out")) << "what to do";
}

TEST_F(Merging, OneDifferenceAnywhereIsAConflict) {
  make_station(a_, "P1", 1);
  for (const char* change :
       {"UPDATE sessions SET observer_sha256 = 'x'", "UPDATE runs SET hand = 'left' WHERE id = 1",
        "UPDATE notes SET text = 'another'", "UPDATE attempts SET max_force = 9 WHERE trial = 2",
        "UPDATE attempts SET cut_off_reason = 'x' WHERE state = 'cut_off'",
        "UPDATE samples SET data = x'00' WHERE attempt_id = 4",
        "DELETE FROM samples WHERE attempt_id = 4", "DELETE FROM notes",
        "UPDATE attempts SET run_id = 1 WHERE trial = 3",
        "UPDATE attempts SET first_contact_time = NULL WHERE trial = 2"}) {
    fs::copy_file(a_, b_, fs::copy_options::overwrite_existing);
    EXPECT_NO_THROW(merge(out_, {a_, b_}));
    fs::remove(out_);
    record_otherwise(b_, change);
    EXPECT_TRUE(contains(refusal({a_, b_}), "session 1 is not the same")) << change;
  }
}

TEST_F(Merging, OverlappingSessionsOfOneParticipantAreAConflict) {
  {
    Store a = open_station(a_), b = open_station(b_);
    record_session(a, "P1", 1, 1);
    record_session(b, "P1", 1, 2);
  }
  merge(folder_ / "fine.db", {a_, b_});
  record_otherwise(b_, "UPDATE runs SET started_utc_ns = started_utc_ns - 86400000000000");
  EXPECT_TRUE(contains(refusal({a_, b_}), "sessions 1 and 2 were at the same time"));
}

TEST_F(Merging, SessionsLastUntilTheirLastRunEnds) {
  {
    Store a = open_station(a_), b = open_station(b_);
    record_session(a, "P1", 1, 1);
    record_session(b, "P1", 1, 2);
  }
  // The second run of session 1 began half a day before session 2 and was closed long after it.
  record_otherwise(a_, "UPDATE runs SET ended_ns = ended_ns + 86400000000000 WHERE id = 2");
  EXPECT_TRUE(contains(refusal({a_, b_}), "sessions 1 and 2 were at the same time"));
}

TEST_F(Merging, DifferentProtocolsUnderOneNameAreRefused) {
  {
    Store a = open_station(a_), b = open_station(b_);
    record_session(a, "P1", 1, 1, 'a');
    record_session(b, "P2", 2, 1, 'b');
  }
  const std::string message = refusal({a_, b_});
  EXPECT_TRUE(contains(message, "protocol ho2000 is not the same")) << message;
  for (const char variant : {'a', 'b'}) {
    EXPECT_TRUE(contains(message, a_protocol(variant).sha256.substr(0, 12))) << message;
  }
  {
    Store a = open_station(a_);
    record_session(a, "P9", 9, 1, 'b');
  }
  EXPECT_EQ(merge(out_, {a_, b_}).counts.protocols, 2) << "changed at a, which knows both";
}

}  // namespace
}  // namespace palpate::data
