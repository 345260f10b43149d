#include "stimuli/mesh_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "stimuli/likely_mistakes.h"

namespace palpate::stimuli {
namespace {

constexpr std::size_t kShownFaults = 20;

bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

void FileFaults::add(const std::string& location, const std::string& expected,
                     const std::string& found) {
  if (++count_ > kShownFaults) return;
  messages_.push_back(file_ + ": " + (location.empty() ? "" : location + ": ") + "expected " +
                      expected + ", found " + found);
}

void FileFaults::add_line(std::size_t line, const std::string& expected, std::string_view found) {
  add("line " + std::to_string(line), expected,
      found.empty() ? std::string("the end of the line") : in_quotes(found) + point_meant(found));
}

void FileFaults::throw_if_any() const {
  if (count_ == 0) return;
  std::vector<std::string> all = messages_;
  if (count_ > kShownFaults) {
    all.push_back(file_ + ": " + std::to_string(count_ - kShownFaults) + " more faults");
  }
  throw MeshError(std::move(all));
}

std::string in_quotes(std::string_view word) {
  constexpr std::size_t kLongest = 40;
  std::string text = "\"";
  for (const char c : word.substr(0, kLongest)) text += c < ' ' || c > '~' ? '?' : c;
  return text + (word.size() > kLongest ? "...\"" : "\"");
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  std::size_t at = 0;
  while (true) {
    while (at < line.size() && is_blank(line[at])) ++at;
    if (at == line.size()) return words;
    const std::size_t begin = at;
    while (at < line.size() && !is_blank(line[at])) ++at;
    words.push_back(line.substr(begin, at - begin));
  }
}

bool parse_number(std::string_view word, double& value) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const char* end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, value);
  if (stop != end || word.empty()) return false;
  if (error == std::errc::result_out_of_range) {
    const std::size_t exponent = word.find_first_of("eE");
    const bool tiny = exponent == std::string_view::npos ? word.find('.') <= 2
                                                         : word.substr(exponent + 1, 1) == "-";
    value = 0;
    return tiny;
  }
  return error == std::errc() && std::isfinite(value);
}

void NumberPrecision::add(std::string_view word, double value) {
  int digits = 0, decimals = 0, exponent = 0;
  bool point = false;
  for (std::size_t i = 0; i < word.size(); ++i) {
    if (word[i] == '.') {
      point = true;
    } else if (is_digit(word[i])) {
      if (digits > 0 || word[i] != '0') ++digits;
      if (point) ++decimals;
    } else if (word[i] == 'e' || word[i] == 'E') {
      std::string_view power = word.substr(i + 1);
      if (!power.empty() && power[0] == '+') power.remove_prefix(1);
      std::from_chars(power.data(), power.data() + power.size(), exponent);
      break;
    }
  }
  const int decimal = exponent - decimals;
  if (any_ && decimal != last_decimal_) same_decimal_ = false;
  last_decimal_ = decimal;
  any_ = true;
  most_digits_ = std::max(most_digits_, digits);
  largest_ = std::max(largest_, std::abs(value));
  if (static_cast<double>(static_cast<float>(value)) != value) all_single_ = false;
}

double NumberPrecision::coordinate_error() const {
  if (!any_ || largest_ == 0) return 0;
  constexpr double kSingle = 0x1p-24;
  const int digits = std::clamp(most_digits_, 6, 17);
  double error = 0.5 * std::pow(10.0, std::floor(std::log10(largest_)) + 1 - digits);
  // With fewer than four decimals, 0.05 is more likely exact than rounded.
  if (same_decimal_ && last_decimal_ <= -4) error = 0.5 * std::pow(10.0, last_decimal_);
  if (digits <= 9 || all_single_) error = std::max(error, kSingle * largest_);
  return std::min(error, 1e-4 * largest_);
}

}  // namespace palpate::stimuli
