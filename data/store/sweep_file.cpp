#include "data/store/sweep_file.h"

#include <SQLiteCpp/Column.h>
#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>
#include <SQLiteCpp/Transaction.h>
#include <fcntl.h>
#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "data/base/checksum.h"
#include "data/base/json_text.h"
#include "data/errors.h"
#include "data/files/atomic_folder.h"
#include "data/files/file_permissions.h"
#include "data/files/output_check.h"
#include "data/store/connection.h"
#include "data/store/open.h"
#include "data/store/seals.h"
#include "data/store/statement.h"
#include "data/store/store_error.h"
#include "data/store/writer_lock.h"
#include "data/sweep_record.h"

namespace palpate::data {
namespace {

/// Columns of a row before its seal.
int value_count(const SweepPlan& plan) {
  return 5 + static_cast<int>(plan.parameters.size() + figure_columns(plan).size());
}

/// The plan and seal needed to read the tables of a file.
struct SweepTables {
  SweepPlan plan;
  int version = 0;
  Checksum seal{};      ///< of the plan
  int value_count = 0;  ///< columns of a row before its seal
};

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

constexpr int kPlanValues = 12;  // before its seal

using Objects = std::map<std::string, std::string>;  // name -> SQL

constexpr int kSweepSealsSince = 2;  // version
constexpr const char* kSealColumn = ", seal BLOB NOT NULL CHECK (length(seal) = 32)";
constexpr const char* kSweepColumns =
    "CREATE TABLE sweep (protocol TEXT NOT NULL, files_sha256 TEXT NOT NULL, settings TEXT NOT "
    "NULL, "
    "space TEXT NOT NULL, design TEXT NOT NULL, points INTEGER NOT NULL CHECK (points >= 1), seed "
    "TEXT "
    "NOT NULL, participants INTEGER NOT NULL CHECK (participants >= 1), program_version TEXT NOT "
    "NULL, "
    "parameters TEXT NOT NULL, shapes TEXT NOT NULL, renderers TEXT NOT NULL";

/// A name as a column of SQL. \throws StoreRefused
std::string quoted(const std::string& name) {
  const bool plain = !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-';
  });
  if (!plain) throw StoreRefused("'" + name + "' cannot be the name of a column");
  return '"' + name + '"';
}

std::string end_of_table(int version) {
  return std::string(version < kSweepSealsSince ? "" : kSealColumn) + ") STRICT";
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
                     "; this version of palpate reads 1 to " + std::to_string(kSweepVersion) +
                     "; use the version that wrote it or a newer one");
}

[[noreturn]] void refuse_seal(const std::string& path, const std::string& row) {
  throw StoreRefused(path + ": " + row +
                     " does not match its checksum: the file is damaged or was changed; restore a "
                     "backup, or run the sweep again: the same plan gives the same results");
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
  put_values(values, row, kPlanValues);
  return values.seal({});
}

SweepTables tables_of(SQLite::Database& db, const std::string& path, int version) {
  SQLite::Statement find(db, "SELECT * FROM sweep");
  if (!find.executeStep()) throw SQLite::Exception("no plan", SQLITE_CORRUPT);
  SweepTables tables;
  tables.version = version;
  tables.seal = seal_of_plan(find);
  if (version >= kSweepSealsSince && stored_seal(find) != tables.seal)
    refuse_seal(path, "the plan");
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

/// Within a transaction, in an empty database: identity and version, table `sweep` with the plan in
/// its only row, table `points` with a column for each parameter and figure. \throws StoreRefused:
/// a name cannot be a column's
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
  // Seal the row as stored.
  SQLite::Statement find(db, "SELECT * FROM sweep");
  find.executeStep();
  SweepTables tables{plan, kSweepVersion, seal_of_plan(find), value_count(plan)};
  find.reset();
  SQLite::Statement seal(db, "UPDATE sweep SET seal = ?");
  Binder(seal) << tables.seal;
  seal.exec();
  return tables;
}

/// Computes the seal from the values of the current row of a SELECT *, of either version.
Checksum seal_of_row(SQLite::Statement& row, const SweepTables& tables) {
  SealedValues values;
  values.begin("point");
  put_values(values, row, tables.value_count);
  return values.seal(tables.seal);
}

/// Verifies the row's seal. \throws StoreRefused, naming the row
void require_sealed(SQLite::Statement& row, const SweepTables& tables, const std::string& path) {
  if (tables.version < kSweepSealsSince || stored_seal(row) == seal_of_row(row, tables)) return;
  refuse_seal(path, "point " + std::to_string(row.getColumn(0).getInt64()));
}

