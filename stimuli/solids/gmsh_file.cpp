#include "stimuli/solids/gmsh_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <initializer_list>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "data/base/input_file.h"
#include "data/base/text.h"
#include "stimuli/mesh_file.h"
#include "stimuli/mesh_formats.h"
#include "stimuli/solids/solid_mesh.h"

namespace palpate::stimuli {
namespace {

constexpr std::size_t kMostNodes = 200'000;
constexpr std::uint64_t kTetrahedron = 4, kTetrahedron10 = 11;  // Gmsh's numbers of element types

// Nodes of each element type (Gmsh reference manual, "MSH file format"); 0: none of that number.
constexpr std::array<std::uint8_t, 32> kNodesOfType{0,  2,  3,  4,  4, 8, 6,  5,  3,  6, 9,
                                                    10, 27, 18, 14, 1, 8, 20, 15, 13, 9, 10,
                                                    12, 15, 15, 21, 4, 5, 6,  20, 35, 56};
std::size_t nodes_of_type(std::uint64_t type) {
  return type < kNodesOfType.size() ? kNodesOfType[type] : type == 92 ? 64 : type == 93 ? 125 : 0;
}

// Solids that are no tetrahedra of 4 or 10 nodes.
bool is_other_solid(std::uint64_t type) {
  constexpr std::array<std::uint64_t, 14> kSolids{5,  6,  7,  12, 13, 14, 17,
                                                  18, 19, 29, 30, 31, 92, 93};
  return std::find(kSolids.begin(), kSolids.end(), type) != kSolids.end();
}

std::optional<std::uint64_t> whole_number(std::string_view word) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

class GmshReader {
 public:
  GmshReader(const std::string& name, std::string_view text) : text_(text), faults_(name) {}

  SolidMesh read() {
    bool has_nodes = false, has_elements = false;
    while (next_line()) {
      if (line_.empty()) continue;
      const std::string_view section = line_[0];
      if (section == "$MeshFormat") {
        read_format();
      } else if (section == "$NOD" || section == "$ELM") {  // version 1 names no format
        version_ = Version::one;
      }
      if (section == "$Nodes" || section == "$NOD") {
        has_nodes = true;
        if (has_version()) read_nodes();
      } else if (section == "$Elements" || section == "$ELM") {
        has_elements = true;
        if (has_version()) read_elements();
      } else if (section.starts_with('$') && section != "$MeshFormat") {
        skip_section(std::string(section.substr(1)));
      } else if (!section.starts_with('$')) {
        fault("a section ($MeshFormat, $Nodes, $Elements)", section);
      }
      if (stopped_) break;
    }
    if (!stopped_) {
      if (version_ == Version::none) faults_.add("end", "a section $MeshFormat", "none");
      if (!has_nodes) faults_.add("end", "a section $Nodes", "none");
      if (!has_elements) faults_.add("end", "a section $Elements", "none");
      if (has_elements && tetrahedra_.empty())
        faults_.add("$Elements", "tetrahedra (element type 4 or 11)", "none");
    }
    faults_.throw_if_any();
    return solid();
  }

 private:
  enum class Version { none, one, two, four };
  using Numbers = std::vector<std::uint64_t>;

  struct Read {
    std::array<std::uint64_t, 10> tags;
    bool quadratic;
    std::size_t place;  ///< a line, in a binary file a byte
  };

  bool next_line() {
    if (at_ >= text_.size()) {
      line_.clear();
      return false;
    }
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    line_ = words_of(text_.substr(at_, end - at_));
    at_ = end + 1;
    ++number_;
    return true;
  }

  std::size_t place() const { return is_binary_ ? record_ : number_; }
  void fault_at(std::size_t place, const std::string& expected, const std::string& found) {
    if (is_binary_) {
      faults_.add("byte " + std::to_string(place), expected, found);
    } else {
      faults_.add_line(place, expected, found);
    }
  }
  void fault(const std::string& expected, std::string_view found) {
    fault_at(place(), expected, std::string(found));
    stopped_ = true;
  }
  bool has_version() {
    if (version_ == Version::none) fault("a section $MeshFormat first", line_[0]);
    return !stopped_;
  }

