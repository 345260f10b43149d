#include "data/store/attempts.h"

#include <sqlite3.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <map>
#include <memory>
#include <span>
#include <stdexcept>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "data/errors.h"
#include "data/files/utc.h"
#include "data/store/connection.h"
#include "data/store/frames.h"
#include "data/store/protocol_rows.h"
#include "data/store/record_columns.h"
#include "data/store/seals.h"
#include "data/store/statement.h"
#include "data/store/task_text.h"
#include "data/trial_columns.h"

namespace palpate::data {
namespace {

constexpr int kZlibPlain = 3, kZlibWithBodies = 4;
constexpr bool is_zstd(int packing) { return packing > kZlibWithBodies; }
constexpr bool packs_bodies(int packing) {
  return packing == kZlibWithBodies || packing == kSamplesPacking;
}
constexpr std::size_t bytes_a_sample(int packing) {
  return 4 + (packing > 1 ? 8 : 0) + 13 * 8 + 4 + (packing > 2 ? 2 * 8 + 6 * 8 + 3 : 0) +
         (packs_bodies(packing) ? 1 + 13 * 8 : 0);
}
// Limits of the stored count, so that a damaged one cannot make the decoder allocate memory out of
// proportion to the compressed bytes: at most a trial of an hour at the highest rate; beyond some
// minutes, at least as many bytes per sample as the jitter of a clock takes (zlib compresses 1000
// equal bytes to one).
constexpr std::int64_t kMostSamples = 40'000'000;
constexpr std::size_t kSamplesWithFewBytes = 400'000;
constexpr std::size_t kLeastBytesASample = 2;
constexpr std::size_t kMostShrunk = 1032;             // the highest compression ratio of zlib
constexpr std::size_t kPiece = std::size_t{1} << 16;  // bytes decompressed at a time
// Higher levels of zstd save little, because the low bytes of a measured signal are noise.
constexpr int kLevel = 3;
constexpr int kMostWindow = 23;  // log2 of the bytes that a frame may refer back to: 8 MiB

// Visits the columns in order, for encoder and decoder: calls column(rows, get, form), where
// get(row) is a reference to the field and `form` a value of its stored type.
template <class Samples, class Bodies, class Visitor>
void visit_columns(int packing, Samples& samples, Bodies& bodies, Visitor&& visit) {
  const auto column = [&](auto get, auto form) { visit(samples, get, form); };
  constexpr std::uint8_t kByte{};
  constexpr std::uint32_t kWord{};
  constexpr std::int64_t kTime{};
  constexpr double kReal{};
  column(
      [](auto& s) -> auto& { return s.tick; }, kWord);
  if (packing > 1)
    column(
        [](auto& s) -> auto& { return s.period_ns; }, kTime);
  if (packing > 2)
    column(
        [](auto& s) -> auto& { return s.lateness_ns; }, kTime);
  if (packing > 2)
    column(
        [](auto& s) -> auto& { return s.compute_ns; }, kTime);
  for (int i = 0; i < 3; ++i)
    column(
        [i](auto& s) -> auto& { return s.tip[i]; }, kReal);
  for (int i = 0; i < 3; ++i)
    column(
        [i](auto& s) -> auto& { return s.tail[i]; }, kReal);
  for (int i = 0; i < 3; ++i)
    column(
        [i](auto& s) -> auto& { return s.force[i]; }, kReal);
  for (int i = 0; i < 3; ++i)
    column(
        [i](auto& s) -> auto& { return s.torque[i]; }, kReal);
  for (int i = 0; i < 3 && packing > 2; ++i)
    column(
        [i](auto& s) -> auto& { return s.device1[i]; }, kReal);
  for (int i = 0; i < 3 && packing > 2; ++i)
    column(
        [i](auto& s) -> auto& { return s.device2[i]; }, kReal);
  column(
      [](auto& s) -> auto& { return s.depth; }, kReal);
  column(
      [](auto& s) -> auto& { return s.contacts; }, kByte);
  column(
      [](auto& s) -> auto& { return s.contact_type; }, kByte);
  column(
      [](auto& s) -> auto& { return s.buttons; }, kByte);
  if (packing > 2) {
    column(
        [](auto& s) -> auto& { return s.faults; }, kWord);
  } else {
    column(
        [](auto& s) -> auto& { return s.faults; }, kByte);
  }
  if (!packs_bodies(packing)) return;
  column(
      [](auto& s) -> auto& { return s.bodies; }, kByte);
  for (int i = 0; i < 3; ++i)
    visit(
        bodies, [i](auto& b) -> auto& { return b.centre[i]; }, kReal);
  for (int i = 0; i < 4; ++i)
    visit(
        bodies, [i](auto& b) -> auto& { return b.orientation_wxyz[i]; }, kReal);
  for (int i = 0; i < 3; ++i)
    visit(
        bodies, [i](auto& b) -> auto& { return b.velocity[i]; }, kReal);
  for (int i = 0; i < 3; ++i)
    visit(
        bodies, [i](auto& b) -> auto& { return b.spin[i]; }, kReal);
}

constexpr std::size_t kCrcSize = 4;

std::uint32_t crc_of(const unsigned char* bytes, std::size_t size) {
  return static_cast<std::uint32_t>(crc32_z(crc32_z(0, nullptr, 0), bytes, size));
}

bool bytes_suffice(std::size_t count, std::size_t size) {
  return count <= kSamplesWithFewBytes || size / kLeastBytesASample >= count;
}

[[noreturn]] void refuse() { throw StoreError("the samples are damaged"); }

/// Decompresses piece by piece.
class Decoder {
 public:
  Decoder() = default;
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
  virtual ~Decoder() = default;
  /// Fills `room` in part. \return bytes, 0 at the end of the stream \throws StoreError: damaged
  virtual std::size_t next(std::span<unsigned char> room) = 0;
  /// Whether compressed bytes follow the end of the stream.
  virtual bool has_more() const = 0;
};

class ZlibDecoder final : public Decoder {
 public:
  ZlibDecoder(const void* data, std::size_t size) : left_(size) {
    stream_.next_in = const_cast<Bytef*>(static_cast<const Bytef*>(data));
    if (inflateInit(&stream_) != Z_OK) throw StoreError("the samples: out of memory");
  }
  ~ZlibDecoder() override { inflateEnd(&stream_); }

