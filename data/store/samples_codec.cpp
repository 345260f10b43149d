#include "data/store/samples_codec.h"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <span>
#include <stdexcept>
#include <type_traits>

#include "data/errors.h"

namespace palpate::data {
namespace {

constexpr std::size_t bytes_a_sample(int packing) {
  return 4 + (packing > 1 ? 8 : 0) + 13 * 8 + 4 + (packing > 2 ? 2 * 8 + 6 * 8 + 3 : 0) +
         (packing > 3 ? 1 + 13 * 8 : 0);
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
// zlib's level: a trial of 10 s takes some 50 ms, and higher levels save little, because the low
// bytes of a measured signal are noise.
constexpr int kLevel = 3;

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
  if (packing < 4) return;
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

/// Decompresses a zlib stream piece by piece.
class Planes {
 public:
  Planes(const void* data, std::size_t size) : left_(size) {
    stream_.next_in = const_cast<Bytef*>(static_cast<const Bytef*>(data));
    if (inflateInit(&stream_) != Z_OK) throw StoreError("the samples: out of memory");
  }
  Planes(const Planes&) = delete;
  Planes& operator=(const Planes&) = delete;
  ~Planes() { inflateEnd(&stream_); }

  /// The next bytes, at least one and at most `most`. \throws StoreError at the end.
  std::span<const unsigned char> take(std::size_t most) {
    if (at_ == end_ && !fill()) refuse();
    const std::span<const unsigned char> some(piece_.data() + at_, std::min(most, end_ - at_));
    at_ += some.size();
    return some;
  }

  /// \throws StoreError: more bytes follow, compressed or decompressed.
  void expect_end() {
    if (at_ != end_ || fill() || left_ + stream_.avail_in > 0) refuse();
  }

  /// CRC-32 of all decompressed bytes.
  std::uint32_t crc() const { return static_cast<std::uint32_t>(crc_); }

 private:
  /// False at the end of the stream.
  bool fill() {
    at_ = end_ = 0;
    while (end_ == 0 && !ended_) {
      if (stream_.avail_in == 0) {  // avail_in has 32 bits
        stream_.avail_in = static_cast<uInt>(std::min<std::size_t>(left_, 1U << 30U));
        left_ -= stream_.avail_in;
      }
      stream_.next_out = piece_.data();
      stream_.avail_out = static_cast<uInt>(piece_.size());
      const int status = inflate(&stream_, Z_NO_FLUSH);
      if (status != Z_OK && status != Z_STREAM_END) refuse();
      ended_ = status == Z_STREAM_END;
      end_ = piece_.size() - stream_.avail_out;
    }
    crc_ = crc32_z(crc_, piece_.data(), end_);
    return end_ > 0;
  }

  z_stream stream_{};
  std::size_t left_;  // input bytes not yet given to the stream
  std::vector<unsigned char> piece_ = std::vector<unsigned char>(kPiece);
  std::size_t at_ = 0, end_ = 0;
  bool ended_ = false;
  uLong crc_ = crc32_z(0, nullptr, 0);
};

template <class Field>
using Bits = std::conditional_t<sizeof(Field) == 8, std::uint64_t, Field>;

std::string compressed(const std::vector<unsigned char>& planes, int level) {
  uLongf size = compressBound(planes.size());
  std::string packed(size, '\0');
  const int status = compress2(reinterpret_cast<Bytef*>(packed.data()), &size, planes.data(),
                               planes.size(), level);
  if (status != Z_OK) throw StoreError("the samples could not be compressed: out of memory");
  packed.resize(size);
  return packed;
}

}  // namespace

int packing_for(const std::vector<BodyRecord>& bodies) {
  return bodies.empty() ? kPlainSamplesPacking : kSamplesPacking;
}

std::string pack_samples(const std::vector<SampleRecord>& samples,
                         const std::vector<BodyRecord>& bodies) {
  const std::size_t count = samples.size();
  if (!bodies.empty() && bodies.size() != count)
    throw std::invalid_argument("expected one body for each sample, or none");
  const int packing = packing_for(bodies);
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
  std::string packed = compressed(planes, kLevel);
  // Store nearly equal samples uncompressed: their compressed size would look like a damaged count.
  if (!bytes_suffice(count, packed.size())) packed = compressed(planes, Z_NO_COMPRESSION);
  const std::uint32_t crc = crc_of(planes.data(), planes.size());
  for (int shift = 24; shift >= 0; shift -= 8) packed += static_cast<char>(crc >> shift);
  return packed;
}

RecordedSamples unpack_samples(const void* data, std::size_t size, std::int64_t count,
                               int packing) {
  if (count < 0 || count > kMostSamples) throw StoreError("the number of samples is damaged");
  const auto rows = static_cast<std::size_t>(count);
  const std::size_t expected = rows * bytes_a_sample(packing);
  if (expected / kMostShrunk > size || (packing > 2 && size < kCrcSize)) refuse();
  if (!bytes_suffice(rows, size)) refuse();
  if (packing > 2) size -= kCrcSize;
  Planes planes(data, size);
  RecordedSamples out;
  out.samples.resize(rows);
  if (packing > kPlainSamplesPacking) out.bodies.resize(rows);
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

}  // namespace palpate::data
