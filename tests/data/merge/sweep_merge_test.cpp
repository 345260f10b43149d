#include <functional>
#include <utility>

#include "data/merge/merge.h"
#include "tests/data/store/sweep_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;
namespace fs = std::filesystem;

class SweepMerges : public ::testing::Test {
 protected:
  std::string made(const std::string& name, const std::vector<std::int64_t>& points) {
    make_sweep(folder_ / name, points);
    return folder_ / name;
  }
  void expect_refused(const std::vector<std::string>& inputs, const std::string& said) {
    try {
      merge_sweeps(out_, inputs);
      ADD_FAILURE() << "is not refused: " << said;
    } catch (const StoreRefused& error) {
      EXPECT_NE(std::string(error.what()).find(said), std::string::npos) << error.what();
    }
    EXPECT_FALSE(fs::exists(out_));
  }
  TemporaryFolder folder_;
  const std::string out_ = folder_ / "out.sweep";
};

TEST_F(SweepMerges, AnyOrderGivesTheBytesOfOneProcess) {
  make_sweep(folder_ / "one.sweep", {1, 2, 3, 5, 8, 9}, true);
  const std::vector<std::string> parts{made("a.sweep", {9, 2}), made("b.sweep", {5, 1, 2}),
                                       made("c.sweep", {3, 8})};
  std::vector<std::vector<std::string>> orders{{parts[0], parts[1], parts[2]},
                                               {parts[2], parts[1], parts[0], parts[1]},
                                               {parts[1], parts[0], parts[2]}};
  for (const auto& order : orders) {
    std::vector<std::int64_t> progress;
    const SweepMergeResult result =
        merge_sweeps(out_, order, [&](std::int64_t file) { progress.push_back(file); });
    EXPECT_EQ(result.points, 6);
    EXPECT_EQ(result.failed, 0);
    EXPECT_TRUE(differences(result.plan, a_sweep_plan()).empty());
    EXPECT_EQ(contents_of(out_), contents_of(folder_ / "one.sweep"));
    EXPECT_EQ(progress, (std::vector<std::int64_t>{1, 2, 3}));
    fs::remove(out_);
  }
}

TEST_F(SweepMerges, FailedPointsAreCounted) {
  SweepFile::open(folder_ / "a.sweep", a_sweep_plan()).record({a_failed_row(4), a_sweep_row(6)});
  const SweepMergeResult result = merge_sweeps(out_, {folder_ / "a.sweep"});
  EXPECT_EQ(result.points, 2);
  EXPECT_EQ(result.failed, 1);
  SweepFile file = SweepFile::open(out_);
  EXPECT_TRUE(same(rows_of(file)[0], a_failed_row(4)));
}

TEST_F(SweepMerges, APointWithTwoResultsIsRefused) {
  const std::string a = made("a.sweep", {1, 2, 3});
  // The last digit of one figure.
  SweepFile::open(folder_ / "b.sweep", a_sweep_plan()).record({a_sweep_row(2, 1e-15)});
  expect_refused({a, folder_ / "b.sweep"}, "point 2 has other results");
}

TEST_F(SweepMerges, AnotherPlanIsRefusedWithItsDifferences) {
  const std::string a = made("a.sweep", {1});
  SweepPlan other = a_sweep_plan();
  other.seed = 7;
  make_sweep(folder_ / "b.sweep", {2}, false, other);
  expect_refused({a, folder_ / "b.sweep"}, "seed: 18446744073709551615 and 7");
}

TEST(SweepPlans, EveryDifferenceIsNamedAndNoOther) {
  const SweepPlan plan = a_sweep_plan();
  EXPECT_TRUE(differences(plan, plan).empty());
  // A change of a field, and the expected start of its sentence.
  const std::vector<std::pair<std::string, std::function<void(SweepPlan&)>>> changes{
      {"protocol", [](SweepPlan& p) { p.protocol = R"({"name": "other"})"; }},
      {"contents of the files", [](SweepPlan& p) { p.files_sha256 = std::string(64, 'a'); }},
      {"settings of the participant", [](SweepPlan& p) { p.settings = R"({"motor": {}})"; }},
      {"space", [](SweepPlan& p) { p.space = R"({"version": 1})"; }},
      {"design: \"lhs\" and \"grid\"", [](SweepPlan& p) { p.design = "grid"; }},
      {"points: 20 and 21", [](SweepPlan& p) { p.points = 21; }},
      {"seed", [](SweepPlan& p) { p.seed = 2; }},
      {"participants: 3 and 4", [](SweepPlan& p) { p.participants = 4; }},
      {"program version", [](SweepPlan& p) { p.program_version = "1.2.4"; }},
      {"parameters", [](SweepPlan& p) { p.parameters.pop_back(); }},
      {"shapes", [](SweepPlan& p) { p.shapes.front() = "cap"; }},
      {"renderers", [](SweepPlan& p) { std::swap(p.renderers[0], p.renderers[1]); }}};
  for (const auto& [begin, change] : changes) {
    SweepPlan other = plan;
    change(other);
    const std::vector<std::string> said = differences(plan, other);
    ASSERT_EQ(said.size(), 1U) << begin;
    EXPECT_TRUE(said[0].starts_with(begin)) << said[0];
  }
}

TEST_F(SweepMerges, RefusesBusyMissingOrExistingFiles) {
  const std::string a = made("a.sweep", {1});
  expect_refused({}, "no file to merge");
  expect_refused({a, folder_ / "none.sweep"}, "no such file");
  {
    const SweepFile writer = SweepFile::open(folder_ / "b.sweep", a_sweep_plan());
    expect_refused({a, folder_ / "b.sweep"}, "process");
  }
  const std::string before = contents_of(a);
  EXPECT_THROW(merge_sweeps(a, {a}), StoreRefused);
  EXPECT_EQ(contents_of(a), before);
}

}  // namespace
}  // namespace palpate::data
