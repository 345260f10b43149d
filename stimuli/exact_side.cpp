#include "stimuli/exact_side.h"

#include <array>
#include <cmath>
#include <cstddef>

namespace palpate::stimuli {

int side_of(const Vec3& a, const Vec3& b, const Vec3& q) {
  const double left = (b.x - a.x) * (q.y - a.y), right = (b.y - a.y) * (q.x - a.x);
  const double det = left - right;
  // Shewchuk 1997, orient2d: the error of the plain formula.
  if (std::abs(det) > 3.4e-16 * (std::abs(left) + std::abs(right))) return det > 0 ? 1 : -1;
  // The six products as exact sums of two numbers, added without error.
  std::array<double, 12> sum{};
  std::size_t count = 0;
  const auto add = [&](double value) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const double total = value + sum[i], back = total - value;
      const double error = (value - (total - back)) + (sum[i] - back);
      if (error != 0) sum[kept++] = error;
      value = total;
    }
    sum[kept++] = value;
    count = kept;
  };
  const auto add_product = [&](double x, double y) {
    const double product = x * y;
    add(std::fma(x, y, -product));
    add(product);
  };
  add_product(a.x, b.y);
  add_product(-a.y, b.x);
  add_product(b.x, q.y);
  add_product(-b.y, q.x);
  add_product(q.x, a.y);
  add_product(-q.y, a.x);
  if (sum[count - 1] != 0) return sum[count - 1] > 0 ? 1 : -1;
  if (b.y != a.y) return b.y < a.y ? 1 : -1;
  return b.x > a.x ? 1 : b.x < a.x ? -1 : 0;
}

}  // namespace palpate::stimuli
