#pragma once
// A condition on named numbers: a pattern at each point of a sweep, "cone>5 && cube>5 &&
// min(cone,cube)>3", or a hypothesis on an analysis, "paired.cone.p_holm < 0.05". The parser
// distinguishes numbers and conditions.
//
// clang-format off
//   or      := and { "||" and }
//   and     := not { "&&" not }
//   not     := "!" not | compare
//   compare := sum [ ("<" | "<=" | ">" | ">=" | "==" | "!=") sum ]
//   sum     := product { ("+" | "-") product }
//   product := sign { ("*" | "/") sign }
//   sign    := "-" sign | atom
//   atom    := number | name | ("min" | "max") "(" or { "," or } ")" | "abs" "(" or ")" | "(" or ")"
//   name    := word { ("." | ":") word }; or any text in ' or "
//   word    := letters, digits and _; the first one does not begin with a digit
// clang-format on

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace palpate::analysis {

/// what(): the expression, a mark below the place, and the expectation there.
class PatternError : public std::runtime_error {
 public:
  PatternError(const std::string& expression, std::size_t place, const std::string& expected);
  std::size_t place() const { return place_; }  ///< byte of the expression, from 0

 private:
  std::size_t place_;
};

class Pattern {
 public:
  /// The column of a name; none: unknown.
  using Resolve = std::function<std::optional<std::size_t>(const std::string& name)>;

  /// \param known  names to suggest for an unknown one
  /// \param source  origin of the names, for messages
  /// \throws PatternError
  Pattern(std::string expression, const Resolve& resolve, const std::vector<std::string>& known,
          const std::string& source = "the sweep");
  Pattern(Pattern&&) noexcept;
  Pattern& operator=(Pattern&&) noexcept;
  ~Pattern();

  const std::string& expression() const { return expression_; }

  /// Whether the pattern holds. None: the outcome depends on an undefined value (NaN). An outcome
  /// that no value of it can change is defined: "x > 5 && 1 > 2" does not hold.
  /// \param value  of a column
  std::optional<bool> holds(const std::function<double(std::size_t column)>& value) const;

  struct Node;

 private:
  std::string expression_;
  std::unique_ptr<Node> root_;
};

}  // namespace palpate::analysis