  /// A line of whole numbers. \param count  how many; 0: any \return false and a fault: another
  /// line
  bool line_of(std::size_t count, const char* what, Numbers& out) {
    out.clear();
    if (!next_line()) {
      fault(what, "the end of the file");
      return false;
    }
    for (const std::string_view word : line_) {
      // Tags of entities may be negative; no number used here may.
      const auto value = whole_number(word.starts_with('-') ? word.substr(1) : word);
      if (!value) break;
      out.push_back(*value);
    }
    if (out.size() == line_.size() && (count == 0 || out.size() == count)) return true;
    fault(what, line_.empty() ? "an empty line" : line_[0]);
    return false;
  }

  /// Whole numbers of a record: a line, or in a binary file integers of these widths in bytes.
  bool record(std::initializer_list<std::size_t> widths, const char* what, Numbers& out) {
    if (!is_binary_) return line_of(widths.size(), what, out);
    out.clear();
    return std::all_of(widths.begin(), widths.end(),
                       [&](std::size_t width) { return integers(1, width, what, out); });
  }

  /// Appends integers of a binary file.
  bool integers(std::size_t count, std::size_t width, const char* what, Numbers& out) {
    if (out.empty()) record_ = at_;
    if (count > (text_.size() - std::min(at_, text_.size())) / width) {
      fault(what, "the end of the file");
      return false;
    }
    for (std::size_t i = 0; i < count; ++i) {
      std::uint64_t value = little_endian(text_, at_);
      if (width == 8) value |= std::uint64_t{little_endian(text_, at_ + 4)} << 32U;
      out.push_back(value);
      at_ += width;
    }
    return true;
  }

  void end_section(std::string_view name) {
    if (stopped_) return;
    bool there = next_line();
    while (is_binary_ && there && line_.empty()) there = next_line();
    if (!there || line_.empty() || line_[0] != name)
      fault(std::string(name), line_.empty() ? "the end of the section" : in_quotes(line_[0]));
  }
  void skip_section(const std::string& name) {
    const std::string end = "$End" + name, older = "$END" + name;
    while (next_line()) {
      if (!line_.empty() && (line_[0] == end || line_[0] == older)) return;
    }
    fault(end, "the end of the file");
  }

  void read_format() {
    if (!next_line() || line_.size() < 3) return fault("a version, 0 or 1, and 8: 4.1 0 8", "less");
    if (line_[0] != "4.1" && line_[0] != "2.2" && line_[0] != "2.1" && line_[0] != "2")
      return fault("version 1, 2 to 2.2 or 4.1 (gmsh -format msh41)", line_[0]);
    if (line_[1] != "0" && line_[1] != "1")
      return fault("0, an ASCII file, or 1, a binary one", line_[1]);
    if (line_[2] != "8") return fault("numbers of 8 bytes", line_[2]);
    version_ = line_[0] == "4.1" ? Version::four : Version::two;
    if (line_[1] == "1") {
      is_binary_ = true;
      Numbers one;
      if (!integers(1, 4, "the number 1, which tells the order of bytes", one)) return;
      if (one[0] != 1)
        return fault("little-endian numbers (save it as ASCII)", "another order of bytes");
    }
    end_section("$EndMeshFormat");
  }

  void read_nodes() {
    if (version_ == Version::four) return read_blocks_of_nodes();
    Numbers count, tag;
    if (!line_of(1, "the number of nodes", count)) return;
    if (count[0] > kMostNodes)
      return fault("at most " + std::to_string(kMostNodes) + " nodes", std::to_string(count[0]));
    for (std::uint64_t i = 0; i < count[0] && !stopped_; ++i) {
      if (is_binary_) {
        if (integers(1, 4, "the number of a node", tag = {})) read_place(tag[0]);
        continue;
      }
      const bool there = next_line();
      const auto own = there && line_.size() == 4 ? whole_number(line_[0]) : std::nullopt;
      if (!own)
        return fault("a node's number and three coordinates",
                     there && !line_.empty() ? line_[0] : "the end of the section");
      line_.erase(line_.begin());
      add_place(*own, line_);
    }
    end_section(version_ == Version::one ? "$ENDNOD" : "$EndNodes");
  }

