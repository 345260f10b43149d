#pragma once
// A line of text as an image, set by Pango.

#include <glm/vec3.hpp>
#include <string>
#include <vector>

namespace palpate::runner {

struct TextImage {
  int width = 0, height = 0;        ///< px
  std::vector<unsigned char> bgra;  ///< premultiplied, rows from the top
};

/// \param size  px, of the font. \param halo  colour about the letters, so that they are readable
/// on any ground
TextImage text_image(const std::string& text, double size, const glm::vec3& colour,
                     const glm::vec3& halo);

}  // namespace palpate::runner
