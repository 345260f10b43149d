#include "protocols/latin_square.h"

#include <algorithm>
#include <stdexcept>

namespace palpate::protocols {

int latin_square_rows(int n) { return n % 2 == 0 || n == 1 ? n : 2 * n; }

std::vector<int> latin_square_row(int n, int participant_number) {
  if (n < 1) throw std::invalid_argument("a Latin square needs at least one condition");
  if (participant_number < 1) throw std::invalid_argument("participants are numbered from 1");
  const int row = (participant_number - 1) % latin_square_rows(n);
  // 0, 1, n-1, 2, n-2, ...: neighbours differ by every amount once (twice up to sign for odd n,
  // where the mirrored rows make up for it); adding the row's number keeps the differences.
  std::vector<int> order;
  for (int k = 0; k < n; ++k) {
    const int zigzag = k % 2 == 1 ? (k + 1) / 2 : (n - k / 2) % n;
    order.push_back((zigzag + row) % n);
  }
  if (row >= n) std::reverse(order.begin(), order.end());
  return order;
}

}  // namespace palpate::protocols
