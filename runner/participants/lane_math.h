#pragma once
// Branch-free single-precision functions that compilers can vectorise (loops with calls to libm are
// not vectorised without -ffast-math). Only + - * / and sqrt, so results are the same to the bit on
// every machine.

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace palpate::runner::participants::lane {

// As many floats as a register holds, for loops that compilers do not vectorise by themselves. Each
// lane has the operations of a single float, so results are the same to the bit at every width.
#if defined(__AVX512F__)
inline constexpr int kWidth = 16;
#elif defined(__AVX__)
inline constexpr int kWidth = 8;
#else
inline constexpr int kWidth = 4;
#endif

using Floats = float __attribute__((vector_size(4 * kWidth)));
using Ints = std::int32_t __attribute__((vector_size(4 * kWidth)));  ///< also flags: 0 or -1

inline Floats load(const float* from) {
  Floats out;
  std::memcpy(&out, from, sizeof out);
  return out;
}
inline void store(const Floats& from, float* to) { std::memcpy(to, &from, sizeof from); }
inline Floats all(float value) { return value - Floats{}; }

inline float max(float a, float b) { return a > b ? a : b; }
inline float min(float a, float b) { return a < b ? a : b; }
inline float clamp(float x, float low, float high) { return min(max(x, low), high); }
inline float positive(float x) { return x > 0.0f ? x : 0.0f; }
inline float sign(float x) { return x < 0.0f ? -1.0f : 1.0f; }
inline float abs(float x) { return std::fabs(x); }

inline Floats max(const Floats& a, const Floats& b) { return a > b ? a : b; }
inline Floats min(const Floats& a, const Floats& b) { return a < b ? a : b; }
inline Floats abs(const Floats& x) { return max(x, -x); }
inline Floats mix(const Floats& a, const Floats& b, const Floats& t) { return a + t * (b - a); }

// The bits of floats, and the whole numbers of some bits as floats.
inline std::int32_t bits(float x) { return std::bit_cast<std::int32_t>(x); }
inline Ints bits(const Floats& x) { return reinterpret_cast<Ints>(x); }
inline float of_bits(std::int32_t x) { return std::bit_cast<float>(x); }
inline Floats of_bits(const Ints& x) { return reinterpret_cast<Floats>(x); }
inline float to_floats(std::int32_t x) { return static_cast<float>(x); }
inline Floats to_floats(const Ints& x) { return __builtin_convertvector(x, Floats); }

/// e^x for x <= 88. Relative error below 3e-7; clamped to e^-87 below x = -87.
template <class T>
inline T exp(T x) {
  x = max(x, T{} - 87.0f);
  // Adding 1.5 * 2^23 rounds to an integer and leaves it in the low bits of the mantissa.
  constexpr float kRounder = 12582912.0f;
  const T shifted = x * 1.44269504f + kRounder;
  const T n = shifted - kRounder;
  // ln 2 in two parts: the first has few enough bits that n times it is exact.
  const T r = (x - n * 0.693359375f) + n * 2.12194440e-4f;
  // Taylor, |r| <= ln(2) / 2: the first term left out is r^7 / 5040 < 1.2e-7.
  const T p =
      1.0f +
      r * (1.0f +
           r * (1.0f / 2 + r * (1.0f / 6 + r * (1.0f / 24 + r * (1.0f / 120 + r * (1.0f / 720))))));
  return p * of_bits((bits(shifted) - std::bit_cast<std::int32_t>(kRounder) + 127) << 23);
}

/// ln x for positive normal x. Absolute error below 2e-7 + 1.2e-7 |ln x|.
template <class T>
inline T log(T x) {
  // x = m 2^n with m in [sqrt(1/2), sqrt(2)).
  constexpr std::int32_t kRootHalf = 0x3f3504f3;
  const auto n = (bits(x) - kRootHalf) >> 23;
  const T m = of_bits(bits(x) - (n << 23));
  // ln m = 2 artanh f; the first term left out is 2 f^9 / 9 < 3e-8.
  const T f = (m - 1.0f) / (m + 1.0f);
  const T g = f * f;
  const T series = 1.0f + g * (1.0f / 3 + g * (1.0f / 5 + g * (1.0f / 7)));
  return to_floats(n) * 0.693147181f + 2.0f * f * series;
}

/// From here on ln Phi(x) is exactly zero.
inline constexpr float kLogNormalCdfIsZero = 6.0f;

/// ln Phi(x), Phi the standard normal distribution function.
/// Absolute error below 5e-6 for x > -5, relative error below 1e-6 beyond.
template <class T>
inline T log_normal_cdf(T x) {
  // erfc(a) = t exp(-a^2 + h(t)) with t = 1 / (1 + a/2), a >= 0; h is smooth on all of [0, 1].
  // Coefficients: our own Chebyshev interpolation of h in y = 2 t - 1, degree 7, error 3e-6.
  const T a = lane::abs(x) * 0.707106781f;
  const T t = 1.0f / (1.0f + 0.5f * a);
  const T y = 2.0f * t - 1.0f;
  T h = -0.001297829f * y + 0.00136074639f;
  h = h * y + 0.00814063271f;
  h = h * y - 0.00961388235f;
  h = h * y - 0.0467184495f;
  h = h * y + 0.047291129f;
  h = h * y + 0.672630484f;
  h = h * y - 0.671792452f;
  const T lower = lane::log(0.5f * t) + h - a * a;  // ln Phi(-|x|)
  const T upper = lane::log(1.0f - lane::exp(lower));
  return x < 0.0f ? lower : upper;
}

inline Floats sqrt(const Floats& x) {
  Floats out;
#if defined(__AVX512F__)
  out = reinterpret_cast<Floats>(_mm512_maskz_sqrt_ps(0xffff, reinterpret_cast<__m512>(x)));
#elif defined(__AVX__)
  out = reinterpret_cast<Floats>(_mm256_sqrt_ps(reinterpret_cast<__m256>(x)));
#elif defined(__SSE2__)
  out = reinterpret_cast<Floats>(_mm_sqrt_ps(reinterpret_cast<__m128>(x)));
#else
  for (int i = 0; i < kWidth; ++i) out[i] = std::sqrt(x[i]);
#endif
  return out;
}

inline bool any(const Ints& flags) {
#if defined(__AVX512F__)
  const auto bits = reinterpret_cast<__m512i>(flags);
  return _mm512_test_epi32_mask(bits, bits) != 0;
#elif defined(__AVX__)
  return _mm256_movemask_ps(reinterpret_cast<__m256>(flags)) != 0;
#elif defined(__SSE2__)
  return _mm_movemask_ps(reinterpret_cast<__m128>(flags)) != 0;
#else
  std::int32_t either = 0;
  for (int i = 0; i < kWidth; ++i) either |= flags[i];
  return either != 0;
#endif
}

/// Whether every lane of x[a] is at least 0 and less than end[a], for a = 0, 1, 2.
inline bool all_within(const Floats* x, const float* end) {
#if defined(__AVX512F__)
  // As whole numbers without sign, positive floats keep their order, and those with a sign come
  // after all of them: -0 is taken for outside, which changes no distance.
  __mmask16 within = 0xffff;
  for (int a = 0; a < 3; ++a) {
    within = _mm512_mask_cmplt_epu32_mask(within, reinterpret_cast<__m512i>(x[a]),
                                          _mm512_castps_si512(_mm512_set1_ps(end[a])));
  }
  return within == 0xffff;
#else
  Ints within = ~Ints{};  // NaN is outside
  for (int a = 0; a < 3; ++a) within &= (x[a] >= 0.0f) & (x[a] < end[a]);
  return !any(~within);
#endif
}

/// Flags of the first `count` lanes, of all if there are fewer.
inline Ints first_lanes(int count) {
  Ints lane;
  for (int i = 0; i < kWidth; ++i) lane[i] = i;
  return lane < count;
}

/// Stores the flagged lanes side by side. \return their number. \param to  has room for all lanes
template <class T>
int store_flagged(const T& from, const Ints& flags, void* to) {
  static_assert(sizeof from == sizeof flags);
#if defined(__AVX512F__)
  const auto bits = reinterpret_cast<__m512i>(flags);
  const __mmask16 chosen = _mm512_test_epi32_mask(bits, bits);
  _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(chosen, reinterpret_cast<__m512i>(from)));
  return __builtin_popcount(chosen);
#else
  int count = 0;
  for (int i = 0; i < kWidth; ++i) {
    const auto value = from[i];
    std::memcpy(static_cast<char*>(to) + sizeof value * static_cast<std::size_t>(count), &value,
                sizeof value);
    count -= flags[i];
  }
  return count;
#endif
}

