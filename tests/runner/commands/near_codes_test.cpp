#include <gtest/gtest.h>

#include "runner/station/admission.h"

namespace palpate::runner::commands {
namespace {

using Codes = std::vector<std::string>;

TEST(NearCodes, VariantsOfOneCodeAreNear) {
  const Codes known = {"P01", "Q7", "SUBJ10"};
  for (const char* slip : {"p01", "P1", "p1", "PO1", "Po1", "P0l", "P0I", "P001", "P0i"}) {
    EXPECT_EQ(station::near_codes(slip, known), Codes{"P01"}) << slip;
  }
  EXPECT_EQ(station::near_codes("subj1O", known), Codes{"SUBJ10"});
  EXPECT_EQ(station::near_codes("q07", known), Codes{"Q7"});
}

TEST(NearCodes, CodesThatDifferByALetterAreNear) {
  for (const char* slip : {"SUJB10", "SUB10", "SUBBJ10", "SUBK10", "SUBJ10a"}) {
    EXPECT_EQ(station::near_codes(slip, {"SUBJ10"}), Codes{"SUBJ10"}) << slip;
  }
  EXPECT_EQ(station::near_codes("PP01", {"P01"}), Codes{"P01"});
  EXPECT_EQ(station::near_codes("01", {"P01"}), Codes{"P01"});
  EXPECT_EQ(station::near_codes("MKHX", {"MKHB"}), Codes{"MKHB"});
}

TEST(NearCodes, ConsecutiveCodesAreNotNear) {
  Codes known;
  for (int i = 1; i <= 120; ++i) {
    const std::string number = std::to_string(i);
    const std::string code = "P" + std::string(3 - number.size(), '0') + number;
    EXPECT_EQ(station::near_codes(code, known), Codes{}) << code;
    known.push_back(code);
  }
  known.clear();
  for (int i = 1; i <= 120; ++i) {
    EXPECT_EQ(station::near_codes("T" + std::to_string(i), known), Codes{}) << i;
    known.push_back("T" + std::to_string(i));
  }
}

TEST(NearCodes, ShortCodesThatDifferByALetterAreNotNear) {
  EXPECT_EQ(station::near_codes("B1", {"A1", "C1"}), Codes{});
  EXPECT_EQ(station::near_codes("B", {"A", "C"}), Codes{});
  EXPECT_EQ(station::near_codes("KXR", {"KXQ", "KQX"}), Codes{});
  EXPECT_EQ(station::near_codes("P01", {"P01"}), Codes{}) << "that is the code itself";
  EXPECT_EQ(station::near_codes("0", {"P01", "1"}), Codes{});
}

}  // namespace
}  // namespace palpate::runner::commands
