#pragma once
// Internal to data/store: compresses servo samples, lossless to the bit. The format is the column
// `packing` of the table samples; tests/fuzz/samples.cpp feeds the decoder arbitrary bytes.

#include <cstdint>
#include <string>
#include <vector>

#include "data/record.h"

namespace palpate::data {

/// Packing 4: packing 3, followed by `bodies` and the fields of TrialRecord::bodies; for samples
/// with a body.
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
inline constexpr int kSamplesPacking = 4;
inline constexpr int kPlainSamplesPacking = 3;  ///< for samples without bodies

/// As in TrialRecord.
struct RecordedSamples {
  std::vector<SampleRecord> samples;
  std::vector<BodyRecord> bodies;
};

/// The packing for samples: 4 if there are bodies, else 3.
int packing_for(const std::vector<BodyRecord>& bodies);
/// Packs samples in packing_for(bodies). \param bodies one for each sample, or none
/// \throws std::invalid_argument: another number of bodies
std::string pack_samples(const std::vector<SampleRecord>& samples,
                         const std::vector<BodyRecord>& bodies = {});

/// \param packing  1 to kSamplesPacking
/// \throws StoreError: the bytes are not a packing of `count` samples. what() does not name the
/// file.
RecordedSamples unpack_samples(const void* data, std::size_t size, std::int64_t count,
                               int packing = kPlainSamplesPacking);

}  // namespace palpate::data
