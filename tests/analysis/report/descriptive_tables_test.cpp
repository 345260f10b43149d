// Tables of times, accuracy, confusion, time-outs, exclusions and tests of a study that is small
// enough to work out by hand.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/report/report.h"
#include "analysis/report/tables.h"
#include "analysis/statistics/analysis.h"

namespace palpate::analysis {
namespace {
namespace by_hand {

using Row = std::vector<std::string>;
using Rows = std::vector<Row>;

struct Study {
  TrialTableBuilder builder;
  int n_trials = 0;

  /// A trial; the response is empty for a time-out.
  void add(const std::string& participant, const std::string& renderer, const std::string& shape,
           const std::string& response, double time, bool practice = false) {
    StudyTrial raw;
    raw.participant = participant;
    raw.renderer = renderer;
    raw.shape = shape;
    raw.response = response;
    raw.correct = response == shape;
    raw.timed_out = response.empty();
    raw.response_time = time;
    raw.practice = practice;
    raw.trial = ++n_trials;
    builder.add(raw);
  }
};

/// Two participants; times whose means, medians and products are whole.
Analysis two_participants() {
  Study study;
  study.add("A", "point", "cone", "cone", 3, true);
  for (const double time : {2, 8}) study.add("A", "point", "cone", "cone", time);
  study.add("A", "point", "cone", "cube", 5);
  study.add("A", "point", "cone", "", 60);
  study.add("A", "point", "cone", "cone", 0.1);
  study.add("A", "point", "cube", "cube", 4);
  for (const double time : {1, 4}) study.add("A", "ray", "cone", "cone", time);
  study.add("A", "ray", "cube", "cube", 2);
  study.add("A", "ray", "cube", "", 30);
  study.add("A", "ray", "cube", "", 45.5);
  study.add("B", "point", "cone", "cone", 3);
  study.add("B", "point", "cube", "cube", 9);
  for (const double time : {3, 12}) study.add("B", "ray", "cone", "cone", time);
  study.add("B", "ray", "cone", "cube", 0.15);
  study.add("B", "ray", "cube", "cube", 6);
  Provenance provenance;
  provenance.source = "trials.csv";
  provenance.protocol_name = "ho2000";
  provenance.protocol_sha256 = {"aa", "bb"};
  provenance.program_versions = {"1.0"};
  provenance.observer_sha256 = "cc";
  return analyze(study.builder.finish(provenance), {}, "2.0");
}

TEST(DescriptiveTables, TimesAreMeansOverParticipants) {
  // Cone with point: A 2 and 8 s (mean 5, median 5, geometric mean 4), B 3 s.
  EXPECT_EQ(times_table(two_participants()).rows,
            (Rows{{"cone", "point", "4.00", "1.41", "4.00", "3.46", "2", "3"},
                  {"cone", "ray", "5.00", "3.54", "5.00", "3.46", "2", "4"},
                  {"cube", "point", "6.50", "3.54", "6.50", "6.00", "2", "2"},
                  {"cube", "ray", "4.00", "2.83", "4.00", "3.46", "2", "2"}}));
}

TEST(DescriptiveTables, AccuracyCountsTimeOutsAsWrong) {
  EXPECT_EQ(accuracy_table(two_participants()).rows,
            (Rows{{"cone", "point", "66.7 %", "80.0 %", "80.0 %", "4", "1", "6"},
                  {"cone", "ray", "80.0 %", "80.0 %", "83.3 %", "4", "0", "5"},
                  {"cube", "point", "100.0 %", "100.0 %", "100.0 %", "2", "0", "2"},
                  {"cube", "ray", "50.0 %", "100.0 %", "66.7 %", "2", "2", "4"}}));
}

TEST(DescriptiveTables, ConfusionHasEveryTrialOnce) {
  const std::vector<Table> tables = confusion_tables(two_participants());
  ASSERT_EQ(tables.size(), 2U);
  EXPECT_EQ(tables[0].header, (Row{"shown", "cone", "cube", "no response"}));
  EXPECT_EQ(tables[0].rows, (Rows{{"cone", "4", "1", "1"}, {"cube", "0", "2", "0"}}));
  EXPECT_EQ(tables[1].rows, (Rows{{"cone", "4", "1", "0"}, {"cube", "0", "2", "2"}}));
  EXPECT_NE(tables[0].caption.find("point"), std::string::npos);
  EXPECT_NE(tables[1].caption.find("ray"), std::string::npos);
}

TEST(DescriptiveTables, ExclusionsAddUp) {
  const Table table = exclusions_table(two_participants());
  // renderer, trials, wrong, no response, too fast, used, left out
  EXPECT_EQ(table.rows, (Rows{{"point", "8", "1", "1", "1", "5", "37.5 %"},
                              {"ray", "9", "1", "2", "0", "6", "33.3 %"}}));
  EXPECT_NE(table.notes[0].find("0.200 s. 1 practice trial "), std::string::npos);
}

TEST(DescriptiveTables, CountsAreOfAllTrialsWithoutPractice) {
  const Counts counts = two_participants().description.counts;
  EXPECT_EQ(counts.n_participants, 2U);
  EXPECT_EQ(counts.n_trials, 17U);
  EXPECT_EQ(counts.n_correct, 12U);
  EXPECT_EQ(counts.n_timeouts, 3U);
  EXPECT_EQ(counts.n_too_fast, 2U) << "right or wrong";
  EXPECT_EQ(counts.n_used_for_times, 11U);
  EXPECT_NEAR(counts.accuracy.value(), 12.0 / 17, 1e-15);
}

TEST(DescriptiveTables, TimeOutsNameLimitAndParticipantWithMost) {
  EXPECT_EQ(time_outs_table(two_participants()).rows,
            (Rows{{"cone", "point", "6", "1", "16.7 %", "60 s", "20.0 % (A)"},
                  {"cone", "ray", "5", "0", "0.0 %", "–", "–"},
                  {"cube", "point", "2", "0", "0.0 %", "–", "–"},
                  {"cube", "ray", "4", "2", "50.0 %", "30 to 45.50 s", "66.7 % (A)"}}));
}

TEST(DescriptiveTables, ReductionsAreOfMeansAndOfMeanLogs) {
  const Table table = reduction_table(two_participants());
  EXPECT_EQ(table.header, (Row{"shape", "geometric", "95 % interval", "arithmetic", "t", "df",
                               "p (Holm)", "pairs", "paper"}));
  ASSERT_EQ(table.rows.size(), 2U);
  // Cone: mean logs -ln 2 and +ln 2 apart; means 4 and 5 s. With one degree of freedom Student's t
  // is Cauchy's distribution: p = 1 - 2 atan(t) / pi.
  const Row& cone = table.rows[0];
  EXPECT_EQ(cone[0], "cone");
  EXPECT_EQ(cone[1], "0.0 %");
  EXPECT_EQ(cone[3], "−25.0 %");
  EXPECT_EQ(cone[4], "0.00");
  EXPECT_EQ(cone[5], "1");
  EXPECT_EQ(cone[6], "1.000");
  EXPECT_EQ(cone[7], "2");
  EXPECT_EQ(cone[8], "22 %");
  // Cube: A halves, B takes two thirds of the time: geometric mean 1/sqrt(3); means 6.5 and 4 s.
  const double a = std::log(2.0), b = std::log(1.5);
  const double t = (a + b) / std::fabs(a - b);  // mean over se of two values
  const double p = 1 - 2 * std::atan(t) / std::acos(-1.0);
  const Row& cube = table.rows[1];
  EXPECT_EQ(cube[1], "42.3 %");
  EXPECT_EQ(cube[3], "38.5 %");
  EXPECT_NEAR(std::stod("-" + cube[4].substr(3)), -t, 0.006) << cube[4];
  EXPECT_NEAR(std::stod(cube[6]), 2 * p, 0.0006) << "two tests";
  EXPECT_EQ(cube[8], "11 %");
  const Row tests = tests_table(two_participants()).rows[1];
  // t, df, p, p (Holm), dz, gz (none for two pairs), V, p (Wilcoxon), BCa
  EXPECT_NEAR(std::stod("-" + tests[1].substr(3)), -t, 0.006) << tests[1];
  EXPECT_EQ(tests[2], "1");
  EXPECT_NEAR(std::stod(tests[3]), p, 0.0006);
  EXPECT_EQ(tests[4], cube[6]);
  EXPECT_NEAR(std::stod("-" + tests[5].substr(3)), -t / std::sqrt(2.0), 0.006) << tests[5];
  EXPECT_EQ(tests[6], "–");
  EXPECT_EQ(tests[7], "0.0");
  EXPECT_EQ(tests[8], "0.500") << "2 times 1/4";
}

TEST(DescriptiveTables, POfASingleTestIsNotAdjusted) {
  const auto named = [](const Table& table, const std::string& name) {
    return std::ranges::count(table.header, name);
  };
  Analysis analysis = two_participants();
  EXPECT_EQ(named(tests_table(analysis), "p (Holm)"), 1);
  analysis.comparisons[0].shapes[0].t_test.p.reset();
  for (const Table& table : {reduction_table(analysis), tests_table(analysis)}) {
    EXPECT_EQ(named(table, "p (Holm)"), 0) << table.caption;
    EXPECT_EQ(named(table, "p"), 1) << table.caption;
    EXPECT_EQ(named(table, "t"), 1) << table.caption;
    EXPECT_EQ(named(table, "df"), 1) << table.caption;
    for (const auto& row : table.rows) EXPECT_EQ(row.size(), table.header.size());
    for (const std::string& note : table.notes)
      EXPECT_EQ(note.find("Holm"), std::string::npos) << note;
  }
}

TEST(DescriptiveTables, CensoredEstimatesHaveTheirTimeOutsBeside) {
  const Table table = censored_table(two_participants());
  ASSERT_EQ(table.rows.size(), 2U);
  EXPECT_EQ(table.header.back(), "n");
  EXPECT_EQ(table.rows[0][1], "0.0 %");
  EXPECT_EQ(table.rows[0][4], "16.7 %");
  EXPECT_EQ(table.rows[0][5], "0.0 %");
  EXPECT_EQ(table.rows[1][4], "0.0 %");
  EXPECT_EQ(table.rows[1][5], "50.0 %");
  EXPECT_EQ(table.rows[1][6], "2");
}

TEST(DescriptiveTables, ProvenanceNamesWhatIsKnown) {
  EXPECT_EQ(provenance_table(two_participants()).rows, (Rows{{"source", "trials.csv"},
                                                             {"participants", "2 participants"},
                                                             {"protocol", "ho2000"},
                                                             {"protocol SHA-256", "aa"},
                                                             {"protocol SHA-256", "bb"},
                                                             {"observer SHA-256", "cc"},
                                                             {"recorded with palpate", "1.0"},
                                                             {"analysed with palpate", "2.0"}}));
}

/// The fields of a line of a table: what two or more spaces separate.
Row fields_of(const std::string& line) {
  Row fields;
  for (std::size_t at = 0; (at = line.find_first_not_of(' ', at)) != std::string::npos;) {
    const std::size_t end = std::min(line.find("  ", at), line.size());
    fields.push_back(line.substr(at, end - at));
    at = end;
  }
  return fields;
}

std::vector<std::string> lines_of_report(const Analysis& analysis) {
  const std::string text = report_text(analysis);
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    lines.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

TEST(TextReport, SeparatesTheFieldsOfEveryTableRow) {
  const Analysis analysis = two_participants();
  const auto lines = lines_of_report(analysis);
  for (const Table& table :
       {reduction_table(analysis), times_table(analysis), accuracy_table(analysis),
        exclusions_table(analysis), time_outs_table(analysis), confusion_tables(analysis)[0]}) {
    const auto header = std::ranges::find(lines, table.header, fields_of);
    ASSERT_TRUE(header != lines.end()) << table.caption;
    EXPECT_NE((header - 1)->find(table.caption), std::string::npos);
    EXPECT_TRUE((header + 1)->starts_with("  ─"));
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
      EXPECT_EQ(fields_of(*(header + 2 + static_cast<std::ptrdiff_t>(r))), table.rows[r]);
    }
  }
  EXPECT_NE(std::ranges::find(lines, "2 participants, 17 trials, 70.6 % correct; 11 times used."),
            lines.end());
}

TEST(TextReport, SplitsWideTablesAndRepeatsTheNames) {
  Study study;
  Row shapes;
  for (int s = 0; s < 16; ++s) shapes.push_back("object" + std::to_string(s));
  for (const std::string participant : {"A", "B"}) {
    for (const std::string renderer : {"point", "ray"}) {
      for (std::size_t s = 0; s < shapes.size(); ++s) {
        study.add(participant, renderer, shapes[s], shapes[(s + 1) % shapes.size()], 2);
      }
    }
  }
  const Analysis analysis = analyze(study.builder.finish({}), {}, "2.0");
  const auto lines = lines_of_report(analysis);
  const Table table = confusion_tables(analysis)[0];
  auto line = std::ranges::find(lines, table.caption);
  ASSERT_TRUE(line != lines.end());
  Row header{"shown"};
  Rows rows(shapes.size());
  for (std::size_t r = 0; r < rows.size(); ++r) rows[r] = {shapes[r]};
  for (++line; header.size() < table.header.size(); line += 2 + std::ssize(rows)) {
    if (*line == "  (continued)") ++line;
    const Row part = fields_of(*line);
    ASSERT_GT(part.size(), 1U);
    ASSERT_EQ(part[0], "shown");
    header.insert(header.end(), part.begin() + 1, part.end());
    for (std::size_t r = 0; r < rows.size(); ++r) {
      const Row fields = fields_of(*(line + 2 + static_cast<std::ptrdiff_t>(r)));
      ASSERT_EQ(fields.size(), part.size());
      EXPECT_EQ(fields[0], shapes[r]);
      rows[r].insert(rows[r].end(), fields.begin() + 1, fields.end());
    }
  }
  EXPECT_EQ(header, table.header);
  EXPECT_EQ(rows, table.rows);
}

}  // namespace by_hand
}  // namespace
}  // namespace palpate::analysis
