// Curves and marks are distinguishable; tooltips name them.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/input/trials.h"
#include "analysis/report/plan_report.h"
#include "analysis/statistics/analysis.h"
#include "analysis/statistics/task_analysis.h"

namespace palpate::analysis {
namespace {
namespace curves {

Plan plan_of(std::size_t n_curves) {
  Plan plan;
  plan.model.shapes = {"cone"};
  plan.model.log_ratios = {-0.2};
  plan.settings.min_participants = 4;
  plan.settings.max_participants = 20;
  plan.settings.power = 0.8;
  plan.settings.simulation.studies = 100;
  for (std::size_t c = 0; c < n_curves; ++c) {
    const std::size_t trials = 10 * (c + 1);
    plan.settings.trials.push_back(trials);
    PlanCurve& curve = plan.curves.emplace_back();
    curve.trials = trials;
    for (const std::size_t participants : {4UL, 20UL})
      curve.points.push_back({{participants, trials}, {100, {10 * c + participants}, 0, 0}});
  }
  return plan;
}

TEST(PlanFigureCurves, HaveTheShapesAndColoursOfTheLegend) {
  for (std::size_t n = 1; n <= 6; ++n) {
    const Figure figure = plan_figure(plan_of(n));
    ASSERT_EQ(figure.legend.size(), n);
    std::set<MarkerShape> shapes;
    std::vector<const Mark*> symbols;
    for (const Mark& mark : figure.panels.at(0).marks) {
      if (mark.kind == Mark::Kind::symbol) symbols.push_back(&mark);
    }
    ASSERT_EQ(symbols.size(), 2 * n);
    for (std::size_t c = 0; c < n; ++c) {
      shapes.insert(figure.legend[c].shape);
      for (const Mark* const mark : {symbols[2 * c], symbols[2 * c + 1]}) {
        EXPECT_EQ(mark->shape, figure.legend[c].shape) << c;
        EXPECT_EQ(mark->role, figure.legend[c].role) << c;
      }
    }
    EXPECT_EQ(shapes.size(), n) << "colours alone are not seen by everybody";
  }
}

/// The highest end of the intervals of `n` participants, drawn on the axis of mean times and of a
/// task's means: above 1, it is beyond the axis.
double overrun_of_times(int n) {
  TrialTableBuilder builder;
  for (int p = 0; p < n; ++p) {
    const std::string person = "P" + std::to_string(p);
    StudyTrial raw;
    raw.participant = person;
    raw.renderer = "ray";
    raw.shape = raw.response = "cone";
    raw.correct = true;
    raw.trial = 1;
    raw.response_time = p == 0 ? 6 : 1;
    builder.add(raw);
  }
  const Analysis analysis = analyze(builder.finish({}), {}, "test");
  const TimesCell& cell = analysis.description.times[0][0];
  const double n_double = n, t = n == 2 ? 12.706 : 4.303;
  const double end =
      *cell.mean_of_participant_means + t * *cell.sd_of_participant_means / std::sqrt(n_double);
  return end / figure15_of(analysis).panels[0].y.high;
}

double overrun_of_tasks(std::size_t n) {
  StudyAnalysis analysis;
  TaskGroup& group = analysis.groups.emplace_back();
  group.task = "compare";
  group.measure = "jnd";
  GroupMean& ray = group.renderers.emplace_back();
  ray.renderer = "ray";
  for (std::size_t p = 0; p < n; ++p)
    ray.participants.push_back({"P" + std::to_string(p), p == 0 ? 10.0 : 12.0});
  ray.mean = 11;
  ray.ci95 = Interval{9, 25};
  const std::vector<Figure> figures = task_figures(analysis);
  const bool noted = figures.at(0).notes.back().find("arrow") != std::string::npos;
  EXPECT_EQ(noted, n < 3);
  return 25 / figures[0].panels.at(0).y.high;
}

TEST(AxesOfMeans, CutIntervalsOfTwoParticipantsOnly) {
  EXPECT_LE(overrun_of_times(3), 1);
  EXPECT_GT(overrun_of_times(2), 1);
  EXPECT_LE(overrun_of_tasks(3), 1);
  EXPECT_GT(overrun_of_tasks(2), 1);
}

Analysis analysis_of(const std::vector<std::string>& renderers) {
  TrialTableBuilder builder;
  for (std::size_t p = 0; p < 4; ++p) {
    const std::string name = "P" + std::to_string(p);
    int number = 0;
    for (std::size_t r = 0; r < renderers.size(); ++r) {
      for (const std::string shape : {"cone", "cube"}) {
        StudyTrial raw;
        raw.participant = name;
        raw.renderer = renderers[r];
        raw.shape = raw.response = shape;
        raw.correct = true;
        raw.trial = ++number;
        raw.response_time = 2 + 0.3 * static_cast<double>((p * 7 + r * 5 + shape.size()) % 11);
        builder.add(raw);
      }
    }
  }
  return analyze(builder.finish({}), {}, "test");
}

TEST(SpeedupFigure, MarksSayTheirComparisonShapeAndReduction) {
  for (const std::vector<std::string>& renderers :
       {std::vector<std::string>{"point", "ray"}, {"point", "ray", "third"}}) {
    const Analysis analysis = analysis_of(renderers);
    const auto figures = figures_of(analysis, {});
    const auto speedup = std::ranges::find(figures, "speedup", &Figure::id);
    ASSERT_NE(speedup, figures.end());
    ASSERT_EQ(speedup->panels.size(), renderers.size() - 1);
    for (const Panel& panel : speedup->panels) {
      EXPECT_EQ(panel.title.empty(), renderers.size() == 2);
      const std::string before = panel.title.empty() ? "" : panel.title + ", ";
      int symbols = 0;
      for (const Mark& mark : panel.marks) {
        if (mark.kind != Mark::Kind::symbol || mark.shape != MarkerShape::circle) continue;
        const std::string shape = symbols++ == 0 ? "cone" : "cube";
        EXPECT_EQ(mark.text.rfind(before + shape + ": ", 0), 0U) << mark.text;
        EXPECT_NE(mark.text.find(" %, 95 % interval "), std::string::npos) << mark.text;
        EXPECT_NE(speedup->description.find(mark.text), std::string::npos) << mark.text;
      }
      EXPECT_EQ(symbols, 2);
    }
  }
}

}  // namespace curves
}  // namespace
}  // namespace palpate::analysis
