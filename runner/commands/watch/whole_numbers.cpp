#include "runner/commands/watch/whole_numbers.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "data/base/text.h"

namespace palpate::runner {
namespace {

constexpr int kHighestOrder = 3;
// A page counts in double precision, exact to 2^53; a difference of order 3 is up to 8 times a
// value, and zigzag doubles it.
constexpr double kLargest = 1e14;

void put(std::string& out, std::int64_t value) {
  std::uint64_t rest =
      (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63);  // zigzag
  for (; rest > 127; rest >>= 7) out += static_cast<char>((rest & 127) | 128);
  out += static_cast<char>(rest);
}

std::string packed(const std::vector<std::int64_t>& values) {
  std::string out;
  for (const std::int64_t value : values) put(out, value);
  return out;
}

/// In place; what was before the first value counts as 0.
void difference(std::vector<std::int64_t>& values) {
  for (std::size_t i = values.size(); i-- > 1;) values[i] -= values[i - 1];
}

std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::string out(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(out.data()), &size,
                reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uLong>(bytes.size()),
                Z_BEST_COMPRESSION) != Z_OK)
    throw std::runtime_error("the ticks could not be compressed");
  out.resize(size);
  return out;
}

}  // namespace

void WholeNumbers::add(const std::string& name, std::span<const double> values,
                       double steps_per_unit) {
  std::vector<std::int64_t> whole;
  whole.reserve(values.size());
  for (const double value : values) {
    const double steps = value * steps_per_unit;
    const std::int64_t before = whole.empty() ? 0 : whole.back();
    whole.push_back(std::isfinite(steps) ? std::llround(std::clamp(steps, -kLargest, kLargest))
                                         : before);
  }
  int best_order = 0;
  std::string best = packed(whole);
  for (int order = 1; order <= kHighestOrder; ++order) {
    difference(whole);
    std::string bytes = packed(whole);
    if (bytes.size() >= best.size()) continue;
    best = std::move(bytes);
    best_order = order;
  }
  columns_.push_back({name, values.size(), steps_per_unit, best_order});
  bytes_ += best;
}

std::string WholeNumbers::text() const { return base64_encoded(deflated(bytes_)); }

}  // namespace palpate::runner
