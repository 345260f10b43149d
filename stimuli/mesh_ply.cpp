// Stanford polygon files (.ply), ASCII and binary in both byte orders: elements vertex (x, y, z)
// and face (vertex_indices); all else is skipped.

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "stimuli/mesh_formats.h"
#include "stimuli/mesh_names.h"
#include "stimuli/polygon_soup.h"

namespace palpate::stimuli {
namespace {

enum class PlyEncoding { ascii, little, big };

struct PlyType {
  std::size_t size = 0;  ///< bytes; 0: no such type
  bool is_float = false, is_signed = false;
};

PlyType ply_type(std::string_view name) {
  if (name == "char" || name == "int8") return {1, false, true};
  if (name == "uchar" || name == "uint8") return {1, false, false};
  if (name == "short" || name == "int16") return {2, false, true};
  if (name == "ushort" || name == "uint16") return {2, false, false};
  if (name == "int" || name == "int32") return {4, false, true};
  if (name == "uint" || name == "uint32") return {4, false, false};
  if (name == "float" || name == "float32") return {4, true, true};
  if (name == "double" || name == "float64") return {8, true, true};
  return {};
}

struct PlyProperty {
  std::string name;
  PlyType type;
  bool is_list = false;
  PlyType count = {};  ///< of a list: type of its length
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties = {};

  std::size_t find(std::string_view property) const {
    std::size_t i = 0;
    while (i < properties.size() && properties[i].name != property) ++i;
    return i;
  }
};

class PlyReader {
 public:
  PlyReader(std::string_view bytes, FileFaults& faults) : bytes_(bytes), faults_(faults) {
    // All lines end like the first one; a carriage return elsewhere may be binary data.
    const std::size_t end = bytes.find_first_of("\r\n");
    const bool returns = end < bytes.size() && bytes[end] == '\r' &&
                         (end + 1 == bytes.size() || bytes[end + 1] != '\n');
    line_end_ = returns ? '\r' : '\n';
  }

  PolygonSoup read() {
    if (!read_header() || !check_header()) return {};
    names_.place_kind = encoding_ == PlyEncoding::ascii ? "line" : "byte";
    for (const PlyElement& element : elements_) {
      if (!(encoding_ == PlyEncoding::ascii ? read_lines(element) : read_binary(element)))
        return {};
    }
    if (soup_.faces.empty()) faults_.add("", "at least one face", "none");
    // The error follows from the digits of a text; binary numbers may be in single precision.
    soup_.coordinate_error = encoding_ == PlyEncoding::ascii ? precision_.coordinate_error()
                             : single_                       ? largest_ * 0x1p-24
                                                             : 0;
    soup_.names = std::make_shared<const MeshNames>(std::move(names_));
    return std::move(soup_);
  }

 private:
  // The next line without its end.
  std::string_view next_line() {
    ++line_;
    std::size_t end = bytes_.find(line_end_, at_);
    if (end == std::string_view::npos) end = bytes_.size();
    const std::string_view line = bytes_.substr(at_, end - at_);
    at_ = std::min(end + 1, bytes_.size());
    return line;
  }

  bool fault(const std::string& expected, std::string_view found) {
    faults_.add_line(line_, expected, found);
    return false;
  }

  bool read_header() {
    if (words_of(next_line()) != std::vector<std::string_view>{"ply"}) {
      faults_.add("line 1", "\"ply\"", "something else");
      return false;
    }
    while (at_ < bytes_.size()) {
      const std::string_view line = next_line();
      const std::vector<std::string_view> words = words_of(line);
      if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
      if (words[0] == "end_header") return true;
      if (words[0] == "format") {
        if (!read_format(words)) return false;
      } else if (words[0] == "element") {
        if (!read_element(words)) return false;
      } else if (words[0] == "property") {
        if (!read_property(words)) return false;
      } else {
        return fault("comment, element, property or end_header", words[0]);
      }
    }
    return fault("end_header", "");
  }