/// Checks version, integrity, tables (as made by create_sweep_tables) and all seals. \throws
/// StoreRefused; SQLite::Exception.
SweepTables read_sweep_tables(SQLite::Database& db, const std::string& path) {
  const int version = known_version(db, path);
  const auto refuse = [&](const char* why) {
    throw StoreRefused(path + ": " + why +
                       "; the file is damaged or was changed; run the sweep again");
  };
  const Objects found = objects_of_sweep(db);
  const auto table = found.find("sweep");
  if (table == found.end() || table->second != sweep_table(version))
    refuse("has no table of a sweep's plan");
  SweepTables tables = tables_of(db, path, version);
  const auto is_of_plan = [&] {
    return found ==
           Objects{{"sweep", sweep_table(version)}, {"points", points_table(tables.plan, version)}};
  };
  if (!is_of_plan()) {
    tables.plan.has_cells = false;
    tables.value_count = value_count(tables.plan);
    if (!is_of_plan()) refuse("has other tables than a sweep's file");
  }
  SQLite::Statement check(db, "PRAGMA quick_check");
  if (check.executeStep() && check.getColumn(0).getString() != "ok") {
    throw SQLite::Exception(check.getColumn(0).getString(), SQLITE_CORRUPT);
  }
  if (version < kSweepSealsSince) return tables;
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
  // Seal the row as stored: SQLite keeps neither NaN nor the sign of zero.
  Binder(find_) << row.point;
  find_.executeStep();
  const Checksum seal = seal_of_row(find_, tables_);
  find_.reset();
  Binder(seal_) << seal << row.point;
  seal_.exec();
  seal_.reset();
}

/// Reads and verifies the current row of a SELECT *.
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

/// Binds the columns of a row of either version, and its seal.
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

namespace fs = std::filesystem;

// Wait for a reader in another program, such as an export, instead of ending a sweep of hours;
// others wait for this writer likewise.
constexpr int kLongTimeoutMs = 60'000;
constexpr std::size_t kPageRows = 1000;  // rows read at a time

void sync_path(const std::string& path, const std::string& named) {
  const int opened = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool done = opened >= 0 && ::fsync(opened) == 0;
  const int error = errno;
  if (opened >= 0) ::close(opened);
  if (!done) throw StoreError(named + ": cannot be written: " + write_fault(error));
}

void make_empty_file(const std::string& file) {
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (descriptor < 0) {
    throw StoreError(file + ": cannot be created: " + std::generic_category().message(errno) +
                     "; check that the folder exists and that you may write there");
  }
  ::close(descriptor);
}

void require_fitting(const SweepPlan& plan, const SweepRow& row, const std::string& path) {
  if (row.point >= 1 && row.point <= plan.points && row.values.size() == plan.parameters.size() &&
      row.figures.size() == figure_columns(plan).size()) {
    return;
  }
  throw StoreRefused(path + ": point " + std::to_string(row.point) +
                     " does not fit the sweep's plan");
}

[[noreturn]] void refuse_other_plan(const std::string& path,
                                    const std::vector<std::string>& reasons) {
  std::string text = path + ": holds another sweep. Differences (that sweep, then this one):";
  for (const std::string& reason : reasons) text += "\n  " + reason;
  throw StoreRefused(text +
                     "\nName another file, or give the settings with which that sweep was begun");
}

}  // namespace

bool is_sweep_file(const std::string& path) {
  // https://www.sqlite.org/fileformat.html#the_database_header: big-endian, at offset 68.
  std::ifstream file(path, std::ios::binary);
  char header[72];
  if (!file.read(header, sizeof header)) return false;
  if (std::string(header, 15) != "SQLite format 3") return false;
  std::uint32_t id = 0;
  for (int i = 68; i < 72; ++i) id = (id << 8U) | static_cast<unsigned char>(header[i]);
  return id == kSweepApplicationId;
}

struct SweepFile::Impl {
  std::string path, file;          ///< as given, for messages; absolute, links resolved
  std::optional<WriterLock> lock;  // before db: released after the database is closed
  std::optional<SQLite::Database> db;
  FileIdentity identity;
  bool writes = false;
  SweepTables tables;

  void resolve(bool writing) {
    std::error_code error;
    file = fs::weakly_canonical(fs::absolute(path, error), error).string();
    if (path.empty() || error) throw StoreRefused("'" + path + "' is not a path of a sweep's file");
    if (writing) require_name(path);
    if (writing) {
      const ResolvedPath resolved = resolve_trusted_links(path);
      if (!resolved.fault.empty()) throw StoreRefused(path + ": " + resolved.fault);
      file = resolved.path;
    }
    const fs::file_status status = fs::status(file, error);
    if (fs::exists(status) && !fs::is_regular_file(status)) {
      throw StoreRefused(path + ": is not a file; name a file");
    }
    if (!writing && !fs::exists(status)) {
      throw StoreRefused(path + ": there is no such file (or its folder may not be read)");
    }
  }