  std::size_t next(std::span<unsigned char> room) override {
    std::size_t count = 0;
    while (count == 0 && !ended_) {
      if (stream_.avail_in == 0) {  // avail_in has 32 bits
        stream_.avail_in = static_cast<uInt>(std::min<std::size_t>(left_, 1U << 30U));
        left_ -= stream_.avail_in;
      }
      stream_.next_out = room.data();
      stream_.avail_out = static_cast<uInt>(room.size());
      const int status = inflate(&stream_, Z_NO_FLUSH);
      if (status != Z_OK && status != Z_STREAM_END) refuse();
      ended_ = status == Z_STREAM_END;
      count = room.size() - stream_.avail_out;
    }
    return count;
  }
  bool has_more() const override { return left_ + stream_.avail_in > 0; }

 private:
  z_stream stream_{};
  std::size_t left_;  ///< input bytes not yet given to the stream
  bool ended_ = false;
};

class ZstdDecoder final : public Decoder {
 public:
  ZstdDecoder(const void* data, std::size_t size) : in_{data, size, 0} {
    if (!stream_) throw StoreError("the samples: out of memory");
    ZSTD_DCtx_setParameter(stream_.get(), ZSTD_d_windowLogMax, kMostWindow);
  }

  std::size_t next(std::span<unsigned char> room) override {
    ZSTD_outBuffer out{room.data(), room.size(), 0};
    while (out.pos == 0 && !ended_) {
      const std::size_t before = in_.pos;
      const std::size_t left = ZSTD_decompressStream(stream_.get(), &out, &in_);
      if (ZSTD_isError(left) != 0) refuse();
      ended_ = left == 0;
      if (!ended_ && out.pos == 0 && in_.pos == before) refuse();  // cut off
    }
    return out.pos;
  }
  bool has_more() const override { return in_.pos < in_.size; }

 private:
  struct Free {
    void operator()(ZSTD_DCtx* stream) const { ZSTD_freeDCtx(stream); }
  };
  std::unique_ptr<ZSTD_DCtx, Free> stream_{ZSTD_createDCtx()};
  ZSTD_inBuffer in_;
  bool ended_ = false;
};

/// The decompressed bytes, in order.
class Planes {
 public:
  explicit Planes(std::unique_ptr<Decoder> decoder) : decoder_(std::move(decoder)) {}

  /// The next bytes, at least one and at most `most`. \throws StoreError at the end.
  std::span<const unsigned char> take(std::size_t most) {
    if (at_ == end_ && !fill()) refuse();
    const std::span<const unsigned char> some(piece_.data() + at_, std::min(most, end_ - at_));
    at_ += some.size();
    return some;
  }

  /// \throws StoreError: more bytes follow, compressed or decompressed.
  void expect_end() {
    if (at_ != end_ || fill() || decoder_->has_more()) refuse();
  }

  /// CRC-32 of all decompressed bytes.
  std::uint32_t crc() const { return static_cast<std::uint32_t>(crc_); }

