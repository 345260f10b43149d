#include "data/store/sweep_schema.h"

#include <sqlite3.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>

#include "data/base/json_text.h"
#include "data/errors.h"
#include "data/store/seals.h"
#include "data/store/statement_values.h"
#include "data/store/sweep_file.h"

namespace palpate::data {
namespace {

constexpr int kPlanColumns = 12;  // before its seal

using Objects = std::map<std::string, std::string>;  // name -> SQL

constexpr int kSealsSince = 2;  // version
constexpr const char* kSealColumn = ", seal BLOB NOT NULL CHECK (length(seal) = 32)";
constexpr const char* kSweepColumns =
    "CREATE TABLE sweep (protocol TEXT NOT NULL, files_sha256 TEXT NOT NULL, settings TEXT NOT "
    "NULL, "
    "space TEXT NOT NULL, design TEXT NOT NULL, points INTEGER NOT NULL CHECK (points >= 1), seed "
    "TEXT "
    "NOT NULL, participants INTEGER NOT NULL CHECK (participants >= 1), program_version TEXT NOT "
    "NULL, "
    "parameters TEXT NOT NULL, shapes TEXT NOT NULL, renderers TEXT NOT NULL";

/// As a column of SQL. \throws StoreRefused
std::string quoted(const std::string& name) {
  const bool plain = !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-';
  });
  if (!plain) throw StoreRefused("'" + name + "' cannot be the name of a column");
  return '"' + name + '"';
}

std::string end_of_table(int version) {
  return std::string(version < kSealsSince ? "" : kSealColumn) + ") STRICT";
}

std::string sweep_table(int version) { return kSweepColumns + end_of_table(version); }

std::string points_table(const SweepPlan& plan, int version) {
  std::string sql =
      "CREATE TABLE points (point INTEGER PRIMARY KEY CHECK (point BETWEEN 1 AND " +
      std::to_string(plan.points) +
      "), seed INTEGER NOT NULL, order_seed INTEGER NOT NULL, status TEXT NOT NULL CHECK (status "
      "IN "
      "('ok', 'failed')), reason TEXT NOT NULL CHECK ((reason = '') = (status = 'ok'))";
  for (const std::string& name : plan.parameters) sql += ", " + quoted(name) + " ANY NOT NULL";
  for (const std::string& name : figure_columns(plan)) sql += ", " + quoted(name) + " REAL";
  return sql + end_of_table(version);
}

Objects objects_of_sweep(SQLite::Database& db) {
  Objects out;
  SQLite::Statement find(db, "SELECT name, ifnull(sql, '') FROM sqlite_schema");
  while (find.executeStep()) out[find.getColumn(0).getString()] = find.getColumn(1).getString();
  return out;
}

int known_version(SQLite::Database& db, const std::string& path) {
  const int version = db.execAndGet("PRAGMA user_version").getInt();
  if (version >= 1 && version <= kSweepVersion) return version;
  throw StoreRefused(path + ": a sweep's file of version " + std::to_string(version) +
                     ", this palpate knows 1 to " + std::to_string(kSweepVersion) +
                     "; use the palpate that wrote it or a newer one");
}

[[noreturn]] void refuse_seal(const std::string& path, const std::string& row) {
  throw StoreRefused(path + ": " + row +
                     " does not match its checksum: the file is damaged or was changed; restore a "
                     "backup, or make it anew: of the same plan it comes out the same");
}

/// Columns of a row before its seal.
int value_count(const SweepPlan& plan) {
  return 5 + static_cast<int>(plan.parameters.size() + figure_columns(plan).size());
}

/// The values of a row, each with its type. \param count  of columns, from the first
void put_values(SealedValues& out, SQLite::Statement& row, int count) {
  for (int i = 0; i < count; ++i) {
    const SQLite::Column value = row.getColumn(i);
    switch (value.getType()) {
      case SQLITE_INTEGER:
        out << value.getInt64();
        break;
      case SQLITE_FLOAT:
        out << value.getDouble();
        break;
      case SQLITE_NULL:
        out << std::optional<double>();
        break;
      case SQLITE_BLOB:  // there is none before the seal
        out << std::optional<double>() << value.getString();
        break;
      default:
        out << value.getString();
    }
  }
}

