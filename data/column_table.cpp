#include "data/column_table.h"

#include <stdexcept>
#include <utility>

namespace palpate::data {

ColumnTable::ColumnTable(const std::vector<std::string>& names) {
  for (const std::string& name : names) columns_.push_back({name, {}});
}

template <class T>
ColumnTable& ColumnTable::append(T value) {
  if (next_ == columns_.size()) throw std::logic_error("more values than columns");
  Column& column = columns_[next_++];
  if (rows_ == 0) column.cells = std::vector<T>();
  auto* const cells = std::get_if<std::vector<T>>(&column.cells);
  if (cells == nullptr)
    throw std::logic_error("column " + column.name + " has values of another type");
  cells->push_back(std::move(value));
  return *this;
}

template ColumnTable& ColumnTable::append(double);
template ColumnTable& ColumnTable::append(std::int64_t);
template ColumnTable& ColumnTable::append(std::uint8_t);
template ColumnTable& ColumnTable::append(std::string);

void ColumnTable::end_row() {
  if (next_ != columns_.size()) throw std::logic_error("a row with too few values");
  next_ = 0;
  ++rows_;
}

}  // namespace palpate::data
