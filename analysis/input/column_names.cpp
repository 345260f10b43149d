#include "analysis/input/column_names.h"

#include <algorithm>
#include <cstddef>

#include "stimuli/text.h"

namespace palpate::analysis {
namespace {

constexpr std::size_t kLongestName = 64;  // bytes; a longer one is nobody's slip
constexpr std::size_t kMostShown = 40;

bool is_letter_or_digit(char c) {
  return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z');
}

/// Letters in lower case and digits.
std::string plain(std::string_view name) {
  std::string out;
  for (const char c : name) {
    if (is_letter_or_digit(c)) out += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return out;
}

}  // namespace

std::vector<AlikeColumn> alike_columns(const std::vector<std::string>& found,
                                       const std::vector<std::string_view>& known) {
  std::vector<AlikeColumn> alike;
  for (const std::string& name : found) {
    const std::string own = plain(name);
    if (own.empty() || name.size() > kLongestName || std::ranges::find(known, name) != known.end())
      continue;
    std::string_view nearest;
    std::size_t least = own.size() <= 5 ? 2 : 3;  // beyond, it is another word
    for (const std::string_view one : known) {
      if (std::ranges::find(found, one) != found.end()) continue;
      const std::size_t distance = stimuli::edit_distance(own, plain(one));
      if (distance < least) {
        least = distance;
        nearest = one;
      }
    }
    if (!nearest.empty()) alike.push_back({name, std::string(nearest)});
  }
  return alike;
}

std::string sentence(const AlikeColumn& column) {
  return "Column '" + stimuli::printable(column.found, kMostShown) +
         "' is not known and was not read; is '" + column.meant + "' meant?";
}

std::string hint_for(std::string_view missing, const std::vector<AlikeColumn>& alike) {
  const auto found = std::ranges::find(alike, missing, &AlikeColumn::meant);
  if (found == alike.end()) return "";
  return " (is '" + stimuli::printable(found->found, kMostShown) + "' meant?)";
}

}  // namespace palpate::analysis