 private:
  /// False at the end of the stream.
  bool fill() {
    at_ = 0;
    end_ = decoder_->next(piece_);
    crc_ = crc32_z(crc_, piece_.data(), end_);
    return end_ > 0;
  }

  std::unique_ptr<Decoder> decoder_;
  std::vector<unsigned char> piece_ = std::vector<unsigned char>(kPiece);
  std::size_t at_ = 0, end_ = 0;
  uLong crc_ = crc32_z(0, nullptr, 0);
};

std::unique_ptr<Decoder> decoder_of(int packing, const void* data, std::size_t size) {
  if (is_zstd(packing)) return std::make_unique<ZstdDecoder>(data, size);
  return std::make_unique<ZlibDecoder>(data, size);
}

template <class Field>
using Bits = std::conditional_t<sizeof(Field) == 8, std::uint64_t, Field>;

std::string compressed(const std::vector<unsigned char>& planes) {
  std::string packed(ZSTD_compressBound(planes.size()), '\0');
  const std::size_t size =
      ZSTD_compress(packed.data(), packed.size(), planes.data(), planes.size(), kLevel);
  if (ZSTD_isError(size) != 0)
    throw StoreError("the samples could not be compressed: out of memory");
  packed.resize(size);
  return packed;
}

std::string uncompressed(const std::vector<unsigned char>& planes) {
  uLongf size = compressBound(planes.size());
  std::string packed(size, '\0');
  const int status = compress2(reinterpret_cast<Bytef*>(packed.data()), &size, planes.data(),
                               planes.size(), Z_NO_COMPRESSION);
  if (status != Z_OK) throw StoreError("the samples could not be packed: out of memory");
  packed.resize(size);
  return packed;
}

AttemptState state_of(const std::string& text) {
  if (text == "completed") return AttemptState::completed;
  if (text == "cut_off") return AttemptState::cut_off;
  if (text == "running") return AttemptState::running;
  throw SQLite::Exception("state is '" + text + "'", SQLITE_CORRUPT);
}

std::optional<Link> read_link(RowReader& row) {
  std::optional<Link> link;
  std::optional<std::int64_t> position;
  std::optional<Checksum> seal;
  row >> position >> seal;
  if (position && seal) link = {*position, *seal};
  return link;
}

class AttemptReader {
 public:
  AttemptReader(SQLite::Database& db, const std::string& path, int version,
                const AttemptFilter& filter, const std::function<void(const StoredTrial&)>& visit)
      : db_(db),
        path_(path),
        version_(version),
        filter_(filter),
        visit_(visit),
        find_(db, std::string("SELECT ") + kPlanColumns +
                      ", a.run_id, a.state, a.cut_off_reason, " +
                      (sealed() ? "a.link, a.seal, a.samples_sha256, " : "NULL, NULL, NULL, ") +
                      task_column(version) + outcome_columns(version) +
                      " FROM attempts a WHERE a.session_id = ? ORDER BY a.trial, a.attempt"),
        find_samples_(db, "SELECT packing, count, data FROM samples WHERE attempt_id = ?") {}

  void read();

 private:
  struct KnownRun {
    RunInfo info;
    std::int64_t link = 0;
    bool running = false;
  };
  bool sealed() const { return version_ >= kSealsSince; }
  bool checks_seals() const { return sealed() && !filter_.seals_verified; }
  std::vector<std::int64_t> sessions();
  void read_session(std::int64_t id);
  void read_runs(const SessionHead& session, std::optional<ChainCheck>& chain);
  void read_notes(std::int64_t session, ChainCheck& chain);
  void read_page_answers(std::int64_t session, ChainCheck& chain);
  void require_files(const RunInfo& run, std::int64_t protocol);
  void read_attempt(std::optional<ChainCheck>& chain);
  void read_samples(std::int64_t attempt, const std::optional<Checksum>& sum);
  void read_frames(std::int64_t attempt);
  void require_no_hidden_rows();