  void keep_writers_away() {
    try {
      lock.emplace(file);
    } catch (const StoreRefused&) {
      throw;  // another process writes to it
    } catch (const StoreError&) {
      lock.reset();  // no write permission for its folder, so no writer of this user either
    }
  }

  void create(const SweepPlan& wanted) {
    if (belongs_to_database(file) || fs::exists(file + "-journal")) {
      throw StoreRefused(
          path + ": is the name of a file that belongs to another database, or its journal " +
          file + "-journal is left; name another file");
    }
    const AtomicFolder folder(file);
    SweepCopy(folder / "new.sweep", wanted).finish();
    if (::rename((folder / "new.sweep").c_str(), file.c_str()) != 0) {
      throw StoreError(path + ": cannot be created: " + std::generic_category().message(errno));
    }
  }

  void connect(bool writing) {
    writes = writing;
    if (!is_sweep_file(file)) {
      throw StoreRefused(path +
                         ": is not a sweep's file; 'palpate sweep' creates one. Analyse and export "
                         "a study's database with --db");
    }
    require_private_sqlite_files(file);
    const bool one_name = names_of_file(file) <= 1;
    if (fs::exists(file + "-journal")) require_one_name(file, path);
    guarded(path, [&] {
      // Opening the file rolls back the journal of a killed process.
      if (writes || (one_name && ::access(file.c_str(), W_OK) == 0)) {
        db.emplace(file, kOpenWrite, kLongTimeoutMs);
      } else if (fs::exists(file + "-journal")) {
        db.emplace(file, kOpenRead, kLongTimeoutMs);
      } else {
        db.emplace(immutable_uri(file), kOpenRead | SQLITE_OPEN_URI, kLongTimeoutMs);
      }
      db->exec("PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON");
      db->exec(writes ? "PRAGMA journal_mode = DELETE; PRAGMA synchronous = FULL"
                      : "PRAGMA query_only = ON");
      tables = read_sweep_tables(*db, path);
    });
    identity = identity_of(file);
  }

  void require_in_place() const {
    if (identity_of(file) == identity) return;
    throw StoreError(path +
                     ": the file was moved, replaced or deleted while in use; the latest points "
                     "are not safely stored");
  }
};

