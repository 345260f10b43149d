// Texts and form of the reports.

#include "analysis/report/report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/figures/svg.h"
#include "analysis/input/trials.h"
#include "analysis/statistics/analysis.h"
#include "analysis/statistics/conclusions.h"
#include "analysis/text.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {

struct Study {
  std::vector<std::string> participants{"A", "B", "C", "D", "E"};
  std::vector<std::string> renderers{"point", "ray"};
  std::vector<std::string> shapes{"sphere", "cone", "cylinder", "cube"};
  int repetitions = 6;
  Simulated simulated = Simulated::no;
  double cone_ratio = 0.6;   ///< of ray to point times
  double lost_with_ray = 0;  ///< proportion of time-outs
};

Analysis analysis_of_study(const Study& study) {
  TrialTableBuilder builder;
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  for (std::size_t p = 0; p < study.participants.size(); ++p) {
    int number = 0;
    for (const auto& renderer : study.renderers) {
      for (const auto& shape : study.shapes) {
        for (int i = 0; i < study.repetitions; ++i) {
          StudyTrial raw;
          raw.participant = study.participants[p];
          raw.renderer = renderer;
          raw.shape = shape;
          // Half of the participants have the ray first.
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

/// Whether `word` occurs without a letter beside it.
bool has_word(const std::string& text, const std::string& word) {
  const auto letter = [](char c) { return (c | 0x20) >= 'a' && (c | 0x20) <= 'z'; };
  for (std::size_t at = 0; (at = text.find(word, at)) != std::string::npos; at += word.size()) {
    const std::size_t end = at + word.size();
    if ((at == 0 || !letter(text[at - 1])) && (end == text.size() || !letter(text[end]))) {
      return true;
    }
  }
  return false;
}

TEST(Answer, NamesWhatIsFasterSlowerAndNeither) {
  Study study;
  EXPECT_TRUE(conclusion(analysis_of_study(study))
                  .starts_with("The ray is faster than the point for cone (4"))
      << conclusion(analysis_of_study(study));
  EXPECT_TRUE(holds(conclusion(analysis_of_study(study)),
                    "no clear difference for sphere, cylinder and cube"));
  study.cone_ratio = 1.6;
  EXPECT_TRUE(conclusion(analysis_of_study(study))
                  .starts_with("The ray is slower than the point for cone (5"))
      << conclusion(analysis_of_study(study));
  study.cone_ratio = 1;
  EXPECT_EQ(conclusion(analysis_of_study(study)),
            "No clear difference between ray and point for sphere, cone, cylinder and cube.");
}

TEST(Answer, SaysWhyNothingCanBeSaid) {
  Study study;
  study.participants = {"A"};
  EXPECT_TRUE(holds(conclusion(analysis_of_study(study)), "cannot say"));
  study.participants = {"A", "B", "C"};
  study.renderers = {"ray"};
  EXPECT_TRUE(holds(conclusion(analysis_of_study(study)), "cannot say"));
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
  study.participants = {std::string(200, 'p'), "B", "C"};
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
  EXPECT_TRUE(holds(text, "of the trials with ray are excluded from the times"));
  EXPECT_TRUE(holds(text, "Exclusions differ between renderers"));
  EXPECT_FALSE(holds(text, "of the trials with point are excluded"));
}

TEST(Reports, NameTimeOutsOfCellsThatHaveAny) {
  Study study;
  study.lost_with_ray = 0.3;
  const Analysis lost = analysis_of_study(study), none = analysis_of_study({});
  for (const auto& write : {report_text, page}) {
    EXPECT_TRUE(holds(write(lost), "Time-outs: trials that ended at the limit"));
    EXPECT_TRUE(holds(write(lost), "with time-outs"));
    EXPECT_FALSE(holds(write(none), "ime-out as")) << "of a card";
    EXPECT_FALSE(holds(write(none), "Time-outs:"));
  }
  EXPECT_TRUE(holds(page(lost), "as censored times"));
  EXPECT_TRUE(holds(drawings(lost), "limit "));
  EXPECT_FALSE(holds(drawings(none), "limit "));
  const auto with = nlohmann::json::parse(report_json(lost)),
             without = nlohmann::json::parse(report_json(none));
  EXPECT_FALSE(without.contains("time_outs"));
  EXPECT_FALSE(without["paired_by_shape"]["cone"].contains("censored"));
  std::size_t counted = 0;
  for (const auto& shape : with["time_outs"]["ray"]) {
    std::size_t participants = 0;
    for (const auto& one : shape["participants"])
      participants += one["n_timeouts"].get<std::size_t>();
    EXPECT_EQ(participants, shape["n_timeouts"].get<std::size_t>());
    counted += participants;
  }
  EXPECT_EQ(counted, with["counts"]["n_timeouts"].get<std::size_t>());
  EXPECT_EQ(with["paired_by_shape"]["cone"]["censored"]["status"], "ok");
}

TEST(Figures, EndViolinsAtLimitsAndCountTimeOuts) {
  Study study;
  study.lost_with_ray = 0.2;
  study.repetitions = 20;
  const Analysis analysis = analysis_of_study(study);
  const auto figures = figures_of(analysis, {});
  const auto times = std::ranges::find(figures, "times", &Figure::id);
  ASSERT_NE(times, figures.end());
  std::size_t texts = 0;
  for (const Mark& mark : times->panels[0].marks) {
    if (mark.kind == Mark::Kind::text && holds(mark.text, " (")) ++texts;
    if (mark.kind != Mark::Kind::area) continue;
    for (const auto& cell : analysis.time_outs.cells[1]) {
      if (!holds(mark.text, "ray") || !cell.highest_limit) continue;
      EXPECT_LE(*std::ranges::max_element(mark.y), times->panels[0].y.high);
    }
  }
  EXPECT_EQ(texts, 4U) << "the ray's four shapes";
  EXPECT_TRUE(holds(times->description, "time-outs of 100 trials"));
}

/// A study with a servo record: `bins` of the longest periods that trials had.
StudyRecord servo_record(const std::vector<std::size_t>& bins) {
  StudyRecord record;
  for (const char* renderer : {"point", "ray"}) {
    ServoQuality& servo = record.servo.emplace_back();
    servo.renderer = renderer;
    servo.n_trials = bins.size();
    servo.longest_period = 0.001;
    for (const std::size_t bin : bins) ++servo.longest_periods[bin];
  }
  return record;
}

TEST(Figures, OmitTheServoWhereEveryTrialIsAlike) {
  Study study;
  study.simulated = Simulated::yes;
  const Analysis analysis = analysis_of_study(study);
  const auto drawn = [&](const StudyRecord& record) {
    return std::ranges::count(figures_of(analysis, record), "servo", &Figure::id);
  };
  EXPECT_EQ(drawn(servo_record({20, 20, 20})), 0);
  EXPECT_EQ(drawn(servo_record({20, 20, 23})), 1);
  const std::string text = report_html(analysis, servo_record({20, 20, 20}));
  EXPECT_TRUE(holds(text, "in the same bin"));
  EXPECT_TRUE(holds(text, "virtual clock"));
}

TEST(Cards, NameAdjustedPAndIntervalWhereTheyDisagree) {
  Analysis analysis = analysis_of_study({});
  PairedShape& cone = analysis.comparisons[0].shapes[1];
  cone.t_test.p = 0.03;
  cone.t_test.p_holm = 0.09;
  cone.t_test.log_ratio_ci95 = Interval{std::log(0.8), std::log(0.99)};
  const std::string text = page(analysis);
  EXPECT_TRUE(holds(text, "1.0 to 20.0\u00a0%, not adjusted"));
  EXPECT_TRUE(
      holds(text, "no clear difference among 4 tests, adjusted p = 0.090 (by itself p = 0.030)"));
}

TEST(Paper, IsSilentWhereNothingMatchesIt) {
  Study study;
  study.shapes = {"Kugel", "L", "plate", "Würfel hart"};
  study.lost_with_ray = 0.1;
  for (const auto& write : {report_text, page, drawings}) {
    const std::string text = write(analysis_of_study(study));
    for (const char* word :
         {"paper", "Ho et al", "Basdogan", "fig. 15", "figure 15", "Figure 15", "n.s."}) {
      // The style sheet has "paper" as name of a colour.
      const std::size_t from = write == page ? text.find("<body>") : 0;
      const std::size_t to = std::min(text.find("<script"), text.size());
      EXPECT_FALSE(holds(text.substr(from, to - from).substr(0, std::string::npos), word) &&
                   std::string(word) != "paper")
          << word;
    }
    EXPECT_FALSE(holds(text, "the paper"));
  }
  study.shapes[0] = "sphere";
  EXPECT_TRUE(holds(report_text(analysis_of_study(study)), "fig. 15"));
  study.renderers = {"ray"};  // a single renderer: no comparison
  EXPECT_FALSE(holds(report_text(analysis_of_study(study)), "fig. 15"));
  EXPECT_FALSE(holds(report_text(analysis_of_study(study)), "with time-outs"));
  EXPECT_TRUE(holds(report_text(analysis_of_study(study)), "Time-outs: trials that ended"));
}

TEST(Reports, NeverPrintNanOrInfinity) {
  for (std::size_t participants = 1; participants <= 3; ++participants) {
    for (const auto& renderers : {std::vector<std::string>{"point"},
                                  {"ray"},
                                  {"point", "ray"},
                                  {"tip"},
                                  {"ray", "tip"},
                                  {"point", "ray", "a", "b", "c", "d", "e"}}) {
      Study study;
      study.participants.resize(participants);
      study.renderers = renderers;
      study.lost_with_ray = 1;
      const Analysis analysis = analysis_of_study(study);
      for (const auto& write : {report_text, drawings, report_json}) {
        const std::string text = write(analysis);
        for (const char* bad : {"nan", "NaN", "inf", "Infinity"}) {
          EXPECT_FALSE(has_word(text, bad)) << bad << " with " << participants;
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
  EXPECT_EQ(escaped("<a href=\"x\">&'\x01\xFF"),
            "&lt;a href=&quot;x&quot;&gt;&amp;&#39;\\u0001\\xff");
  Study study;
  study.participants = {"<script>alert(1)</script>", "B", "C"};
  study.shapes = {"cone", "<script>"};
  study.renderers = {"point", "ray"};
  study.shapes = {"cone", "<script>", "</script>"};
  for (const auto& write : {page, drawings}) {
    const std::string text = write(analysis_of_study(study));
    EXPECT_FALSE(holds(text, "<script>alert"));
    EXPECT_TRUE(holds(text, "&lt;script&gt;"));
  }
  // Two script elements: the palette and the program.
  const std::string text = page(analysis_of_study(study));
  std::size_t begins = 0, ends = 0;
  for (std::size_t at = 0; (at = text.find("<script", at)) != std::string::npos; ++at) ++begins;
  for (std::size_t at = 0; (at = text.find("</script", at)) != std::string::npos; ++at) ++ends;
  EXPECT_EQ(begins, 2U);
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

TEST(Cards, SayFasterOrSlowerBelowOnePercent) {
  for (const double percent : {0.5, -0.5}) {
    Analysis analysis = analysis_of_study({});
    PairedShape& cone = analysis.comparisons[0].shapes[1];
    cone.percent_reduction_geometric = percent;
    cone.mean_log_ratio = std::log1p(-percent / 100);
    const std::string text = page(analysis);
    EXPECT_TRUE(holds(text, std::string("<b>cone</b><span class=\"value\">0.5\u00a0%</span> ") +
                                (percent > 0 ? "faster" : "slower")));
  }
}

}  // namespace
}  // namespace palpate::analysis
