#include "stimuli/edit_distance.h"

#include <algorithm>
#include <vector>

namespace palpate::stimuli {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);  // to the first j bytes of b
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
    }
  }
  return row.back();
}

std::string nearest_word(std::string_view word, const std::vector<std::string>& known) {
  std::string nearest;
  std::size_t distance = word.size() / 2 + 1;
  for (const std::string& one : known) {
    const std::size_t edits = edit_distance(word, one);
    if (edits >= distance) continue;
    distance = edits;
    nearest = one;
  }
  return nearest;
}

}  // namespace palpate::stimuli