  bool read_format(const std::vector<std::string_view>& words) {
    const std::string_view name = words.size() > 1 ? words[1] : "";
    if (name == "ascii") {
      encoding_ = PlyEncoding::ascii;
    } else if (name == "binary_little_endian") {
      encoding_ = PlyEncoding::little;
    } else if (name == "binary_big_endian") {
      encoding_ = PlyEncoding::big;
    } else {
      return fault("ascii, binary_little_endian or binary_big_endian", name);
    }
    has_format_ = true;
    return true;
  }

  bool read_element(const std::vector<std::string_view>& words) {
    std::uint64_t count = 0;
    if (words.size() < 3 || !parse_whole(words[2], count))
      return fault("a name and a number after element", words.back());
    elements_.push_back({std::string(words[1]), count});
    return true;
  }

  bool read_property(const std::vector<std::string_view>& words) {
    if (elements_.empty()) return fault("element before the first property", words[0]);
    PlyProperty property;
    property.is_list = words.size() > 1 && words[1] == "list";
    const std::size_t type = property.is_list ? 3 : 1;
    if (words.size() < type + 2) return fault("a type and a name after property", "");
    property.type = ply_type(words[type]);
    property.name = words[type + 1];
    if (property.is_list) property.count = ply_type(words[2]);
    if (property.type.size == 0 ||
        (property.is_list && (property.count.size == 0 || property.count.is_float)))
      return fault("a type of PLY, char to double (the length of a list: an integer type)",
                   words[1]);
    elements_.back().properties.push_back(std::move(property));
    return true;
  }

  bool check_header() {
    if (!has_format_) faults_.add("", "a format line in the header", "none");
    const auto named = [&](const char* name) {
      return std::find_if(elements_.begin(), elements_.end(),
                          [&](const PlyElement& element) { return element.name == name; });
    };
    const auto vertex = named("vertex"), face = named("face");
    bool good = has_format_ && vertex != elements_.end() && face != elements_.end();
    for (const char* name : {"vertex", "face"}) {
      const auto again = std::count_if(elements_.begin(), elements_.end(),
                                       [&](const auto& element) { return element.name == name; });
      if (again < 2) continue;
      faults_.add("", std::string("one element ") + name + " in the header", std::to_string(again));
      good = false;
    }
    if (vertex == elements_.end()) faults_.add("", "an element vertex in the header", "none");
    if (face == elements_.end()) {
      faults_.add("", "an element face in the header: a cloud of points is no surface", "none");
    }
    if (!good) return false;
    for (const char* axis : {"x", "y", "z"}) {
      const std::size_t i = vertex->find(axis);
      if (i < vertex->properties.size() && !vertex->properties[i].is_list) continue;
      faults_.add("", std::string("a property ") + axis + " of vertex in the header", "none");
      good = false;
    }
    const std::size_t list = list_of(*face);
    if (list == face->properties.size() || !face->properties[list].is_list ||
        face->properties[list].type.is_float) {
      faults_.add("", "a property list vertex_indices of whole numbers of face in the header",
                  "none");
      good = false;
    }
    if (vertex->count == 0) {
      faults_.add("", "at least one vertex", "none");
      good = false;
    }
    if (vertex->count >= kMost || face->count >= kMost) {
      faults_.add("", "fewer than 2^31 vertices and faces", "more");
      good = false;
    }
    return good;
  }

  static std::size_t list_of(const PlyElement& face) {
    const std::size_t i = face.find("vertex_indices");
    return i < face.properties.size() ? i : face.find("vertex_index");
  }

  static bool parse_whole(std::string_view word, std::uint64_t& value) {
    const char* end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, value);
    return error == std::errc() && stop == end && !word.empty();
  }

  bool read_lines(const PlyElement& element) {
    for (std::uint64_t i = 0; i < element.count; ++i) {
      std::vector<std::string_view> words;
      while (words.empty()) {
        if (at_ >= bytes_.size()) {
          faults_.add("line " + std::to_string(line_ + 1),
                      std::to_string(element.count) + " lines of element " + element.name,
                      "the end of the file after " + std::to_string(i));
          return false;
        }
        words = words_of(next_line());
      }
      if (element.name == "vertex") {
        take_vertex_line(element, words);
      } else if (element.name == "face") {
        take_face_line(element, words);
      }
    }
    return true;
  }

