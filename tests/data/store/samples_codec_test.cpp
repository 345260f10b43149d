#include <gtest/gtest.h>
#include <zlib.h>
#include <zstd.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <stdexcept>

#include "data/store/attempts.h"
#include "data/store/store.h"
#include "tests/shared/peak_memory.h"

namespace palpate::data {
namespace {

std::vector<std::uint64_t> bits_of(const SampleRecord& sample) {
  std::vector<std::uint64_t> bits{sample.tick,
                                  static_cast<std::uint64_t>(sample.period_ns),
                                  static_cast<std::uint64_t>(sample.lateness_ns),
                                  static_cast<std::uint64_t>(sample.compute_ns),
                                  sample.contacts,
                                  sample.contact_type,
                                  sample.buttons,
                                  sample.faults,
                                  std::bit_cast<std::uint64_t>(sample.depth)};
  for (const auto& vector :
       {sample.tip, sample.tail, sample.force, sample.torque, sample.device1, sample.device2}) {
    for (const double x : vector) bits.push_back(std::bit_cast<std::uint64_t>(x));
  }
  return bits;
}

void expect_same_bits(const std::vector<SampleRecord>& samples) {
  const auto [packing, packed] = pack_samples(samples);
  const auto back = unpack_samples(packed.data(), packed.size(),
                                   static_cast<std::int64_t>(samples.size()), packing)
                        .samples;
  ASSERT_EQ(back.size(), samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_EQ(bits_of(back[i]), bits_of(samples[i])) << "sample " << i;
  }
}

/// A stroke over an object, sampled at 1 kHz with sensor noise.
std::vector<SampleRecord> a_stroke(int ticks) {
  constexpr std::uint32_t kSeed = 7;
  std::mt19937 noise(kSeed);
  std::vector<SampleRecord> samples(static_cast<std::size_t>(ticks));
  for (int t = 0; t < ticks; ++t) {
    auto& s = samples[static_cast<std::size_t>(t)];
    s.tick = static_cast<std::uint32_t>(t);
    s.period_ns = 1'000'000 + static_cast<std::int64_t>(noise() % 1000);
    const auto jitter = [&] { return 1e-6 * static_cast<double>(noise() % 100); };
    s.tip = {0.03 * std::sin(t * 1e-3) + jitter(), 0.02 * std::cos(t * 2e-3) + jitter(),
             0.03 + jitter()};
    s.tail = {s.tip[0], s.tip[1] + jitter(), s.tip[2] + 0.12};
    s.depth = t % 2000 < 1000 ? 1e-3 * std::abs(std::sin(t * 3e-3)) : 0;
    s.force = s.device1 = {0, 0, 800 * s.depth};
    s.lateness_ns = static_cast<std::int64_t>(noise() % 50'000);
    s.compute_ns = 1000 + static_cast<std::int64_t>(noise() % 1000);
    s.contacts = s.depth > 0;
  }
  return samples;
}

TEST(SamplesCodec, BodiesComeBackOtherSamplesKeepTheirPacking) {
  constexpr std::uint64_t kSeed = 4;
  std::mt19937_64 random(kSeed);
  std::vector<SampleRecord> samples = a_stroke(50);
  std::vector<BodyRecord> bodies;
  const auto [plain_packing, plain] = pack_samples(samples);
  EXPECT_EQ(plain_packing, kPlainSamplesPacking);
  bodies.resize(samples.size());
  for (std::size_t i = 10; i < samples.size(); ++i) {  // at first nothing was shown
    samples[i].bodies = 1;
    for (auto* vector : {&bodies[i].centre, &bodies[i].velocity, &bodies[i].spin}) {
      for (double& x : *vector) x = std::bit_cast<double>(random());
    }
    for (double& x : bodies[i].orientation_wxyz) x = std::bit_cast<double>(random());
  }
  const auto [packing, packed] = pack_samples(samples, bodies);
  EXPECT_EQ(packing, kSamplesPacking);
  const RecordedSamples back = unpack_samples(packed.data(), packed.size(), 50, kSamplesPacking);
  const auto bits = [](const auto& values) {
    std::vector<std::uint64_t> out;
    out.reserve(values.size());
    for (const double x : values) out.push_back(std::bit_cast<std::uint64_t>(x));
    return out;
  };
  ASSERT_EQ(back.bodies.size(), bodies.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_EQ(bits_of(back.samples[i]), bits_of(samples[i])) << i;
    EXPECT_EQ(back.samples[i].bodies, samples[i].bodies) << i;
    EXPECT_EQ(bits(back.bodies[i].centre), bits(bodies[i].centre)) << i;
    EXPECT_EQ(bits(back.bodies[i].orientation_wxyz), bits(bodies[i].orientation_wxyz)) << i;
    EXPECT_EQ(bits(back.bodies[i].velocity), bits(bodies[i].velocity)) << i;
    EXPECT_EQ(bits(back.bodies[i].spin), bits(bodies[i].spin)) << i;
  }
  EXPECT_TRUE(unpack_samples(plain.data(), plain.size(), 50).bodies.empty());
  EXPECT_THROW(unpack_samples(plain.data(), plain.size(), 50, kSamplesPacking), StoreError);
  EXPECT_THROW(unpack_samples(packed.data(), packed.size(), 50, kPlainSamplesPacking), StoreError);
  bodies.pop_back();
  EXPECT_THROW(pack_samples(samples, bodies), std::invalid_argument);
}

TEST(SamplesCodec, EveryBitPatternComesBack) {
  constexpr std::uint64_t kSeed = 1;
  std::mt19937_64 random(kSeed);
  std::vector<SampleRecord> samples(257);
  for (auto& s : samples) {
    s.tick = static_cast<std::uint32_t>(random());
    s.period_ns = static_cast<std::int64_t>(random());
    s.lateness_ns = static_cast<std::int64_t>(random());
    s.compute_ns = static_cast<std::int64_t>(random());
    for (auto* vector : {&s.tip, &s.tail, &s.force, &s.torque, &s.device1, &s.device2}) {
      for (double& x : *vector) x = std::bit_cast<double>(random());
    }
    s.depth = std::bit_cast<double>(random());
    s.contacts = static_cast<std::uint8_t>(random());
    s.contact_type = static_cast<std::uint8_t>(random());
    s.buttons = static_cast<std::uint8_t>(random());
    s.faults = static_cast<std::uint32_t>(random());
  }
  using Limits = std::numeric_limits<double>;
  samples[3].tip = {Limits::quiet_NaN(), std::bit_cast<double>(0x7FF0000000000001u), -0.0};
  samples[4].force = {Limits::infinity(), -Limits::infinity(), Limits::denorm_min()};
  samples[5].depth = std::bit_cast<double>(0xFFFFFFFFFFFFFFFFu);
  expect_same_bits(samples);
}

TEST(SamplesCodec, AnyNumberOfSamplesComesBack) {
  expect_same_bits({});
  expect_same_bits(a_stroke(1));
  expect_same_bits(a_stroke(10'000));
}

TEST(SamplesCodec, AStrokeWithNoiseTakesLessThanHalf) {
  const auto samples = a_stroke(10'000);
  EXPECT_LT(pack_samples(samples).bytes.size(), samples.size() * 94);  // 187 bytes each before
}

TEST(SamplesCodec, TheFirstPackingIsReadWithoutPeriods) {
  // Two samples of packing 1, made by the program that wrote it.
  const unsigned char packed[] = {
      0x78, 0x5e, 0x63, 0x60, 0x00, 0x03, 0x46, 0x7b, 0x86, 0x16, 0x86, 0x2a, 0x86, 0x87, 0x0c,
      0xee, 0x0c, 0xeb, 0x18, 0x44, 0x18, 0xaa, 0x19, 0xf6, 0x33, 0x4c, 0x41, 0xe1, 0xdb, 0x33,
      0xcc, 0x63, 0xd8, 0xc1, 0x10, 0xc8, 0xf0, 0x9a, 0xa1, 0x95, 0x41, 0x0e, 0xc8, 0xa2, 0x18,
      0x34, 0xa0, 0x99, 0x60, 0xcf, 0xf0, 0x92, 0x61, 0x26, 0x1c, 0xce, 0x22, 0xd9, 0x7c, 0x7b,
      0x86, 0x00, 0x86, 0x24, 0x06, 0x5f, 0x86, 0x4b, 0x0c, 0x1f, 0x19, 0x56, 0x32, 0xfc, 0x61,
      0x60, 0x04, 0x42, 0x06, 0x06, 0x01, 0x00, 0xf9, 0x68, 0x15, 0xf9};
  const auto back = unpack_samples(packed, sizeof packed, 2, 1).samples;
  ASSERT_EQ(back.size(), 2u);
  EXPECT_EQ(back[0].tick, 0u);
  EXPECT_EQ(back[1].tick, 1u);
  EXPECT_EQ(back[1].period_ns, 0);
  EXPECT_EQ(back[0].tip, (std::array<double, 3>{0.01, -0.02, 0.03}));
  EXPECT_EQ(back[1].force, (std::array<double, 3>{0, -0.0, 0.8}));
  EXPECT_EQ(back[1].depth, 0.001);
  EXPECT_EQ(back[1].faults, 16u);
  EXPECT_THROW(unpack_samples(packed, sizeof packed, 2, 2), StoreError);
}

TEST(SamplesCodec, SecondPackingIsReadWithoutLatenessAndCommands) {
  // Two samples of packing 2, made from its description by another program.
  const unsigned char packed[] = {
      0x78, 0x5e, 0x63, 0x60, 0x00, 0x03, 0x46, 0x08, 0x05, 0x02, 0xfc, 0x0c, 0x4e, 0x8c, 0x0e,
      0x5f, 0xec, 0x19, 0x5a, 0x18, 0xaa, 0x18, 0x1e, 0x32, 0xb8, 0x33, 0xac, 0x63, 0x10, 0x61,
      0xa8, 0x66, 0xd8, 0xcf, 0x30, 0x05, 0x85, 0x6f, 0xcf, 0x30, 0x8f, 0x71, 0x07, 0x5b, 0xa0,
      0xca, 0xeb, 0xbb, 0xad, 0xfa, 0x72, 0x52, 0x3b, 0x16, 0x10, 0x56, 0x7f, 0x98, 0xc1, 0x58,
      0xc1, 0xf8, 0x88, 0xf1, 0x6c, 0xe3, 0xa5, 0xc6, 0x8f, 0x8d, 0x43, 0x10, 0xf6, 0x41, 0x59,
      0x0d, 0x68, 0x22, 0xf6, 0x0c, 0x2f, 0x19, 0x66, 0xc2, 0xe1, 0x2c, 0x0c, 0xf5, 0x84, 0x04,
      0xec, 0x19, 0x02, 0x18, 0x92, 0x18, 0x7c, 0x19, 0x2e, 0x31, 0x7c, 0x64, 0x58, 0xc9, 0xf0,
      0x07, 0xe8, 0x43, 0x46, 0x06, 0x16, 0x06, 0x01, 0x00, 0x08, 0x90, 0x26, 0xd7};
  const auto back = unpack_samples(packed, sizeof packed, 2, 2).samples;
  ASSERT_EQ(back.size(), 2u);
  EXPECT_EQ(back[1].tick, 1u);
  EXPECT_EQ(back[1].period_ns, 1'000'500);
  EXPECT_EQ(back[1].lateness_ns, 0);
  EXPECT_EQ(back[1].tail, (std::array<double, 3>{0.01, -0.02, 0.151}));
  EXPECT_EQ(back[1].force, (std::array<double, 3>{0, -0.0, 0.8}));
  EXPECT_EQ(back[1].device1, (std::array<double, 3>{}));
  EXPECT_EQ(back[1].depth, 0.001);
  EXPECT_EQ(back[1].buttons, 4);
  EXPECT_EQ(back[1].faults, 16u);
  EXPECT_THROW(unpack_samples(packed, sizeof packed, 2, 3), StoreError);
}

TEST(SamplesCodec, RefusesAbsurdCountsBeforeAllocating) {
  const std::string packed = pack_samples(a_stroke(10)).bytes;
  EXPECT_THROW(unpack_samples(packed.data(), packed.size(), 99'999'999), StoreError);
  const std::vector<SampleRecord> still(200'000);  // the smallest packed samples
  expect_same_bits(still);
}

void add_crc(std::string& packed, std::uint32_t crc) {
  for (int shift = 24; shift >= 0; shift -= 8) packed += static_cast<char>(crc >> shift);
}

/// Zeros as zstd packs them, a valid blob of packing 5.
std::string a_zstd_bomb(std::size_t count) {
  constexpr std::size_t kBytesASample = 187;
  const std::string zeros(count * kBytesASample, '\0');
  std::string packed(ZSTD_compressBound(zeros.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), zeros.data(), zeros.size(), 3));
  add_crc(packed,
          static_cast<std::uint32_t>(crc32_z(
              crc32_z(0, nullptr, 0), reinterpret_cast<const Bytef*>(zeros.data()), zeros.size())));
  return packed;
}

/// The planes of packing 5 as packing 3 had them.
std::string as_zlib(const std::string& packed, std::size_t planes) {
  std::string bytes(planes, '\0');
  EXPECT_EQ(ZSTD_decompress(bytes.data(), planes, packed.data(), packed.size() - 4), planes);
  uLongf size = compressBound(planes);
  std::string old(size, '\0');
  compress2(reinterpret_cast<Bytef*>(old.data()), &size,
            reinterpret_cast<const Bytef*>(bytes.data()), planes, 3);
  return old.substr(0, size) + packed.substr(packed.size() - 4);
}

TEST(SamplesCodec, TheThirdPackingIsRead) {
  constexpr std::size_t kTicks = 2000;
  const auto samples = a_stroke(kTicks);
  const std::string packed = pack_samples(samples).bytes;
  const std::string old = as_zlib(packed, kTicks * 187);
  const auto back = unpack_samples(old.data(), old.size(), kTicks, 3).samples;
  for (std::size_t i = 0; i < kTicks; ++i) ASSERT_EQ(bits_of(back[i]), bits_of(samples[i]));
  EXPECT_LT(packed.size(), old.size());
  EXPECT_THROW(unpack_samples(old.data(), old.size(), kTicks, 5), StoreError);
  EXPECT_THROW(unpack_samples(packed.data(), packed.size(), kTicks, 3), StoreError);
}

/// A valid blob of the third packing, with all-zero samples.
std::string a_bomb(std::size_t count) {
  std::string packed(count, '\0');
  const std::vector<unsigned char> zeros(count);
  z_stream stream{};
  deflateInit(&stream, 6);
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  uLong crc = crc32_z(0, nullptr, 0);
  constexpr int kBytesASample = 187;  // as data/store/attempts.h has it
  for (int i = 0; i < kBytesASample; ++i) {
    stream.next_in = const_cast<Bytef*>(zeros.data());
    stream.avail_in = static_cast<uInt>(count);
    crc = crc32_z(crc, zeros.data(), count);
    deflate(&stream, i + 1 == kBytesASample ? Z_FINISH : Z_NO_FLUSH);
  }
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  add_crc(packed, static_cast<std::uint32_t>(crc));
  return packed;
}

TEST(SamplesCodec, MemoryIsInProportionToTheBytes) {
  const auto peak = [](const std::string& packed, std::size_t count, bool good, int packing) {
    return peak_memory([&] {
      try {
        const auto samples =
            unpack_samples(packed.data(), packed.size(), static_cast<std::int64_t>(count), packing)
                .samples;
        if (!good || samples.size() != count) _exit(2);
      } catch (const StoreError&) {
        if (good) _exit(2);
      }
    });
  };
  constexpr std::size_t kRecord = sizeof(SampleRecord);
  const std::string stroke = pack_samples(a_stroke(100'000)).bytes;
  const auto whole = peak(stroke, 100'000, true, kPlainSamplesPacking);
  ASSERT_TRUE(whole);
  EXPECT_LT(*whole, 100'000 * (kRecord + 8) + (4U << 20U));  // no additional copy
  // 180 kB that unpack to a million samples, 187 MB; in memory they would take more.
  const std::string bomb = a_bomb(1'000'000);
  EXPECT_LT(bomb.size(), 500'000U);
  const auto refused = peak(bomb, 1'000'000, false, 3);
  ASSERT_TRUE(refused);
  EXPECT_LT(*refused, 4U << 20U);
  const std::string smaller = a_zstd_bomb(1'000'000);
  EXPECT_LT(smaller.size(), 50'000U);
  const auto refused_too = peak(smaller, 1'000'000, false, 5);
  ASSERT_TRUE(refused_too);
  EXPECT_LT(*refused_too, 4U << 20U);
  // The largest count accepted with few bytes.
  const auto most = peak(a_bomb(400'000), 400'000, true, 3);
  ASSERT_TRUE(most);
  EXPECT_LT(*most, 100U << 20U);
}

TEST(SamplesCodec, LongStandstillsAreStoredAndReadAgain) {
  constexpr std::size_t kTicks = 450'000;
  const auto [packing, packed] = pack_samples(std::vector<SampleRecord>(kTicks));
  EXPECT_EQ(packing, 3);
  const auto back = unpack_samples(packed.data(), packed.size(), kTicks, packing).samples;
  ASSERT_EQ(back.size(), kTicks);
  EXPECT_EQ(bits_of(back.back()), bits_of(SampleRecord{}));
}

TEST(SamplesCodec, DamageIsRefused) {
  const auto samples = a_stroke(100);
  const std::string packed = pack_samples(samples).bytes;
  const auto unpack = [](const std::string& bytes, std::int64_t count) {
    return unpack_samples(bytes.data(), bytes.size(), count).samples;
  };
  EXPECT_THROW(unpack(packed.substr(0, packed.size() - 1), 100), StoreError);
  EXPECT_THROW(unpack(packed + "x", 100), StoreError);
  EXPECT_THROW(unpack(packed, 99), StoreError);
  EXPECT_THROW(unpack(packed, 101), StoreError);
  EXPECT_THROW(unpack(packed, -1), StoreError);
  EXPECT_THROW(unpack(packed, std::numeric_limits<std::int64_t>::max()), StoreError);
  EXPECT_THROW(unpack("", 1), StoreError);
  for (std::size_t i = 0; i < packed.size(); ++i) {
    std::string damaged = packed;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x10);
    try {
      const auto back = unpack(damaged, 100);
      // A bit that zstd does not use (in its header) changes nothing.
      for (std::size_t k = 0; k < back.size(); ++k)
        ASSERT_EQ(bits_of(back[k]), bits_of(samples[k]));
    } catch (const StoreError&) {
      continue;
    }
  }
}

}  // namespace
}  // namespace palpate::data
