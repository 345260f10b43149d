#pragma once
// A strict reader of RFC 4180, and a session to export.

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "data/export/csv.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data::testing {

using Rows = std::vector<std::vector<std::string>>;

/// Strict RFC 4180: any deviation fails the test.
inline Rows parse_rfc4180(const std::string& text) {
  Rows rows(1);
  rows.back().emplace_back();
  std::size_t i = 0;
  while (i < text.size()) {
    std::string& field = rows.back().back();
    if (text[i] == '"' && field.empty()) {
      for (++i;; ++i) {
        if (i >= text.size()) {
          ADD_FAILURE() << "unclosed quote";
          return rows;
        }
        if (text[i] == '"') {
          if (i + 1 >= text.size() || text[i + 1] != '"') break;
          ++i;
        }
        field += text[i];
      }
      ++i;
    }
    while (i < text.size() && text[i] != ',' && text[i] != '\r') {
      EXPECT_TRUE(text[i] != '"' && text[i] != '\n') << "at " << i;
      field += text[i++];
    }
    if (i >= text.size()) break;
    if (text[i++] == ',') {
      rows.back().emplace_back();
    } else {
      EXPECT_EQ(text.at(i++), '\n');
      rows.emplace_back().emplace_back();
    }
  }
  EXPECT_EQ(rows.back(), std::vector<std::string>{""}) << "the last line has its end";
  rows.pop_back();
  return rows;
}

/// Column name -> value of one row.
inline std::map<std::string, std::string> by_name(const Rows& rows, std::size_t row) {
  std::map<std::string, std::string> values;
  EXPECT_EQ(rows.at(row).size(), rows.at(0).size());
  for (std::size_t i = 0; i < rows[0].size(); ++i) values[rows[0][i]] = rows[row].at(i);
  return values;
}

class ExportCsv : public ::testing::Test {
 protected:
  void show(const TrialRecord& record) {
    store_.begin_attempt(run_, record, record.onset_ns);
    store_.finish_attempt(run_, record);
  }
  Rows rows() { return parse_rfc4180(contents_of(out_)); }
  std::ptrdiff_t files() const {
    return std::distance(std::filesystem::directory_iterator(out_folder_.path()),
                         std::filesystem::directory_iterator());
  }
  const TemporaryFolder folder_, out_folder_;
  Store store_ = Store::open(folder_ / "study.db", Store::Mode::write_or_create);
  const Participant person_ = store_.enrol(a_protocol(), "P1", 4);
  const palpate::data::Run run_ = store_.begin_run(person_, a_run());
  const std::string out_ = out_folder_ / "trials.csv";
};

}  // namespace palpate::data::testing
