#pragma once
// Results of Ho, Basdogan & Srinivasan (2000), fig. 15.

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

namespace palpate::analysis {

/// Percent reduction of the mean time to identify a shape with the ray, compared with the point.
struct PaperEffect {
  std::string_view shape;
  std::optional<double> percent_reduction;  ///< none: the difference was not significant
};

inline constexpr std::array<PaperEffect, 4> kPaperEffects{
    {{"sphere", std::nullopt}, {"cone", 22.0}, {"cylinder", std::nullopt}, {"cube", 11.0}}};

/// \return null for a shape that is not in the paper
constexpr const PaperEffect* find_paper_effect(std::string_view shape) {
  const auto* found = std::ranges::find(kPaperEffects, shape, &PaperEffect::shape);
  return found == kPaperEffects.end() ? nullptr : found;
}

}  // namespace palpate::analysis
