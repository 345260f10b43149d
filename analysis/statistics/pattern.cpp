#include "analysis/statistics/pattern.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "analysis/text.h"
#include "data/base/text.h"

namespace palpate::analysis {

// Internal to analysis/statistics: a pattern as a tree, built by the parser and evaluated by
// Pattern.

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

/// Whether a node of this kind is a condition; others are numbers.
inline bool is_truth(Pattern::Node::Kind kind) { return kind >= Pattern::Node::Kind::less; }

/// \throws PatternError
Pattern::Node parse_pattern(const std::string& text, const Pattern::Resolve& resolve,
                            const std::vector<std::string>& known, const std::string& source);

namespace {

using Node = Pattern::Node;
using Kind = Node::Kind;

constexpr std::size_t kDeepest = 100;  // depth of nested parentheses and signs

struct Operator {
  const char* text;
  Kind kind;
};
constexpr Operator kComparisons[] = {{"<=", Kind::at_most}, {">=", Kind::at_least},
                                     {"==", Kind::equal},   {"!=", Kind::unequal},
                                     {"<", Kind::less},     {">", Kind::greater}};

class Parser {
 public:
  Parser(const std::string& text, const Pattern::Resolve& resolve,
         const std::vector<std::string>& known, const std::string& source)
      : text_(text), resolve_(resolve), known_(known), source_(source) {}

  Node parse() {
    Node root = either();
    skip_space();
    if (at_ < text_.size()) fail(at_, "an operator or the end");
    require_truth(root);
    return root;
  }

 private:
  [[noreturn]] void fail(std::size_t place, const std::string& expected) const {
    throw PatternError(text_, place, expected);
  }
  void skip_space() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t')) ++at_;
  }
  bool take(const std::string& word) {
    skip_space();
    if (text_.compare(at_, word.size(), word) != 0) return false;
    at_ += word.size();
    return true;
  }
  void require_truth(const Node& node) const {
    if (!is_truth(node.kind)) fail(node.place, "a condition such as 'cone > 5'; this is a number");
  }
  void require_number(const Node& node) const {
    if (is_truth(node.kind)) fail(node.place, "a number; this is a condition");
  }

  Node joined_by(const char* word, Kind kind, Node (Parser::*part)()) {
    Node first = (this->*part)();
    while (take(word)) {
      require_truth(first);
      Node second = (this->*part)();
      require_truth(second);
      const std::size_t place = first.place;
      first = made(kind, place, std::move(first), std::move(second));
    }
    return first;
  }
  Node either() { return joined_by("||", Kind::either, &Parser::both); }
  Node both() { return joined_by("&&", Kind::both, &Parser::opposite); }

  Node opposite() {
    skip_space();
    const std::size_t place = at_;
    if (text_.compare(at_, 2, "!=") != 0 && take("!")) {
      const Deeper deeper(*this, place);
      Node part = opposite();
      require_truth(part);
      return made(Kind::opposite, place, std::move(part));
    }
    return comparison();
  }

  std::optional<Kind> take_comparison() {
    for (const Operator& one : kComparisons) {
      if (take(one.text)) return one.kind;
    }
    return std::nullopt;
  }

  Node comparison() {
    Node first = sum();
    const auto kind = take_comparison();
    if (!kind) {
      skip_space();
      if (at_ < text_.size() && text_[at_] == '=') fail(at_, "== for a comparison");
      return first;
    }
    require_number(first);
    Node second = sum();
    require_number(second);
    const std::size_t end = at_;
    if (take_comparison()) fail(end, "one comparison at a time: a < b && b < c");
    const std::size_t place = first.place;
    return made(*kind, place, std::move(first), std::move(second));
  }

  Node sum() {
    Node first = product();
    while (true) {
      const bool plus = take("+");
      if (!plus && !take("-")) return first;
      require_number(first);
      Node second = product();
      require_number(second);
      const std::size_t place = first.place;
      first = made(plus ? Kind::add : Kind::subtract, place, std::move(first), std::move(second));
    }
  }

  Node product() {
    Node first = sign();
    while (true) {
      const bool times = take("*");
      if (!times && !take("/")) return first;
      require_number(first);
      Node second = sign();
      require_number(second);
      const std::size_t place = first.place;
      first =
          made(times ? Kind::multiply : Kind::divide, place, std::move(first), std::move(second));
    }
  }

  Node sign() {
    skip_space();
    const std::size_t place = at_;
    if (!take("-")) return atom();
    const Deeper deeper(*this, place);
    Node part = sign();
    require_number(part);
    return made(Kind::negative, place, std::move(part));
  }

  Node atom() {
    skip_space();
    const std::size_t place = at_;
    if (at_ == text_.size()) fail(place, "a number, a name or '('; the expression ends here");
    const char c = text_[at_];
    if (take("(")) {
      const Deeper deeper(*this, place);
      Node inner = either();
      if (!take(")")) fail(at_, "')' for the '(' in column " + std::to_string(place + 1));
      inner.place = place;
      return inner;
    }
    if (is_digit(c) || c == '.') return number(place);
    if (c == '\'' || c == '"') return quoted_name(place);
    if (is_letter(c)) return name_or_function(place);
    fail(place, "a number, a name or '('");
  }

  Node number(std::size_t place) {
    Node node;
    node.place = place;
    const char* const end = text_.data() + text_.size();
    const auto read = std::from_chars(text_.data() + at_, end, node.number);
    if (read.ec != std::errc()) fail(place, "a number");
    at_ = static_cast<std::size_t>(read.ptr - text_.data());
    if (at_ < text_.size() && is_letter(text_[at_])) fail(at_, "an operator after the number");
    return node;
  }