Checksum stored_seal(SQLite::Statement& row) {
  Checksum seal{};
  const SQLite::Column stored = row.getColumn(row.getColumnCount() - 1);
  if (stored.getBytes() != static_cast<int>(seal.size())) return {};
  std::memcpy(seal.data(), stored.getBlob(), seal.size());
  return seal;
}

std::vector<std::string> names_of(const std::string& text) {
  const nlohmann::json list = json_or_discarded(text);
  std::vector<std::string> out;
  if (!list.is_array()) throw SQLite::Exception("the names of columns", SQLITE_CORRUPT);
  for (const nlohmann::json& name : list) {
    if (!name.is_string()) throw SQLite::Exception("the names of columns", SQLITE_CORRUPT);
    out.push_back(name.get<std::string>());
  }
  return out;
}

Checksum seal_of_plan(SQLite::Statement& row) {
  SealedValues values;
  values.begin("sweep");
  put_values(values, row, kPlanColumns);
  return values.seal({});
}

SweepTables tables_of(SQLite::Database& db, const std::string& path, int version) {
  SQLite::Statement find(db, "SELECT * FROM sweep");
  if (!find.executeStep()) throw SQLite::Exception("no plan", SQLITE_CORRUPT);
  SweepTables tables;
  tables.version = version;
  tables.seal = seal_of_plan(find);
  if (version >= kSealsSince && stored_seal(find) != tables.seal) refuse_seal(path, "the plan");
  SweepPlan& plan = tables.plan;
  std::string seed, parameters, shapes, renderers;
  RowReader(find) >> plan.protocol >> plan.files_sha256 >> plan.settings >> plan.space >>
      plan.design >> plan.points >> seed >> plan.participants >> plan.program_version >>
      parameters >> shapes >> renderers;
  if (find.executeStep()) throw SQLite::Exception("two plans", SQLITE_CORRUPT);
  char* end = nullptr;
  plan.seed = std::strtoull(seed.c_str(), &end, 10);
  plan.parameters = names_of(parameters);
  plan.shapes = names_of(shapes);
  plan.renderers = names_of(renderers);
  tables.value_count = value_count(plan);
  return tables;
}

}  // namespace

SweepTables create_sweep_tables(SQLite::Database& db, const SweepPlan& plan) {
  db.exec(sweep_table(kSweepVersion));
  db.exec(points_table(plan, kSweepVersion));
  db.exec("PRAGMA application_id = " + std::to_string(kSweepApplicationId));
  db.exec("PRAGMA user_version = " + std::to_string(kSweepVersion));
  SQLite::Statement insert(
      db, "INSERT INTO sweep VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, zeroblob(32))");
  Binder(insert) << plan.protocol << plan.files_sha256 << plan.settings << plan.space << plan.design
                 << plan.points << std::to_string(plan.seed) << plan.participants
                 << plan.program_version << nlohmann::json(plan.parameters).dump()
                 << nlohmann::json(plan.shapes).dump() << nlohmann::json(plan.renderers).dump();
  insert.exec();
  // Sealed as it was stored.
  SQLite::Statement find(db, "SELECT * FROM sweep");
  find.executeStep();
  const SweepTables tables{plan, kSweepVersion, seal_of_plan(find), value_count(plan)};
  find.reset();
  SQLite::Statement seal(db, "UPDATE sweep SET seal = ?");
  Binder(seal) << tables.seal;
  seal.exec();
  return tables;
}

SweepTables read_sweep_tables(SQLite::Database& db, const std::string& path) {
  const int version = known_version(db, path);
  const auto refuse = [&](const char* why) {
    throw StoreRefused(path + ": " + why + "; the file is damaged or was changed, make it anew");
  };
  const Objects found = objects_of_sweep(db);
  const auto table = found.find("sweep");
  if (table == found.end() || table->second != sweep_table(version))
    refuse("has no table of a sweep's plan");
  SweepTables tables = tables_of(db, path, version);
  const Objects expected{{"sweep", sweep_table(version)},
                         {"points", points_table(tables.plan, version)}};
  if (found != expected) refuse("has other tables than a sweep's file");
  SQLite::Statement check(db, "PRAGMA quick_check");
  if (check.executeStep() && check.getColumn(0).getString() != "ok") {
    throw SQLite::Exception(check.getColumn(0).getString(), SQLITE_CORRUPT);
  }
  if (version < kSealsSince) return tables;
  SQLite::Statement row(db, "SELECT * FROM points");
  while (row.executeStep()) require_sealed(row, tables, path);
  return tables;
}

