#include "protocols/order.h"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <utility>

#include "protocols/schedule.h"

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

namespace {

/// An order under construction: what has been placed, what remains, whether it can be completed.
class Arrangement {
 public:
  Arrangement(const std::vector<int>& counts, const Protocol::Order& order)
      : remaining_(counts),
        ready_(counts.size(), 0),
        max_run_(order.max_run),
        distance_(order.min_distance.value_or(1)) {
    for (const int count : counts) total_ += count;
  }

  long long total() const { return total_; }
  int remaining(std::size_t stimulus) const { return remaining_[stimulus]; }
  std::size_t stimuli() const { return remaining_.size(); }

  /// Whether the limits let this stimulus come next.
  bool allowed(std::size_t stimulus) const {
    if (remaining_[stimulus] == 0 || ready_[stimulus] > position_) return false;
    return !(max_run_ && stimulus == last_ && run_ >= *max_run_);
  }

  void place(std::size_t stimulus) {
    --remaining_[stimulus];
    --total_;
    run_ = stimulus == last_ ? run_ + 1 : 1;
    last_ = stimulus;
    ready_[stimulus] = position_ + distance_;
    ++position_;
  }

  /// Whether the remaining trials can follow in some order. Exact. A distance of 2 or more forbids
  /// any repeat and so implies every max_run: the two limits are treated separately.
  bool completable() const {
    if (distance_ > 1) return completable_at_distance();
    return !max_run_ || completable_in_runs();
  }

 private:
  // The others that remain cut a stimulus' trials into at most others + 1 runs; for the last placed
  // stimulus the first of these has begun already. Sufficient too: at most one stimulus can be at
  // its bound, and placing it (or, when its run is full, any other) keeps all bounds.
  bool completable_in_runs() const {
    for (std::size_t i = 0; i < remaining_.size(); ++i) {
      const long long others = total_ - remaining_[i];
      const long long begun = i == last_ ? run_ : 0;
      if (remaining_[i] > *max_run_ * (others + 1) - begun) return false;
    }
    return true;
  }

  // Placing an allowed stimulus of which most remain is never wrong. Proof: in a valid completion
  // that places j now (at a_1 < a_2 < ...) and i, with no fewer left, at b_1 < b_2 < ..., let m be
  // the first index with a_(m+1) > b_(m+1), or the number of a's. Swapping a_1..a_m with b_1..b_m
  // keeps all distances, for b_(m+1) - a_m > b_(m+1) - b_m and a_(m+1) - b_m > b_(m+1) - b_m. So
  // taking the most frequent each time decides the question.
  // It need not go on to the end: when most * distance <= total, the rest splits into `most` rounds
  // of `distance` or more different stimuli, and within each round the longest unseen may go first.
  bool completable_at_distance() const {
    Arrangement rest = *this;
    while (rest.total_ > 0) {
      const int most = *std::max_element(rest.remaining_.begin(), rest.remaining_.end());
      if (static_cast<long long>(most) * distance_ <= rest.total_) return true;
      std::optional<std::size_t> next;
      for (std::size_t i = 0; i < rest.stimuli(); ++i) {
        if (rest.allowed(i) && (!next || rest.remaining_[i] > rest.remaining_[*next])) next = i;
      }
      if (!next) return false;
      rest.place(*next);
    }
    return true;
  }

