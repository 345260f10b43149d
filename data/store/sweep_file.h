#pragma once
// The file of a sweep: an SQLite database, distinct from a study's. One row per point, one writer,
// any number of readers.
//
// Durability: a recorded point is synced to disk when record() returns. A rollback journal instead
// of a -wal, so that it also works on file systems shared by several machines; each machine writes
// its own file. finish() rewrites the file, points in order, in one transaction: the bytes of a
// finished file depend on the plan and the results alone, not on the order of their arrival.
//
// Seals: the plan and each row have a SHA-256 of their values, verified on opening and on every
// reading: a flipped bit is refused with the row's number. The seal of a row begins with that of
// the plan. Files of version 1 have no seals; they are read without, and sealed when resumed or
// merged.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "data/errors.h"
#include "data/sweep_record.h"

namespace palpate::data {

inline constexpr int kSweepApplicationId = 0x504C5053;  ///< "PLPS", PRAGMA application_id
inline constexpr int kSweepVersion = 2;                 ///< PRAGMA user_version; 1: no seals

/// Whether the header of a file marks it as a sweep's. False if it cannot be read.
bool is_sweep_file(const std::string& path);

class SweepFile {
 public:
  /// Creates the file (0600) or resumes it, as its only writer. \throws StoreRefused: it holds
  /// another plan (names every difference), is not a sweep's file, is damaged (names the row), or
  /// open for writing elsewhere; StoreError: cannot be read or written.
  static SweepFile open(const std::string& path, const SweepPlan& plan);
  enum class Writers { any, none };
  /// For reading, also beside its writer; Writers::none: keeps writers away as long as it is open.
  /// \throws as above
  static SweepFile open(const std::string& path, Writers writers = Writers::any);

  SweepFile(SweepFile&&) noexcept;
  SweepFile& operator=(SweepFile&&) noexcept;
  ~SweepFile();

  const std::string& path() const;
  const SweepPlan& plan() const;
  /// For each of the plan's points, whether it is on record.
  std::vector<bool> recorded();
  std::int64_t count();   ///< points on record
  std::int64_t failed();  ///< of them
  /// Visits all points by number. Does not block writers: includes points recorded meanwhile if
  /// they come later in this order.
  void for_each(const std::function<void(const SweepRow&)>& visit);

  /// On disk when it returns. \throws StoreRefused: one is on record, or does not fit the plan;
  /// StoreError, and nothing is recorded.
  void record(const std::vector<SweepRow>& rows);
  /// Rewrites the file (see above); nothing can be recorded afterwards. \throws StoreError; the
  /// file is then as before.
  void finish();

 private:
  friend class SweepCopy;
  struct Impl;
  void rewrite(bool writing);
  explicit SweepFile(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// A new finished file, merged from others of one plan.
class SweepCopy {
 public:
  /// \param path must not exist
  SweepCopy(const std::string& path, const SweepPlan& plan);
  ~SweepCopy();
  SweepCopy(const SweepCopy&) = delete;
  SweepCopy& operator=(const SweepCopy&) = delete;

  /// Adds the missing points from `from`. \throws StoreRefused: a point exists with other values.
  void add(SweepFile& from);
  /// Puts the points in order and syncs. \return number of points, and of failed ones
  std::pair<std::int64_t, std::int64_t> finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate::data
