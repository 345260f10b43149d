#pragma once
// How alike two words are: for "did you mean ...?".

#include <cstddef>
#include <string_view>

namespace palpate::stimuli {

/// Levenshtein's distance: how many bytes to insert, delete or replace to make `b` of `a`.
std::size_t edit_distance(std::string_view a, std::string_view b);

}  // namespace palpate::stimuli
