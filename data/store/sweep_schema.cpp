#include "data/store/sweep_schema.h"

#include <sqlite3.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>

#include "data/base/json_text.h"
#include "data/errors.h"
#include "data/store/statement_values.h"
#include "data/store/sweep_file.h"

namespace palpate::data {
namespace {

using Objects = std::map<std::string, std::string>;  // name -> SQL

constexpr const char* kSweepTable =
    "CREATE TABLE sweep (protocol TEXT NOT NULL, files_sha256 TEXT NOT NULL, settings TEXT NOT "
    "NULL, "
    "space TEXT NOT NULL, design TEXT NOT NULL, points INTEGER NOT NULL CHECK (points >= 1), seed "
    "TEXT "
    "NOT NULL, participants INTEGER NOT NULL CHECK (participants >= 1), program_version TEXT NOT "
    "NULL, "
    "parameters TEXT NOT NULL, shapes TEXT NOT NULL, renderers TEXT NOT NULL) STRICT";

/// As a column of SQL. \throws StoreRefused
std::string quoted(const std::string& name) {
  const bool plain = !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-';
  });
  if (!plain) throw StoreRefused("'" + name + "' cannot be the name of a column");
  return '"' + name + '"';
}

std::string points_table(const SweepPlan& plan) {
  std::string sql =
      "CREATE TABLE points (point INTEGER PRIMARY KEY CHECK (point BETWEEN 1 AND " +
      std::to_string(plan.points) +
      "), seed INTEGER NOT NULL, order_seed INTEGER NOT NULL, status TEXT NOT NULL CHECK (status "
      "IN "
      "('ok', 'failed')), reason TEXT NOT NULL CHECK ((reason = '') = (status = 'ok'))";
  for (const std::string& name : plan.parameters) sql += ", " + quoted(name) + " ANY NOT NULL";
  for (const std::string& name : figure_columns(plan)) sql += ", " + quoted(name) + " REAL";
  return sql + ") STRICT";
}

Objects objects_of_sweep(SQLite::Database& db) {
  Objects out;
  SQLite::Statement find(db, "SELECT name, ifnull(sql, '') FROM sqlite_schema");
  while (find.executeStep()) out[find.getColumn(0).getString()] = find.getColumn(1).getString();
  return out;
}

void require_version(SQLite::Database& db, const std::string& path) {
  const int version = db.execAndGet("PRAGMA user_version").getInt();
  if (version == kSweepVersion) return;
  throw StoreRefused(path + ": a sweep's file of version " + std::to_string(version) +
                     ", this palpate knows " + std::to_string(kSweepVersion) +
                     "; use the palpate that wrote it or a newer one");
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

SweepPlan plan_of(SQLite::Database& db) {
  SQLite::Statement find(db, "SELECT * FROM sweep");
  if (!find.executeStep()) throw SQLite::Exception("no plan", SQLITE_CORRUPT);
  SweepPlan plan;
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
  return plan;
}

}  // namespace

void create_sweep_tables(SQLite::Database& db, const SweepPlan& plan) {
  db.exec(kSweepTable);
  db.exec(points_table(plan));
  db.exec("PRAGMA application_id = " + std::to_string(kSweepApplicationId));
  db.exec("PRAGMA user_version = " + std::to_string(kSweepVersion));
  SQLite::Statement insert(db, "INSERT INTO sweep VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  Binder(insert) << plan.protocol << plan.files_sha256 << plan.settings << plan.space << plan.design
                 << plan.points << std::to_string(plan.seed) << plan.participants
                 << plan.program_version << nlohmann::json(plan.parameters).dump()
                 << nlohmann::json(plan.shapes).dump() << nlohmann::json(plan.renderers).dump();
  insert.exec();
}

SweepPlan read_sweep_plan(SQLite::Database& db, const std::string& path) {
  require_version(db, path);
  const auto refuse = [&](const char* why) {
    throw StoreRefused(path + ": " + why + "; the file is damaged or was changed, make it anew");
  };
  const Objects found = objects_of_sweep(db);
  const auto table = found.find("sweep");
  if (table == found.end() || table->second != kSweepTable)
    refuse("has no table of a sweep's plan");
  const SweepPlan plan = plan_of(db);
  const Objects expected{{"sweep", kSweepTable}, {"points", points_table(plan)}};
  if (found != expected) refuse("has other tables than a sweep's file");
  SQLite::Statement check(db, "PRAGMA quick_check");
  if (check.executeStep() && check.getColumn(0).getString() != "ok") {
    throw SQLite::Exception(check.getColumn(0).getString(), SQLITE_CORRUPT);
  }
  return plan;
}

std::string insert_sweep_row_sql(const SweepPlan& plan) {
  const std::size_t columns = 5 + plan.parameters.size() + figure_columns(plan).size();
  std::string sql = "INSERT INTO points VALUES (?";
  for (std::size_t i = 1; i < columns; ++i) sql += ", ?";
  return sql + ")";
}

void bind_sweep_row(SQLite::Statement& insert, const SweepRow& row) {
  Binder bind(insert);
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
}

SweepRow read_sweep_row(SQLite::Statement& row, const SweepPlan& plan) {
  SweepRow out;
  std::string status;
  RowReader(row) >> out.point >> out.seed >> out.order_seed >> status >> out.reason;
  int column = 5;
  for (std::size_t i = 0; i < plan.parameters.size(); ++i) {
    const SQLite::Column value = row.getColumn(column++);
    if (value.isText()) {
      out.values.emplace_back(value.getString());
    } else {
      out.values.emplace_back(value.getDouble());
    }
  }
  const int columns = row.getColumnCount();
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

void copy_row(const std::vector<SQLite::Column>& row, SQLite::Statement& insert) {
  int index = 0;
  for (const SQLite::Column& value : row) {
    ++index;
    switch (value.getType()) {
      case SQLITE_INTEGER:
        insert.bind(index, value.getInt64());
        break;
      case SQLITE_FLOAT:
        insert.bind(index, value.getDouble());
        break;
      case SQLITE_NULL:
        insert.bind(index);
        break;
      default:
        insert.bind(index, value.getString());
    }
  }
}

bool same_row(SQLite::Statement& a, SQLite::Statement& b) {
  if (a.getColumnCount() != b.getColumnCount()) return false;
  for (int i = 0; i < a.getColumnCount(); ++i) {
    const SQLite::Column one = a.getColumn(i), two = b.getColumn(i);
    if (one.getType() != two.getType()) return false;
    if (one.isFloat()) {
      const double x = one.getDouble(), y = two.getDouble();
      if (std::memcmp(&x, &y, sizeof x) != 0) return false;
    } else if (one.getString() != two.getString()) {
      return false;
    }
  }
  return true;
}

}  // namespace palpate::data
