#include "data/base/group_assignment.h"

#include <algorithm>
#include <utility>

#include "data/base/random.h"

namespace palpate {
namespace {

// Streams of a protocol's seed; part of the meaning of a seed: never renumber them.
constexpr std::uint64_t kGroups = 900;
constexpr std::uint64_t kMasks = 901;

/// The groups of block `index` (from 0), in order.
std::vector<std::size_t> permuted_block(const GroupAssignment& groups, int index) {
  std::vector<std::size_t> out;
  for (int i = 0; i < groups.block; ++i)
    for (std::size_t group = 0; group < groups.names.size(); ++group) out.push_back(group);
  Random random(groups.seed, {kGroups, static_cast<std::uint64_t>(index)});
  random.shuffle(out);
  return out;
}

struct Place {
  std::size_t group = 0;
  int row = 1;
};

Place place_of(const GroupAssignment& groups, int number) {
  if (!groups.any()) return {0, number};
  const int from_zero = std::max(number, 1) - 1, count = static_cast<int>(groups.names.size());
  if (groups.rule != GroupAssignment::Rule::blocked)
    return {static_cast<std::size_t>(from_zero % count), from_zero / count + 1};
  const int size = count * groups.block, index = from_zero / size;
  const std::vector<std::size_t> block = permuted_block(groups, index);
  const auto at = block.begin() + from_zero % size;
  return {*at, index * groups.block + static_cast<int>(std::count(block.begin(), at, *at)) + 1};
}

}  // namespace

void GroupAssignment::mask() {
  if (masked()) return;
  true_names = names;
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = static_cast<char>('A' + i);
  Random(seed, {kMasks}).shuffle(names);
}

GroupAssignment GroupAssignment::unmasked() const {
  GroupAssignment out = *this;
  if (masked()) out.names = std::exchange(out.true_names, {});
  return out;
}

std::vector<std::string> GroupAssignment::listed() const {
  std::vector<std::string> out = names;
  if (masked()) std::ranges::sort(out);
  return out;
}

std::size_t GroupAssignment::group(int number) const { return place_of(*this, number).group; }

int GroupAssignment::row(int number) const { return place_of(*this, number).row; }

const std::string& GroupAssignment::name(int number) const {
  static const std::string kNone;
  return any() ? names[group(number)] : kNone;
}

int GroupAssignment::number(std::size_t group, int row) const {
  const int count = static_cast<int>(names.size());
  if (rule != Rule::blocked) return (row - 1) * count + static_cast<int>(group) + 1;
  const int index = (row - 1) / block;
  const std::vector<std::size_t> order = permuted_block(*this, index);
  int left = (row - 1) % block;
  const auto at =
      std::ranges::find_if(order, [&](std::size_t one) { return one == group && left-- == 0; });
  return index * count * block + static_cast<int>(at - order.begin()) + 1;
}

std::size_t GroupAssignment::find(const std::string& name) const {
  return static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
}

const char* to_string(GroupAssignment::Rule rule) {
  switch (rule) {
    case GroupAssignment::Rule::blocked:
      return "blocked";
    case GroupAssignment::Rule::given:
      return "given";
    case GroupAssignment::Rule::balanced:
      break;
  }
  return "balanced";
}

}  // namespace palpate
