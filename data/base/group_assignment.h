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

  std::vector<std::string> names;       ///< as they are shown; empty: no groups
  std::vector<std::string> true_names;  ///< of masked groups, in the same order; else empty
  Rule rule = Rule::balanced;
  int block = 2;           ///< blocked: participants of each group in a block
  std::uint64_t seed = 0;  ///< of the protocol

  bool any() const { return !names.empty(); }
  bool masked() const { return !true_names.empty(); }
  /// Shows A, B, ... in place of the names, in an order from the seed.
  void mask();
  /// The same, with the names shown.
  GroupAssignment unmasked() const;
  /// The name in the protocol. \pre group < names.size()
  const std::string& true_name(std::size_t group) const {
    return masked() ? true_names[group] : names[group];
  }
  /// The names as a list shows them: letters by the alphabet, so that their order tells nothing.
  std::vector<std::string> listed() const;
  /// The index of the group of participant `number` (from 1); 0 without groups.
  std::size_t group(int number) const;
  /// The participant's number within the group, from 1: the row of every counterbalancing. Without
  /// groups `number` itself. So all orders occur within each group.
  int row(int number) const;
  /// The name as it is shown; "" without groups.
  const std::string& name(int number) const;
  /// The number of participant `row` (from 1) of a group. \pre group < names.size()
  int number(std::size_t group, int row) const;
  /// The index of a name that is shown; names.size(): there is none.
  std::size_t find(const std::string& name) const;
};

/// "balanced", "blocked", "given"
const char* to_string(GroupAssignment::Rule rule);

}  // namespace palpate
