#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "data/export/dataset_description.h"
#include "data/export/exported_columns.h"
#include "tests/data/export/csv_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;

TEST_F(ExportCsv, TheCodebookDescribesEveryColumnAndBit) {
  TrialRecord record = a_record(1);
  record.shape = record.response = "-cube";
  show(record);
  ExportSettings settings;
  settings.codebook = out_folder_ / "codebook.csv";
  settings.fault_bits = {{16, "force-limited: ..."}, {2048, "old-reading: ..."}};
  settings.facts = [](const ProtocolInfo&) {
    return ProtocolFacts{.stimuli = {{"-cube", "{}"}, {"cone", "{}"}}};
  };
  export_csv(store_, out_, settings);
  const Rows book = parse_rfc4180(contents_of(settings.codebook));
  EXPECT_EQ(book[0], (std::vector<std::string>{"table", "column", "unit", "value", "meaning"}));
  std::vector<std::string> described;
  std::map<std::string, std::string> bits, shapes;
  for (std::size_t i = 1; i < book.size(); ++i) {
    const auto row = by_name(book, i);
    EXPECT_NE(row.at("meaning"), "");
    if (row.at("table") != "trials") continue;
    if (row.at("value").empty()) described.push_back(row.at("column"));
    if (row.at("column") == "faults") bits[row.at("value")] = row.at("meaning");
    if (row.at("column") == "shape") shapes[row.at("value")] = row.at("meaning");
  }
  EXPECT_EQ(described, rows()[0]);
  std::map<std::pair<std::string, std::string>, std::string> column_of;
  for (std::size_t i = 1; i < book.size(); ++i) {
    const auto row = by_name(book, i);
    if (!row.at("value").empty()) continue;
    const auto [other, fresh] =
        column_of.emplace(std::pair(row.at("table"), row.at("meaning")), row.at("column"));
    EXPECT_TRUE(fresh) << row.at("column") << " is described as " << other->second << " is";
  }
  EXPECT_EQ(bits.at("16"), "force-limited: ...");
  EXPECT_EQ(bits.at("2048"), "old-reading: ...");
  EXPECT_TRUE(shapes.contains("'-cube")) << "as it stands in the table";
  EXPECT_EQ(by_name(rows(), 1).at("shape"), "'-cube");
}

TEST(SampleColumns, HaveOneUnitForAQuantitysCoordinates) {
  std::map<std::string, std::string> unit_of;
  for (const Column& column : sample_columns()) {
    const std::string name = column.name;
    if (name.size() < 3 || name[name.size() - 2] != '_' || name.back() < 'x') continue;
    const auto [unit, first] = unit_of.emplace(name.substr(0, name.size() - 2), column.unit);
    EXPECT_EQ(unit->second, column.unit) << name;
  }
  const std::map<std::string, std::string> expected{{"tip", "m"},     {"tail", "m"},
                                                    {"force", "N"},   {"torque", "N m"},
                                                    {"device1", "N"}, {"device2", "N"}};
  EXPECT_EQ(unit_of, expected);
}

TEST_F(ExportCsv, TheCodebookOverwritesNoOtherFile) {
  show(a_record(1));
  ExportSettings settings;
  for (const std::string& taken :
       {out_, out_folder_ / "attempts.csv", folder_ / "study.db", out_folder_.path()}) {
    settings.codebook = taken;
    EXPECT_THROW(export_csv(store_, out_, settings), StoreRefused) << taken;
  }
  settings.codebook = out_folder_ / "mine.csv";
  write_file(settings.codebook, "mine");
  EXPECT_THROW(export_csv(store_, out_, settings), StoreRefused);
  EXPECT_EQ(contents_of(settings.codebook), "mine");
  EXPECT_EQ(files(), 1) << "nothing else was written";
}

}  // namespace
}  // namespace palpate::data
