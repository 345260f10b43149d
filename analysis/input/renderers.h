#pragma once
// Which renderers of a study are compared, and what they are called in sentences.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace palpate::analysis {

/// A renderer against the reference; every difference is `renderer` minus `reference`.
struct RendererPair {
  std::string reference, renderer;
  /// Indices into TrialTable::renderers; none: no trial with it.
  std::optional<std::size_t> reference_at, renderer_at;

  bool in_data() const { return reference_at && renderer_at; }
  /// The paper's own comparison, and so the only one that its figures stand beside.
  bool is_ray_minus_point() const { return reference == "point" && renderer == "ray"; }
};

/// Every other renderer against the first. Of a lone renderer: with the other one of point and ray,
/// or with "another renderer", of which there are no trials. \param renderers of a TrialTable
std::vector<RendererPair> renderer_pairs(const std::vector<std::string>& renderers);

/// "the point", "the ray"; others have their names alone.
std::string the(const std::string& renderer);

/// "ray − point"
std::string difference_name(const RendererPair& pair);

}  // namespace palpate::analysis