  void read_blocks_of_nodes() {
    Numbers head, block, tag;
    if (!record({8, 8, 8, 8}, "four numbers: blocks, nodes, least and greatest tag", head)) return;
    if (head[1] > kMostNodes)
      return fault("at most " + std::to_string(kMostNodes) + " nodes", std::to_string(head[1]));
    for (std::uint64_t b = 0; b < head[0] && !stopped_; ++b) {
      if (!record({4, 4, 4, 8}, "four numbers: dimension, entity, parametric, nodes", block))
        return;
      if (block[2] != 0) return fault("nodes without parameters (0)", std::to_string(block[2]));
      if (block[3] > kMostNodes) return fault("fewer nodes", std::to_string(block[3]));
      Numbers tags;
      for (std::uint64_t i = 0; i < block[3]; ++i) {
        if (!record({8}, "the tag of a node", tag)) return;
        tags.push_back(tag[0]);
      }
      for (const std::uint64_t own : tags) read_place(own);
    }
    if (!stopped_ && nodes_.size() != head[1])
      return fault(std::to_string(head[1]) + " nodes, as the section begins with",
                   std::to_string(nodes_.size()));
    end_section("$EndNodes");
  }

  void read_place(std::uint64_t tag) {
    if (stopped_) return;
    if (!is_binary_) {
      next_line();
      return add_place(tag, line_);
    }
    Numbers bits;
    if (!integers(3, 8, "three coordinates", bits)) return;
    const Vec3 p(std::bit_cast<double>(bits[0]), std::bit_cast<double>(bits[1]),
                 std::bit_cast<double>(bits[2]));
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
      return fault("three finite coordinates", "infinity or NaN");
    add_node(tag, p);
  }

  void add_place(std::uint64_t tag, const std::vector<std::string_view>& words) {
    Vec3 p;
    bool good = words.size() == 3;
    for (int c = 0; good && c < 3; ++c)
      good = parse_number(words[static_cast<std::size_t>(c)], p[c]);
    if (!good) return fault("three coordinates", words.empty() ? "an empty line" : words[0]);
    add_node(tag, p);
  }

  void add_node(std::uint64_t tag, const Vec3& p) {
    if (!index_.try_emplace(tag, nodes_.size()).second)
      fault_at(place(), "each node once", "node " + std::to_string(tag) + " again");
    nodes_.push_back(p);
  }

  /// \return false and a fault: a solid of another kind, or a type without a known size
  bool takes(std::uint64_t type) {
    if (is_other_solid(type)) {
      fault("tetrahedra (element type 4 or 11)", std::to_string(type));
    } else if (nodes_of_type(type) == 0) {
      fault("an element type of Gmsh, 1 to 31", std::to_string(type));
    }
    return !stopped_;
  }

  static bool is_tetrahedron(std::uint64_t type) {
    return type == kTetrahedron || type == kTetrahedron10;
  }

  void add_tetrahedron(std::uint64_t type, const std::uint64_t* nodes, std::size_t place) {
    Read read{{}, type == kTetrahedron10, place};
    std::copy(nodes, nodes + nodes_of_type(type), read.tags.begin());
    tetrahedra_.push_back(read);
  }

  void read_elements() {
    if (version_ == Version::four) return read_blocks_of_elements();
    Numbers count, element;
    if (!line_of(1, "the number of elements", count)) return;
    std::uint64_t left = count[0];
    while (left > 0 && !stopped_) {
      if (is_binary_) {
        left -= read_elements_alike(left);
        continue;
      }
      if (!line_of(0, "the numbers of an element", element)) return;
      read_element(element);
      --left;
    }
    end_section(version_ == Version::one ? "$ENDELM" : "$EndElements");
  }