/// Neighbours in memory, for each lane.
struct Pairs {
  Floats first, second;
};

/// from[at[i]] and from[at[i] + 1]
inline Pairs pairs(const float* from, const Ints& at) {
#if defined(__AVX512F__)
  // The functions without a mask have false alarms of g++ 12 (its bug 105593).
  const auto eight = [&](const __m256i places) {
    return _mm512_castpd_ps(_mm512_mask_i32gather_pd(_mm512_setzero_pd(), 0xff, places, from, 4));
  };
  const auto places = reinterpret_cast<__m512i>(at);
  const __m512 low = eight(_mm512_maskz_extracti64x4_epi64(0xff, places, 0)),
               high = eight(_mm512_maskz_extracti64x4_epi64(0xff, places, 1));
  const __m512i even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
  const __m512i odd = _mm512_setr_epi32(1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
  return {reinterpret_cast<Floats>(_mm512_permutex2var_ps(low, even, high)),
          reinterpret_cast<Floats>(_mm512_permutex2var_ps(low, odd, high))};
#else
  using Two = float __attribute__((vector_size(8)));
  using Four = float __attribute__((vector_size(16)));
  const auto two = [&](int i) {
    Two out;
    std::memcpy(&out, from + at[i], sizeof out);
    return out;
  };
  struct Fours {
    Four first, second;
  };
  const auto four = [&](int i) {
    const Four low = __builtin_shufflevector(two(i), two(i + 1), 0, 1, 2, 3),
               high = __builtin_shufflevector(two(i + 2), two(i + 3), 0, 1, 2, 3);
    return Fours{__builtin_shufflevector(low, high, 0, 2, 4, 6),
                 __builtin_shufflevector(low, high, 1, 3, 5, 7)};
  };
#if defined(__AVX__)
  const Fours low = four(0), high = four(4);
  return {__builtin_shufflevector(low.first, high.first, 0, 1, 2, 3, 4, 5, 6, 7),
          __builtin_shufflevector(low.second, high.second, 0, 1, 2, 3, 4, 5, 6, 7)};
#else
  const Fours only = four(0);
  return {only.first, only.second};
#endif
#endif
}

}  // namespace palpate::runner::participants::lane
