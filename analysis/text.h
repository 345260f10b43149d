#pragma once
// Formatting of text and numbers for terminals, SVG and HTML. Text from files passes
// printable() or escaped().

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "data/base/text.h"

namespace palpate::analysis {

/// Escaped for text and quoted attributes of XML and HTML; control characters are made printable.
std::string escaped(std::string_view text);

/// Number of characters (code points) of a UTF-8 text; each is counted as one column.
std::size_t width(std::string_view text);
std::string pad_right(std::string_view text, std::size_t columns);
std::string pad_left(std::string_view text, std::size_t columns);

/// At most `columns` characters; a longer text is cut and ends in an ellipsis.
std::string shortened(std::string_view text, std::size_t columns);

/// Lines that satisfy `fits`, broken at spaces but not before a percent sign; a single word that
/// does not fit is a line of its own.
std::vector<std::string> wrapped(std::string_view text,
                                 const std::function<bool(std::string_view)>& fits);

/// "1 trial", "2 trials".
std::string counted(std::size_t n, std::string_view one, std::string_view many);

/// Fixed notation, independent of the locale: decimal point, minus sign U+2212, no negative zero.
std::string fixed(double value, int decimals);

/// Four significant digits, in the shortest form, with a decimal point: levels may be millimetres
/// or kilonewtons. "inf", "-inf".
std::string short_number(double value);

/// A p value with three decimals: "0.042", "<0.001".
std::string p_text(double p);
/// In a sentence: "p = 0.042", "p < 0.001".
std::string p_phrase(double p);

/// "a", "a and b", "a, b and c".
template <class Strings>
std::string joined(const Strings& parts) {
  std::string all;
  std::size_t left = parts.size();
  for (const auto& part : parts) {
    all += part;
    --left;
    if (left > 1) all += ", ";
    if (left == 1) all += " and ";
  }
  return all;
}

}  // namespace palpate::analysis
