// Stereolithography files, binary and ASCII: triangles without shared vertices.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>

#include "stimuli/little_endian.h"
#include "stimuli/mesh_text.h"

namespace palpate::stimuli {
namespace {

constexpr std::size_t kHeader = 84;    // 80 bytes of anything, the number of triangles
constexpr std::size_t kTriangle = 50;  // a normal, three corners, two bytes of anything

// A text that begins with "solid" may still be the header of a binary file; no text has a 0.
bool is_text(std::string_view bytes) {
  const std::vector<std::string_view> words = words_of(bytes.substr(0, 1000));
  if (words.empty() || words[0].size() < 5) return false;
  std::string start(words[0].substr(0, 5));
  for (char& c : start) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c);
  return start == "solid" && bytes.find('\0') == std::string_view::npos;
}

/// \param place  the line or byte that it begins at
void add_triangle(PolygonSoup& soup, MeshNames& names, std::size_t place) {
  const auto end = static_cast<std::uint32_t>(soup.vertices.size());
  soup.faces.push_back({end - 3, end - 2, end - 1});
  names.faces.push_back(
      {static_cast<std::uint32_t>(soup.faces.size()), static_cast<std::uint32_t>(place)});
}

PolygonSoup read_binary(std::string_view bytes, FileFaults& faults) {
  PolygonSoup soup;
  MeshNames names{{}, {}, "byte"};
  const std::size_t count = little_endian(bytes, kHeader - 4);
  soup.vertices.reserve(3 * count);
  soup.faces.reserve(count);
  double largest = 0;
  for (std::size_t t = 0; t < count; ++t) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::size_t at = kHeader + kTriangle * t + 12 * (corner + 1);
      Vec3 position;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        position[static_cast<int>(axis)] =
            std::bit_cast<float>(little_endian(bytes, at + 4 * axis));
      }
      const double far =
          std::max({std::abs(position.x), std::abs(position.y), std::abs(position.z)});
      if (!std::isfinite(position.x + position.y + position.z)) {
        faults.add("byte " + std::to_string(at), "three finite coordinates",
                   "infinity or no number");
      }
      largest = std::max(largest, far);
      soup.vertices.push_back(position);
    }
    add_triangle(soup, names, kHeader + kTriangle * t);
  }
  soup.coordinate_error = largest * 0x1p-24;
  soup.names = std::make_shared<const MeshNames>(std::move(names));
  return soup;
}

class AsciiReader {
 public:
  AsciiReader(std::string_view text, FileFaults& faults) : text_(text), faults_(faults) {}

  PolygonSoup read() {
    advance();
    while (!word_.empty()) {
      if (is("facet")) {
        if (!read_facet()) skip_facet();
      } else if (is("solid") || is("endsolid")) {
        inside_ = is("solid");
        skip_line();
        advance();
      } else if (inside_ || soup_.faces.empty()) {
        fault("facet or endsolid");
        skip_facet();
      } else {  // what follows a solid and is none
        skip_line();
        advance();
      }
    }
    if (inside_) fault("facet or endsolid");
    soup_.coordinate_error = precision_.coordinate_error();
    soup_.names = std::make_shared<const MeshNames>(std::move(names_));
    return std::move(soup_);
  }

 private:
  void advance() {
    while (at_ < text_.size() && static_cast<unsigned char>(text_[at_]) <= ' ') {
      if (text_[at_++] == '\n') ++line_;
    }
    const std::size_t begin = at_;
    while (at_ < text_.size() && static_cast<unsigned char>(text_[at_]) > ' ') ++at_;
    word_ = text_.substr(begin, at_ - begin);
  }

  void skip_line() {
    while (at_ < text_.size() && text_[at_] != '\n') ++at_;
  }

  void skip_facet() {
    do advance();
    while (!word_.empty() && !is("facet") && !is("endsolid"));
  }

  bool is(std::string_view keyword) const {
    return std::equal(word_.begin(), word_.end(), keyword.begin(), keyword.end(),
                      [](char c, char k) { return (c >= 'A' && c <= 'Z' ? c + 32 : c) == k; });
  }

  void fault(const std::string& expected) {
    if (word_.empty()) {
      faults_.add("line " + std::to_string(line_), expected, "the end of the file");
    } else {
      faults_.add_line(line_, expected, word_);
    }
  }

  bool take(std::string_view keyword) {
    if (!is(keyword)) {
      fault(std::string(keyword));
      return false;
    }
    advance();
    return true;
  }

  bool take_position(Vec3& position, bool is_corner) {
    for (int axis = 0; axis < 3; ++axis) {
      double value = 0;
      // A normal is not used (it follows from the corners) and is often nan.
      if (!parse_number(word_, value) && (is_corner || word_.empty())) {
        fault("three finite coordinates");
        return false;
      }
      position[axis] = value;
      if (is_corner) precision_.add(word_, value);
      advance();
    }
    return true;
  }

  bool read_facet() {
    Vec3 position;
    const std::size_t line = line_;
    advance();
    if (!take("normal") || !take_position(position, false) || !take("outer") || !take("loop")) {
      return false;
    }
    std::vector<Vec3> corners;
    for (int corner = 0; corner < 3; ++corner) {
      if (!take("vertex") || !take_position(position, true)) return false;
      corners.push_back(position);
    }
    if (!take("endloop") || !take("endfacet")) return false;
    soup_.vertices.insert(soup_.vertices.end(), corners.begin(), corners.end());
    add_triangle(soup_, names_, line);
    return true;
  }

  std::string_view text_, word_;
  FileFaults& faults_;
  std::size_t at_ = 0, line_ = 1;
  bool inside_ = false;
  PolygonSoup soup_;
  MeshNames names_{{}, {}, "line"};
  NumberPrecision precision_;
};

}  // namespace

PolygonSoup read_stl(std::string_view bytes, FileFaults& faults) {
  // The size decides: many binary files begin with "solid" as well.
  const bool has_header = bytes.size() >= kHeader;
  const std::size_t count = has_header ? little_endian(bytes, kHeader - 4) : 0;
  PolygonSoup soup;
  if (has_header && bytes.size() == kHeader + kTriangle * count) {
    soup = read_binary(bytes, faults);
  } else if (is_text(bytes)) {
    soup = AsciiReader(bytes, faults).read();
  } else if (has_header && bytes.size() > kHeader + kTriangle * count) {
    soup = read_binary(bytes, faults);  // what follows is no triangle, and some programs write it
  } else if (has_header) {
    faults.add("byte 80",
               std::to_string(kHeader + kTriangle * count) + " bytes for " + std::to_string(count) +
                   " triangles",
               std::to_string(bytes.size()) + " bytes");
    return soup;
  } else {
    faults.add("byte 0", "a binary header of 84 bytes, or \"solid\"",
               std::to_string(bytes.size()) + " other bytes");
    return soup;
  }
  if (soup.faces.empty()) faults.add("", "at least one triangle", "none");
  return soup;
}

}  // namespace palpate::stimuli
