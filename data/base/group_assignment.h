#pragma once
// Groups of participants: who belongs to which. It follows from the protocol and the participant's
// number alone, so that no database has to store it and no merge can lose it.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace palpate {

struct GroupAssignment {
  enum class Rule {
    balanced,  ///< the groups in turn
    blocked,   ///< permuted blocks from the seed: nobody can tell the next group
    given,     ///< the experimenter names the group, which then determines the number
  };
  static constexpr std::size_t kMost = 12;

  std::vector<std::string> names;  ///< empty: no groups
  Rule rule = Rule::balanced;
  int block = 2;           ///< blocked: participants of each group in a block
  std::uint64_t seed = 0;  ///< of the protocol

  bool any() const { return !names.empty(); }
  /// The index of the group of participant `number` (from 1); 0 without groups.
  std::size_t group(int number) const;
  /// The participant's number within the group, from 1: the row of every counterbalancing. Without
  /// groups `number` itself. So all orders occur within each group.
  int row(int number) const;
  /// The name; "" without groups.
  const std::string& name(int number) const;
  /// The number of participant `row` (from 1) of a group. \pre group < names.size()
  int number(std::size_t group, int row) const;
  /// The index of a name; names.size(): there is none.
  std::size_t find(const std::string& name) const;
};

/// "balanced", "blocked", "given"
const char* to_string(GroupAssignment::Rule rule);

}  // namespace palpate
