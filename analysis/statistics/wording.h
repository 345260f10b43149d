#pragma once
// What an analysis is called and what it answers, in words.

#include <string>
#include <string_view>

#include "analysis/statistics/analysis.h"
#include "analysis/statistics/paper_effects.h"

namespace palpate::analysis {

/// The answer to the paper's question: for which shapes a renderer is faster than the reference,
/// slower, neither (Holm-adjusted p < 0.05 of the paired t-tests), or why that cannot be said. A
/// sentence for each comparison; of many comparisons the first ones.
std::string answer(const Analysis& analysis);

/// What the study compares, to go on a phrase like "less time": "with the ray" for the paper's
/// comparison, "with tip2 `joint` tip1" for another one, "`joint` the point" for several.
/// \param joint "than with" or "against"
std::string with_renderer(const Analysis& analysis, const std::string& joint);

/// What the paper found for a shape; null where it has none, as for any comparison but ray against
/// point with trials of both.
const PaperEffect* paper_effect(const RendererPair& pair, std::string_view shape);
/// The same in words: "22 %", "n.s.", or empty.
std::string paper_reduction(const RendererPair& pair, const std::string& shape);
/// Whether the paper compared what one of the study's comparisons does, with one of its shapes.
bool compares_as_paper(const Analysis& analysis);

}  // namespace palpate::analysis