  SQLite::Database& db_;
  const std::string path_;
  const int version_;
  const AttemptFilter filter_;
  const std::function<void(const StoredTrial&)>& visit_;
  SQLite::Statement find_, find_samples_;
  std::vector<SQLite::Column> columns_;  // of find_
  StoredTrial trial_;
  SealedValues values_;
  std::map<std::int64_t, KnownRun> runs_;      // of the session, by id
  std::int64_t known_run_ = 0, run_link_ = 0;  // of the run in trial_.run
  std::map<std::int64_t, std::string> files_;  // checksum of a protocol's
  std::int64_t seen_ = 0;
};

std::vector<std::int64_t> AttemptReader::sessions() {
  SQLite::Statement find(db_, std::string("SELECT s.id") + kFromProtocolDown +
                                  (filter_.trial != nullptr ? "WHERE pa.code = ? AND s.number = ? "
                                   : filter_.session        ? "WHERE pa.id = ? AND s.number = ? "
                                                            : "") +
                                  "ORDER BY pr.id, pa.number, s.number");
  Binder which(find);
  if (filter_.trial != nullptr) {
    which << filter_.trial->code << filter_.trial->session;
  } else if (filter_.session) {
    which << filter_.session->first << filter_.session->second;
  }
  std::vector<std::int64_t> all;
  while (find.executeStep()) all.push_back(find.getColumn(0).getInt64());
  return all;
}

void AttemptReader::read_page_answers(std::int64_t session, ChainCheck& chain) {
  if (version_ < 5) return;
  SQLite::Statement find(
      db_, std::string("SELECT r.link, ") + kPageAnswerColumns +
               ", p.link, p.seal FROM page_answers p JOIN runs r ON r.id = p.run_id WHERE "
               "r.session_id = ? ORDER BY p.run_id, p.id");
  Binder(find) << session;
  for (std::int64_t number = 1; find.executeStep(); ++number) {
    std::int64_t run_link = 0;
    PageAnswer answer;
    RowReader row(find);
    row >> run_link >> answer;
    put_page_answer(values_, run_link, answer);
    chain.add(read_link(row), values_, {.kind = "answer to a page", .number = number});
  }
}

/// Verifies that the stored files of the protocol are those that the run recorded.
void AttemptReader::require_files(const RunInfo& run, std::int64_t protocol) {
  if (run.files_sha256.empty()) return;
  auto known = files_.find(protocol);
  if (known == files_.end()) known = files_.emplace(protocol, files_checksum(db_, protocol)).first;
  if (known->second == run.files_sha256) return;
  throw SQLite::Exception("participant " + trial_.participant.code + ", session " +
                              std::to_string(run.session) +
                              ": the stored files of the protocol are not those that were shown",
                          SQLITE_CORRUPT);
}

void AttemptReader::read_runs(const SessionHead& session, std::optional<ChainCheck>& chain) {
  SQLite::Statement find(db_,
                         "SELECT r.id, r.end_reason, r.ended_ns, " +
                             std::string(sealed() ? "r.protocol_id, r.link, r.seal, r.end_link, "
                                                    "r.end_seal, "
                                                  : "NULL, NULL, NULL, NULL, NULL, ") +
                             run_columns(version_) +
                             " FROM runs r JOIN sessions s ON s.id = r.session_id WHERE "
                             "r.session_id = ? ORDER BY r.id");
  Binder(find) << session.id;
  runs_.clear();
  for (std::int64_t number = 1; find.executeStep(); ++number) {
    std::int64_t id = 0;
    std::string end_reason;
    std::optional<std::int64_t> ended_ns, protocol;
    RowReader row(find);
    row >> id >> end_reason >> ended_ns >> protocol;
    const auto link = read_link(row), end_link = read_link(row);
    KnownRun& run = runs_[id];
    row >> run.info;
    run.link = link ? link->position : 0;
    run.running = run_end_of(end_reason) == RunEnd::running;
    trial_.run = run.info;
    require_valid_run(trial_);
    if (!chain) continue;
    require_files(run.info, protocol.value_or(session.protocol_id));
    put_run(values_, run.info);
    chain->add(link, values_, {.kind = "run", .number = number});
    if (run.running) continue;
    put_end(values_, run.link, end_reason, ended_ns);
    chain->add(end_link, values_, {.kind = "end of run", .number = number});
  }
}

void AttemptReader::read_notes(std::int64_t session, ChainCheck& chain) {
  SQLite::Statement find(db_,
                         "SELECT r.link, n.at_ns, n.text, n.link, n.seal FROM notes n JOIN runs r "
                         "ON r.id = n.run_id WHERE r.session_id = ? ORDER BY n.run_id, n.id");
  Binder(find) << session;
  for (std::int64_t number = 1; find.executeStep(); ++number) {
    std::int64_t run_link = 0, at_ns = 0;
    std::string text;
    RowReader row(find);
    row >> run_link >> at_ns >> text;
    put_note(values_, run_link, at_ns, text);
    chain.add(read_link(row), values_, {.kind = "note", .number = number});
  }
}

void AttemptReader::read_samples(std::int64_t attempt, const std::optional<Checksum>& sum) {
  find_samples_.reset();
  find_samples_.bind(1, attempt);
  if (!find_samples_.executeStep()) {
    if (sum) throw SQLite::Exception("its samples are missing", SQLITE_CORRUPT);
    return;
  }
  const int packing = find_samples_.getColumn(0).getInt();
  const std::int64_t count = find_samples_.getColumn(1).getInt64();
  const SQLite::Column data = find_samples_.getColumn(2);
  const void* const bytes = data.getBlob();  // must precede getBytes()
  const auto size = static_cast<std::size_t>(data.getBytes());
  if (sealed() && sum != checksum_of_samples(packing, count, bytes, size)) {
    throw SQLite::Exception("its samples were changed since they were recorded", SQLITE_CORRUPT);
  }
  if (filter_.samples != SampleReading::unpack) return;
  if (packing < 1 || packing > kSamplesPacking) {
    throw StoreRefused(
        path_ + ": holds samples in a packing unknown to this version of palpate; use a newer one");
  }
  try {
    RecordedSamples recorded = unpack_samples(bytes, size, count, packing);
    trial_.record.samples = std::move(recorded.samples);
    trial_.record.bodies = std::move(recorded.bodies);
  } catch (const StoreError& error) {
    throw SQLite::Exception(error.what(), SQLITE_CORRUPT);
  }
}

void AttemptReader::read_frames(std::int64_t attempt) {
  const auto& seen = trial_.record.task.seen;
  if (!seen || seen->frames_sha256.empty()) return;
  std::vector<FrameRecord> frames = data::read_frames(db_, attempt);
  if (frames_checksum(frames) != seen->frames_sha256)
    throw SQLite::Exception("its frames were changed since they were recorded", SQLITE_CORRUPT);
  if (filter_.samples == SampleReading::unpack) trial_.record.frames = std::move(frames);
}

void AttemptReader::read_attempt(std::optional<ChainCheck>& chain) {
  TrialRecord& record = trial_.record;
  record = {};
  record.session = trial_.run.session;
  AttemptSealed about;
  std::int64_t run = 0;
  std::string state_text;
  RowReader row(columns_);
  const std::int64_t id = read_plan(row, record);
  about.began_ns = record.onset_ns;
  row >> run >> state_text;
  const AttemptState state = state_of(state_text);
  if (state == AttemptState::running) return;
  const bool wanted = (!filter_.state || *filter_.state == state) &&
                      (filter_.trial == nullptr || filter_.trial->trial == record.trial);
  if (!wanted && !chain) return;
  row >> about.cut_off_reason;
  const std::optional<Link> link = read_link(row);
  row >> about.samples;
  read_task(row, record);
  const bool completed = state == AttemptState::completed;
  if (completed) read_outcome(row, record);
  if (about.cut_off_reason.has_value() == completed) {
    throw SQLite::Exception(
        "a completed attempt has a reason for being cut off, or a cut-off attempt has no reason",
        SQLITE_CORRUPT);
  }
  if (run != known_run_) {
    const auto known = runs_.find(run);
    if (known == runs_.end()) throw SQLite::Exception("an attempt without a run", SQLITE_CORRUPT);
    trial_.run = known->second.info;
    run_link_ = known->second.link;
    known_run_ = run;
  }
  trial_.cut_off_reason = about.cut_off_reason.value_or("");
  require_valid_record(trial_);
  if (chain) {
    about.run_link = run_link_;
    put_attempt(values_, about, record);
    chain->add(link, values_, {.kind = "trial", .number = record.trial, .attempt = record.attempt});
  }
  if (!wanted) return;
  if (filter_.samples != SampleReading::skip &&
      (filter_.samples_wanted == nullptr || (*filter_.samples_wanted)(trial_))) {
    read_samples(id, about.samples);
    read_frames(id);
  }
  record.onset_utc = format_utc(to_unix_ns(trial_.run.clock, record.onset_ns));
  visit_(trial_);
}

void AttemptReader::read_session(std::int64_t id) {
  const SessionHead session = read_session_head(db_, id, version_);
  trial_.participant = session.participant;
  trial_.protocol_name = session.protocol_name;
  trial_.protocol_sha256 = session.protocol_sha256;
  known_run_ = 0;
  std::optional<ChainCheck> chain;
  if (checks_seals()) {
    put_session(values_, session);
    chain.emplace(path_ + ": participant " + session.participant.code + ", session " +
                      std::to_string(session.number),
                  values_.seal({}));
  }
  read_runs(session, chain);
  if (chain) {
    read_notes(id, *chain);
    read_page_answers(id, *chain);
  }
  trial_.run.session = session.number;
  find_.reset();
  find_.bind(1, id);
  while (find_.executeStep()) {
    if (++seen_ == 1) columns_ = columns_of(find_);
    try {
      read_attempt(chain);
    } catch (const SQLite::Exception& error) {
      throw SQLite::Exception(
          "row " + std::to_string(columns_[0].getInt64()) + " of attempts: " + error.what(),
          error.getErrorCode());
    }
  }
  if (chain) chain->finish();
}

/// A damaged index hides rows from queries: counts them without indexes.
void AttemptReader::require_no_hidden_rows() {
  SQLite::Statement count(db_, "SELECT count(*) FROM attempts NOT INDEXED");
  count.executeStep();
  const std::int64_t stored = count.getColumn(0).getInt64();
  if (stored == seen_) return;
  throw SQLite::Exception("of " + std::to_string(stored) + " attempts only " +
                              std::to_string(seen_) + " can be found: an index is damaged",
                          SQLITE_CORRUPT);
}

void AttemptReader::read() {
  for (const std::int64_t id : sessions()) read_session(id);
  if (filter_.trial == nullptr && !filter_.session) require_no_hidden_rows();
}

std::string trial_name(const TrialRecord& record) {
  return "session " + std::to_string(record.session) + ", trial " + std::to_string(record.trial);
}

struct OpenAttempt {
  std::int64_t id = 0;
  TrialRecord plan;
};

/// The attempt of a run that has begun and not ended; there is one at most.
std::optional<OpenAttempt> open_attempt(SQLite::Database& db, const Run& run) {
  SQLite::Statement find(
      db,
      "SELECT id, trial, attempt, block, renderer, shape, practice, orientation_w, orientation_x, "
      "orientation_y, orientation_z FROM attempts WHERE run_id = ? AND state = 'running'");
  Binder(find) << run.id;
  if (!find.executeStep()) return std::nullopt;
  OpenAttempt open;
  RowReader row(find);
  row >> open.id >> open.plan.trial >> open.plan.attempt >> open.plan.block >> open.plan.renderer >>
      open.plan.shape >> open.plan.practice;
  for (double& q : open.plan.orientation_wxyz) row >> q;
  open.plan.session = run.session;
  return open;
}

/// \return its number within the trial: 1, 2, ...
int insert_attempt(SQLite::Database& db, SQLite::Statement& insert, const Run& run,
                   const TrialRecord& plan, std::int64_t began_ns) {
  SQLite::Statement count(db,
                          "SELECT coalesce(max(attempt), 0) FROM attempts WHERE session_id = ? AND "
                          "trial = ?");
  Binder(count) << run.session_id << plan.trial;
  count.executeStep();
  const int attempt = count.getColumn(0).getInt() + 1;
  insert.reset();
  Binder bind(insert);
  bind << run.session_id << run.id << plan.trial << attempt << plan.block << plan.renderer
       << plan.shape << plan.practice;
  for (const double q : plan.orientation_wxyz) bind << q;
  bind << began_ns << task_text(plan.task);
  insert.exec();
  return attempt;
}

constexpr const char* kInsertAttempt =
    "INSERT INTO attempts (session_id, run_id, trial, attempt, block, renderer, shape, practice, "
    "orientation_w, orientation_x, orientation_y, orientation_z, began_ns, task, state) "
    "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, 'running')";

/// The statement of complete().
std::string completing_sql() {
  std::string sql =
      "UPDATE attempts SET state = 'completed', response = ?, correct = ?, timed_out = ?, "
      "response_time = ?, first_contact_time = ?, onset_ns = ?, response_ns = ?, start_tip_x = ?, "
      "start_tip_y = ?, start_tip_z = ?, start_tail_x = ?, start_tail_y = ?, start_tail_z = ?, ";
  for (const MeasuredColumn& column : kMeasured) sql += std::string(column.name) + " = ?, ";
  return sql + "samples_sha256 = ?, task = ? WHERE id = ?";
}

/// The task with the checksum of its frames.
TaskRecord task_with_frames(const TrialRecord& record) {
  TaskRecord task = record.task;
  if (task.seen && !record.frames.empty())
    task.seen->frames_sha256 = frames_checksum(record.frames);
  return task;
}

void complete(SQLite::Database& db, SQLite::Statement& update, std::int64_t id,
              const TrialRecord& record) {
  update.reset();
  Binder bind(update);
  bind << record.response << record.correct << record.timed_out << record.response_time
       << record.first_contact_time << record.onset_ns << record.response_ns;
  for (const double x : record.start_tip) bind << x;
  for (const double x : record.start_tail) bind << x;
  for_each_measured(record, [&](const MeasuredColumn&, const auto& value) { bind << value; });
  const auto count = static_cast<std::int64_t>(record.samples.size());
  const PackedSamples packed =
      count > 0 ? pack_samples(record.samples, record.bodies) : PackedSamples{};
  bind << (count > 0 ? std::optional(checksum_of_samples(packed.packing, count, packed.bytes.data(),
                                                         packed.bytes.size()))
                     : std::nullopt)
       << task_text(task_with_frames(record)) << id;
  update.exec();
  write_frames(db, id, record.frames);
  if (count == 0) return;
  SQLite::Statement insert(
      db, "INSERT INTO samples (attempt_id, packing, count, data) VALUES (?, ?, ?, ?)");
  Binder(insert) << id << packed.packing << count;
  insert.bindNoCopy(4, packed.bytes.data(), static_cast<int>(packed.bytes.size()));
  insert.exec();
}

bool has_record(SQLite::Database& db, const Run& run, int trial) {
  SQLite::Statement find(
      db, "SELECT 1 FROM attempts WHERE session_id = ? AND trial = ? AND state = 'completed'");
  Binder(find) << run.session_id << trial;
  return find.executeStep();
}

}  // namespace

PackedSamples pack_samples(const std::vector<SampleRecord>& samples,
                           const std::vector<BodyRecord>& bodies) {
  const std::size_t count = samples.size();
  if (!bodies.empty() && bodies.size() != count)
    throw std::invalid_argument("expected one body for each sample, or none");
  const int packing = bodies.empty() ? kPlainSamplesPacking : kSamplesPacking;
  std::vector<unsigned char> planes(count * bytes_a_sample(packing));
  std::size_t offset = 0;
  visit_columns(packing, samples, bodies, [&](const auto& of, auto get, auto form) {
    using Field = decltype(form);
    using Pattern = Bits<Field>;
    Pattern before = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const auto pattern = std::bit_cast<Pattern>(static_cast<Field>(get(of[i])));
      const auto stored = sizeof(Field) == 1 ? pattern : static_cast<Pattern>(pattern - before);
      before = pattern;
      for (std::size_t byte = 0; byte < sizeof(Field); ++byte) {
        planes[offset + byte * count + i] =
            static_cast<unsigned char>(stored >> (8 * (sizeof(Field) - 1 - byte)));
      }
    }
    offset += sizeof(Field) * count;
  });
  PackedSamples packed{packing, compressed(planes)};
  // Store nearly equal samples uncompressed: their compressed size would look like a damaged count.
  if (!bytes_suffice(count, packed.bytes.size()))
    packed = {bodies.empty() ? kZlibPlain : kZlibWithBodies, uncompressed(planes)};
  const std::uint32_t crc = crc_of(planes.data(), planes.size());
  for (int shift = 24; shift >= 0; shift -= 8) packed.bytes += static_cast<char>(crc >> shift);
  return packed;
}

