#pragma once
// Internal to analysis/statistics: a pattern as a tree, which the parser makes and Pattern
// evaluates.

#include <cstddef>
#include <string>
#include <vector>

#include "analysis/statistics/pattern.h"

namespace palpate::analysis {

struct Pattern::Node {
  enum class Kind {
    number,
    column,
    negative,
    add,
    subtract,
    multiply,
    divide,
    minimum,
    maximum,
    absolute,
    less,
    at_most,
    greater,
    at_least,
    equal,
    unequal,
    both,
    either,
    opposite
  };

  Kind kind = Kind::number;
  double number = 0;
  std::size_t column = 0;
  std::size_t place = 0;  ///< in the expression
  std::vector<Node> parts;
};

/// Whether a node of this kind holds or not; others are numbers.
inline bool is_truth(Pattern::Node::Kind kind) { return kind >= Pattern::Node::Kind::less; }

/// \throws PatternError
Pattern::Node parse_pattern(const std::string& text, const Pattern::Resolve& resolve,
                            const std::vector<std::string>& known, const std::string& source);

}  // namespace palpate::analysis
