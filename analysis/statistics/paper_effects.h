#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

namespace palpate::analysis {

/// What Ho, Basdogan & Srinivasan (2000), fig. 15, report for a shape: how much less time people
/// took with the ray than with the point.
struct PaperEffect {
  std::string_view shape;
  std::optional<double> percent_reduction;  ///< none: the difference was not significant
};

inline constexpr std::array<PaperEffect, 4> kPaperEffects{
    {{"sphere", std::nullopt}, {"cone", 22.0}, {"cylinder", std::nullopt}, {"cube", 11.0}}};

/// \return null for a shape that the paper did not have
constexpr const PaperEffect* find_paper_effect(std::string_view shape) {
  const auto* found = std::ranges::find(kPaperEffects, shape, &PaperEffect::shape);
  return found == kPaperEffects.end() ? nullptr : found;
}

}  // namespace palpate::analysis