RecordedSamples unpack_samples(const void* data, std::size_t size, std::int64_t count,
                               int packing) {
  if (count < 0 || count > kMostSamples) throw StoreError("the number of samples is damaged");
  const auto rows = static_cast<std::size_t>(count);
  const std::size_t expected = rows * bytes_a_sample(packing);
  if ((!is_zstd(packing) && expected / kMostShrunk > size) || (packing > 2 && size < kCrcSize))
    refuse();
  if (!bytes_suffice(rows, size)) refuse();
  if (packing > 2) size -= kCrcSize;
  Planes planes(decoder_of(packing, data, size));
  RecordedSamples out;
  out.samples.resize(rows);
  if (packs_bodies(packing)) out.bodies.resize(rows);
  std::vector<std::uint64_t> column(rows);
  visit_columns(packing, out.samples, out.bodies, [&](auto& of, auto get, auto form) {
    using Field = decltype(form);
    using Pattern = Bits<Field>;
    for (std::size_t byte = 0; byte < sizeof(Field); ++byte) {
      for (std::size_t i = 0; i < rows;) {
        for (const unsigned char stored : planes.take(rows - i)) {
          column[i] = (byte == 0 ? 0 : column[i] << 8) | stored;
          ++i;
        }
      }
    }
    Pattern before = 0;
    for (std::size_t i = 0; i < rows; ++i) {
      const auto pattern =
          static_cast<Pattern>(sizeof(Field) == 1 ? column[i] : column[i] + before);
      before = pattern;
      get(of[i]) = std::bit_cast<Field>(pattern);
    }
  });
  planes.expect_end();
  if (packing > 2) {
    std::uint32_t crc = 0;
    for (std::size_t i = 0; i < kCrcSize; ++i)
      crc = crc << 8 | static_cast<const unsigned char*>(data)[size + i];
    if (crc != planes.crc()) refuse();
  }
  return out;
}

