#include "data/export/csv.h"
#include "tests/data/store/sweep_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;

class SweepCsv : public ::testing::Test {
 protected:
  SweepFile of(const std::vector<SweepRow>& rows) {
    SweepFile::open(folder_ / "a.sweep", a_sweep_plan(5000)).record(rows);
    return SweepFile::open(folder_ / "a.sweep");
  }
  TemporaryFolder folder_;
  const std::string out_ = folder_ / "a.csv";
};

TEST_F(SweepCsv, HasOrderedColumnsAndARowPerPoint) {
  SweepRow row = a_sweep_row(4);
  row.values = {0.1, std::string("=1+1")};
  row.figures.assign(row.figures.size(), std::nullopt);
  row.figures.front() = -1.0 / 3;
  row.figures.back() = 1e-7;
  SweepFile file = of({row, a_failed_row(2)});
  EXPECT_EQ(export_sweep_csv(file, out_, false), 2);
  std::string header =
      "point,status,reason,delay,order,gain_ball,gain_hat,gain_se_ball,gain_se_hat";
  for (const char* const what : {"time", "accuracy", "time_outs", "contact_share"}) {
    for (const char* const cell : {"point_ball", "point_hat", "ray_ball", "ray_hat"})
      header += std::string(",") + what + "_" + cell;
  }
  EXPECT_EQ(contents_of(out_),
            header + "\r\n" + "2,failed,\"grip, of \"\"point\"\" 2\",0.6666666666666666,word 0" +
                std::string(20, ',') + "\r\n" + "4,ok,,0.1,'=1+1,-0.3333333333333333" +
                std::string(19, ',') + "1e-07\r\n");
}

TEST_F(SweepCsv, HasEveryPointOfALargeSweep) {
  std::vector<SweepRow> rows;
  for (std::int64_t point = 1; point <= 2001; ++point) rows.push_back(a_sweep_row(2 * point));
  SweepFile file = of(rows);
  std::vector<std::int64_t> progress;
  EXPECT_EQ(export_sweep_csv(file, out_, false, [&](std::int64_t n) { progress.push_back(n); }),
            2001);
  EXPECT_EQ(progress, (std::vector<std::int64_t>{1000, 2000}));
  const std::string text = contents_of(out_);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 2002);
  EXPECT_NE(text.find("\n4002,ok,"), std::string::npos);
}

TEST_F(SweepCsv, OverwritesOnlyWithForce) {
  SweepFile file = of({a_sweep_row(1)});
  export_sweep_csv(file, out_, false);
  const std::string before = contents_of(out_);
  std::ofstream(out_) << "mine";
  EXPECT_THROW(export_sweep_csv(file, out_, false), StoreRefused);
  EXPECT_EQ(contents_of(out_), "mine");
  EXPECT_THROW(export_sweep_csv(file, folder_ / "a.sweep", true), StoreRefused);
  export_sweep_csv(file, out_, true);
  EXPECT_EQ(contents_of(out_), before);
}

TEST_F(SweepCsv, LeavesNoFileWhenStopped) {
  std::vector<SweepRow> rows;
  for (std::int64_t point = 1; point <= 1000; ++point) rows.push_back(a_sweep_row(point));
  SweepFile file = of(rows);
  EXPECT_THROW(
      export_sweep_csv(file, out_, false, [](std::int64_t) { throw std::runtime_error("stop"); }),
      std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(out_));
}

}  // namespace
}  // namespace palpate::data