  // Version 1: number, type, two regions, how many nodes, nodes; 2: number, type, how many tags,
  // tags, nodes.
  void read_element(const Numbers& element) {
    const bool is_first = version_ == Version::one;
    if (element.size() < 3) return fault("a number, a type and nodes", "less");
    if (!takes(element[1])) return;
    const std::size_t most = element.size();
    const std::size_t head = is_first ? 5 : 3 + std::min<std::size_t>(element[2], most);
    if (!is_tetrahedron(element[1])) return;
    if (most != head + nodes_of_type(element[1])) {
      return fault(
          element[1] == kTetrahedron ? "a tetrahedron of four nodes" : "a tetrahedron of ten nodes",
          std::to_string(most) + " numbers");
    }
    add_tetrahedron(element[1], element.data() + head, number_);
  }

  // A header and elements of one type, in binary files of version 2. \return how many
  std::uint64_t read_elements_alike(std::uint64_t left) {
    Numbers head, element;
    if (!record({4, 4, 4}, "a type, elements and tags", head) || !takes(head[0])) return left;
    if (head[1] == 0 || head[1] > left) {
      fault("1 to " + std::to_string(left) + " elements", std::to_string(head[1]));
      return left;
    }
    const std::size_t nodes = nodes_of_type(head[0]);
    for (std::uint64_t i = 0; i < head[1]; ++i) {
      const std::size_t begin = at_;
      if (!integers(1 + head[2] + nodes, 4, "an element", element = {})) return left;
      if (is_tetrahedron(head[0])) add_tetrahedron(head[0], element.data() + 1 + head[2], begin);
    }
    return head[1];
  }

  void read_blocks_of_elements() {
    Numbers head, block, element;
    if (!record({8, 8, 8, 8}, "four numbers: blocks, elements, least and greatest tag", head))
      return;
    for (std::uint64_t b = 0; b < head[0] && !stopped_; ++b) {
      if (!record({4, 4, 4, 8}, "four numbers: dimension, entity, element type, elements", block))
        return;
      if (!takes(block[2])) return;
      const std::size_t numbers = 1 + nodes_of_type(block[2]);
      const char* what = block[2] == kTetrahedron     ? "a tag and four nodes"
                         : block[2] == kTetrahedron10 ? "a tag and ten nodes"
                                                      : "the numbers of an element";
      for (std::uint64_t i = 0; i < block[3]; ++i) {
        const std::size_t begin = is_binary_ ? at_ : number_ + 1;
        const bool good = is_binary_
                              ? integers(numbers, 8, what, element = {})
                              : line_of(is_tetrahedron(block[2]) ? numbers : 0, what, element);
        if (!good) return;
        if (is_tetrahedron(block[2])) add_tetrahedron(block[2], element.data() + 1, begin);
      }
    }
    end_section("$EndElements");
  }

  std::uint32_t node_of(std::uint64_t tag, const Read& read) {
    const auto found = index_.find(tag);
    if (found == index_.end()) {
      fault_at(read.place, "a node of $Nodes", std::to_string(tag));
      known_ = false;
      return 0;
    }
    const auto [used, is_new] = used_.try_emplace(static_cast<std::uint32_t>(found->second),
                                                  static_cast<std::uint32_t>(mesh_.nodes.size()));
    if (is_new) mesh_.nodes.push_back(nodes_[found->second]);
    return used->second;
  }

  std::uint32_t middle_of(std::uint32_t a, std::uint32_t b) {
    const auto [found, is_new] =
        middles_.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh_.nodes.size()));
    if (is_new) mesh_.nodes.push_back(0.5 * (mesh_.nodes[a] + mesh_.nodes[b]));
    return found->second;
  }

