// A BIDS dataset by the program's functions; by its validators: tests/data/export/datasets.

#include <gtest/gtest.h>

#include <string>

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

TEST(Bids, ListsTheMotionOfASessionOfTwoProtocolsInOneTable) {
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
