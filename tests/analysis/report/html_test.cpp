// Elements of HTML pages: tables, cards, sections, and the hash of a script.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/report/html_page.h"
#include "analysis/report/report.h"
#include "analysis/statistics/analysis.h"

namespace palpate::analysis {
namespace {
namespace html {

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size()) ++n;
  return n;
}

bool holds(const std::string& text, const std::string& part) { return count_of(text, part) > 0; }

// A wrong hash blocks the script of the page. Values by `openssl dgst -sha256 -binary | base64`.
TEST(ScriptHash, IsBase64OfSha256) {
  EXPECT_EQ(script_hash(""), "sha256-47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU=");
  EXPECT_EQ(script_hash("abc"), "sha256-ungWv48Bz+pBQUDeXa4iI7ADYaOWF3qctBD/YfIAFa0=");
  EXPECT_EQ(script_hash("console.log(1)"), "sha256-CihokcEcBW4atb/CW/XWsvWwbTjqwQlE9nj9ii5ww5M=");
}

TEST(HtmlTable, HasHeadersNamesAndNumbers) {
  Table table;
  table.caption = "Times & more";
  table.header = {"shape", "renderer", "mean"};
  table.n_names = 2;
  table.rows = {{"cone", "ray", "<1"}, {"cube", "ray", "5 %"}};
  table.notes = {"In 95 % of trials."};
  std::string out;
  put_table(out, table);
  EXPECT_TRUE(holds(out, "aria-label=\"Times &amp; more\""));
  EXPECT_TRUE(holds(out, "<caption>Times &amp; more</caption>"));
  EXPECT_TRUE(holds(out,
                    "<tr><th scope=\"col\" class=\"name\">shape</th>"
                    "<th scope=\"col\" class=\"name\">renderer</th><th scope=\"col\">mean</th>"
                    "</tr>"));
  EXPECT_TRUE(holds(out,
                    "<tr><th scope=\"row\" class=\"name\">cone</th>"
                    "<td class=\"name\">ray</td><td>&lt;1</td></tr>"));
  EXPECT_EQ(count_of(out, "<tr>"), 3U);
  EXPECT_TRUE(holds(out, "<p class=\"note\">In 95\u00a0% of trials.</p>"));
  EXPECT_FALSE(holds(out, "Cut to"));
  std::string folded;
  put_collapsible_tables(folded, "Tables of <b>", {table, table});
  EXPECT_TRUE(folded.starts_with("<details>"));
  EXPECT_TRUE(holds(folded, "<summary>Tables of &lt;b&gt;</summary>"));
  EXPECT_EQ(count_of(folded, out), 2U);
  EXPECT_TRUE(folded.ends_with("</details>\n"));
}

TEST(HtmlTable, IsCutWithANote) {
  const auto drawn = [](std::size_t rows, std::size_t columns) {
    Table table;
    table.header.assign(columns, "h");
    table.rows.assign(rows, std::vector<std::string>(columns, "v"));
    std::string out;
    put_table(out, table);
    return out;
  };
  EXPECT_FALSE(holds(drawn(400, 60), "Cut to"));
  EXPECT_EQ(count_of(drawn(400, 2), "<tr>"), 401U);
  EXPECT_EQ(count_of(drawn(401, 2), "<tr>"), 401U);
  EXPECT_TRUE(holds(drawn(401, 2), "Cut to 400 rows and 60 columns; the JSON file is complete."));
  EXPECT_EQ(count_of(drawn(1, 61), ">v<"), 60U);
  EXPECT_TRUE(holds(drawn(1, 61), "Cut to 400 rows"));
}

TEST(EscapedSentence, KeepsPercentSignsWithTheirNumbers) {
  EXPECT_EQ(escaped_sentence("5 % & 6 %"), "5\u00a0% &amp; 6\u00a0%");
  EXPECT_EQ(escaped_sentence("<a>"), "&lt;a&gt;");
}

/// Renderers "point", "r1", ... and shapes "s0", ..., all correct, for three participants; the last
/// renderer halves the times with every shape.
Analysis analysis_of(std::size_t renderers, std::size_t shapes) {
  TrialTableBuilder builder;
  for (int p = 0; p < 3; ++p) {
    int trial = 0;
    for (std::size_t r = 0; r < renderers; ++r) {
      for (std::size_t s = 0; s < shapes; ++s) {
        for (int i = 0; i < 2; ++i) {
          StudyTrial raw;
          const std::string name = "P" + std::to_string(p), shape = "s" + std::to_string(s);
          const std::string renderer = r == 0 ? "point" : "r" + std::to_string(r);
          raw.participant = name;
          raw.renderer = renderer;
          raw.shape = raw.response = shape;
          raw.correct = true;
          raw.trial = ++trial;
          // Differences between renderers vary with the participant.
          const double own = 1 + 0.01 * ((7 * p + 3 * i + 5 * static_cast<int>(r) * (p + 1)) % 11);
          raw.response_time = (r + 1 == renderers ? 2 : 4) * own;
          builder.add(raw);
        }
      }
    }
  }
  return analyze(builder.finish({}), {}, "test");
}

std::string cards_of(std::size_t renderers, std::size_t shapes) {
  std::string out;
  put_reduction_cards(out, analysis_of(renderers, shapes));
  return out;
}

TEST(Cards, OneForEachShapeAndComparison) {
  const std::string one = cards_of(2, 3);
  EXPECT_EQ(count_of(one, "<ul class=\"cards\""), 1U);
  EXPECT_EQ(count_of(one, "<li"), 3U);
  EXPECT_EQ(count_of(one, "<li class=\"clear\">"), 3U) << "half the time, hardly any variance";
  EXPECT_EQ(count_of(one, " faster"), 3U);
  EXPECT_FALSE(holds(one, "The first"));
  EXPECT_EQ(count_of(cards_of(3, 2), "<ul class=\"cards\""), 2U);
  EXPECT_TRUE(holds(cards_of(3, 2), "with r2 against the point"));
}

TEST(Cards, AreCutWithANote) {
  EXPECT_EQ(count_of(cards_of(2, 12), "<li"), 12U);
  EXPECT_FALSE(holds(cards_of(2, 12), "The first"));
  EXPECT_EQ(count_of(cards_of(2, 14), "<li"), 12U);
  EXPECT_TRUE(holds(cards_of(2, 14), "The first 12 of 14 shapes."));
  EXPECT_EQ(count_of(cards_of(5, 1), "<li"), 4U);
  EXPECT_FALSE(holds(cards_of(5, 1), "The first"));
  EXPECT_EQ(count_of(cards_of(6, 1), "<li"), 4U);
  EXPECT_TRUE(holds(cards_of(6, 1), "The first 4 of 5 comparisons."));
}

/// The card of a cone whose times with the ray are `factor` times those with the point.
std::string card_of(double factor, double low, double high) {
  Analysis analysis;
  analysis.table.shapes = {"cone"};
  Comparison& comparison = analysis.comparisons.emplace_back();
  comparison.pair = {"point", "ray", 0, 1};
  PairedShape& shape = comparison.shapes.emplace_back();
  shape.mean_log_ratio = std::log(factor);
  shape.percent_reduction_geometric = percent_reduction(std::log(factor));
  shape.t_test.log_ratio_ci95 = Interval{std::log(low), std::log(high)};
  CensoredEstimate& censored = comparison.censored.emplace_back();
  censored.n_censored = 2;
  censored.log_ratio = std::log(factor);
  censored.log_ratio_ci95 = shape.t_test.log_ratio_ci95;
  std::string out;
  put_reduction_cards(out, analysis);
  return out;
}

TEST(Cards, TurnTheIntervalWithTheEstimate) {
  const std::string slower = card_of(1.341, 0.682, 2.638);
  EXPECT_TRUE(holds(slower, "34.1\u00a0%</span> slower<small>95\u00a0% interval −31.8 to 163.8"));
  EXPECT_TRUE(holds(slower, "as censored times: 34.1\u00a0% slower (−31.8 to 163.8)"));
  EXPECT_TRUE(holds(slower, "paper: 22\u00a0% faster"));
  const std::string faster = card_of(0.8, 0.5, 1.1);
  EXPECT_TRUE(holds(faster, "20.0\u00a0%</span> faster<small>95\u00a0% interval −10.0 to 50.0"));
  EXPECT_TRUE(holds(faster, "as censored times: 20.0\u00a0% faster (−10.0 to 50.0)"));
}

TEST(Quotable, SentencesHaveTestsAndTurnWithTheirDirection) {
  Analysis analysis;
  analysis.table.shapes = {"cone"};
  Comparison& comparison = analysis.comparisons.emplace_back();
  comparison.pair = {"point", "ray", 0, 1};
  PairedShape& cone = comparison.shapes.emplace_back();
  cone.n_pairs = 7;
  cone.percent_reduction_geometric = percent_reduction(std::log(0.8));
  cone.t_test = {"", 0.25, 0.1, -2.5, 6, 0.0468, Interval{std::log(0.65), std::log(0.99)}, 0.0465};
  cone.effect_size.dz = -0.94;
  EXPECT_EQ(sentences_to_quote(analysis),
            std::vector<std::string>{
                "cone: 20.0 % less time with the ray than with the point, 95 % CI [1.0, 35.0], "
                "t(6) = −2.50, p = 0.047, dz = −0.94, n = 7 (paired t-test of log times)."});
  analysis.table.shapes.push_back("cube");
  comparison.shapes.push_back(PairedShape(cone));
  PairedShape& cube = comparison.shapes.back();
  cube.percent_reduction_geometric = percent_reduction(std::log(1.5));
  cube.t_test = {"", 0.25, 0.1, 9, 6, 0.0001, Interval{std::log(0.9), std::log(2.5)}, 0.0002};
  analysis.table.simulated = Simulated::yes;
  EXPECT_EQ(
      sentences_to_quote(analysis)[1],
      "cube: 50.0 % more time with the ray than with the point, 95 % CI [−10.0, 150.0], t(6) = "
      "9.00, p < 0.001 (p < 0.001 adjusted over 2 tests, Holm), dz = −0.94, n = 7 (paired "
      "t-test of log times; SIMULATED PARTICIPANTS).");
  comparison.shapes[0].t_test.p.reset();
  EXPECT_EQ(sentences_to_quote(analysis).size(), 1U) << "an undefined test has no sentence";
}

TEST(HtmlPage, LinksSectionsAndAllowsOnlyItsOwnScript) {
  HtmlPage page("The ray is faster for 2 %", "SIMULATED");
  page.put_banner("simulated <all>");
  page.above_title() += "<p>above</p>";
  page.below_title() += "<p>below</p>";
  page.begin_section("one", "Times & tests", "Times");
  page.put_note("a note");
  page.end_section();
  page.begin_section("two", "Second", "2nd");
  page.body() += "<p>own</p>";
  page.end_section();
  const std::string text = page.html("made by a test.");
  EXPECT_TRUE(holds(text, "<title>SIMULATED: The ray is faster for 2\u00a0%</title>"));
  EXPECT_TRUE(holds(text, "<h1>The ray is faster for 2\u00a0%</h1>"));
  EXPECT_TRUE(holds(text, "role=\"note\">simulated &lt;all&gt;</div>"));
  EXPECT_TRUE(holds(text, "<h2 id=\"one-heading\">Times &amp; tests</h2>"));
  EXPECT_TRUE(holds(text, "<section id=\"one\" aria-labelledby=\"one-heading\">"));
  EXPECT_TRUE(
      holds(text, "<li><a href=\"#one\">Times</a></li>\n<li><a href=\"#two\">2nd</a></li>"));
  EXPECT_TRUE(holds(text, "script-src '" + script_hash(report_script()) + "'"));
  EXPECT_TRUE(holds(text, "<p class=\"note\">a note</p>"));
  EXPECT_TRUE(holds(text, "<footer><p>made by a test."));
  EXPECT_EQ(count_of(text, "<section"), count_of(text, "</section>"));
  const std::vector<std::string> order{"<p>above</p>", "<h1>",       "<p>below</p>",
                                       "<nav",         "id=\"one\"", "a note",
                                       "id=\"two\"",   "<p>own</p>", "<footer>"};
  std::size_t at = 0;
  for (const std::string& part : order) {
    const std::size_t next = text.find(part, at);
    ASSERT_NE(next, std::string::npos) << part;
    at = next;
  }
}

TEST(HtmlPage, FiguresHaveTheirNotesAndButtons) {
  Figure figure;
  figure.id = "times";
  figure.title = "Times";
  figure.notes = {"Bars: 95 % interval."};
  figure.panels.emplace_back();
  HtmlPage page("t");
  page.put_figure_section(figure, "Times");
  EXPECT_TRUE(holds(page.body(), "<figcaption>Bars: 95\u00a0% interval. </figcaption>"));
  EXPECT_TRUE(holds(page.body(), "data-figure=\"times\""));
  EXPECT_EQ(count_of(page.body(), "data-save=\"svg\""), 1U);
  EXPECT_EQ(count_of(page.body(), "data-save=\"png\""), 1U);
  EXPECT_FALSE(holds(page.body(), "<select"));
  page.put_figure(figure, {"P1", "P<2>"});
  EXPECT_TRUE(holds(page.body(), "<option value=\"P&lt;2&gt;\">P&lt;2&gt;</option>"));
  figure.notes.clear();
  HtmlPage plain("t");
  plain.put_figure(figure);
  EXPECT_FALSE(holds(plain.body(), "figcaption"));
}

TEST(List, IsNothingWithoutSentences) {
  std::string out;
  put_list(out, {});
  EXPECT_EQ(out, "");
  put_list(out, {"one & two", "three"});
  EXPECT_EQ(out, "<ul>\n<li>one &amp; two</li>\n<li>three</li>\n</ul>\n");
}

}  // namespace html
}  // namespace
}  // namespace palpate::analysis