std::string insert_sweep_row_sql(const SweepPlan& plan) {
  std::string sql = "INSERT INTO points VALUES (?";
  for (int i = value_count(plan); i > 1; --i) sql += ", ?";
  return sql + ", ?)";
}

SweepRowWriter::SweepRowWriter(SQLite::Database& db, const SweepTables& tables)
    : tables_(tables),
      insert_(db, insert_sweep_row_sql(tables.plan)),
      find_(db, "SELECT * FROM points WHERE point = ?"),
      seal_(db, "UPDATE points SET seal = ? WHERE point = ?") {}

void SweepRowWriter::add(const SweepRow& row) {
  Binder bind(insert_);
  bind << row.point << row.seed << row.order_seed << (row.reason.empty() ? "ok" : "failed")
       << row.reason;
  for (const SweepValue& value : row.values) {
    if (const auto* const number = std::get_if<double>(&value)) {
      bind << *number;
    } else {
      bind << std::get<std::string>(value);
    }
  }
  for (const std::optional<double>& figure : row.figures) bind << figure;
  bind << Checksum{};
  insert_.exec();
  insert_.reset();
  // Sealed as it was stored: SQLite keeps no NaN, and no sign of a zero.
  Binder(find_) << row.point;
  find_.executeStep();
  const Checksum seal = seal_of_row(find_, tables_);
  find_.reset();
  Binder(seal_) << seal << row.point;
  seal_.exec();
  seal_.reset();
}

Checksum seal_of_row(SQLite::Statement& row, const SweepTables& tables) {
  SealedValues values;
  values.begin("point");
  put_values(values, row, tables.value_count);
  return values.seal(tables.seal);
}

void require_sealed(SQLite::Statement& row, const SweepTables& tables, const std::string& path) {
  if (tables.version < kSealsSince || stored_seal(row) == seal_of_row(row, tables)) return;
  refuse_seal(path, "point " + std::to_string(row.getColumn(0).getInt64()));
}

SweepRow read_sweep_row(SQLite::Statement& row, const SweepTables& tables,
                        const std::string& path) {
  require_sealed(row, tables, path);
  SweepRow out;
  std::string status;
  RowReader(row) >> out.point >> out.seed >> out.order_seed >> status >> out.reason;
  int column = 5;
  for (std::size_t i = 0; i < tables.plan.parameters.size(); ++i) {
    const SQLite::Column value = row.getColumn(column++);
    if (value.isText()) {
      out.values.emplace_back(value.getString());
    } else {
      out.values.emplace_back(value.getDouble());
    }
  }
  const int columns = tables.value_count;
  while (column < columns) {
    const SQLite::Column figure = row.getColumn(column++);
    if (figure.isNull()) {
      out.figures.emplace_back();
    } else {
      out.figures.emplace_back(figure.getDouble());
    }
  }
  return out;
}

void copy_row(SQLite::Statement& row, const Checksum& seal, SQLite::Statement& insert) {
  const int values = insert.getBindParameterCount() - 1;
  for (int i = 0; i < values; ++i) {
    const SQLite::Column value = row.getColumn(i);
    switch (value.getType()) {
      case SQLITE_INTEGER:
        insert.bind(i + 1, value.getInt64());
        break;
      case SQLITE_FLOAT:
        insert.bind(i + 1, value.getDouble());
        break;
      case SQLITE_NULL:
        insert.bind(i + 1);
        break;
      default:
        insert.bind(i + 1, value.getString());
    }
  }
  insert.bind(values + 1, seal.data(), static_cast<int>(seal.size()));
}

}  // namespace palpate::data
