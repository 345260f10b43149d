#include "data/samples_codec.h"

#include <zlib.h>

#include <bit>
#include <type_traits>

#include "data/store.h"

namespace palpate {
namespace {

constexpr std::size_t bytes_a_sample(int packing) {
  return 4 + (packing > 1 ? 8 : 0) + 13 * 8 + 4 + (packing > 2 ? 2 * 8 + 6 * 8 + 3 : 0);
}
constexpr std::int64_t kMostSamples = 100'000'000;  // more than a day at 1 kHz: a damaged count
constexpr std::size_t kMostShrunk = 1032;           // zlib makes nothing smaller than this part
// A trial of 10 s packs in some 50 ms at this level, and higher ones save little: the low bytes of
// a measured signal are noise.
constexpr int kLevel = 3;

// One visit for both directions: `column(get, form)` where get(sample) is a reference to the field,
// and `form` has the type that it is stored as.
template <class Visitor>
void visit_columns(int packing, Visitor&& column) {
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
}

constexpr std::size_t kCrcSize = 4;

std::uint32_t crc_of(const unsigned char* bytes, std::size_t size) {
  return static_cast<std::uint32_t>(crc32_z(crc32_z(0, nullptr, 0), bytes, size));
}

template <class Field>
using Bits = std::conditional_t<sizeof(Field) == 8, std::uint64_t, Field>;

}  // namespace

std::string pack_samples(const std::vector<SampleRecord>& samples) {
  const std::size_t count = samples.size();
  std::vector<unsigned char> planes(count * bytes_a_sample(kSamplesPacking));
  std::size_t offset = 0;
  visit_columns(kSamplesPacking, [&](auto get, auto form) {
    using Field = decltype(form);
    using Pattern = Bits<Field>;
    Pattern before = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const auto pattern = std::bit_cast<Pattern>(static_cast<Field>(get(samples[i])));
      const auto stored = sizeof(Field) == 1 ? pattern : static_cast<Pattern>(pattern - before);
      before = pattern;
      for (std::size_t byte = 0; byte < sizeof(Field); ++byte) {
        planes[offset + byte * count + i] =
            static_cast<unsigned char>(stored >> (8 * (sizeof(Field) - 1 - byte)));
      }
    }
    offset += sizeof(Field) * count;
  });
  uLongf size = compressBound(planes.size());
  std::string packed(size, '\0');
  const int status = compress2(reinterpret_cast<Bytef*>(packed.data()), &size, planes.data(),
                               planes.size(), kLevel);
  if (status != Z_OK) throw StoreError("the samples could not be compressed: out of memory");
  packed.resize(size);
  const std::uint32_t crc = crc_of(planes.data(), planes.size());
  for (int shift = 24; shift >= 0; shift -= 8) packed += static_cast<char>(crc >> shift);
  return packed;
}

std::vector<SampleRecord> unpack_samples(const void* data, std::size_t size, std::int64_t count,
                                         int packing) {
  if (count < 0 || count > kMostSamples) throw StoreError("the number of samples is damaged");
  const auto rows = static_cast<std::size_t>(count);
  const std::size_t expected = rows * bytes_a_sample(packing);
  if (expected / kMostShrunk > size || (packing > 2 && size < kCrcSize))
    throw StoreError("the samples are damaged");
  if (packing > 2) size -= kCrcSize;
  std::vector<unsigned char> planes(expected + 1);  // one more: a longer stream shows
  uLongf length = planes.size();
  uLong used = size;
  const int status = uncompress2(planes.data(), &length, static_cast<const Bytef*>(data), &used);
  if (status != Z_OK || length != expected || used != size)
    throw StoreError("the samples are damaged");
  if (packing > 2) {
    std::uint32_t crc = 0;
    for (std::size_t i = 0; i < kCrcSize; ++i)
      crc = crc << 8 | static_cast<const unsigned char*>(data)[size + i];
    if (crc != crc_of(planes.data(), expected)) throw StoreError("the samples are damaged");
  }
  std::vector<SampleRecord> samples(rows);
  std::size_t offset = 0;
  visit_columns(packing, [&](auto get, auto form) {
    using Field = decltype(form);
    using Pattern = Bits<Field>;
    Pattern before = 0;
    for (std::size_t i = 0; i < rows; ++i) {
      std::uint64_t stored = 0;
      for (std::size_t byte = 0; byte < sizeof(Field); ++byte) {
        stored = stored << 8 | planes[offset + byte * rows + i];
      }
      const auto pattern = static_cast<Pattern>(sizeof(Field) == 1 ? stored : stored + before);
      before = pattern;
      get(samples[i]) = std::bit_cast<Field>(pattern);
    }
    offset += sizeof(Field) * rows;
  });
  return samples;
}

}  // namespace palpate
