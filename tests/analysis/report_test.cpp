// What the reports say and how.

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "analysis/analysis.h"
#include "analysis/figures.h"
#include "analysis/figures_svg.h"
#include "analysis/figures_vega.h"
#include "analysis/report_html.h"
#include "analysis/report_json.h"
#include "analysis/report_text.h"
#include "analysis/text.h"
#include "analysis/trial_table_builder.h"
#include "analysis/wording.h"
#include "stimuli/random.h"

namespace palpate {
namespace {

struct Study {
  std::vector<std::string> people{"A", "B", "C", "D", "E"};
  std::vector<std::string> renderers{"point", "ray"};
  std::vector<std::string> shapes{"sphere", "cone", "cylinder", "cube"};
  int repetitions = 6;
  Simulated simulated = Simulated::no;
  double cone_ratio = 0.6;   ///< of ray to point times
  double lost_with_ray = 0;  ///< share of time-outs
};

Analysis analysis_of_study(const Study& study) {
  TrialTableBuilder builder;
  Random random(11);
  for (std::size_t p = 0; p < study.people.size(); ++p) {
    int number = 0;
    for (const auto& renderer : study.renderers) {
      for (const auto& shape : study.shapes) {
        for (int i = 0; i < study.repetitions; ++i) {
          RawTrial raw;
          raw.participant = study.people[p];
          raw.renderer = renderer;
          raw.shape = shape;
          // Half of the people have the ray first.
          raw.trial = ++number + (renderer == "point" && p % 2 == 1 ? 100000 : 0);
          raw.timed_out = renderer == "ray" && random.unit() < study.lost_with_ray;
          if (!raw.timed_out) raw.response = shape;
          raw.correct = !raw.timed_out;
          raw.response_time = 8 * std::exp(0.1 * random.normal()) *
                              (renderer == "ray" && shape == "cone" ? study.cone_ratio : 1);
          raw.simulated =
              study.simulated == Simulated::yes || (study.simulated == Simulated::mixed && p == 0);
          builder.add(raw);
        }
      }
    }
  }
  return analyze(builder.finish({}), {}, "1.2.3");
}

std::string page(const Analysis& analysis) { return report_html(analysis, {}); }

std::string drawings(const Analysis& analysis) {
  std::string all;
  for (const Figure& figure : figures_of(analysis, {})) all += figure_svg(figure, light_palette());
  return all;
}

bool holds(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Answer, NamesWhatIsFasterSlowerAndNeither) {
  Study study;
  EXPECT_TRUE(
      answer(analysis_of_study(study)).starts_with("The ray is faster than the point for cone (4"))
      << answer(analysis_of_study(study));
  EXPECT_TRUE(
      holds(answer(analysis_of_study(study)), "no clear difference for sphere, cylinder and cube"));
  study.cone_ratio = 1.6;
  EXPECT_TRUE(
      answer(analysis_of_study(study)).starts_with("The ray is slower than the point for cone (5"))
      << answer(analysis_of_study(study));
  study.cone_ratio = 1;
  EXPECT_EQ(answer(analysis_of_study(study)),
            "No clear difference between ray and point for sphere, cone, cylinder and cube.");
}

TEST(Answer, SaysWhyNothingCanBeSaid) {
  Study study;
  study.people = {"A"};
  EXPECT_TRUE(holds(answer(analysis_of_study(study)), "cannot say"));
  study.people = {"A", "B", "C"};
  study.renderers = {"ray"};
  EXPECT_TRUE(holds(answer(analysis_of_study(study)), "cannot say"));
}

TEST(Reports, SaySimulatedWhereverAFigureStands) {
  Study study;
  for (const auto& write : {report_text, page, drawings}) {
    study.simulated = Simulated::no;
    EXPECT_FALSE(holds(write(analysis_of_study(study)), "SIMULATED"));
    study.simulated = Simulated::yes;
    EXPECT_TRUE(holds(write(analysis_of_study(study)), "SIMULATED PARTICIPANTS"));
    study.simulated = Simulated::mixed;
    EXPECT_TRUE(holds(write(analysis_of_study(study)), "PARTLY SIMULATED PARTICIPANTS"));
  }
  using Parsed = nlohmann::json;
  EXPECT_EQ(Parsed::parse(report_json(analysis_of_study(study)))["simulated"], "mixed");
  study.simulated = Simulated::yes;
  EXPECT_EQ(Parsed::parse(report_json(analysis_of_study(study)))["simulated"], true);
}

TEST(Text, StaysWithinAHundredColumns) {
  Study study;
  study.people = {std::string(200, 'p'), "B", "C"};
  study.repetitions = 2;
  for (int i = 0; i < 40; ++i) study.shapes.push_back(std::string(60, 'x') + std::to_string(i));
  study.shapes.push_back("Würfel mit sehr langem Namen und Umlauten äöü");
  std::istringstream lines(report_text(analysis_of_study(study)));
  for (std::string line; std::getline(lines, line);) {
    EXPECT_LE(width(line), 100U) << line;
    EXPECT_TRUE(is_plain_utf8(line)) << line;
  }
}

TEST(Reports, HoldManyRenderersOfAnyName) {
  Study study;
  study.renderers = {"</script><b>", "ray", std::string(200, 'r'), "a\"'&", "]]>", "x", "y", "z"};
  const Analysis analysis = analysis_of_study(study);
  ASSERT_EQ(analysis.comparisons.size(), 7U);
  for (const auto& write : {page, drawings}) {
    const std::string text = write(analysis);
    EXPECT_FALSE(holds(text, "</script><b>"));
    EXPECT_TRUE(holds(text, "&lt;/script&gt;&lt;b&gt;"));
  }
  std::istringstream lines(report_text(analysis));
  for (std::string line; std::getline(lines, line);) EXPECT_LE(width(line), 100U) << line;
}

TEST(Text, WarnsOfExclusions) {
  Study study;
  EXPECT_FALSE(holds(report_text(analysis_of_study(study)), "Warning"));
  study.lost_with_ray = 0.3;
  const std::string text = report_text(analysis_of_study(study));
  EXPECT_TRUE(holds(text, "of the trials with ray are not in the times"));
  EXPECT_TRUE(holds(text, "Exclusions differ between renderers"));
  EXPECT_FALSE(holds(text, "of the trials with point are not"));
}

TEST(Reports, NeverPrintNanOrInfinity) {
  for (std::size_t people = 1; people <= 3; ++people) {
    for (const auto& renderers : {std::vector<std::string>{"point"},
                                  {"ray"},
                                  {"point", "ray"},
                                  {"tip"},
                                  {"ray", "tip"},
                                  {"point", "ray", "a", "b", "c", "d", "e"}}) {
      Study study;
      study.people.resize(people);
      study.renderers = renderers;
      study.lost_with_ray = 1;
      const Analysis analysis = analysis_of_study(study);
      for (const auto& write : {report_text, drawings, report_json}) {
        const std::string text = write(analysis);
        for (const char* bad : {"nan", "NaN", "inf ", "inf\"", "inf%", "Infinity"}) {
          EXPECT_FALSE(holds(text, bad)) << bad << " with " << people;
        }
      }
    }
  }
}

TEST(Json, IsTheSameAgainAndReadsBackExactly) {
  const Analysis analysis = analysis_of_study({});
  const std::string text = report_json(analysis);
  EXPECT_EQ(text, report_json(analysis_of_study({})));
  const auto json = nlohmann::json::parse(text);
  EXPECT_EQ(json["paired_by_shape"]["cone"]["t_test"]["p"].get<double>(),
            analysis.comparisons[0].shapes[1].t_test.p.value());
  EXPECT_EQ(json["program_version"], "1.2.3");
}

TEST(Escaping, NothingFromAFileIsMarkup) {
  EXPECT_EQ(escaped("<a href=\"x\">&'\x01\xFF"), "&lt;a href=&quot;x&quot;&gt;&amp;&#39;??");
  Study study;
  study.people = {"<script>alert(1)</script>", "B", "C"};
  study.shapes = {"cone", "<script>"};
  study.renderers = {"point", "ray"};
  study.shapes = {"cone", "<script>", "</script>"};
  for (const auto& write : {page, drawings}) {
    const std::string text = write(analysis_of_study(study));
    EXPECT_FALSE(holds(text, "<script>alert"));
    EXPECT_TRUE(holds(text, "&lt;script&gt;"));
  }
  // Three scripts at most, each with its end: data, Vega, ours.
  const std::string text = page(analysis_of_study(study));
  std::size_t begins = 0, ends = 0;
  for (std::size_t at = 0; (at = text.find("<script", at)) != std::string::npos; ++at) ++begins;
  for (std::size_t at = 0; (at = text.find("</script", at)) != std::string::npos; ++at) ++ends;
  EXPECT_LE(begins, 3U);
  EXPECT_EQ(begins, ends);
}

TEST(TextHelpers, NumbersAndNames) {
  EXPECT_EQ(fixed(-0.04, 1), "0.0");
  EXPECT_EQ(fixed(-1.25, 1), "−1.2");
  EXPECT_EQ(p_text(0.00099), "<0.001");
  EXPECT_EQ(p_text(0.05), "0.050");
  EXPECT_EQ(width("äö–"), 3U);
  EXPECT_EQ(shortened("abcdef", 4), "abc…");
  EXPECT_EQ(shortened("äöüß", 4), "äöüß");
  EXPECT_EQ(joined(std::vector<std::string>{"a", "b", "c"}), "a, b and c");
  EXPECT_FALSE(is_plain_utf8("\xC0\xAF"));
  EXPECT_FALSE(is_plain_utf8("\xED\xA0\x80"));
  EXPECT_FALSE(is_plain_utf8("a\x1b[31m"));
  EXPECT_FALSE(is_plain_utf8("\xC2\x85"));
  EXPECT_TRUE(is_plain_utf8("näïve 形 🙂"));
}

}  // namespace
}  // namespace palpate
