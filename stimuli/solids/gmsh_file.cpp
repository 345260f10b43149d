#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "data/base/text.h"
#include "stimuli/mesh_file.h"
#include "stimuli/mesh_formats.h"
#include "stimuli/solids/solid_mesh.h"

namespace palpate::stimuli {
namespace {

constexpr int kTetrahedron = 4, kTetrahedron10 = 11;  // Gmsh's numbers of element types
constexpr std::size_t kMostNodes = 200'000;

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
    bool has_format = false, has_nodes = false, has_elements = false;
    while (next_line()) {
      if (line_.empty()) continue;
      if (line_[0] == "$MeshFormat") {
        has_format = true;
        read_format();
      } else if (line_[0] == "$Nodes") {
        has_nodes = true;
        read_nodes();
      } else if (line_[0] == "$Elements") {
        has_elements = true;
        read_elements();
      } else if (line_[0].starts_with('$')) {
        skip_section(std::string(line_[0].substr(1)));
      } else {
        fault("a section ($MeshFormat, $Nodes, $Elements)", line_[0]);
        faults_.throw_if_any();
      }
      if (stopped_) break;
    }
    if (!stopped_) {
      if (!has_format) faults_.add("end", "a section $MeshFormat", "none");
      if (!has_nodes) faults_.add("end", "a section $Nodes", "none");
      if (!has_elements) faults_.add("end", "a section $Elements", "none");
      if (has_elements && tetrahedra_.empty())
        faults_.add("$Elements", "tetrahedra (element type 4 or 11)", "none");
    }
    faults_.throw_if_any();
    return solid();
  }

 private:
  struct Read {
    std::array<std::uint64_t, 10> tags;
    bool quadratic;
    std::size_t line;
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
  void fault(const std::string& expected, std::string_view found) {
    faults_.add_line(number_, expected, found);
    stopped_ = true;
  }
  /// Reads a line of `count` whole numbers. \return false and a fault: the line is different
  bool numbers(std::size_t count, const char* what, std::vector<std::uint64_t>& out) {
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
  void end_section(std::string_view name) {
    if (stopped_) return;
    if (!next_line() || line_.empty() || line_[0] != name)
      fault(std::string(name), line_.empty() ? "the end of the section" : line_[0]);
  }
  void skip_section(const std::string& name) {
    const std::string end = "$End" + name;
    while (next_line()) {
      if (!line_.empty() && line_[0] == end) return;
    }
    fault(end, "the end of the file");
  }

  void read_format() {
    if (!next_line() || line_.size() < 2) return fault("4.1 0 8", "less");
    if (line_[0] != "4.1") return fault("version 4.1 (gmsh -format msh41)", line_[0]);
    if (line_[1] != "0") return fault("0, an ASCII file (gmsh without -bin)", line_[1]);
    end_section("$EndMeshFormat");
  }

  void read_nodes() {
    std::vector<std::uint64_t> head, block, tag;
    if (!numbers(4, "four numbers: blocks, nodes, least and greatest tag", head)) return;
    if (head[1] > kMostNodes)
      return fault("at most " + std::to_string(kMostNodes) + " nodes", line_[1]);
    for (std::uint64_t b = 0; b < head[0] && !stopped_; ++b) {
      if (!numbers(4, "four numbers: dimension, entity, parametric, nodes", block)) return;
      if (block[2] != 0) return fault("nodes without parameters (0)", line_[2]);
      if (block[3] > kMostNodes) return fault("fewer nodes", line_[3]);
      std::vector<std::uint64_t> tags;
      for (std::uint64_t i = 0; i < block[3]; ++i) {
        if (!numbers(1, "the tag of a node", tag)) return;
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
    Vec3 p;
    const bool there = next_line();
    bool good = there && line_.size() == 3;
    for (int c = 0; good && c < 3; ++c)
      good = parse_number(line_[static_cast<std::size_t>(c)], p[c]);
    if (!good) {
      fault("three coordinates",
            !there ? "the end of the file" : (line_.empty() ? "an empty line" : line_[0]));
      return;
    }
    if (!index_.try_emplace(tag, nodes_.size()).second)
      faults_.add_line(number_, "each node once", "node " + std::to_string(tag) + " again");
    nodes_.push_back(p);
  }

  void read_elements() {
    std::vector<std::uint64_t> head, block, element;
    if (!numbers(4, "four numbers: blocks, elements, least and greatest tag", head)) return;
    for (std::uint64_t b = 0; b < head[0] && !stopped_; ++b) {
      if (!numbers(4, "four numbers: dimension, entity, element type, elements", block)) return;
      const bool quadratic = block[2] == kTetrahedron10, linear = block[2] == kTetrahedron;
      if (block[0] == 3 && !quadratic && !linear)
        return fault("tetrahedra (element type 4 or 11)", line_[2]);
      for (std::uint64_t i = 0; i < block[3]; ++i) {
        if (!quadratic && !linear) {
          if (!numbers(0, "the numbers of an element", element)) return;
          continue;
        }
        if (!numbers(quadratic ? 11 : 5, quadratic ? "a tag and ten nodes" : "a tag and four nodes",
                     element))
          return;
        Read read{{}, quadratic, number_};
        std::copy(element.begin() + 1, element.end(), read.tags.begin());
        tetrahedra_.push_back(read);
      }
    }
    end_section("$EndElements");
  }

  std::uint32_t node_of(std::uint64_t tag, const Read& read) {
    const auto found = index_.find(tag);
    if (found == index_.end()) {
      faults_.add_line(read.line, "a node of $Nodes", std::to_string(tag));
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
  void check_once(const QuadraticTetrahedron& t, std::size_t line) {
    std::array<std::uint32_t, 4> corners{t[0], t[1], t[2], t[3]};
    std::sort(corners.begin(), corners.end());
    if (!known_elements_.insert(corners).second) {
      faults_.add_line(line, "each tetrahedron once", "one with the corners of another");
      return;
    }
    for (std::size_t left_out = 0; left_out < 4; ++left_out) {
      std::array<std::uint32_t, 3> face{};
      for (std::size_t i = 0, k = 0; i < 4; ++i) {
        if (i != left_out) face[k++] = corners[i];
      }
      if (++faces_[face] == 3)
        faults_.add_line(line, "at most two tetrahedra on a face", "a third one");
    }
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
        faults_.add_line(read.line, "a tetrahedron with a volume", "a flat one");
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
      check_once(t, read.line);
      mesh_.tetrahedra.push_back(t);
    }
    faults_.throw_if_any();
    return std::move(mesh_);
  }

  std::string_view text_;
  FileFaults faults_;
  std::size_t at_ = 0, number_ = 0;
  bool stopped_ = false;
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
