// Columns of a sweep over tasks, and differences of two plans.

#include "data/sweep_record.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace palpate::data {
namespace {
namespace sweep_records {

using Names = std::vector<std::string>;

SweepPlan plan_of(const std::string& blocks) {
  SweepPlan plan;
  plan.protocol = R"({"version": 2, "renderers": ["point", "ray"], "blocks": [)" + blocks + "]}";
  plan.parameters = {"delay"};
  return plan;
}

SweepPlan plan_of_shapes() {
  SweepPlan plan;
  plan.protocol = R"({"version": 1})";
  plan.shapes = {"ball"};
  plan.renderers = {"point", "ray"};
  return plan;
}

/// Each with its standard error.
Names with_errors(const Names& measures, const std::string& place) {
  Names out;
  for (const std::string& measure : measures) {
    out.push_back(measure + place);
    out.push_back(measure + "_se" + place);
  }
  return out;
}

TEST(SweepColumns, TaskColumnsAreMeasureBlockStimulusRenderer) {
  const struct {
    const char* task;
    Names measures;
  } tasks[] = {{"compare", {"threshold", "jnd"}},
               {"detect", {"threshold", "d_prime"}},
               {"rate", {"exponent"}},
               {"adjust", {"pse", "jnd"}}};
  for (const auto& [task, measures] : tasks) {
    const SweepPlan plan =
        plan_of(R"({"name": "first", "task": ")" + std::string(task) +
                R"(", "stimuli": ["ball", "hat"]}, {"name": "tried", "practice": true, "task": ")" +
                task + R"(", "stimuli": ["ball"]}, {"name": "last", "task": ")" + task +
                R"(", "stimuli": ["hat"], "renderers": ["ray"]})");
    Names wanted;
    for (const char* const place : {"_first_ball_point", "_first_hat_point", "_first_ball_ray",
                                    "_first_hat_ray", "_last_hat_ray"}) {
      const Names one = with_errors(measures, place);
      wanted.insert(wanted.end(), one.begin(), one.end());
    }
    EXPECT_EQ(figure_columns(plan), wanted) << task;
    wanted.insert(wanted.begin(), {"point", "status", "reason", "delay"});
    EXPECT_EQ(sweep_columns(plan), wanted) << task;
  }
}

TEST(SweepColumns, IdentificationHasInformationOverAllStimuli) {
  const SweepPlan plan = plan_of(
      R"({"name": "who", "task": "identify", "stimuli": ["ball", "hat"], "renderers": ["ray"]})");
  EXPECT_EQ(figure_columns(plan),
            (Names{"accuracy_who_ball_ray", "accuracy_se_who_ball_ray", "time_who_ball_ray",
                   "time_se_who_ball_ray", "accuracy_who_hat_ray", "accuracy_se_who_hat_ray",
                   "time_who_hat_ray", "time_se_who_hat_ray", "bits_who_ray", "bits_se_who_ray"}));
  const auto cells = task_columns(plan);
  ASSERT_EQ(cells.size(), 3U);
  EXPECT_EQ(
      cells[1].task + "," + cells[1].block + "," + cells[1].stimulus + "," + cells[1].renderer,
      "identify,who,hat,ray");
  EXPECT_EQ(cells[2].stimulus, "");
}

TEST(SweepColumns, CellsOfFactorsAreApart) {
  SweepPlan plan = plan_of("");
  const auto columns_with = [&](const std::string& crossing) {
    plan.protocol = R"({"version": 2, "renderers": ["ray"], "factors": [
      {"name": "surface", "levels": [{"name": "smooth", "set": {}}, {"name": "rough", "set": {}}]},
      {"name": "size", "levels": [{"name": "s", "set": {}}, {"name": "l", "set": {}}]}],
      "blocks": [{"name": "b", "task": "rate", "stimuli": ["ball"], )" +
                    crossing + "}]}";
    return figure_columns(plan);
  };
  EXPECT_EQ(columns_with(R"("factors": ["size", "surface"])"),
            (Names{"exponent_b_ball_smooth_s_ray", "exponent_se_b_ball_smooth_s_ray",
                   "exponent_b_ball_smooth_l_ray", "exponent_se_b_ball_smooth_l_ray",
                   "exponent_b_ball_rough_s_ray", "exponent_se_b_ball_rough_s_ray",
                   "exponent_b_ball_rough_l_ray", "exponent_se_b_ball_rough_l_ray"}));
  EXPECT_EQ(task_columns(plan).front().stimulus, "ball[surface=smooth,size=s]");
  EXPECT_EQ(columns_with(R"("factors": {"surface": ["rough"]})"),
            (Names{"exponent_b_ball_rough_ray", "exponent_se_b_ball_rough_ray"}));
  EXPECT_EQ(columns_with(R"("factors": ["size", "surface"], "shared": true)"),
            (Names{"exponent_b_ball_ray", "exponent_se_b_ball_ray"}));
}

