#pragma once
// Internal to data/store: tables and rows of a sweep's file.

#include <SQLiteCpp/Column.h>
#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>

#include <string>
#include <vector>

#include "data/sweep_record.h"

namespace palpate::data {

/// Within a transaction, in an empty database: identity and version, table `sweep` with the plan in
/// its only row, table `points` with a column for each parameter and figure. \throws StoreRefused:
/// a name that is no column's
void create_sweep_tables(SQLite::Database& db, const SweepPlan& plan);

/// Checks version, integrity, and that the tables are those that create_sweep_tables makes.
/// \throws StoreRefused; SQLite::Exception.
SweepPlan read_sweep_plan(SQLite::Database& db, const std::string& path);

std::string insert_sweep_row_sql(const SweepPlan& plan);
void bind_sweep_row(SQLite::Statement& insert, const SweepRow& row);
/// From SELECT *.
SweepRow read_sweep_row(SQLite::Statement& row, const SweepPlan& plan);
/// Binds what stands in the columns. \param row  columns_of() the statement
void copy_row(const std::vector<SQLite::Column>& row, SQLite::Statement& insert);
/// Whether the rows that two statements stand at are the same to the bit.
bool same_row(SQLite::Statement& a, SQLite::Statement& b);

}  // namespace palpate::data