  Node quoted_name(std::size_t place) {
    const std::size_t end = text_.find(text_[at_], at_ + 1);
    if (end == std::string::npos) fail(place, "the closing quotation mark of the name");
    const std::string name = text_.substr(at_ + 1, end - at_ - 1);
    at_ = end + 1;
    return column(name, place);
  }

  Node name_or_function(std::size_t place) {
    while (is_in_word(at_) || (joins_words(at_) && is_in_word(at_ + 1))) ++at_;
    const std::string name = text_.substr(place, at_ - place);
    skip_space();
    if (at_ < text_.size() && text_[at_] == '(') return function(name, place);
    return column(name, place);
  }

  Node function(const std::string& name, std::size_t place) {
    Node node;
    node.place = place;
    if (name == "min") {
      node.kind = Kind::minimum;
    } else if (name == "max") {
      node.kind = Kind::maximum;
    } else if (name == "abs") {
      node.kind = Kind::absolute;
    } else {
      fail(place, "one of the functions min, max and abs");
    }
    take("(");
    const Deeper deeper(*this, place);
    do {
      node.parts.push_back(either());
      require_number(node.parts.back());
    } while (take(","));
    if (!take(")"))
      fail(at_, "',' or ')' of '" + name + "' in column " + std::to_string(place + 1));
    if (node.kind == Kind::absolute && node.parts.size() != 1) fail(place, "one value for abs");
    return node;
  }

  Node column(const std::string& name, std::size_t place) {
    const auto found = resolve_(name);
    if (!found) fail(place, "a name that " + source_ + " has" + suggestion(name));
    Node node;
    node.kind = Kind::column;
    node.place = place;
    node.column = *found;
    return node;
  }

  std::string suggestion(const std::string& name) const {
    const std::string* nearest = nullptr;
    std::size_t least = name.size() / 2 + 2;
    for (const std::string& one : known_) {
      const std::size_t edits = edit_distance(name, one);
      if (edits < least) {
        least = edits;
        nearest = &one;
      }
    }
    if (nearest != nullptr) return "; did you mean " + as_written(*nearest) + "?";
    std::string all;
    constexpr std::size_t kMost = 12;
    for (std::size_t i = 0; i < std::min(known_.size(), kMost); ++i)
      all += (i == 0 ? "" : ", ") + as_written(known_[i]);
    return ", such as " + all;
  }

  /// The name, in quotes if needed.
  static std::string as_written(const std::string& name) {
    bool plain = !name.empty() && is_letter(name[0]) && !is_joint(name.back());
    for (std::size_t i = 0; plain && i < name.size(); ++i)
      plain = is_letter(name[i]) || is_digit(name[i]) ||
              (is_joint(name[i]) && i + 1 < name.size() && !is_joint(name[i + 1]));
    if (plain) return name;
    const char mark = name.find('\'') == std::string::npos ? '\'' : '"';
    return mark + name + mark;
  }

  template <class... Parts>
  static Node made(Kind kind, std::size_t place, Parts... parts) {
    Node node;
    node.kind = kind;
    node.place = place;
    (node.parts.push_back(std::move(parts)), ...);
    return node;
  }
  bool is_in_word(std::size_t place) const {
    return place < text_.size() && (is_letter(text_[place]) || is_digit(text_[place]));
  }
  bool joins_words(std::size_t place) const {
    return place < text_.size() && is_joint(text_[place]);
  }
  static bool is_joint(char c) { return c == '.' || c == ':'; }
  static bool is_digit(char c) { return c >= '0' && c <= '9'; }
  static bool is_letter(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
  }

  struct Deeper {
    Deeper(Parser& parser, std::size_t place) : parser_(parser) {
      if (++parser_.depth_ > kDeepest) parser_.fail(place, "at most 100 nested parentheses");
    }
    ~Deeper() { --parser_.depth_; }
    Deeper(const Deeper&) = delete;
    Deeper& operator=(const Deeper&) = delete;
    Parser& parser_;
  };

  const std::string& text_;
  const Pattern::Resolve& resolve_;
  const std::vector<std::string>& known_;
  const std::string& source_;
  std::size_t at_ = 0, depth_ = 0;
};

}  // namespace

Pattern::Node parse_pattern(const std::string& text, const Pattern::Resolve& resolve,
                            const std::vector<std::string>& known, const std::string& source) {
  return Parser(text, resolve, known, source).parse();
}

namespace {

using Node = Pattern::Node;
using Kind = Node::Kind;

using Value = std::function<double(std::size_t)>;

double node_number(const Node& node, const Value& value) {
  const auto part = [&](std::size_t i) { return node_number(node.parts[i], value); };
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

std::optional<bool> node_truth(const Node& node, const Value& value) {
  if (node.kind == Kind::opposite) {
    const auto part = node_truth(node.parts[0], value);
    return part ? std::optional(!*part) : std::nullopt;
  }
  if (node.kind == Kind::both || node.kind == Kind::either) {
    const bool decisive = node.kind == Kind::either;
    const auto a = node_truth(node.parts[0], value), b = node_truth(node.parts[1], value);
    if (a == decisive || b == decisive) return decisive;
    return a && b ? std::optional(!decisive) : std::nullopt;
  }
  const double a = node_number(node.parts[0], value), b = node_number(node.parts[1], value);
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
  return node_truth(*root_, value);
}

}  // namespace palpate::analysis