  void take_vertex_line(const PlyElement& element, const std::vector<std::string_view>& words) {
    Vec3 position;
    std::size_t at = 0;
    for (const PlyProperty& property : element.properties) {
      const std::string_view word = at < words.size() ? words[at] : std::string_view();
      std::uint64_t length = 0;
      if (property.is_list && !parse_whole(word, length)) {
        fault("the length of the list " + property.name, word);
        break;
      }
      const int axis = axis_of(property);
      if (axis >= 0) {
        double value = 0;
        if (!parse_number(word, value)) {
          fault("three finite coordinates", word);
          break;
        }
        position[axis] = value;
        precision_.add(word, value);
      }
      at += 1 + static_cast<std::size_t>(std::min<std::uint64_t>(length, words.size()));
    }
    add_vertex(position, line_);
  }

  void take_face_line(const PlyElement& element, const std::vector<std::string_view>& words) {
    std::size_t at = 0;
    const std::size_t wanted = list_of(element);
    for (std::size_t i = 0; i <= wanted; ++i) {
      const std::string_view word = at < words.size() ? words[at] : std::string_view();
      std::uint64_t length = 0;
      if (element.properties[i].is_list &&
          (!parse_whole(word, length) || length > words.size() - at - 1)) {
        fault("the length of the list " + element.properties[i].name + " and as many numbers",
              word);
        return;
      }
      if (i < wanted) {
        at += 1 + static_cast<std::size_t>(length);
        continue;
      }
      std::vector<std::uint32_t> face;
      for (std::size_t k = 1; k <= length; ++k) {
        std::uint64_t vertex = 0;
        if (!parse_whole(words[at + k], vertex) || vertex >= vertex_count()) {
          fault(known_vertices(), words[at + k]);
          return;
        }
        face.push_back(static_cast<std::uint32_t>(vertex));
      }
      add_face(std::move(face), line_);
    }
  }

  static int axis_of(const PlyProperty& property) {
    if (property.is_list || property.name.size() != 1) return -1;
    const char c = property.name[0];
    return c >= 'x' && c <= 'z' ? c - 'x' : -1;
  }

  std::uint64_t vertex_count() const {
    for (const PlyElement& element : elements_) {
      if (element.name == "vertex") return element.count;
    }
    return 0;
  }
  std::string known_vertices() const {
    return "vertex numbers from 0 to " + std::to_string(vertex_count() - 1);
  }

  void add_vertex(const Vec3& position, std::size_t place) {
    names_.vertices.push_back(
        {static_cast<std::uint32_t>(soup_.vertices.size()), static_cast<std::uint32_t>(place)});
    soup_.vertices.push_back(position);
  }

  void add_face(std::vector<std::uint32_t> face, std::size_t place) {
    if (face.size() < 3) {
      faults_.add(names_.place_kind + " " + std::to_string(place),
                  "three or more corners of a face", std::to_string(face.size()));
      return;
    }
    names_.faces.push_back(
        {static_cast<std::uint32_t>(soup_.faces.size()), static_cast<std::uint32_t>(place)});
    soup_.faces.push_back(std::move(face));
  }

  std::uint64_t word_at(std::size_t at, std::size_t size) const {
    std::uint64_t word = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t byte = encoding_ == PlyEncoding::big ? at + i : at + size - 1 - i;
      word = word << 8U | static_cast<unsigned char>(bytes_[byte]);
    }
    return word;
  }

  double number_at(std::size_t at, const PlyType& type) const {
    const std::uint64_t word = word_at(at, type.size);
    if (type.is_float) {
      return type.size == 8 ? std::bit_cast<double>(word)
                            : std::bit_cast<float>(static_cast<std::uint32_t>(word));
    }
    if (!type.is_signed) return static_cast<double>(word);
    const unsigned shift = 64 - 8 * static_cast<unsigned>(type.size);
    return static_cast<double>(static_cast<std::int64_t>(word << shift) >> shift);
  }