void read_attempts(SQLite::Database& db, const std::string& path, int version,
                   const AttemptFilter& filter,
                   const std::function<void(const StoredTrial&)>& visit) {
  AttemptReader(db, path, version, filter, visit).read();
}

// Writes attempts: one by one as they are shown, or many simulated ones in one transaction.
// begin_attempt commits before the stimulus is shown, so that a crash leaves a trace of the
// attempt; finish_attempt commits its record.

void cut_off_open_attempt(SQLite::Database& db, SealWriter& seals, const Run& run,
                          const std::string& reason) {
  SQLite::Statement find(db, "SELECT id FROM attempts WHERE run_id = ? AND state = 'running'");
  Binder(find) << run.id;
  if (!find.executeStep()) return;
  const std::int64_t id = find.getColumn(0).getInt64();
  find.reset();
  SQLite::Statement update(
      db, "UPDATE attempts SET state = 'cut_off', cut_off_reason = ? WHERE id = ?");
  Binder(update) << reason << id;
  update.exec();
  seals.attempt(id);
}

int Store::begin_attempt(const Run& run, const TrialRecord& planned, std::int64_t began_ns) {
  Validator validator;
  validate_plan(validator, planned, run.session);
  validator.throw_if_invalid(impl_->path + ": " + trial_name(planned));
  return impl_->commit([&] {
    SQLite::Database& db = *impl_->db;
    impl_->require_running(run);
    if (has_record(db, run, planned.trial))
      impl_->refuse(trial_name(planned) + " already has a record");
    if (const auto open = open_attempt(db, run)) {
      impl_->refuse(trial_name(planned) + " cannot begin while trial " +
                    std::to_string(open->plan.trial) + " has not ended");
    }
    SQLite::Statement insert(db, kInsertAttempt);
    return insert_attempt(db, insert, run, planned, began_ns);
  });
}

