#include "analysis/statistics/pattern.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "analysis/statistics/pattern_tree.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

using Node = Pattern::Node;
using Kind = Node::Kind;

using Value = std::function<double(std::size_t)>;

double number_of(const Node& node, const Value& value) {
  const auto part = [&](std::size_t i) { return number_of(node.parts[i], value); };
  switch (node.kind) {
    case Kind::column:
      return value(node.column);
    case Kind::negative:
      return -part(0);
    case Kind::add:
      return part(0) + part(1);
    case Kind::subtract:
      return part(0) - part(1);
    case Kind::multiply:
      return part(0) * part(1);
    case Kind::divide:
      return part(0) / part(1);
    case Kind::absolute:
      return std::fabs(part(0));
    case Kind::minimum:
    case Kind::maximum: {
      double out = part(0);
      for (std::size_t i = 1; i < node.parts.size(); ++i) {
        const double other = part(i);
        if (std::isnan(out) || std::isnan(other)) return std::nan("");
        out = node.kind == Kind::minimum ? std::min(out, other) : std::max(out, other);
      }
      return out;
    }
    default:
      return node.number;
  }
}

std::optional<bool> truth_of(const Node& node, const Value& value) {
  if (node.kind == Kind::opposite) {
    const auto part = truth_of(node.parts[0], value);
    return part ? std::optional(!*part) : std::nullopt;
  }
  if (node.kind == Kind::both || node.kind == Kind::either) {
    const bool decisive = node.kind == Kind::either;
    const auto a = truth_of(node.parts[0], value), b = truth_of(node.parts[1], value);
    if (a == decisive || b == decisive) return decisive;
    return a && b ? std::optional(!decisive) : std::nullopt;
  }
  const double a = number_of(node.parts[0], value), b = number_of(node.parts[1], value);
  if (std::isnan(a) || std::isnan(b)) return std::nullopt;
  switch (node.kind) {
    case Kind::less:
      return a < b;
    case Kind::at_most:
      return a <= b;
    case Kind::greater:
      return a > b;
    case Kind::at_least:
      return a >= b;
    case Kind::equal:
      return a == b;
    default:
      return a != b;
  }
}

std::string pattern_message(const std::string& expression, std::size_t place,
                            const std::string& expected) {
  const std::size_t columns = width(std::string_view(expression).substr(0, place));
  return "the pattern, column " + std::to_string(columns + 1) + ": expected " + expected + "\n  " +
         expression + "\n  " + std::string(columns, ' ') + "^";
}

}  // namespace

PatternError::PatternError(const std::string& expression, std::size_t place,
                           const std::string& expected)
    : std::runtime_error(pattern_message(expression, place, expected)), place_(place) {}

Pattern::Pattern(std::string expression, const Resolve& resolve,
                 const std::vector<std::string>& known, const std::string& source)
    : expression_(std::move(expression)),
      root_(std::make_unique<Node>(parse_pattern(expression_, resolve, known, source))) {}
Pattern::Pattern(Pattern&&) noexcept = default;
Pattern& Pattern::operator=(Pattern&&) noexcept = default;
Pattern::~Pattern() = default;

std::optional<bool> Pattern::holds(const std::function<double(std::size_t)>& value) const {
  return truth_of(*root_, value);
}

}  // namespace palpate::analysis