SweepFile::SweepFile(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SweepFile::SweepFile(SweepFile&&) noexcept = default;
SweepFile& SweepFile::operator=(SweepFile&&) noexcept = default;
SweepFile::~SweepFile() = default;

const std::string& SweepFile::path() const { return impl_->path; }
const SweepPlan& SweepFile::plan() const { return impl_->tables.plan; }

SweepFile SweepFile::open(const std::string& path, const SweepPlan& plan) {
  auto impl = std::make_unique<Impl>();
  impl->path = path;
  impl->resolve(true);
  impl->lock.emplace(impl->file);
  if (!fs::exists(impl->file)) impl->create(plan);
  impl->lock->lock_database();  // of a new file
  require_one_name(impl->file, path);
  impl->connect(true);
  const std::vector<std::string> reasons = differences(impl->tables.plan, plan);
  if (!reasons.empty()) refuse_other_plan(path, reasons);
  const bool sealed = impl->tables.version == kSweepVersion;
  SweepFile file(std::move(impl));
  if (!sealed) file.rewrite(true);
  return file;
}

SweepFile SweepFile::open(const std::string& path, Writers writers) {
  auto impl = std::make_unique<Impl>();
  impl->path = path;
  impl->resolve(false);
  if (writers == Writers::none) impl->keep_writers_away();
  impl->connect(false);
  return SweepFile(std::move(impl));
}

std::vector<bool> SweepFile::recorded() {
  return guarded(impl_->path, [&] {
    std::vector<bool> out(static_cast<std::size_t>(impl_->tables.plan.points), false);
    SQLite::Statement find(*impl_->db, "SELECT point FROM points");
    while (find.executeStep())
      out[static_cast<std::size_t>(find.getColumn(0).getInt64()) - 1] = true;
    return out;
  });
}

std::int64_t SweepFile::count() {
  return guarded(impl_->path,
                 [&] { return impl_->db->execAndGet("SELECT count(*) FROM points").getInt64(); });
}

std::int64_t SweepFile::failed() {
  return guarded(impl_->path, [&] {
    return impl_->db->execAndGet("SELECT count(*) FROM points WHERE status = 'failed'").getInt64();
  });
}

void SweepFile::for_each(const std::function<void(const SweepRow&)>& visit) {
  std::vector<SweepRow> rows;
  std::int64_t last = 0;
  do {
    rows.clear();
    guarded(impl_->path, [&] {
      SQLite::Statement find(*impl_->db,
                             "SELECT * FROM points WHERE point > ? ORDER BY point LIMIT ?");
      Binder(find) << last << static_cast<std::int64_t>(kPageRows);
      while (find.executeStep()) rows.push_back(read_sweep_row(find, impl_->tables, impl_->path));
    });
    for (const SweepRow& row : rows) visit(row);
    if (!rows.empty()) last = rows.back().point;
  } while (rows.size() == kPageRows);
}

void SweepFile::record(const std::vector<SweepRow>& rows) {
  if (!impl_->writes) throw StoreRefused(impl_->path + ": was opened for reading only");
  guarded(impl_->path, [&] {
    SQLite::Transaction transaction(*impl_->db, SQLite::TransactionBehavior::IMMEDIATE);
    SweepRowWriter writer(*impl_->db, impl_->tables);
    for (const SweepRow& row : rows) {
      require_fitting(impl_->tables.plan, row, impl_->path);
      writer.add(row);
    }
    transaction.commit();
  });
  impl_->require_in_place();
}

void SweepFile::finish() { rewrite(false); }

void SweepFile::rewrite(bool writing) {
  const AtomicFolder folder(impl_->file);
  const std::string ordered = folder / "ordered.sweep";
  SweepCopy copy(ordered, impl_->tables.plan);
  copy.add(*this);
  copy.finish();
  impl_->require_in_place();
  impl_->db.reset();
  if (::rename(ordered.c_str(), impl_->file.c_str()) != 0) {
    throw StoreError(impl_->path +
                     ": cannot be put in order: " + std::generic_category().message(errno));
  }
  sync_path(fs::path(impl_->file).parent_path().string(), impl_->path);
  impl_->lock->lock_database();  // of the file that replaced it
  impl_->connect(writing);
}

struct SweepCopy::Impl {
  std::string path;
  SweepPlan plan;
  SweepTables tables;
  std::optional<SQLite::Database> db;
  std::optional<SQLite::Transaction> transaction;
  std::int64_t last = 0;  ///< last point added
  bool in_order = true;

  void begin() {
    make_empty_file(path);
    guarded(path, [&] {
      db.emplace(path, kOpenWrite, kLongTimeoutMs);
      // A temporary file, deleted if anything fails: needs no journal. One transaction for all
      // sources: the header counts transactions.
      db->exec("PRAGMA page_size = 4096; PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF");
      transaction.emplace(*db);
      tables = create_sweep_tables(*db, plan);
    });
  }
};

SweepCopy::SweepCopy(const std::string& path, const SweepPlan& plan)
    : impl_(std::make_unique<Impl>()) {
  impl_->path = path;
  impl_->plan = plan;
  impl_->begin();
}
SweepCopy::~SweepCopy() = default;

void SweepCopy::add(SweepFile& from) {
  SQLite::Database& db = *impl_->db;
  guarded(from.path(), [&] {
    SQLite::Statement read(*from.impl_->db, "SELECT * FROM points ORDER BY point");
    SQLite::Statement insert(db, insert_sweep_row_sql(impl_->plan));
    SQLite::Statement find(db, "SELECT * FROM points WHERE point = ?");
    while (read.executeStep()) {
      require_sealed(read, from.impl_->tables, from.path());
      const Checksum seal = seal_of_row(read, impl_->tables);
      const std::int64_t point = read.getColumn(0).getInt64();
      if (point <= impl_->last) {
        find.reset();
        find.bind(1, point);
        if (find.executeStep()) {
          if (seal_of_row(find, impl_->tables) == seal) continue;
          throw StoreRefused(
              from.path() + ": point " + std::to_string(point) +
              " has other results than in an earlier file, with the same seeds; one of "
              "them is wrong");
        }
        impl_->in_order = false;
      }
      copy_row(read, seal, insert);
      insert.exec();
      insert.reset();
      impl_->last = std::max(impl_->last, point);
    }
  });
}

std::pair<std::int64_t, std::int64_t> SweepCopy::finish() {
  Impl& impl = *impl_;
  guarded(impl.path, [&] { impl.transaction->commit(); });
  impl.transaction.reset();
  if (!impl.in_order) {
    impl.db.reset();
    const std::string shuffled = impl.path + ".shuffled";
    fs::rename(impl.path, shuffled);
    {
      SweepFile source = SweepFile::open(shuffled);
      SweepCopy ordered(impl.path, impl.plan);
      ordered.add(source);
      ordered.finish();
    }
    fs::remove(shuffled);
    impl.db.emplace(impl.path, kOpenWrite, kLongTimeoutMs);
  }
  const std::pair<std::int64_t, std::int64_t> counts{
      impl.db->execAndGet("SELECT count(*) FROM points").getInt64(),
      impl.db->execAndGet("SELECT count(*) FROM points WHERE status = 'failed'").getInt64()};
  impl.db.reset();
  sync_path(impl.path, impl.path);
  return counts;
}

}  // namespace palpate::data
