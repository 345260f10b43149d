#include "data/column_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <stdexcept>

namespace palpate::data {
namespace {

TEST(ColumnTable, KeepsTypesOfColumnsAndMarksMissingValues) {
  ColumnTable table({"name", "count", "yes", "time"});
  table << "a" << 3 << true << std::optional<double>(0.5);
  table.end_row();
  table << std::string() << std::uint64_t{4} << false << std::optional<double>();
  table.end_row();
  ASSERT_EQ(table.rows(), 2U);
  const auto& columns = table.columns();
  EXPECT_EQ(columns[0].name, "name");
  EXPECT_EQ(std::get<std::vector<std::string>>(columns[0].cells),
            (std::vector<std::string>{"a", ""}));
  EXPECT_EQ(std::get<std::vector<std::int64_t>>(columns[1].cells),
            (std::vector<std::int64_t>{3, 4}));
  EXPECT_EQ(std::get<std::vector<std::uint8_t>>(columns[2].cells),
            (std::vector<std::uint8_t>{1, 0}));
  const auto& times = std::get<std::vector<double>>(columns[3].cells);
  EXPECT_EQ(times[0], 0.5);
  EXPECT_TRUE(std::isnan(times[1]));
}

TEST(ColumnTable, RefusesIncompleteAndMixedRows) {
  ColumnTable table({"a", "b"});
  table << 1.0;
  EXPECT_THROW(table.end_row(), std::logic_error);
  table << 2;
  EXPECT_THROW(table << 3, std::logic_error);
  table.end_row();
  EXPECT_THROW(table << "a text among numbers", std::logic_error);
}

}  // namespace
}  // namespace palpate::data