void Store::finish_attempt(const Run& run, const TrialRecord& record) {
  Validator validator;
  validate_plan(validator, record, run.session);
  validate_outcome(validator, record);
  validator.throw_if_invalid(impl_->path + ": " + trial_name(record));
  impl_->commit([&] {
    SQLite::Database& db = *impl_->db;
    const auto open = open_attempt(db, run);
    if (!open) impl_->refuse(trial_name(record) + " has not been begun");
    const TrialRecord& plan = open->plan;
    if (plan.trial != record.trial || plan.attempt != record.attempt ||
        plan.block != record.block || plan.renderer != record.renderer ||
        plan.shape != record.shape || plan.practice != record.practice ||
        plan.orientation_wxyz != record.orientation_wxyz) {
      impl_->refuse("the record of " + trial_name(record) + ", attempt " +
                    std::to_string(record.attempt) +
                    " does not belong to the attempt that was begun (trial " +
                    std::to_string(plan.trial) + ", attempt " + std::to_string(plan.attempt) + ")");
    }
    SQLite::Statement update(db, completing_sql());
    complete(db, update, open->id, record);
    impl_->seals->attempt(open->id);
    return true;
  });
}

void Store::cut_off_attempt(const Run& run, const std::string& reason) {
  Validator validator;
  validator.present("reason", reason);
  validator.throw_if_invalid(impl_->path + ": attempt");
  impl_->commit([&] {
    if (!open_attempt(*impl_->db, run)) impl_->refuse("no attempt is open");
    cut_off_open_attempt(*impl_->db, *impl_->seals, run, reason);
    return true;
  });
}

