#include "data/store/sweep_file.h"

#include <SQLiteCpp/Transaction.h>
#include <fcntl.h>
#include <sqlite3.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <system_error>

#include "data/files/atomic_folder.h"
#include "data/files/file_identity.h"
#include "data/files/file_permissions.h"
#include "data/files/output_check.h"
#include "data/files/trusted_links.h"
#include "data/store/integrity_checks.h"
#include "data/store/lock.h"
#include "data/store/sqlite_errors.h"
#include "data/store/statement_values.h"
#include "data/store/sweep_schema.h"

namespace palpate::data {
namespace {

namespace fs = std::filesystem;

// A reader in another program, such as an export, does not end a sweep of hours; nor does a writer
// that waits for that reader end others.
constexpr int kBusyTimeoutMs = 60'000;
constexpr std::size_t kPageRows = 1000;  // that are read at a time
constexpr int kOpenWrite = SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX;

void sync_path(const std::string& path, const std::string& named) {
  const int opened = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool done = opened >= 0 && ::fsync(opened) == 0;
  const int error = errno;
  if (opened >= 0) ::close(opened);
  if (!done)
    throw StoreError(named + ": cannot be written: " + std::generic_category().message(error));
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
                     " does not fit to the sweep's plan");
}

[[noreturn]] void refuse_other_plan(const std::string& path,
                                    const std::vector<std::string>& reasons) {
  std::string text = path + ": holds another sweep. Of that and of this one differ:";
  for (const std::string& reason : reasons) text += "\n  " + reason;
  throw StoreRefused(text + "\nName another file, or give what that sweep was begun with");
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
                         ": is no sweep's file; 'palpate sweep' makes one. A study's database is "
                         "analysed and exported with --db");
    }
    require_private_sqlite_files(file);
    guarded(path, [&] {
      // A journal that a killed process left is rolled back by whoever opens the file.
      if (writes || ::access(file.c_str(), W_OK) == 0) {
        db.emplace(file, kOpenWrite, kBusyTimeoutMs);
      } else if (fs::exists(file + "-journal")) {
        db.emplace(file, SQLITE_OPEN_READONLY | SQLITE_OPEN_NOMUTEX, kBusyTimeoutMs);
      } else {
        db.emplace(immutable_uri(file),
                   SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, kBusyTimeoutMs);
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

void SweepFile::rewrite(bool goes_on) {
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
  impl_->connect(goes_on);
}

struct SweepCopy::Impl {
  std::string path;
  SweepPlan plan;
  SweepTables tables;
  std::optional<SQLite::Database> db;
  std::optional<SQLite::Transaction> transaction;
  std::int64_t last = 0;  ///< point that was added
  bool in_order = true;

  void begin() {
    make_empty_file(path);
    guarded(path, [&] {
      db.emplace(path, kOpenWrite, kBusyTimeoutMs);
      // A temporary file, deleted if anything fails: needs no journal. One transaction, whatever
      // the number of sources: the header counts them.
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
              " has other results than in a file before it, with the same seeds; one of "
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
    impl.db.emplace(impl.path, kOpenWrite, kBusyTimeoutMs);
  }
  const std::pair<std::int64_t, std::int64_t> counts{
      impl.db->execAndGet("SELECT count(*) FROM points").getInt64(),
      impl.db->execAndGet("SELECT count(*) FROM points WHERE status = 'failed'").getInt64()};
  impl.db.reset();
  sync_path(impl.path, impl.path);
  return counts;
}

}  // namespace palpate::data