TEST(SweepColumns, GroupsFollowWhereTheirSettingsVary) {
  SweepPlan plan = plan_of("");
  plan.protocol = R"({"version": 2, "renderers": ["ray"], "groups": {"names": ["young", "old"]},
      "blocks": [{"name": "b", "task": "rate", "stimuli": ["ball"]}]})";
  plan.space = R"({"parameters": [{"name": "delay", "of": "participant"}]})";
  EXPECT_EQ(figure_columns(plan), (Names{"exponent_b_ball_ray", "exponent_se_b_ball_ray"}));
  plan.space = R"({"parameters": [{"name": "delay", "of": "group:old"}]})";
  EXPECT_EQ(figure_columns(plan),
            (Names{"exponent_b_ball_ray", "exponent_se_b_ball_ray", "exponent_b_ball_ray_young",
                   "exponent_se_b_ball_ray_young", "exponent_b_ball_ray_old",
                   "exponent_se_b_ball_ray_old"}));
}

TEST(SweepColumns, Version1HasTimesByShapeAndRenderer) {
  const SweepPlan plan = plan_of_shapes();
  EXPECT_TRUE(task_columns(plan).empty());
  EXPECT_EQ(figure_columns(plan),
            (Names{"gain_ball", "gain_se_ball", "time_point_ball", "time_ray_ball",
                   "accuracy_point_ball", "accuracy_ray_ball", "time_outs_point_ball",
                   "time_outs_ray_ball", "contact_share_point_ball", "contact_share_ray_ball"}));
}

TEST(SweepPlans, NameAtMostFiveDifferences) {
  SweepPlan one = plan_of(""), two = one;
  EXPECT_EQ(differences(one, two), Names{});
  two.protocol = "\n" + two.protocol;
  EXPECT_EQ(differences(one, two), Names{"protocol: their layout alone"});
  two.protocol = "{";
  EXPECT_EQ(differences(one, two), Names{"protocol: texts that cannot be compared"});
  two = one;
  one.space = R"({"a": 1, "b": 1, "c": 1, "d": 1, "e": 1})";
  two.space = R"({"a": 2, "b": 2, "c": 2, "d": 2, "e": 2})";
  EXPECT_EQ(differences(one, two),
            Names{"space: /a 1 and 2; /b 1 and 2; /c 1 and 2; /d 1 and 2; /e 1 and 2"});
  one.space = R"({"a": 1, "b": 1, "c": 1, "d": 1, "e": 1, "f": 1, "g": 1})";
  two.space = R"({"a": 2, "b": 2, "c": 2, "d": 2, "e": 2, "f": 2, "g": 2})";
  EXPECT_EQ(differences(one, two), Names{"space: /a 1 and 2; /b 1 and 2; /c 1 and 2; /d 1 and 2; "
                                         "/e 1 and 2; and 2 more"});
  one = two = plan_of_shapes();
  two.files_sha256 = "x";
  two.points = 7;
  two.renderers = {"ray"};
  EXPECT_EQ(differences(one, two),
            (Names{"contents of the files that the protocol names", "points: 0 and 7",
                   R"(renderers: ["point","ray"] and ["ray"])"}));
  one = two = plan_of("");
  two.design = std::string(50, 'x');  // of which 40 characters are shown, with the quote
  EXPECT_EQ(differences(one, two), Names{"design: \"\" and \"" + std::string(39, 'x') + "..."});
}

}  // namespace sweep_records
}  // namespace
}  // namespace palpate::data