void Store::record_simulated(const Run& run, const std::vector<TrialRecord>& records) {
  for (const auto& record : records) {
    Validator validator;
    validate_plan(validator, record, run.session);
    validate_outcome(validator, record);
    validator.expect(record.attempt == 1, "a simulated trial has one attempt");
    validator.throw_if_invalid(impl_->path + ": " + trial_name(record));
  }
  impl_->commit([&] {
    SQLite::Database& db = *impl_->db;
    impl_->require_running(run);
    SQLite::Statement person(db,
                             "SELECT p.simulated FROM sessions s JOIN participants p ON p.id = "
                             "s.participant_id WHERE s.id = ?");
    Binder(person) << run.session_id;
    if (!person.executeStep() || person.getColumn(0).getInt() != 1) {
      impl_->refuse("trials of a real participant are begun and finished one by one");
    }
    SQLite::Statement insert(db, kInsertAttempt), update(db, completing_sql());
    for (const auto& record : records) {
      if (has_record(db, run, record.trial))
        impl_->refuse(trial_name(record) + " already has a record");
      insert_attempt(db, insert, run, record, record.onset_ns);
      const std::int64_t id = db.getLastInsertRowid();
      complete(db, update, id, record);
      impl_->seals->attempt(id);
    }
    return true;
  });
}

}  // namespace palpate::data
