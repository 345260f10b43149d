// A BIDS dataset by the program's functions; by its validators: tests/data/export/datasets.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "data/export/datasets.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;

constexpr unsigned kTicks = 7;

void record_a_trial(Store& store, char protocol, const std::string& code, bool simulated) {
  const Participant person = simulated ? store.enrol(a_protocol(protocol), code, {}, true, 1)
                                       : store.enrol(a_protocol(protocol), code);
  const palpate::data::Run run = store.begin_run(person, a_run());
  TrialRecord record = a_record(1);
  record.samples.resize(kTicks);
  for (unsigned i = 0; i < kTicks; ++i) record.samples[i].tick = i;
  record.attempt = store.begin_attempt(run, record, 1);
  store.finish_attempt(run, record);
  store.end_run(run, RunEnd::done, 1);
}

TEST(Bids, TellsPeopleFromSimulatedParticipantsAndFromBoth) {
  const TemporaryFolder folder;
  Store store = Store::open(folder / "s.db", Store::Mode::write_or_create);
  record_a_trial(store, 'a', "P1", false);
  record_a_trial(store, 'a', "P2", true);
  record_a_trial(store, 'b', "P2", false);
  record_a_trial(store, 'a', "P3", true);
  record_a_trial(store, 'b', "P3", true);
  const ExportResult result = export_bids(store, folder / "bids", {});
  EXPECT_EQ(contents_of(folder / "bids/participants.tsv"),
            "participant_id\tsimulated\nsub-P1\t0\nsub-P2\tmixed\nsub-P3\t1\n");
  EXPECT_EQ(result.trials, 5);
  EXPECT_EQ(result.samples, 5 * kTicks);
  EXPECT_EQ(result.attempts, 0);
  EXPECT_TRUE(result.simulated);
}

TEST(Bids, KeepsTheOrderOfASetClock) {
  const TemporaryFolder folder;
  Store store = Store::open(folder / "s.db", Store::Mode::write_or_create);
  const Participant person = store.enrol(a_protocol(), "P1");
  constexpr std::int64_t kHour_ns = 3'600'000'000'000;
  for (const int sitting : {0, 1}) {
    RunInfo info = a_run();
    info.clock.utc_ns -= sitting * kHour_ns;
    const palpate::data::Run run = store.begin_run(person, info);
    for (const int of_sitting : {1, 2}) {
      TrialRecord record = a_record(2 * sitting + of_sitting);
      record.onset_ns = info.clock.monotonic_ns + of_sitting * 10'000'000'000;
      record.response_ns = record.onset_ns + 1'000'000'000;
      record.attempt = store.begin_attempt(run, record, record.onset_ns - 1);
      store.finish_attempt(run, record);
    }
    store.end_run(run, sitting == 0 ? RunEnd::paused : RunEnd::done, info.clock.monotonic_ns);
  }
  export_bids(store, folder / "bids", {});
  const std::string stem = folder / "bids/sub-P1/ses-1/beh/sub-P1_ses-1_task-ho2000_beh";
  std::istringstream table(contents_of(stem + ".tsv"));
  std::vector<std::string> onsets;
  std::string line;
  std::getline(table, line);
  while (std::getline(table, line)) onsets.push_back(line.substr(0, line.find('\t')));
  EXPECT_EQ(onsets, (std::vector<std::string>{"0", "10", "-3600", "-3590"}));
  const auto about = nlohmann::json::parse(contents_of(stem + ".json"));
  EXPECT_EQ(about["ClockSetBack"],
            nlohmann::json::parse(R"([{"BeforeTrial": 3, "Seconds": -3610.0}])"));
}

TEST(Bids, ItsReadmeShowsTextsLiterally) {
  const TemporaryFolder folder;
  Store store = Store::open(folder / "s.db", Store::Mode::write_or_create);
  record_a_trial(store, 'a', "P1", false);
  ExportSettings settings;
  settings.about.authors = {{.name = "<script>alert(1)</script>"}};
  settings.about.acknowledgements = "[x](javascript:alert(1)) \u202Egnp.exe\n# heading";
  export_bids(store, folder / "bids", settings);
  export_psychds(store, folder / "psychds", settings);
  for (const char* name : {"bids/README", "psychds/README.md"}) {
    const std::string text = contents_of(folder / name);
    EXPECT_TRUE(contains(text, "\\<script\\>alert(1)\\</script\\>")) << text;
    EXPECT_TRUE(contains(text, "\\[x\\](javascript")) << text;
    EXPECT_FALSE(contains(text, "\u202E")) << text;
    EXPECT_FALSE(contains(text, "\n# heading")) << text;
  }
}

TEST(Bids, ListsMotionOfTwoProtocolsInOneTable) {
  const TemporaryFolder folder;
  Store store = Store::open(folder / "s.db", Store::Mode::write_or_create);
  for (const char protocol : {'a', 'b'}) {
    for (const char* code : {"P1", "P2"}) record_a_trial(store, protocol, code, false);
  }
  export_bids(store, folder / "bids", {.motion = true});
  for (const char* code : {"P1", "P2"}) {
    const std::string session = std::string("sub-") + code + "_ses-1";
    const std::string table = contents_of(
        folder / ("bids/sub-" + std::string(code) + "/ses-1/" + session + "_scans.tsv"));
    std::size_t recordings = 0;
    for (std::size_t at = 0; (at = table.find("\nmotion/" + session, at)) != std::string::npos;
         ++at)
      ++recordings;
    EXPECT_EQ(recordings, 2U) << table;
  }
}

}  // namespace
}  // namespace palpate::data
