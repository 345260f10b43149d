// Trials read from a database equal those read from its export.

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "data/files/checksum.h"
#include "data/store/store.h"
#include "protocols/parse.h"

namespace palpate::analysis {
namespace {

class TrialsStore : public ::testing::Test {
 protected:
  TrialsStore() {
    std::string pattern = ::testing::TempDir() + "palpate_XXXXXX";
    folder_ = ::mkdtemp(pattern.data());
    path_ = folder_ + "/study.db";
  }
  ~TrialsStore() override { std::filesystem::remove_all(folder_); }

  static data::TrialRecord trial(int number, const std::string& renderer, const std::string& shape,
                                 const std::string& response) {
    data::TrialRecord record;
    record.trial = number;
    record.renderer = renderer;
    record.shape = shape;
    record.response = response;
    record.correct = shape == response;
    record.timed_out = response.empty();
    record.response_time = response.empty() ? 60 : 1.5 * number;
    record.onset_ns = number * 100'000'000'000LL;
    record.response_ns = record.onset_ns + static_cast<std::int64_t>(record.response_time * 1e9);
    return record;
  }
  void study(const std::vector<data::TrialRecord>& records) {
    data::Store store = data::Store::open(path_, data::Store::Mode::write_or_create);
    // Stimuli are in the order of the protocol, not of their first appearance.
    const std::string text =
        R"({"stimuli": [{"name": "wedge"}, {"name": "cube"}, {"name": "torus"}]})";
    const data::ProtocolInfo protocol{"test", text, data::checksum_hex(text)};
    const data::Participant participant = store.enrol(protocol, "S1", 1, true, 7);
    data::RunInfo info;
    info.program_version = "9.9.9";
    info.build = "test";
    info.device = "simulated";
    info.response_device = "simulated";
    info.observer_sha256 = std::string(64, 'b');
    const palpate::data::Run run = store.begin_run(participant, info);
    store.record_simulated(run, records);
    store.end_run(run, data::RunEnd::done, 1'000'000'000'000LL);
  }

  std::string folder_, path_;
};

TEST_F(TrialsStore, ReadsCompletedTrials) {
  auto practice = trial(1, "ray", "cube", "cube");
  practice.practice = true;
  study({practice, trial(2, "ray", "torus", "torus"), trial(3, "point", "wedge", ""),
         trial(4, "point", "cube", "wedge")});
  const TrialTable table = read_trials_store(path_);
  EXPECT_EQ(table.participants, (std::vector<std::string>{"S1"}));
  EXPECT_EQ(table.renderers, (std::vector<std::string>{"point", "ray"}));
  EXPECT_EQ(table.shapes, (std::vector<std::string>{"cube", "wedge", "torus"}));
  EXPECT_EQ(table.n_practice, 1U);
  EXPECT_EQ(table.simulated, Simulated::yes);
  ASSERT_EQ(table.rows.size(), 3U);
  EXPECT_EQ(table.rows[0].shape, 2);
  EXPECT_EQ(table.rows[0].renderer, 1);
  EXPECT_TRUE(table.rows[0].correct);
  EXPECT_EQ(table.rows[0].response_time, 3.0);
  EXPECT_TRUE(table.rows[1].timed_out);
  EXPECT_EQ(table.rows[1].answer, -1);
  EXPECT_EQ(table.rows[2].answer, 1);
  EXPECT_EQ(table.provenance.protocol_name, "test");
  EXPECT_EQ(table.provenance.protocol_sha256,
            (std::vector<std::string>{data::checksum_hex(
                R"({"stimuli": [{"name": "wedge"}, {"name": "cube"}, {"name": "torus"}]})")}));
  EXPECT_EQ(table.provenance.observer_sha256, std::string(64, 'b'));
  EXPECT_EQ(table.provenance.program_versions, (std::vector<std::string>{"9.9.9"}));
}

TEST_F(TrialsStore, PracticeAloneIsNothingToAnalyse) {
  auto practice = trial(1, "ray", "cube", "cube");
  practice.practice = true;
  study({practice});
  EXPECT_THROW(read_trials_store(path_), protocols::InputError);
  EXPECT_THROW(read_trials_store(folder_ + "/none.db"), data::StoreRefused);
}

}  // namespace
}  // namespace palpate::analysis
