#pragma once
// Internal to data/: servo samples <-> bytes, exact to the bit.

#include <cstdint>
#include <string>
#include <vector>

#include "data/record.h"

namespace palpate::data {

/// Packing 3: the fields of SampleRecord in order of declaration, each as a column of `count`
/// values (vectors as three columns); a value is its bit pattern minus the one before it (modulo
/// 2^32 or 2^64; 8-bit fields as they are); each column is stored byte plane by byte plane, most
/// significant first; the whole is one zlib stream, followed by the CRC-32 of what it unpacks to,
/// most significant byte first (zlib's own Adler-32 lets some changes of a bit through).
/// Neighbouring samples are alike in their upper bytes, which is what makes them small. Packing 2
/// is the same without lateness_ns, compute_ns, device1, device2 and the CRC, the first four of
/// which read as 0, and with the lowest 8 bits of faults alone; packing 1 is without period_ns,
/// too.
inline constexpr int kSamplesPacking = 3;

std::string pack_samples(const std::vector<SampleRecord>& samples);

/// \param packing  1 to kSamplesPacking
/// \throws StoreError: the bytes are no packing of `count` samples. what() does not know the file.
std::vector<SampleRecord> unpack_samples(const void* data, std::size_t size, std::int64_t count,
                                         int packing = kSamplesPacking);

}  // namespace palpate::data
