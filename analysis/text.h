#pragma once
// Text for terminals, SVG and HTML. Nothing that came from a file is printed raw.

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "stimuli/printable.h"

namespace palpate::analysis {

/// For text and quoted attributes of XML and HTML.
std::string escaped(std::string_view text);

/// Characters of a UTF-8 text; each is taken as one column wide.
std::size_t width(std::string_view text);
std::string pad_right(std::string_view text, std::size_t columns);
std::string pad_left(std::string_view text, std::size_t columns);

/// At most `columns` characters, the last an ellipsis where something was cut.
std::string shortened(std::string_view text, std::size_t columns);

/// Lines that fit, broken at spaces but never before a percent sign; a word that does not fit alone
/// stands alone all the same.
std::vector<std::string> wrapped(std::string_view text,
                                 const std::function<bool(std::string_view)>& fits);

/// "1 trial", "2 trials".
std::string counted(std::size_t n, std::string_view one, std::string_view many);

/// Decimal point whatever the locale; a true minus sign (U+2212); never "-0.0".
std::string fixed(double value, int decimals);

/// A p value: "0.042", "<0.001".
std::string p_text(double p);

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