  bool room_for(std::size_t size, const PlyElement& element, std::uint64_t i) {
    if (size <= bytes_.size() - at_) return true;
    faults_.add("byte " + std::to_string(at_),
                std::to_string(element.count) + " of element " + element.name,
                "the end of the file after " + std::to_string(i));
    return false;
  }

  bool read_binary(const PlyElement& element) {
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
    const std::size_t wanted = is_face ? list_of(element) : element.properties.size();
    std::size_t least = 0;  // bytes of each
    for (const PlyProperty& property : element.properties)
      least += property.is_list ? property.count.size : property.type.size;
    if (least == 0) return true;
    const std::uint64_t fit = std::min<std::uint64_t>(element.count, (bytes_.size() - at_) / least);
    if (is_vertex) soup_.vertices.reserve(static_cast<std::size_t>(fit));
    if (is_face) soup_.faces.reserve(static_cast<std::size_t>(fit));
    for (std::uint64_t i = 0; i < element.count; ++i) {
      const std::size_t begin = at_;
      Vec3 position;
      for (std::size_t p = 0; p < element.properties.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        std::uint64_t length = 1;
        if (property.is_list) {
          if (!room_for(property.count.size, element, i)) return false;
          const double count = number_at(at_, property.count);
          if (count < 0) {
            faults_.add("byte " + std::to_string(at_), "the length of a list", "a negative number");
            return false;
          }
          length = static_cast<std::uint64_t>(count);
          at_ += property.count.size;
        }
        if (!room_for(static_cast<std::size_t>(length) * property.type.size, element, i))
          return false;
        if (p == wanted) take_corners(property, length, begin);
        const int axis = is_vertex ? axis_of(property) : -1;
        if (axis >= 0) take_coordinate(property.type, position[axis]);
        at_ += static_cast<std::size_t>(length) * property.type.size;
      }
      if (is_vertex) add_vertex(position, begin);
    }
    return true;
  }

  void take_coordinate(const PlyType& type, double& coordinate) {
    coordinate = number_at(at_, type);
    if (!std::isfinite(coordinate)) {
      faults_.add("byte " + std::to_string(at_), "a finite coordinate", "infinity or NaN");
      coordinate = 0;
    }
    if (!type.is_float || type.size == 8) single_ = false;
    largest_ = std::max(largest_, std::abs(coordinate));
  }

  void take_corners(const PlyProperty& property, std::uint64_t length, std::size_t place) {
    std::vector<std::uint32_t> face;
    face.reserve(static_cast<std::size_t>(length));
    for (std::uint64_t k = 0; k < length; ++k) {
      const std::size_t at = at_ + static_cast<std::size_t>(k) * property.type.size;
      const double vertex = number_at(at, property.type);
      if (vertex < 0 || vertex >= static_cast<double>(vertex_count())) {
        faults_.add("byte " + std::to_string(at), known_vertices(),
                    std::to_string(static_cast<std::int64_t>(vertex)));
        return;
      }
      face.push_back(static_cast<std::uint32_t>(vertex));
    }
    add_face(std::move(face), place);
  }

  static constexpr std::uint64_t kMost = 0x7fffffff;

  std::string_view bytes_;
  FileFaults& faults_;
  std::size_t at_ = 0, line_ = 0;
  PlyEncoding encoding_ = PlyEncoding::ascii;
  char line_end_ = '\n';
  bool has_format_ = false, single_ = true;
  std::vector<PlyElement> elements_;
  PolygonSoup soup_;
  MeshNames names_;
  NumberPrecision precision_;
  double largest_ = 0;
};

}  // namespace

PolygonSoup read_ply(std::string_view bytes, FileFaults& faults) {
  return PlyReader(bytes, faults).read();
}

}  // namespace palpate::stimuli
