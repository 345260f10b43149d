#include "data/store/statement.h"

#include <SQLiteCpp/Exception.h>
#include <sqlite3.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace palpate::data {
std::string RowReader::column_name() const {
  return columns_ != nullptr ? (*columns_)[static_cast<std::size_t>(index_)].getName()
                             : statement_->getColumnName(index_);
}

void RowReader::missing() const {
  throw SQLite::Exception(column_name() + " is missing", SQLITE_CORRUPT);
}

void RowReader::out_of_range(std::int64_t stored) const {
  throw SQLite::Exception(column_name() + " is out of range: " + std::to_string(stored),
                          SQLITE_CORRUPT);
}

std::vector<SQLite::Column> columns_of(SQLite::Statement& statement) {
  std::vector<SQLite::Column> columns;
  columns.reserve(static_cast<std::size_t>(statement.getColumnCount()));
  for (int i = 0; i < statement.getColumnCount(); ++i) columns.push_back(statement.getColumn(i));
  return columns;
}

}  // namespace palpate::data