  std::vector<int> remaining_;
  std::vector<long long> ready_;  // first position at which each stimulus may come again
  std::optional<int> max_run_;
  long long distance_;
  long long total_ = 0;
  long long position_ = 0;
  std::size_t last_ = static_cast<std::size_t>(-1);
  int run_ = 0;
};

/// A stimulus among those that are not ruled out, with a probability proportional to what remains.
std::size_t draw(const Arrangement& arrangement, const std::vector<bool>& ruled_out,
                 Random& random) {
  std::uint64_t weight = 0;
  for (std::size_t i = 0; i < ruled_out.size(); ++i) {
    if (!ruled_out[i]) weight += static_cast<std::uint64_t>(arrangement.remaining(i));
  }
  std::uint64_t pick = random.below(weight);
  std::size_t i = 0;
  for (;; ++i) {
    if (ruled_out[i]) continue;
    const auto here = static_cast<std::uint64_t>(arrangement.remaining(i));
    if (pick < here) return i;
    pick -= here;
  }
}

/// The first unconstrained random order that satisfies the limits, while the budget lasts.
std::optional<std::vector<int>> try_uniform(const Arrangement& start, std::size_t budget,
                                            Random& random) {
  const std::vector<bool> none(start.stimuli(), false);
  while (budget >= static_cast<std::size_t>(start.total())) {
    Arrangement arrangement = start;
    std::vector<int> order;
    while (arrangement.total() > 0) {
      const std::size_t next = draw(arrangement, none, random);
      --budget;
      if (!arrangement.allowed(next)) break;
      arrangement.place(next);
      order.push_back(static_cast<int>(next));
    }
    if (arrangement.total() == 0) return order;
  }
  return std::nullopt;
}

std::vector<int> construct(Arrangement arrangement, Random& random) {
  std::vector<int> order;
  while (arrangement.total() > 0) {
    std::vector<bool> ruled_out(arrangement.stimuli());
    for (std::size_t i = 0; i < ruled_out.size(); ++i) ruled_out[i] = !arrangement.allowed(i);
    for (;;) {  // at most once a stimulus: one of them can be completed
      const std::size_t next = draw(arrangement, ruled_out, random);
      Arrangement extended = arrangement;
      extended.place(next);
      if (extended.completable()) {
        arrangement = extended;
        order.push_back(static_cast<int>(next));
        break;
      }
      ruled_out[next] = true;
    }
  }
  return order;
}

/// Whether the trial at i satisfies the limits with those around it.
bool fits(const std::vector<int>& order, std::size_t i, const Protocol::Order& limits) {
  const auto distance = static_cast<std::size_t>(limits.min_distance.value_or(1));
  for (std::size_t k = 1; k < distance && k < order.size(); ++k) {
    if (i >= k && order[i - k] == order[i]) return false;
    if (i + k < order.size() && order[i + k] == order[i]) return false;
  }
  if (!limits.max_run) return true;
  std::size_t first = i, last = i;
  while (first > 0 && order[first - 1] == order[i]) --first;
  while (last + 1 < order.size() && order[last + 1] == order[i]) ++last;
  return last - first < static_cast<std::size_t>(*limits.max_run);
}

/// Swaps pairs of trials at random where the limits allow it. Either direction of a swap is equally
/// likely, so in the long run all orders that swaps connect are too.
void mix(std::vector<int>& order, const Protocol::Order& limits, Random& random) {
  constexpr std::size_t kSwaps = 30;  // a trial; measured: order_test.cpp
  for (std::size_t n = kSwaps * order.size(); n > 0; --n) {
    const std::size_t i = random.below(order.size());
    const std::size_t j = random.below(order.size());
    std::swap(order[i], order[j]);
    if (!fits(order, i, limits) || !fits(order, j, limits)) std::swap(order[i], order[j]);
  }
}

std::vector<int> in_sequence(std::vector<int> counts) {
  std::vector<int> order;
  for (bool any = true; any;) {
    any = false;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      if (counts[i] == 0) continue;
      --counts[i];
      order.push_back(static_cast<int>(i));
      any = true;
    }
  }
  return order;
}

bool satisfies(const std::vector<int>& order, const std::vector<int>& counts,
               const Protocol::Order& limits) {
  Arrangement arrangement(counts, limits);
  return std::all_of(order.begin(), order.end(), [&](int stimulus) {
    const auto next = static_cast<std::size_t>(stimulus);
    const bool allowed = arrangement.allowed(next);
    if (allowed) arrangement.place(next);
    return allowed;
  });
}

std::string reason(const std::vector<int>& counts, const Protocol::Order& order,
                   const std::vector<std::string>& names) {
  const auto most = std::max_element(counts.begin(), counts.end());
  long long total = 0;
  for (const int count : counts) total += count;
  const std::string shown = "'" + names[static_cast<std::size_t>(most - counts.begin())] +
                            "' is shown " + std::to_string(*most) + " times in a block of " +
                            std::to_string(total) + " trials";
  if (order.min_distance.value_or(1) > 1) {
    Protocol::Order looser = order;
    do {
      --*looser.min_distance;
    } while (*looser.min_distance > 1 && !can_order(counts, looser));
    return "min_distance " + std::to_string(*order.min_distance) +
           " cannot be satisfied: " + shown + "; use a min_distance of at most " +
           std::to_string(*looser.min_distance) + ", more stimuli or fewer repetitions in a block";
  }
  const long long gaps = total - *most + 1;
  return "max_run " + std::to_string(*order.max_run) + " cannot be satisfied: " + shown +
         "; use a max_run of at least " + std::to_string((*most + gaps - 1) / gaps) +
         ", more of the other stimuli or fewer repetitions in a block";
}

}  // namespace

std::size_t uniform_draw_budget(std::size_t trials) {
  // Some milliseconds; enough for limits that one random order in 200 satisfies.
  constexpr std::size_t kSmall = 200000, kPerTrial = 20;
  return std::max(kSmall, kPerTrial * trials);
}

bool can_order(const std::vector<int>& counts, const Protocol::Order& order) {
  return Arrangement(counts, order).completable();
}

std::vector<int> order_block(const std::vector<int>& counts, const Protocol::Order& order,
                             const std::vector<std::string>& names, Random& random) {
  std::size_t trials = 0;
  for (const int count : counts) trials += static_cast<std::size_t>(count);
  return order_block(counts, order, names, random, uniform_draw_budget(trials));
}

std::vector<int> order_block(const std::vector<int>& counts, const Protocol::Order& order,
                             const std::vector<std::string>& names, Random& random,
                             std::size_t draw_budget) {
  const Arrangement start(counts, order);
  if (!start.completable()) throw ScheduleError(reason(counts, order, names));
  if (order.kind == OrderKind::sequential) {
    std::vector<int> sequence = in_sequence(counts);
    if (!satisfies(sequence, counts, order)) {
      throw ScheduleError(
          "the sequential order violates max_run or min_distance; use a random order");
    }
    return sequence;
  }
  if (auto uniform = try_uniform(start, draw_budget, random)) return *std::move(uniform);
  std::vector<int> constructed = construct(start, random);
  mix(constructed, order, random);
  return constructed;
}

}  // namespace palpate::protocols
