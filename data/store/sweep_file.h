#pragma once
// The file of a sweep: an SQLite database of its own kind, no study. One row a point, one writer,
// any number of readers.
//
// Durability: a recorded point is synced to disk when record() returns. A rollback journal instead
// of a -wal, so that it also works on file systems that several machines share; each machine writes
// a file of its own. finish() writes the file anew, points in order, in one transaction: the bytes
// of a finished file depend on the plan and the results alone, not on the order of their arrival.
//
// Seals: the plan and each row have a SHA-256 of their values, which opening and every reading
// verify: a flipped bit is refused with the row's number. The seal of a row begins with that of the
// plan. Files of version 1 have none; they are read as they are, and sealed when they are gone on
// with or merged.

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

/// Whether a file says at its beginning that it is a sweep's. False for what cannot be read.
bool is_sweep_file(const std::string& path);

class SweepFile {
 public:
  /// Creates the file (0600) or goes on with it, as its only writer. \throws StoreRefused: it holds
  /// another plan (names every difference), is no sweep's file, damaged (names the row), or open
  /// for writing elsewhere; StoreError: cannot be read or written.
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
  /// Of the plan's points, from the first: whether it is on record.
  std::vector<bool> recorded();
  std::int64_t count();   ///< points on record
  std::int64_t failed();  ///< of them
  /// One after the other, by number. Keeps no writer away: points that are recorded meanwhile are
  /// there if they come later in this order.
  void for_each(const std::function<void(const SweepRow&)>& visit);

  /// On disk when it returns. \throws StoreRefused: one is on record, or does not fit to the plan;
  /// StoreError, and nothing is recorded.
  void record(const std::vector<SweepRow>& rows);
  /// See above; nothing can be recorded afterwards. \throws StoreError; the file is then as before.
  void finish();

 private:
  friend class SweepCopy;
  struct Impl;
  void rewrite(bool goes_on);
  explicit SweepFile(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// A new finished file, made of others of one plan, for merge.
class SweepCopy {
 public:
  /// \param path must not exist
  SweepCopy(const std::string& path, const SweepPlan& plan);
  ~SweepCopy();
  SweepCopy(const SweepCopy&) = delete;
  SweepCopy& operator=(const SweepCopy&) = delete;

  /// Adds the points of `from` that are not there yet. \throws StoreRefused: a point is there with
  /// other values.
  void add(SweepFile& from);
  /// Points in order, synced. \return points, and how many of them failed
  std::pair<std::int64_t, std::int64_t> finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate::data