  /// Each element once, and at most two on a face: else the surface has holes.
  /// \return whether it is to be added; before version 4 it is repeated for each physical group
  bool check_once(const QuadraticTetrahedron& t, std::size_t place) {
    std::array<std::uint32_t, 4> corners{t[0], t[1], t[2], t[3]};
    std::sort(corners.begin(), corners.end());
    if (!known_elements_.insert(corners).second) {
      if (version_ == Version::four)
        fault_at(place, "each tetrahedron once", "one with the corners of another");
      return false;
    }
    for (std::size_t left_out = 0; left_out < 4; ++left_out) {
      std::array<std::uint32_t, 3> face{};
      for (std::size_t i = 0, k = 0; i < 4; ++i) {
        if (i != left_out) face[k++] = corners[i];
      }
      if (++faces_[face] == 3) fault_at(place, "at most two tetrahedra on a face", "a third one");
    }
    return true;
  }

  SolidMesh solid() {
    for (const Read& read : tetrahedra_) {
      QuadraticTetrahedron t{};
      known_ = true;
      for (std::size_t k = 0; k < (read.quadratic ? 10U : 4U); ++k)
        t[k] = node_of(read.tags[k], read);
      if (read.quadratic) std::swap(t[8], t[9]);  // Gmsh puts edge 23 before 13
      if (!known_) continue;
      const Vec3 o = mesh_.nodes[t[0]];
      const Vec3 u = mesh_.nodes[t[1]] - o, v = mesh_.nodes[t[2]] - o, w = mesh_.nodes[t[3]] - o;
      const double volume = glm::dot(glm::cross(u, v), w);
      const double size = glm::length(u) * glm::length(v) * glm::length(w);
      if (!(std::abs(volume) > 1e-6 * size)) {
        fault_at(read.place, "a tetrahedron with a volume", "a flat one");
        continue;
      }
      if (volume < 0) {  // swap corners 1 and 2 and their edges
        std::swap(t[1], t[2]);
        std::swap(t[4], t[6]);
        std::swap(t[8], t[9]);
      }
      if (!read.quadratic) {
        constexpr int kEdges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
        for (std::size_t e = 0; e < 6; ++e) t[4 + e] = middle_of(t[kEdges[e][0]], t[kEdges[e][1]]);
      }
      if (check_once(t, read.place)) mesh_.tetrahedra.push_back(t);
    }
    faults_.throw_if_any();
    return std::move(mesh_);
  }

  std::string_view text_;
  FileFaults faults_;
  std::size_t at_ = 0, number_ = 0;  ///< byte; line
  std::size_t record_ = 0;           ///< byte where the last record of a binary file begins
  Version version_ = Version::none;
  bool is_binary_ = false, stopped_ = false;
  bool known_ = true;  ///< all nodes of the current tetrahedron
  std::vector<std::string_view> line_;
  std::vector<Vec3> nodes_;
  std::unordered_map<std::uint64_t, std::size_t> index_;  // by tag, in nodes_
  std::vector<Read> tetrahedra_;
  SolidMesh mesh_;
  std::unordered_map<std::uint32_t, std::uint32_t> used_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles_;
  std::set<std::array<std::uint32_t, 4>> known_elements_;  ///< corners
  std::map<std::array<std::uint32_t, 3>, int> faces_;      ///< how many elements share it
};

}  // namespace

bool is_gmsh_file_name(const std::string& path) {
  if (path.size() < 4) return false;
  std::string end = path.substr(path.size() - 4);
  for (char& c : end) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c);
  return end == ".msh";
}

SolidMesh read_gmsh(const std::string& name, const std::string& text) {
  if (is_utf16(text)) {
    FileFaults faults(name);
    faults.add("", "text in UTF-8 or ASCII", "UTF-16; save it as UTF-8");
    faults.throw_if_any();
  }
  return GmshReader(name, text).read();
}

SolidMesh solid_of_file(const ObjectSpec& spec) {
  SolidMesh solid =
      read_gmsh(spec.file, spec.file_bytes ? *spec.file_bytes : mesh_file_bytes(spec.file).bytes);
  for (Vec3& node : solid.nodes) node *= spec.scale;
  return solid;
}

}  // namespace palpate::stimuli
