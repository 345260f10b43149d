// Enrolment: codes and numbers.

#include <gtest/gtest.h>

#include "data/store/store.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;

using Enrolment = StoreOnDisk;

TEST_F(Enrolment, GivesTheSmallestFreeNumberOrTheWanted) {
  Store store = open();
  EXPECT_EQ(store.enrol(a_protocol(), "A").number, 1);
  EXPECT_EQ(store.enrol(a_protocol(), "B", 3).number, 3);
  EXPECT_EQ(store.enrol(a_protocol(), "C").number, 2);
  EXPECT_EQ(store.enrol(a_protocol(), "D").number, 4);
  EXPECT_EQ(store.enrol(a_protocol(), "B").number, 3);
  EXPECT_EQ(store.enrol(a_protocol(), "B", 3).number, 3);
  EXPECT_EQ(store.enrol(a_protocol('b'), "D").number, 1) << "another protocol counts for itself";
  EXPECT_EQ(store.participants(a_protocol().sha256).at(2).code, "B");
  EXPECT_EQ(store.counts().participants, 5);
}

TEST_F(Enrolment, LookUpTellsTheNextNumberWritingNothing) {
  Store store = open();
  EXPECT_EQ(store.look_up(a_protocol(), "A").number, 1);
  EXPECT_EQ(store.look_up(a_protocol(), "A", 4).number, 4);
  EXPECT_EQ(store.look_up(a_protocol(), "A").id, 0);
  EXPECT_EQ(store.counts().participants + store.counts().protocols, 0);
  store.enrol(a_protocol(), "A", 2);
  store.enrol(a_protocol('b'), "Z");
  EXPECT_NE(store.look_up(a_protocol(), "A").id, 0);
  EXPECT_EQ(store.look_up(a_protocol(), "B").number, 1);
  EXPECT_TRUE(
      contains(error_of([&] { store.look_up(a_protocol(), "B", 2); }), "taken by participant A"));
  store.enrol(a_protocol(), "GONE");
  store.forget("GONE");
  EXPECT_TRUE(contains(error_of([&] { store.look_up(a_protocol(), "GONE"); }), "has withdrawn"));
  EXPECT_EQ(store.codes(), (std::vector<std::string>{"A", "Z"}));
}

TEST_F(Enrolment, ConflictingNumbersAndCodesAreRefused) {
  Store store = open();
  store.enrol(a_protocol(), "A", 2);
  store.enrol(a_protocol(), "S", 3, true, 5);
  EXPECT_TRUE(
      contains(error_of([&] { store.enrol(a_protocol(), "B", 2); }), "taken by participant A"));
  EXPECT_TRUE(contains(error_of([&] { store.enrol(a_protocol(), "A", 1); }), "has number 2"));
  EXPECT_TRUE(contains(error_of([&] { store.enrol(a_protocol(), "A", {}, true); }), "is real"));
  EXPECT_TRUE(contains(error_of([&] { store.enrol(a_protocol(), "S"); }), "is simulated"));
  EXPECT_TRUE(
      contains(error_of([&] { store.enrol(a_protocol(), "S", {}, true, 6); }), "seed 5, not 6"));
  EXPECT_THROW(store.enrol(a_protocol(), "B", 0), StoreRefused);
  EXPECT_THROW(store.enrol(a_protocol(), "B", {}, false, 1), StoreRefused);
  ProtocolInfo forged = a_protocol();
  forged.text += " ";
  EXPECT_TRUE(contains(error_of([&] { store.enrol(forged, "B"); }), "SHA-256"));
  EXPECT_EQ(store.counts().participants, 2);
}

TEST_F(Enrolment, CodesArePseudonymsOfLettersAndDigits) {
  Store store = open();
  EXPECT_NO_THROW(store.enrol(a_protocol(), std::string(32, 'x')));
  for (const char* code : {"", "Jane Doe", "a-b", "a_b", "é", "a\n", "../x", "=1"}) {
    EXPECT_THROW(store.enrol(a_protocol(), code), StoreRefused) << code;
  }
  EXPECT_THROW(store.enrol(a_protocol(), std::string(33, 'x')), StoreRefused);
  EXPECT_THROW(store.enrol(a_protocol(), std::string("a\0b", 3)), StoreRefused);
  EXPECT_EQ(store.counts().participants, 1);
}

TEST_F(Enrolment, AProtocolNeedsItsChecksum) {
  Store store = open();
  for (const std::string& sha :
       {std::string(), std::string(63, 'a'), std::string(64, 'A'), checksum_hex("{} ")}) {
    EXPECT_THROW(store.enrol({.name = "n", .text = "{}", .sha256 = sha}, "A"), StoreRefused) << sha;
  }
  store.enrol({.name = "n", .text = "{}", .sha256 = checksum_hex("{}")}, "A");
}

}  // namespace
}  // namespace palpate::data
