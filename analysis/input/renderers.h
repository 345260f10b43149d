#pragma once
// Pairs of renderers that are compared, and their names in sentences.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace palpate::analysis {

/// A renderer and its reference; all differences are `renderer` minus `reference`.
struct RendererPair {
  std::string reference, renderer;
  /// Indices into TrialTable::renderers; none: no trial with it.
  std::optional<std::size_t> reference_at, renderer_at;

  bool in_data() const { return reference_at && renderer_at; }
  /// The comparison of Ho, Basdogan & Srinivasan (2000), the only one shown beside their results.
  bool is_ray_minus_point() const { return reference == "point" && renderer == "ray"; }
};

/// Every further renderer with the first as reference. A single renderer is paired with the other
/// one of point and ray or with "another renderer", without trials: in_data() is false. \param
/// renderers of a TrialTable
std::vector<RendererPair> renderer_pairs(const std::vector<std::string>& renderers);

/// "the point", "the ray"; other names without article.
std::string with_article(const std::string& renderer);

/// "ray − point"
std::string difference_name(const RendererPair& pair);

}  // namespace palpate::analysis
