// The CSV reader: accepted forms, and faults with their location.

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "protocols/parse.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::analysis {
namespace {

const std::string kHeader =
    "participant_id,session,block,trial,renderer,shape,response,correct,response_time\n";

const std::string kNul(1, '\0');

class TrialsCsv : public ::testing::Test {
 protected:
  TrialTable read(const std::string& text) {
    std::ofstream(path_, std::ios::binary) << text;
    return read_trials_csv(path_);
  }
  std::vector<protocols::Fault> faults(const std::string& text) {
    try {
      read(text);
    } catch (const protocols::InputError& error) {
      return error.faults();
    }
    ADD_FAILURE() << "no fault found in " << text.substr(0, 300);
    return {};
  }
  /// Expects exactly one fault at this location, whose message contains `words`.
  void expect_fault(const std::string& text, const std::string& place, const std::string& words) {
    const auto found = faults(text);
    ASSERT_EQ(found.size(), 1U) << text.substr(0, 300);
    EXPECT_EQ(found[0].file, path_);
    EXPECT_EQ(found[0].location, place);
    EXPECT_NE(found[0].expected.find(words), std::string::npos) << found[0].expected;
  }

  const palpate::testing::TemporaryFolder folder_;
  const std::string path_ = folder_ / "trials.csv";
};

TEST_F(TrialsCsv, ReadsTheNineColumns) {
  const TrialTable table = read(kHeader +
                                "P1,1,1,1,ray,cube,sphere,0,2.5\n"
                                "P1,1,1,2,point,cone,cone,1,0.25\n"
                                "P2,1,1,1,ray,cone,,0,60\n");
  EXPECT_EQ(table.participants, (std::vector<std::string>{"P1", "P2"}));
  EXPECT_EQ(table.renderers, (std::vector<std::string>{"point", "ray"}));
  EXPECT_EQ(table.shapes, (std::vector<std::string>{"cone", "cube"}));
  EXPECT_EQ(table.answers, (std::vector<std::string>{"cone", "cube", "sphere"}));
  ASSERT_EQ(table.rows.size(), 3U);
  EXPECT_EQ(table.rows[0].renderer, 1);
  EXPECT_EQ(table.rows[0].shape, 1);
  EXPECT_EQ(table.rows[0].answer, 2);
  EXPECT_FALSE(table.rows[0].correct);
  EXPECT_EQ(table.rows[1].response_time, 0.25);
  EXPECT_TRUE(table.rows[1].correct);
  EXPECT_TRUE(table.rows[2].timed_out) << "an empty response, as there is no column timed_out";
  EXPECT_EQ(table.rows[2].answer, -1);
  EXPECT_EQ(table.simulated, Simulated::no);
  EXPECT_TRUE(table.warnings.empty());
}

TEST_F(TrialsCsv, ReadsTruthAsOtherProgramsWriteIt) {
  const TrialTable table = read(kHeader +
                                "P1,1,1,1,ray,cone,cone,TRUE,2\n"
                                "P1,1,1,2,ray,cone,cube,FALSE,2\n"
                                "P1,1,1,3,ray,cone,cone,True,2\n"
                                "P1,1,1,4,ray,cone,cube,False,2\n"
                                "P1,1,1,5,ray,cone,cone,true,2\n");
  std::vector<bool> correct;
  for (const TrialRow& row : table.rows) correct.push_back(row.correct);
  EXPECT_EQ(correct, (std::vector<bool>{true, false, true, false, true}));
  EXPECT_TRUE(table.warnings.empty());
  expect_fault(kHeader + "P1,1,1,1,ray,cone,cone,yes,2\n", "line 2, column correct", "TRUE");
}

TEST_F(TrialsCsv, WarnsOfNamesThatLookAlike) {
  const TrialTable table = read(kHeader +
                                "1,1,1,1,ray,cone,cone,1,2\n"
                                "01,1,1,1,ray,cone,cone,1,2\n"
                                "1 ,1,1,1,ray,Cone,Cone,1,2\n"
                                "10,1,1,1,ray,cone,cone,1,2\n"
                                "P00,1,1,1,ray,cone,cone,1,2\n");
  EXPECT_EQ(table.participants.size(), 5u);
  const std::string end = " look alike; they count as different. Write one name in one way.";
  EXPECT_EQ(table.warnings,
            (std::vector<std::string>{"Participants '1', '01' and '1 '" + end,
                                      "Stimuli and answers 'cone' and 'Cone'" + end}));
}

TEST_F(TrialsCsv, CountsTrialsWhoseTorqueWasLeftOut) {
  const std::string header = kHeader.substr(0, kHeader.size() - 1) + ",torque_driven\n";
  const std::string rows =
      "P1,1,1,1,ray,cube,cube,1,2.5,0\n"
      "P1,1,1,2,point,cone,cone,1,0.25,\n"
      "P1,1,1,3,point,cone,cone,1,0.25,NA\n"
      "P2,1,1,1,ray,cone,cone,1,6,1\n";
  EXPECT_EQ(read(header + rows).warnings,
            (std::vector<std::string>{
                "In 1 of 2 trials with ray torque was left out: the device drives force alone."}));
  expect_fault(header + "P1,1,1,1,ray,cube,cube,1,2.5,no\n", "line 2, column torque_driven",
               "0 or 1");
}

TEST_F(TrialsCsv, ToleratesByteMarksCrlfQuotesAndAnyOrder) {
  const TrialTable table = read(
      "\xEF\xBB\xBFresponse_time,note,correct,response,shape,renderer,trial,block,session,"
      "participant_id\r\n"
      "2,\"a \"\"quoted\"\", two\r\nlines\",1,cone,cone,ray,1,1,1,\"P,1\"\r\n"
      "\r\n"
      "3,,1,cone,\"cone\",ray,2,1,1,\"P,1\"");
  ASSERT_EQ(table.rows.size(), 2U);
  EXPECT_EQ(table.participants, (std::vector<std::string>{"P,1"}));
  EXPECT_EQ(table.rows[1].response_time, 3);
}

TEST_F(TrialsCsv, LinesAreCountedThroughQuotedNewlines) {
  expect_fault("note," + kHeader + "\"1\n2\n3\",P1,1,1,1,ray,cone,cone,1,2\n" +
                   ",P1,1,1,2,ray,cone,cone,1,fast\n",
               "line 5, column response_time", "'fast'");
}

TEST_F(TrialsCsv, RenderersArePointRayThenAsTheyAppear) {
  const TrialTable table = read(kHeader +
                                "P1,1,1,1,tube,cone,cone,1,1\n"
                                "P1,1,1,2,ray,cone,cone,1,2\n"
                                "P1,1,1,3,a b,cone,cone,1,3\n"
                                "P1,1,1,4,point,cone,cone,1,4\n"
                                "P1,1,1,5,tube,cone,cone,1,5\n");
  EXPECT_EQ(table.renderers, (std::vector<std::string>{"point", "ray", "tube", "a b"}));
  std::vector<int> renderers;
  renderers.reserve(table.rows.size());
  for (const TrialRow& row : table.rows) renderers.push_back(row.renderer);
  EXPECT_EQ(renderers, (std::vector<int>{2, 1, 3, 0, 2}));
  EXPECT_EQ(table.rows[4].exposure, 2U) << "counted by renderer";
}

TEST_F(TrialsCsv, NamesOfRenderersAreChecked) {
  const auto row = [](const std::string& renderer) {
    return kHeader + "P1,1,1,1," + renderer + ",cone,cone,1,2\n";
  };
  for (const std::string& bad : {std::string(), std::string(201, 'r'), std::string("a\x1b[1m"),
                                 std::string("\xFF"), std::string("no_response")}) {
    expect_fault(row(bad), "line 2, column renderer", "expected a");
  }
  EXPECT_EQ(read(row(std::string(200, 'r'))).renderers[0].size(), 200U);
}

TEST_F(TrialsCsv, RenderersAndCellsHaveALimit) {
  const auto with = [](int renderers, int participants, int stimuli) {
    std::string text = kHeader;
    int trial = 0;
    const auto add = [&](int renderer, int participant, int stimulus) {
      const std::string shape = "s" + std::to_string(stimulus);
      text += "P" + std::to_string(participant) + ",1,1," + std::to_string(++trial) + ",r" +
              std::to_string(renderer) + "," + shape + "," + shape + ",1,2\n";
    };
    for (int r = 0; r < renderers; ++r) add(r, 0, 0);
    for (int s = 0; s < stimuli; ++s) add(0, 0, s);
    for (int p = 0; p < participants; ++p) add(0, p, 0);
    return text;
  };
  EXPECT_EQ(read(with(20, 1, 1)).renderers.size(), 20U);
  expect_fault(with(21, 1, 1), "line 22, column renderer", "at most 20 different renderers");
  EXPECT_EQ(read(with(2, 10000, 200)).participants.size(), 10000U);
  expect_fault(with(3, 7000, 200), "line 6871, column participant_id", "at most 4000000 cells");
}

TEST_F(TrialsCsv, NamesLinesThatEndInCrAlone) {
  const auto with_cr = [](std::string text) {
    for (char& c : text) c = c == '\n' ? '\r' : c;
    return text;
  };
  const std::string row = "P1,1,1,1,ray,cone,cone,1,2\n";
  const std::string words = "a CR that no LF follows";
  expect_fault(with_cr(kHeader + row + row), "line 1", words);
  expect_fault(with_cr("note," + kHeader + "x," + row), "line 1", words);
  expect_fault(with_cr(kHeader.substr(0, kHeader.size() - 1) + ",note\n" + row), "line 1", words);
  expect_fault(with_cr(kHeader + "\"P1\",1,1,1,ray,cone,cone,1,2\n" + row), "line 1", words);
  expect_fault(with_cr(kHeader + "P1,1,1,1,ray,cone,cone,1,\"2\"\n" + row), "line 1", words);
  expect_fault(kHeader + with_cr(row + row + row), "line 2", words);
  std::string large = kHeader;
  while (large.size() < (2U << 20)) large += row;
  expect_fault(with_cr(large), "line 1", words);
  expect_fault(kHeader + row + "P1,1,1,2,ray,co\rne,cone,1,2\n", "line 3", words);
}

TEST_F(TrialsCsv, OmitsPracticeAndOnlyOneMeansTimeOut) {
  const std::string header = kHeader.substr(0, kHeader.size() - 1) + ",practice,timed_out\n";
  const TrialTable table = read(header +
                                "P1,1,1,1,ray,torus,torus,1,2,1,0\n"
                                "P1,1,1,2,ray,cone,,0,60,0,1\n"
                                "P1,1,1,3,ray,cone,,0,7,0,0\n");
  EXPECT_EQ(table.n_practice, 1U);
  EXPECT_EQ(table.shapes, (std::vector<std::string>{"cone"}));
  ASSERT_EQ(table.rows.size(), 2U);
  EXPECT_TRUE(table.rows[0].timed_out);
  EXPECT_FALSE(table.rows[1].timed_out);
}

TEST_F(TrialsCsv, OwnShapesStandInTheOrderShown) {
  const TrialTable table = read(kHeader +
                                "P1,1,1,1,ray,torus,wedge,0,2\n"
                                "P1,1,1,2,ray,prism,prism,1,2\n"
                                "P1,1,1,3,ray,wedge,ring,0,2\n"
                                "P1,1,1,4,ray,cube,cube,1,2\n");
  EXPECT_EQ(table.shapes, (std::vector<std::string>{"cube", "torus", "prism", "wedge"}));
  EXPECT_EQ(table.answers.back(), "ring");
}

TEST_F(TrialsCsv, KnowsSimulatedParticipantsAndSourcesOfRows) {
  const std::string header =
      kHeader.substr(0, kHeader.size() - 1) + ",simulated,protocol_sha256,program_version\n";
  const std::string one = "P1,1,1,1,ray,cone,cone,1,2,1,abc,0.1.0\n";
  EXPECT_EQ(read(header + one).simulated, Simulated::yes);
  const TrialTable mixed = read(header + one + "P2,1,1,1,ray,cone,cone,1,2,0,abc,0.2.0\n");
  EXPECT_EQ(mixed.simulated, Simulated::mixed);
  EXPECT_EQ(mixed.provenance.protocol_sha256, (std::vector<std::string>{"abc"}));
  EXPECT_EQ(mixed.provenance.program_versions, (std::vector<std::string>{"0.1.0", "0.2.0"}));
}

TEST_F(TrialsCsv, EveryBadFieldIsNamed) {
  const auto found = faults(kHeader + "P1,0,1.5,x,,,cone,yes,-1\n" +
                            "P1,1,1,1,ray,cone,cone,1,2\n" + "\t,1,1,2,ray,cone,cone,1,nan\n");
  std::vector<std::string> places;
  places.reserve(found.size());
  for (const protocols::Fault& fault : found) places.push_back(fault.location);
  EXPECT_EQ(places, (std::vector<std::string>{
                        "line 2, column session", "line 2, column block", "line 2, column trial",
                        "line 2, column renderer", "line 2, column shape", "line 2, column correct",
                        "line 2, column response_time", "line 4, column participant_id",
                        "line 4, column response_time"}));
}

TEST_F(TrialsCsv, RefusesBadTimes) {
  for (const char* time : {"", " 2", "2 ", "+2", "inf", "nan", "-0.1", "1e7", "1e999", "2s"}) {
    expect_fault(kHeader + "P1,1,1,1,ray,cone,cone,1," + time + "\n",
                 "line 2, column response_time", "a time in s");
  }
  // A decimal comma adds a field.
  expect_fault(kHeader + "P1,1,1,1,ray,cone,cone,1,1,5\n", "line 2", "expected 9 fields");
}

TEST_F(TrialsCsv, MissingAndDoubleColumns) {
  const auto missing = faults("participant_id,session,block,trial,renderer,shape,response\n");
  ASSERT_EQ(missing.size(), 2U);
  EXPECT_NE(missing[0].expected.find("'correct'"), std::string::npos);
  EXPECT_NE(missing[1].expected.find("'response_time'"), std::string::npos);
  expect_fault("shape," + kHeader + "cone,P1,1,1,1,ray,cone,cone,1,2\n", "line 1, column shape",
               "each column once");
  const auto semicolons = faults("participant_id;session;block\nP1;1;1\n");
  ASSERT_FALSE(semicolons.empty());
  EXPECT_NE(semicolons[0].expected.find("commas"), std::string::npos);
}

TEST_F(TrialsCsv, RefusesBrokenFiles) {
  const std::string row = "P1,1,1,1,ray,cone,cone,1,2\n";
  expect_fault("", "file", "at least one trial");
  expect_fault(kHeader, "file", "at least one trial");
  expect_fault(kHeader + row + "P1,1,1\n", "line 3", "expected 9 fields");
  expect_fault(kHeader + row + "\"P1,1,1,2,ray,cone,cone,1,2\n" + row, "line 3", "never closed");
  expect_fault(kHeader + row + "\"P1\"x,1,1,2,ray,cone,cone,1,2\n", "line 3", "after the closing");
  expect_fault(kHeader + row + "P\"1,1,1,2,ray,cone,cone,1,2\n", "line 3", "quote inside");
  expect_fault(kHeader + row + "P" + kNul + ",1,1,2,ray,cone,cone,1,2\n", "line 3", "NUL");
  expect_fault(kHeader + row + "\"P" + kNul + "\",1,1,2,ray,cone,cone,1,2\n", "line 3", "NUL");
  expect_fault(kHeader + row + "P\xFF,1,1,2,ray,cone,cone,1,2\n", "line 3, column participant_id",
               "UTF-8");
  expect_fault(kHeader + "P1,1,1,1,ray,cone,no_response,0,2\n", "line 2, column response", "empty");
  EXPECT_THROW(read_trials_csv(::testing::TempDir()), protocols::InputError);
  EXPECT_THROW(read_trials_csv(path_ + ".is_not_there"), protocols::InputError);
}

TEST_F(TrialsCsv, OverlongFieldsAreRefusedWhereverTheyStand) {
  const std::string row = "P1,1,1,1,ray,cone,cone,1,2\n", huge(3U << 20, 'x');
  expect_fault(kHeader + row + huge + ",1,1,2,ray,cone,cone,1,2\n", "line 3", "1 MiB");
  expect_fault(kHeader + row + "\"" + huge + "\",1,1,2,ray,cone,cone,1,2\n", "line 3", "1 MiB");
  expect_fault(huge + "\n" + row, "line 1", "1 MiB");
  expect_fault(std::string((1U << 20) + 100, 'x') + "\n" + row, "line 1", "1 MiB");
  // Below the limit, across the reader's blocks: a fault of the one field.
  expect_fault(kHeader + row + std::string(700000, 'x') + ",1,1,2,ray,cone,cone,1,2\n",
               "line 3, column participant_id", "1 to 200 bytes");
  const TrialTable table = read("note," + kHeader + "\"" + std::string(700000, '\n') + "\"," + row +
                                ",P1,1,1,2,ray,cone,cone,1,2\n");
  EXPECT_EQ(table.rows.size(), 2U);
}

TEST_F(TrialsCsv, ManyFaultsAreListedThenCounted) {
  std::string text = kHeader;
  for (int i = 0; i < 1000; ++i) text += "P1,1,1,1,ray,cone,cone,1,never\n";
  const auto found = faults(text);
  ASSERT_EQ(found.size(), kMaxFaults + 1);
  EXPECT_NE(found.back().expected.find("950 more"), std::string::npos);
}

TEST_F(TrialsCsv, RefusesRepeatedRowsAndWarnsOfRepeatedPlaces) {
  const std::string row = "P1,1,1,1,ray,cone,cone,1,2\n";
  expect_fault(kHeader + row + "\n" + row, "file", "1 row appears twice (lines 2 and 4)");
  const TrialTable repeated = read(kHeader + row + "P1,1,1,1,ray,cone,cone,1,2.5\n");
  ASSERT_EQ(repeated.warnings.size(), 1U);
  EXPECT_NE(repeated.warnings[0].find("(lines 2 and 3)"), std::string::npos);
  const std::string late = "P1,1,1,2,ray,cone,,0,NA\n";
  expect_fault(kHeader + row + late + late, "file", "(lines 3 and 4)");
}

TEST_F(TrialsCsv, ChoosesBetweenTwoProtocolsWithTheSamePlaces) {
  const std::string row = "P1,1,1,1,ray,cone,,0,60,";
  const std::string text = kHeader.substr(0, kHeader.size() - 1) + ",protocol_sha256\n" + row +
                           "aaaaaa11\n" + row + "bbbbbb22\nP1,1,1,2,ray,cube,cube,1,2,bbbbbb22\n";
  const TrialTable both = read(text);
  EXPECT_EQ(both.rows.size(), 3U);
  EXPECT_EQ(both.warnings, std::vector<std::string>());
  EXPECT_EQ(pooled_protocols(both.provenance),
            "Trials of 2 different protocols (aaaaaa11, bbbbbb22) are pooled; --protocol chooses "
            "one.");
  const TrialTable one = read_trials_csv(path_, "bbbbbb");
  EXPECT_EQ(one.rows.size(), 2U);
  EXPECT_EQ(one.provenance.protocol_sha256, (std::vector<std::string>{"bbbbbb22"}));
  EXPECT_THROW(read_trials_csv(path_, "cccccc"), protocols::InputError);
  read(kHeader + "P1,1,1,1,ray,cone,cone,1,2\n");
  EXPECT_THROW(read_trials_csv(path_, "aaaaaa"), protocols::InputError);
}

TEST_F(TrialsCsv, StimuliMayBeNamedLikeMissingValues) {
  const std::string header = kHeader.substr(0, kHeader.size() - 1) + ",timed_out\n";
  const TrialTable table = read(header +
                                "P1,1,1,1,ray,cone,NA,0,2,0\n"
                                "P1,1,1,2,ray,NA,NA,1,2,0\n"
                                "P1,1,1,3,ray,NA,nan,0,2,1\n");
  ASSERT_EQ(table.shapes, (std::vector<std::string>{"cone", "NA"}));
  EXPECT_EQ(table.rows[0].answer, 1);
  EXPECT_EQ(table.rows[1].answer, 1);
  EXPECT_EQ(table.rows[2].answer, -1);
  EXPECT_EQ(table.warnings, std::vector<std::string>());
}

TEST_F(TrialsCsv, ShapesCanBePutInAnotherOrder) {
  TrialTable table = read(kHeader +
                          "P1,1,1,1,ray,torus,wedge,0,2\n"
                          "P1,1,1,2,ray,prism,ring,0,2\n"
                          "P1,1,1,3,ray,wedge,,0,2\n");
  order_shapes(table, {"wedge", "torus"});
  EXPECT_EQ(table.shapes, (std::vector<std::string>{"torus", "prism", "wedge"}));
  order_shapes(table, {"wedge", "torus", "prism"});
  EXPECT_EQ(table.shapes, (std::vector<std::string>{"wedge", "torus", "prism"}));
  EXPECT_EQ(table.answers, (std::vector<std::string>{"wedge", "torus", "prism", "ring"}));
  EXPECT_EQ(table.rows[0].shape, 1);
  EXPECT_EQ(table.rows[0].answer, 0);
  EXPECT_EQ(table.rows[1].answer, 3);
  EXPECT_EQ(table.rows[2].answer, -1);
}

// Ten are named, of more how many they are.
TEST_F(TrialsCsv, NamesTenRepeatedRowsAndCountsTheRest) {
  for (const int repeats : {1, 9, 10, 11, 13}) {
    std::string text = kHeader;
    for (int i = 1; i <= repeats; ++i) {
      for (const char* time : {"2.5", "3.5"})
        text += "P1,1,1," + std::to_string(i) + ",ray,cone,cone,1," + time + "\n";
    }
    const TrialTable table = read(text);
    ASSERT_EQ(table.warnings.size(), 1U);
    std::string expected = "(";
    for (int i = 0; i < std::min(repeats, 10); ++i)
      expected += (i == 0 ? "lines " : ", ") + std::to_string(2 * i + 2) + " and " +
                  std::to_string(2 * i + 3);
    if (repeats > 10) expected += ", and " + std::to_string(repeats - 10) + " more";
    EXPECT_NE(table.warnings[0].find(expected + ")"), std::string::npos) << table.warnings[0];
  }
}

TEST_F(TrialsCsv, TimeOutsNeedNoTime) {
  const std::string row = "P1,1,1,1,ray,cone,cone,1,2\n";
  for (const char* nothing : {"", "NA", "n/a", "nan"}) {
    const std::string late = std::string("P1,1,1,2,ray,cone,") + nothing + "," + nothing + ",";
    const TrialTable alone = read(kHeader + row + late + nothing + "\n");
    ASSERT_EQ(alone.rows.size(), 2U) << nothing;
    EXPECT_TRUE(alone.rows[1].timed_out);
    EXPECT_FALSE(alone.rows[1].correct);
    EXPECT_EQ(alone.rows[1].answer, -1);
    EXPECT_EQ(alone.rows[1].response_time, 2);
    ASSERT_EQ(alone.warnings.size(), 1U);
    EXPECT_NE(alone.warnings[0].find("lower bound"), std::string::npos);
    const TrialTable two = read(kHeader + row + late + nothing + "\nP1,1,1,3,ray,cone,,0,60\n");
    EXPECT_EQ(two.rows[1].response_time, 60);
  }
  const std::string header = kHeader.substr(0, kHeader.size() - 1) + ",timed_out\n";
  EXPECT_EQ(
      read(header + "P1,1,1,1,ray,cone,cone,1,2,0\nP1,1,1,2,ray,cone,NA,NA,NA,1\n").rows.size(),
      2U);
  expect_fault(header + "P1,1,1,1,ray,cone,cone,1,NA,0\n", "line 2, column response_time",
               "for a time-out alone");
  expect_fault(header + "P1,1,1,1,ray,cone,cone,NA,2,0\n", "line 2, column correct", "0 or 1");
  expect_fault(kHeader + "P1,1,1,1,ray,cone,,0,NA\n", "file", "the time of one trial");
}

TEST_F(TrialsCsv, ContradictionsAreWarnedOf) {
  EXPECT_EQ(read(kHeader + "P1,1,1,1,ray,cone,cube,1,2\n").warnings.size(), 1U);
  EXPECT_EQ(read(kHeader + "P1,1,1,1,ray,cone,,1,60\n").warnings.size(), 1U);
}

TEST_F(TrialsCsv, RowsFlowThroughTheBuffersBlocks) {
  std::string text = kHeader;
  constexpr int kRows = 30000;  // some three blocks
  for (int i = 1; i <= kRows; ++i) {
    const bool quoted = i % 7 == 0;
    text += quoted ? "\"P1\"" : "P1";
    text += ",1,1," + std::to_string(i) + ",ray,cone," + (quoted ? "\"cone\"" : "cone") + ",1," +
            std::to_string(i) + ".5\n";
  }
  const TrialTable table = read(text);
  ASSERT_EQ(table.rows.size(), static_cast<std::size_t>(kRows));
  for (int i = 0; i < kRows; ++i) {
    ASSERT_EQ(table.rows[static_cast<std::size_t>(i)].response_time, i + 1.5);
  }
}

TEST_F(TrialsCsv, BlocksMayEndAnywhereInQuotedRecords) {
  constexpr int kRows = 6000;  // some two blocks
  const std::string note = "\"a \"\"b\"\"\nc\"";
  for (std::size_t pad = 0; pad < 60; ++pad) {  // more than a record: every byte is last once
    std::string text = "note," + kHeader + std::string(pad, 'x') + ",P1,1,1,1,ray,cone,cone,1,2\n";
    for (int i = 2; i <= kRows; ++i) {
      text += note + ",P1,1,1," + std::to_string(i) + ",ray,\"cone\",cone,1,\"1." +
              std::to_string(i) + "\"\n";
    }
    const TrialTable table = read(text);
    ASSERT_EQ(table.rows.size(), static_cast<std::size_t>(kRows)) << pad;
    ASSERT_EQ(table.shapes.size(), 1U) << pad;
  }
}

}  // namespace
}  // namespace palpate::analysis
