#pragma once
// How alike two words are: for "did you mean ...?".

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::stimuli {

/// Levenshtein's distance: how many bytes to insert, delete or replace to make `b` of `a`.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The first of the words that are most like another; "": with so many edits it is another word.
std::string nearest_word(std::string_view word, const std::vector<std::string>& known);

}  // namespace palpate::stimuli
