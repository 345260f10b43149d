#pragma once
// Conclusions and names of comparisons as phrases and sentences.

#include <string>
#include <string_view>

#include "analysis/statistics/analysis.h"
#include "analysis/statistics/comparison.h"

namespace palpate::analysis {

/// For which shapes the renderer is faster or slower than the reference (Holm-adjusted p < 0.05 of
/// the paired t-tests), for which there is no clear difference, or the reason why there is no test.
/// A sentence for each of the first comparisons.
std::string conclusion(const Analysis& analysis);

/// Continues a phrase such as "less time": "with the ray" for ray and point, "with tip2 `joint`
/// tip1" for another single comparison, "`joint` the point" for several. \param joint "than with"
/// or "against"
std::string with_renderer(const Analysis& analysis, const std::string& joint);

/// The result of Ho, Basdogan & Srinivasan (2000) for a shape; null for other shapes, and unless
/// the pair is ray and point with trials of both.
const PaperEffect* paper_effect(const RendererPair& pair, std::string_view shape);
/// The same as text: "22 %", "n.s." or empty.
std::string paper_reduction(const RendererPair& pair, const std::string& shape);
/// Whether paper_effect() exists for some comparison and shape.
bool compares_as_paper(const Analysis& analysis);

}  // namespace palpate::analysis
