// A database's record on the report page: servo, devices, builds, seeds, protocols.

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/report/report.h"
#include "analysis/statistics/analysis.h"

namespace palpate::analysis {
namespace {
namespace report_page {

Analysis small_analysis() {
  TrialTableBuilder builder;
  for (const char* participant : {"A", "B", "C"}) {
    int trial = 0;
    for (const char* renderer : {"point", "ray"}) {
      for (const char* shape : {"cone", "cube"}) {
        StudyTrial raw;
        raw.participant = participant;
        raw.renderer = renderer;
        raw.shape = raw.response = shape;
        raw.correct = true;
        raw.trial = ++trial;
        raw.response_time = 1 + 0.3 * ((trial * 7 + participant[0]) % 5);
        builder.add(raw);
      }
    }
  }
  Provenance provenance;
  provenance.source = "study.db";
  provenance.protocol_name = "shapes";
  provenance.protocol_sha256 = {"aa11", "bb22"};
  provenance.observer_sha256 = "cc33";
  provenance.program_versions = {"0.9", "1.0"};
  return analyze(builder.finish(std::move(provenance)), {}, "1.1");
}

/// Cells of the rows of the table with this caption, its header first.
std::vector<std::vector<std::string>> table_of(const std::string& page,
                                               const std::string& caption) {
  std::vector<std::vector<std::string>> rows;
  const std::size_t begin = page.find("<caption>" + caption + "</caption>");
  if (begin == std::string::npos) return rows;
  const std::string table = page.substr(begin, page.find("</table>", begin) - begin);
  for (std::size_t at = 0; (at = table.find("<tr>", at)) != std::string::npos; ++at) {
    const std::string row = table.substr(at, table.find("</tr>", at) - at);
    std::vector<std::string>& cells = rows.emplace_back();
    for (std::size_t cell = 4; (cell = row.find("<t", cell)) != std::string::npos; ++cell) {
      const std::size_t from = row.find('>', cell) + 1;
      cells.push_back(row.substr(from, row.find('<', from) - from));
    }
  }
  return rows;
}

using Cells = std::vector<std::string>;

TEST(ReportPage, SaysWhereTheDataAreFrom) {
  StudyRecord record;
  record.devices = {"falcon", "mouse"};
  record.response_devices = {"keyboard"};
  record.builds = {"Release gcc 12"};
  record.protocols = {{"shapes", "aa11", "{\r\n\t\"seed\": 7 <b>\n}", "", "7"},
                      {"shapes", "bb22", "{}", "Shapes by touch", ""}};
  record.seeds = {"A: 11", "B: 12"};
  const Analysis analysis = small_analysis();
  const std::string page = report_html(analysis, record);
  EXPECT_EQ(table_of(page, "Provenance"),
            (std::vector<Cells>{{"what", "value"},
                                {"source", "study.db"},
                                {"participants", "3 participants"},
                                {"protocol", "shapes"},
                                {"protocol SHA-256", "aa11"},
                                {"protocol SHA-256", "bb22"},
                                {"observer SHA-256", "cc33"},
                                {"recorded with palpate", "0.9"},
                                {"recorded with palpate", "1.0"},
                                {"analysed with palpate", "1.1"},
                                {"device", "falcon"},
                                {"device", "mouse"},
                                {"response device", "keyboard"},
                                {"recorded with build", "Release gcc 12"},
                                {"protocol seed", "7"},
                                {"bootstrap seed", std::to_string(analysis.settings.seed)}}));
  EXPECT_NE(page.find("Seeds of the simulated participants"), std::string::npos);
  EXPECT_NE(page.find("A: 11 and B: 12</p>"), std::string::npos);
  EXPECT_NE(page.find("Protocol “shapes” as it was used"), std::string::npos);
  EXPECT_NE(page.find(">{\n &quot;seed&quot;: 7 &lt;b&gt;\n}\n</pre>"), std::string::npos)
      << "line by line, without carriage returns and tabulators";
  EXPECT_NE(page.find("Shapes by touch"), std::string::npos) << "the first title there is";
}

TEST(ReportPage, WithoutARecordNothingOfItIsShown) {
  const std::string page = report_html(small_analysis(), {});
  for (const char* absent : {"Seeds of the", "as it was used", "recorded with build",
                             "protocol seed", "response device", "Servo, by renderer"}) {
    EXPECT_EQ(page.find(absent), std::string::npos) << absent;
  }
}

TEST(ReportPage, CutsLongListsOfSeeds) {
  StudyRecord record;
  for (int i = 0; i < 500; ++i) record.seeds.push_back("seed" + std::to_string(i));
  EXPECT_NE(report_html(small_analysis(), record).find("seed499</p>"), std::string::npos);
  record.seeds.emplace_back("seed500");
  const std::string page = report_html(small_analysis(), record);
  EXPECT_NE(page.find("seed499 …</p>"), std::string::npos);
  EXPECT_EQ(page.find("seed500"), std::string::npos);
}

TEST(ReportPage, ServoTableHasEachNumberUnderItsName) {
  StudyRecord record;
  ServoQuality& servo = record.servo.emplace_back();
  servo.renderer = "point";
  servo.n_trials = 40;
  servo.n_with_missed = 2;
  servo.n_with_faults = 3;
  servo.n_started_inside = 4;
  servo.ticks = 9990;
  servo.missed_ticks = 10;
  servo.longest_period = 0.0021;
  servo.max_force = 3.456;
  ServoQuality& silent = record.servo.emplace_back();
  silent.renderer = "ray";
  record.n_cut_off = 1;
  const std::string page = report_html(small_analysis(), record);
  const auto rows = table_of(page, "Servo, by renderer");
  ASSERT_EQ(rows.size(), 3U);
  const auto value = [&](std::size_t row, const std::string& name) {
    for (std::size_t i = 0; i < rows[0].size(); ++i) {
      if (rows[0][i] == name) return rows[row].at(i);
    }
    return "no column " + name;
  };
  const std::map<std::string, std::pair<std::string, std::string>> expected{
      {"renderer", {"point", "ray"}},
      {"trials", {"40", "0"}},
      {"ticks", {"9990", "0"}},
      {"missed", {"10", "0"}},
      {"of ticks", {"0.1000 %", "0.0000 %"}},  // 10 of 10000 periods
      {"trials with missed", {"2", "0"}},
      {"longest period", {"2.100 ms", "0.000 ms"}},
      {"with fault", {"3", "0"}},
      {"started inside", {"4", "0"}},
      {"largest force", {"3.46 N", "0.00 N"}}};
  EXPECT_EQ(rows[0].size(), expected.size());
  for (const auto& [name, values] : expected) {
    EXPECT_EQ(value(1, name), values.first) << name;
    EXPECT_EQ(value(2, name), values.second) << name;
  }
  EXPECT_NE(page.find("1 attempt was interrupted and repeated."), std::string::npos);
}

TEST(ReportPage, LinksSectionsInTheOrderOfThePage) {
  const std::string page = report_html(small_analysis(), {});
  std::size_t link = 0, section = 0;
  for (const char* id : {"figure15", "speedup", "times", "confusion", "speed-accuracy", "learning",
                         "order", "servo", "exclusions", "tests", "source"}) {
    link = page.find("<a href=\"#" + std::string(id) + "\">", link);
    section = page.find("<section id=\"" + std::string(id) + "\"", section);
    ASSERT_NE(link, std::string::npos) << id;
    ASSERT_NE(section, std::string::npos) << id;
    EXPECT_NE(page[page.find('>', link) + 1], '<') << id << " has a name";
  }
}

TEST(ReportPage, CutsLongListsOfWarnings) {
  Analysis analysis = small_analysis();
  analysis.warnings.assign(100, "look here");
  EXPECT_EQ(report_html(analysis, {}).find(" more</li>"), std::string::npos);
  analysis.warnings.assign(103, "look here");
  EXPECT_NE(report_html(analysis, {}).find("<li>and 3 more</li>"), std::string::npos);
  analysis.warnings.clear();
  EXPECT_EQ(report_html(analysis, {}).find("class=\"warnings\""), std::string::npos);
}

}  // namespace report_page
}  // namespace
}  // namespace palpate::analysis
