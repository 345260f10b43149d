#pragma once
// Internal to data/store: the hash chain over the rows of a session; its links are called seals.
//
// A seal is SHA-256(previous seal, values of the row). It detects accidents and silent edits:
// changing a value changes what its seal was computed from, and removing a row breaks the chain. It
// does not prove authenticity: anyone with this program can recompute seals. Where that matters,
// keep the last seal elsewhere.
//
// Encoding of the values, one after the other: a letter for the type (n null, i integer, r real, t
// text, b blob), then 8 bytes, least significant first: the integer (booleans 0 or 1), the bits of
// the real, or the length of the text or blob, whose bytes follow. The first value is a text, the
// kind of the row:
//
//   session  protocol's sha256 and name, participant's code, enrolled number, simulated and seed,
//            session's number, observer_sha256: link 0, which is not stored
//   run      the columns of runs from started_utc_ns to hand, sha256 of its own protocol or null,
//            files_sha256
//   note     link of its run, at_ns, text
//   attempt  link of its run, the columns of attempts from trial to samples_sha256; then
//            contact_share and edge_dwell, unless both are null; then task, unless it is null; then
//            for each later version of the schema its number and its measured columns
//            (data/trial_columns.h), unless all of them are null
//   page     link of its run, the columns of page_answers from page to at_ns
//   end      link of its run, end_reason, ended_ns

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>

#include <bit>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "data/base/checksum.h"
#include "data/record.h"

namespace palpate::data {

inline constexpr int kSealsSince = 3;  ///< first version of the schema with them

/// The values of a row, encoded for hashing.
class SealedValues {
 public:
  /// Starts a row of this kind; drops the values of the previous row.
  SealedValues& begin(std::string_view kind) {
    size_ = 0;
    return text('t', kind);
  }
  SealedValues& operator<<(const std::string& value) { return text('t', value); }
  SealedValues& operator<<(const Checksum& value) {
    return text('b', {reinterpret_cast<const char*>(value.data()), value.size()});
  }
  SealedValues& operator<<(double value) { return put('r', std::bit_cast<std::uint64_t>(value)); }
  SealedValues& operator<<(std::int64_t value) {
    return put('i', static_cast<std::uint64_t>(value));
  }
  SealedValues& operator<<(std::uint64_t value) { return put('i', value); }
  SealedValues& operator<<(int value) { return *this << std::int64_t{value}; }
  SealedValues& operator<<(std::uint32_t value) { return put('i', value); }
  SealedValues& operator<<(bool value) { return put('i', value ? 1 : 0); }
  template <class T>
  SealedValues& operator<<(const std::optional<T>& value) {
    if (value) return *this << *value;
    *room(1) = 'n';
    return *this;
  }

  Checksum seal(const Checksum& previous) const;  ///< of this row

 private:
  SealedValues& put(char type, std::uint64_t value) {
    unsigned char* at = room(9);
    *at++ = static_cast<unsigned char>(type);
    for (int shift = 0; shift < 64; shift += 8) *at++ = static_cast<unsigned char>(value >> shift);
    return *this;
  }
  SealedValues& text(char type, std::string_view value) {
    put(type, value.size());
    if (!value.empty()) std::memcpy(room(value.size()), value.data(), value.size());
    return *this;
  }
  unsigned char* room(std::size_t more) {
    size_ += more;
    if (size_ > bytes_.size()) bytes_.resize(2 * size_);
    return bytes_.data() + size_ - more;
  }
  std::vector<unsigned char> bytes_;
  std::size_t size_ = 0;
};

struct SessionHead;

/// Sealed values of an attempt outside its TrialRecord.
struct AttemptSealed {
  std::int64_t run_link = 0, began_ns = 0;
  std::optional<std::string> cut_off_reason;  ///< none: it was completed
  std::optional<Checksum> samples;
};

void put_session(SealedValues& out, const SessionHead& session);
void put_run(SealedValues& out, const RunInfo& info);
void put_note(SealedValues& out, std::int64_t run_link, std::int64_t at_ns,
              const std::string& text);
void put_attempt(SealedValues& out, const AttemptSealed& attempt, const TrialRecord& record);
void put_page_answer(SealedValues& out, std::int64_t run_link, const PageAnswer& answer);
void put_end(SealedValues& out, std::int64_t run_link, const std::string& reason,
             std::optional<std::int64_t> ended_ns);
/// Little-endian packing (4 bytes) and count (8), then the data.
Checksum checksum_of_samples(int packing, std::int64_t count, const void* data, std::size_t size);

/// A position in the chain of a session.
struct Link {
  std::int64_t position = 0;  ///< 1, 2, ...; 0: the session itself
  Checksum seal{};
};

/// Identifies a row in messages.
struct RowName {
  const char* kind;  ///< "trial", "note of run", ...
  std::int64_t number = 0;
  int attempt = 0;  ///< 0: not an attempt
};

/// Verifies the rows of one session against their seals. Rows may be added in any order.
class ChainCheck {
 public:
  /// \param session "study.db: participant P01, session 1", for messages
  ChainCheck(std::string session, const Checksum& first) : session_(std::move(session)) {
    last_ = first;
  }

  /// \param link  none: the row has no seal. \throws StoreRefused: it has none, or does not match
  /// it.
  void add(const std::optional<Link>& link, const SealedValues& values, const RowName& name);
  /// After the last row. \throws StoreRefused: rows are missing.
  void finish() const;

 private:
  struct Waiting {
    Checksum seal;
    SealedValues values;
    RowName name;
  };
  void take(const Checksum& seal, const SealedValues& values, const RowName& name);
  [[noreturn]] void fail(const RowName& name, const char* what) const;
  std::string session_;
  Checksum last_;
  std::int64_t links_ = 0;
  std::map<std::int64_t, Waiting> waiting_;
};

/// Internal to data/store: seals rows (seals.h) in the transaction that writes them.
/// Each call reads back the row as it was stored and seals it as the next of its session. Caches
/// the last link of every session: call reset_chains() after a rollback and after deleting
/// sessions.
class SealWriter {
 public:
  explicit SealWriter(SQLite::Database& db) : db_(db) {}

  void run(std::int64_t id);  ///< when it begins
  void note(std::int64_t id);
  void attempt(std::int64_t id);  ///< when it has ended
  void end(std::int64_t run_id);  ///< of a run
  void page_answer(std::int64_t id);
  void reset_chains() { last_.clear(); }

  /// Seals all rows of a database that an earlier schema version wrote without seals.
  void seal_existing_rows();

 private:
  const Link& last_of(std::int64_t session);
  void seal(const char* update, std::int64_t session, std::int64_t id);
  SQLite::Database& db_;
  std::optional<SQLite::Statement> find_attempt_, seal_attempt_;
  SealedValues values_;
  std::map<std::int64_t, Link> last_;  // by session
};

}  // namespace palpate::data
