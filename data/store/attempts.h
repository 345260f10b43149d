#pragma once
// Internal to data/: reads and verifies attempts one at a time, and ends an attempt that a run left
// open.

#include <SQLiteCpp/Database.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "data/record.h"
#include "data/store/seals.h"
#include "data/store/store.h"

namespace palpate::data {

/// How servo samples are compressed, lossless to the bit: the column `packing` of the table
/// samples. tests/fuzz/samples.cpp feeds the decoder arbitrary bytes.
///
/// Packing 6: packing 5 with `bodies` and the fields of TrialRecord::bodies, for samples with a
/// body. Packing 5: the planes of packing 3 as one zstd frame (RFC 8878), which takes less room and
/// time. A long standstill is still packed in 3 or 4, uncompressed.
///
/// Packing 4: packing 3, followed by `bodies` and the fields of TrialRecord::bodies.
///
/// Packing 3: the fields of SampleRecord except `bodies`, in order of declaration, each as a column
/// of `count` values (vectors as three columns). Delta encoding: a value is its bit pattern minus
/// the previous one (modulo 2^32 or 2^64; 8-bit fields without delta). Byte transposition: each
/// column is stored as byte planes, most significant first; the upper bytes of consecutive samples
/// are alike and compress well. The whole is one zlib stream (RFC 1950), followed by the CRC-32 of
/// its content, most significant byte first (zlib's Adler-32 misses some single-bit errors).
///
/// Packing 2: without lateness_ns, compute_ns, device1, device2 (all read as 0) and the CRC, and
/// with only the lowest 8 bits of faults. Packing 1: in addition without period_ns.
inline constexpr int kSamplesPacking = 6;
inline constexpr int kPlainSamplesPacking = 5;  ///< for samples without bodies

/// As in TrialRecord.
struct RecordedSamples {
  std::vector<SampleRecord> samples;
  std::vector<BodyRecord> bodies;
};

struct PackedSamples {
  int packing = kPlainSamplesPacking;
  std::string bytes;
};

/// \param bodies  one for each sample, or none
/// \throws std::invalid_argument: another number of bodies
PackedSamples pack_samples(const std::vector<SampleRecord>& samples,
                           const std::vector<BodyRecord>& bodies = {});

/// \param packing  1 to kSamplesPacking
/// \throws StoreError: the bytes are not a packing of `count` samples. what() does not name the
/// file.
RecordedSamples unpack_samples(const void* data, std::size_t size, std::int64_t count,
                               int packing = kPlainSamplesPacking);

enum class AttemptState { running, completed, cut_off };

enum class SampleReading {
  skip,
  verify,  ///< against their checksum
  unpack,  ///< verify, then decode into TrialRecord::samples
};

/// Which attempts are visited. Their sessions are verified as a whole.
struct AttemptFilter {
  std::optional<AttemptState> state = {};                    ///< none: completed and cut off
  const TrialName* trial = nullptr;                          ///< this one, in every protocol
  std::optional<std::pair<std::int64_t, int>> session = {};  ///< participant's id, number
  SampleReading samples = SampleReading::skip;
  /// Selects the completed trials whose samples are read, called in order; none: all.
  const std::function<bool(const StoredTrial&)>* samples_wanted = nullptr;
  bool seals_verified = false;  ///< they are verified already, in the same snapshot of the database
};

/// Visits attempts by protocol, participant number, session, trial and attempt, and verifies them:
/// every session visited against its hash chain (seals.h), every value against the range that
/// palpate writes. Store, and StationDatabase for merge, read trials through this only. Also
/// verifies the rows of a session that are not visited.
/// \param version of the schema; seals exist since 3.
/// \throws SQLite::Exception (damage), StoreRefused (a row does not match its seal).
void read_attempts(SQLite::Database& db, const std::string& path, int version,
                   const AttemptFilter& filter,
                   const std::function<void(const StoredTrial&)>& visit);

/// Runs within a transaction of the caller; no effect if no attempt is open.
void cut_off_open_attempt(SQLite::Database& db, SealWriter& seals, const Run& run,
                          const std::string& reason);

}  // namespace palpate::data
