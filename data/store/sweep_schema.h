#pragma once
// Internal to data/store: tables and rows of a sweep's file.

#include <SQLiteCpp/Column.h>
#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>

#include <string>
#include <vector>

#include "data/files/checksum.h"
#include "data/sweep_record.h"

namespace palpate::data {

/// What the tables of a file are read with.
struct SweepTables {
  SweepPlan plan;
  int version = 0;
  Checksum seal{};      ///< of the plan
  int value_count = 0;  ///< columns of a row before its seal
};

/// Within a transaction, in an empty database: identity and version, table `sweep` with the plan in
/// its only row, table `points` with a column for each parameter and figure. \throws StoreRefused:
/// a name that is no column's
SweepTables create_sweep_tables(SQLite::Database& db, const SweepPlan& plan);

/// Checks version, integrity, that the tables are those that create_sweep_tables makes, and all
/// seals. \throws StoreRefused; SQLite::Exception.
SweepTables read_sweep_tables(SQLite::Database& db, const std::string& path);

/// Adds rows to a file of the current version.
class SweepRowWriter {
 public:
  SweepRowWriter(SQLite::Database& db, const SweepTables& tables);
  /// \throws SQLite::Exception: the point is on record
  void add(const SweepRow& row);

 private:
  const SweepTables& tables_;
  SQLite::Statement insert_, find_, seal_;
};

/// Of the row of either version that a SELECT * stands at; computed from its values.
Checksum seal_of_row(SQLite::Statement& row, const SweepTables& tables);
/// Verifies the row's seal. \throws StoreRefused, naming the row
void require_sealed(SQLite::Statement& row, const SweepTables& tables, const std::string& path);
/// From SELECT *; verified.
SweepRow read_sweep_row(SQLite::Statement& row, const SweepTables& tables, const std::string& path);

std::string insert_sweep_row_sql(const SweepPlan& plan);
/// Binds what stands in the columns of a row of either version, and its seal.
void copy_row(SQLite::Statement& row, const Checksum& seal, SQLite::Statement& insert);

}  // namespace palpate::data
