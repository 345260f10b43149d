#include "analysis/input/renderers.h"

namespace palpate::analysis {

std::vector<RendererPair> renderer_pairs(const std::vector<std::string>& renderers) {
  if (renderers.empty()) return {};
  const std::string& first = renderers.front();
  if (renderers.size() == 1) {
    if (first == "ray") return {{"point", "ray", std::nullopt, 0}};
    return {{first, first == "point" ? "ray" : "another renderer", 0, std::nullopt}};
  }
  std::vector<RendererPair> pairs;
  pairs.reserve(renderers.size() - 1);
  for (std::size_t r = 1; r < renderers.size(); ++r) pairs.push_back({first, renderers[r], 0, r});
  return pairs;
}

std::string with_article(const std::string& renderer) {
  return renderer == "point" || renderer == "ray" ? "the " + renderer : renderer;
}

std::string difference_name(const RendererPair& pair) {
  return pair.renderer + " − " + pair.reference;
}

}  // namespace palpate::analysis
