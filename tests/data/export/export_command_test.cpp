#include <gtest/gtest.h>

#include <algorithm>

#include "data/store/store.h"
#include "runner/commands/shared/command.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;

class ExportCommand : public ::testing::Test {
 protected:
  ExportCommand() {
    Store store = Store::open(database_, Store::Mode::write_or_create);
    const palpate::data::Run run =
        store.begin_run(store.enrol(a_protocol(), "S1", {}, true, 1), a_run());
    store.record_simulated(run, {a_record(1), a_record(2)});
  }
  std::string usage_error(const std::vector<std::string>& words) {
    try {
      runner::commands::export_command(words);
    } catch (const runner::UsageError& error) {
      return error.what();
    }
    ADD_FAILURE() << "no UsageError";
    return "";
  }
  const TemporaryFolder folder_;
  const std::string database_ = folder_ / "study.db";
  const std::string out_ = folder_ / "trials.csv";
};

TEST_F(ExportCommand, WritesTheCsv) {
  EXPECT_EQ(runner::commands::export_command({"--db", database_, "--format", "csv", "--out", out_}),
            0);
  const std::string text = contents_of(out_);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 3);
}

TEST_F(ExportCommand, OverwritesOnlyWithForce) {
  write_file(out_, "mine");
  EXPECT_TRUE(
      contains(usage_error({"--db", database_, "--format", "csv", "--out", out_}), "--force"));
  EXPECT_EQ(contents_of(out_), "mine");
  EXPECT_EQ(runner::commands::export_command(
                {"--db", database_, "--format", "csv", "--out", out_, "--force"}),
            0);
  EXPECT_TRUE(contains(contents_of(out_), "S1,1,1,2,ray"));
}

TEST_F(ExportCommand, WrongUsageAndWrongFilesAreBadInput) {
  EXPECT_TRUE(contains(usage_error({"--db", database_, "--format", "xls", "--out", out_}),
                       "no format 'xls'; there are: csv, bids, psych-ds"));
  EXPECT_TRUE(contains(usage_error({"--db", database_, "--out", out_}), "format"));
  EXPECT_TRUE(contains(usage_error({"--db", folder_ / "none.db", "--format", "csv", "--out", out_}),
                       "no such file"));
  write_file(folder_ / "text.db", "text");
  EXPECT_TRUE(contains(usage_error({"--db", folder_ / "text.db", "--format", "csv", "--out", out_}),
                       "not a palpate database"));
  EXPECT_FALSE(std::filesystem::exists(out_));
}

}  // namespace
}  // namespace palpate::data
