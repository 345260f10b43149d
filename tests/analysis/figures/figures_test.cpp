// Figures as data: the histogram of servo periods, styles of renderers, and what is left out.

#include "analysis/figures/figures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "analysis/figures/svg.h"
#include "analysis/input/trials.h"
#include "analysis/statistics/analysis.h"

namespace palpate::analysis {
namespace {
namespace figures {

/// Two participants with a trial of each renderer and shape; times differ.
Analysis analysis_of(const std::vector<std::string>& renderers, std::size_t shapes,
                     bool simulated = false, std::size_t participants = 2) {
  TrialTableBuilder builder;
  for (std::size_t p = 0; p < participants; ++p) {
    int trial = 0;
    const std::string name = "P" + std::to_string(p);
    for (std::size_t r = 0; r < renderers.size(); ++r) {
      for (std::size_t s = 0; s < shapes; ++s) {
        const std::string shape = "shape" + std::to_string(s);
        StudyTrial raw;
        raw.participant = name;
        raw.renderer = renderers[r];
        raw.shape = raw.response = shape;
        raw.correct = true;
        raw.simulated = simulated;
        raw.trial = ++trial;
        raw.response_time = 2 + 0.3 * static_cast<double>((p * 7 + r * 5 + s * 3 + p * r) % 11);
        builder.add(raw);
      }
    }
  }
  return analyze(builder.finish({}), {}, "test");
}

const Figure* find(const std::vector<Figure>& figures, const std::string& id) {
  const auto found = std::ranges::find(figures, id, &Figure::id);
  return found == figures.end() ? nullptr : &*found;
}

std::string notes_of(const Figure& figure) {
  std::string all;
  for (const std::string& note : figure.notes) all += note + "\n";
  return all;
}

StudyRecord record_of(const std::vector<std::pair<std::size_t, std::size_t>>& trials_in_bins) {
  StudyRecord record;
  for (const char* renderer : {"point", "ray"}) {
    ServoQuality& servo = record.servo.emplace_back();
    servo.renderer = renderer;
    servo.longest_period = 0.00125;
    servo.ticks = 5000;
    servo.missed_ticks = 3;
    for (const auto& [bin, n] : trials_in_bins) {
      servo.n_trials += n;
      servo.longest_periods[bin] += n;
    }
  }
  return record;
}

TEST(ServoFigure, DrawsThePercentOfTrialsInEachBin) {
  const Analysis analysis = analysis_of({"point", "ray"}, 2);
  const auto all = figures_of(analysis, record_of({{20, 3}, {23, 1}}));
  const Figure* servo = find(all, "servo");
  ASSERT_NE(servo, nullptr);
  ASSERT_EQ(servo->panels.size(), 2U);
  EXPECT_EQ(servo->panels[0].title, "point");
  EXPECT_EQ(servo->panels[1].title, "ray");
  for (const Panel& panel : servo->panels) {
    // log10 of ms: bin b begins at 0.1 ms times 10^(b/20).
    EXPECT_LE(panel.x.low, std::log10(0.51));
    EXPECT_GE(panel.x.high, std::log10(5.0)) << "small differences are not magnified";
    EXPECT_GE(panel.y.high, 75);
    EXPECT_EQ(panel.y.low, 0);
    ASSERT_EQ(panel.marks.size(), 2U);
    const std::array<std::array<double, 3>, 2> bars{{{0, 0.05, 75}, {0.15, 0.2, 25}}};
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(panel.marks[i].kind, Mark::Kind::rect);
      EXPECT_NEAR(panel.marks[i].x[0], bars[i][0], 1e-12);
      EXPECT_NEAR(panel.marks[i].x[1], bars[i][1], 1e-12);
      EXPECT_EQ(panel.marks[i].y, (std::vector<double>{0, bars[i][2]}));
    }
    EXPECT_EQ(panel.marks[0].text, "1.00 to 1.12 ms: 3 trials (75.0 %)");
  }
  EXPECT_NE(servo->panels[0].marks[0].role, servo->panels[1].marks[0].role);
  EXPECT_EQ(servo->description,
            "point: 3 of 5000 ticks missed, longest period 1.250 ms. "
            "ray: 3 of 5000 ticks missed, longest period 1.250 ms. ");
  EXPECT_EQ(notes_of(*servo).find("virtual clock"), std::string::npos);
}

TEST(ServoFigure, ReachesAsFarAsTheTrials) {
  const auto all = figures_of(analysis_of({"point", "ray"}, 2), record_of({{5, 1}, {60, 1}}));
  const Panel& panel = find(all, "servo")->panels[0];
  EXPECT_NEAR(panel.x.low, std::log10(0.1) + 5 / 20.0, 1e-12);
  EXPECT_NEAR(panel.x.high, std::log10(0.1) + 61 / 20.0, 1e-12);
}

TEST(ServoFigure, IsASentenceWithNothingToDraw) {
  const Analysis human = analysis_of({"point", "ray"}, 2),
                 simulated = analysis_of({"point", "ray"}, 2, true);
  EXPECT_EQ(find(figures_of(human, {}), "servo"), nullptr);
  EXPECT_NE(servo_sentence(human, {}).find("database"), std::string::npos);
  const StudyRecord same = record_of({{20, 4}});
  EXPECT_EQ(find(figures_of(human, same), "servo"), nullptr);
  EXPECT_NE(servo_sentence(human, same).find("up to 1.250 ms"), std::string::npos);
  EXPECT_EQ(servo_sentence(human, same).find("virtual clock"), std::string::npos);
  EXPECT_NE(servo_sentence(simulated, same).find("virtual clock"), std::string::npos);
  const auto drawn = figures_of(simulated, record_of({{20, 3}, {23, 1}}));
  EXPECT_NE(notes_of(*find(drawn, "servo")).find("virtual clock"), std::string::npos);
}

TEST(Styles, TellAllRenderersApart) {
  const std::vector<std::vector<std::string>> studies{
      {"point", "ray", "a", "b", "c", "d"}, {"a", "b", "c", "d", "e", "f"}, {"ray", "a", "b"}};
  for (const auto& renderers : studies) {
    const Figure figure = figure15_of(analysis_of(renderers, 1));
    ASSERT_EQ(figure.legend.size(), renderers.size() + 1) << "and one participant";
    std::set<std::pair<Role, MarkerShape>> styles;
    for (std::size_t r = 0; r < renderers.size(); ++r) {
      const LegendEntry& entry = figure.legend[r];
      styles.emplace(entry.role, entry.shape);
      if (entry.label == "point") {
        EXPECT_EQ(entry.role, Role::point);
      }
      if (entry.label == "ray") {
        EXPECT_EQ(entry.role, Role::ray);
      }
    }
    EXPECT_EQ(styles.size(), renderers.size());
  }
}

TEST(Figures, SayWhatTheyLeaveOut) {
  const Analysis many = analysis_of({"point", "ray"}, kShownShapes + 2);
  const Figure figure = figure15_of(many);
  EXPECT_EQ(figure.panels[0].x.ticks.size(), kShownShapes);
  EXPECT_NE(notes_of(figure).find("The first 24 of 26 shapes"), std::string::npos);
  const Figure all = figure15_of(analysis_of({"point", "ray"}, kShownShapes));
  EXPECT_EQ(all.panels[0].x.ticks.size(), kShownShapes);
  EXPECT_EQ(notes_of(all).find("The first"), std::string::npos);

  const Figure crowd = figure15_of(analysis_of({"point", "ray"}, 1, false, 202));
  EXPECT_NE(notes_of(crowd).find("Lines of the first 200 of 202 participants"), std::string::npos);
  std::set<std::string> drawn;
  for (const Mark& mark : crowd.panels[0].marks) {
    if (!mark.participant.empty()) drawn.insert(mark.participant);
  }
  EXPECT_EQ(drawn.size(), 200U);
  const Figure two = figure15_of(analysis_of({"point", "ray"}, 1));
  EXPECT_EQ(notes_of(two).find("Lines of the first"), std::string::npos);
  EXPECT_EQ(two.subtitle, "2 participants, 4 trials");
}

TEST(Palette, GivesEveryRoleAColourAndAVariable) {
  for (const Palette& palette : {light_palette(), dark_palette()}) {
    for (const std::string& colour : palette) {
      EXPECT_EQ(colour.size(), 7U) << colour;
      EXPECT_EQ(colour.find_first_not_of("0123456789abcdef", 1), std::string::npos) << colour;
    }
    const auto of = [&](Role role) { return palette[static_cast<std::size_t>(role)]; };
    const std::set<std::string> lines{of(Role::point),   of(Role::ray),   of(Role::third),
                                      of(Role::fourth),  of(Role::fifth), of(Role::sixth),
                                      of(Role::seventh), of(Role::eighth)};
    EXPECT_EQ(lines.size(), 8U);
    EXPECT_FALSE(lines.contains(of(Role::page)));
  }
  const Palette page = page_palette();
  EXPECT_EQ(page[static_cast<std::size_t>(Role::amber)], "var(--amber)");
  EXPECT_EQ(page[static_cast<std::size_t>(Role::page)], "var(--page)");
  std::set<Role> roles;
  for (std::size_t line = 0; line < 8; ++line) {
    roles.insert(line_role(line));
    EXPECT_EQ(line_role(line), line_role(line + 8));
  }
  EXPECT_EQ(roles.size(), 8U);
}

}  // namespace figures
}  // namespace
}  // namespace palpate::analysis
