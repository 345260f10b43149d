// Wavefront .obj: v, f, g and o statements; the others do not describe the solid.

#include <charconv>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "stimuli/mesh_text.h"

namespace palpate::stimuli {
namespace {

using Index = std::uint32_t;

class ObjReader {
 public:
  ObjReader(std::string_view text, FileFaults& faults)
      : text_(text),
        faults_(faults),
        line_end_(text.find('\n') == std::string_view::npos ? '\r' : '\n') {}

  PolygonSoup read() {
    while (next_line()) {
      const std::vector<std::string_view> words = words_of(line_.substr(0, line_.find('#')));
      if (words.empty()) continue;
      if (words[0] == "v") {
        add_vertex(words);
      } else if (words[0] == "f") {
        add_face(words);
      } else if (words[0] == "o") {
        ++object_;
        object_name_ = rest_of(words);
        group_name_.clear();
      } else if (words[0] == "g") {
        group_name_ = rest_of(words);
      }
    }
    if (soup_.group_names.size() == 1) soup_.group_names.clear();
    if (soup_.group_names.empty()) soup_.group_of.clear();
    for (std::size_t f = 0; f < soup_.faces.size(); ++f) {
      for (const Index v : soup_.faces[f]) check_known(v, names_.faces[f].place);
    }
    soup_.names = std::make_shared<const MeshNames>(std::move(names_));
    if (soup_.faces.empty()) faults_.add("", "at least one f statement", "none");
    soup_.coordinate_error = precision_.coordinate_error();
    return std::move(soup_);
  }

 private:
  // A backslash at the end of a line continues it on the next.
  bool next_line() {
    line_number_ += lines_taken_;
    lines_taken_ = 0;
    bool continued = true;
    joined_.clear();
    while (continued && at_ < text_.size()) {
      std::size_t end = text_.find(line_end_, at_);
      if (end == std::string_view::npos) end = text_.size();
      line_ = text_.substr(at_, end - at_);
      at_ = end + 1;
      ++lines_taken_;
      if (!line_.empty() && line_.back() == '\r') line_.remove_suffix(1);
      continued = !line_.empty() && line_.back() == '\\';
      if (continued) line_.remove_suffix(1);
      if (continued || !joined_.empty()) joined_.append(line_).append(" ");
    }
    if (!joined_.empty()) line_ = joined_;
    return lines_taken_ > 0;
  }

  void add_vertex(const std::vector<std::string_view>& words) {
    Vec3 position;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::string_view word = i + 1 < words.size() ? words[i + 1] : std::string_view();
      double value = 0;
      if (!parse_number(word, value)) {
        faults_.add_line(line_number_, "three finite coordinates after v", word);
        break;
      }
      position[static_cast<int>(i)] = value;
      precision_.add(word, value);
    }
    // Also after a fault, so that the following vertices keep their numbers.
    soup_.vertices.push_back(position);
    names_.vertices.push_back({static_cast<Index>(soup_.vertices.size()), line()});
  }

  void add_face(const std::vector<std::string_view>& words) {
    if (words.size() < 4) {
      faults_.add_line(line_number_, "three or more corners after f", "");
      return;
    }
    std::vector<Index> face;
    for (std::size_t i = 1; i < words.size(); ++i) {
      const std::string_view word = words[i].substr(0, words[i].find('/'));
      std::int64_t number = 0;
      const char* end = word.data() + word.size();
      const auto [stop, error] = std::from_chars(word.data(), end, number);
      if (error != std::errc() || stop != end || number == 0 || number > kMostVertices) {
        faults_.add_line(line_number_, "vertex numbers from 1, or -1 for the latest", words[i]);
        return;
      }
      if (number < 0) number += static_cast<std::int64_t>(soup_.vertices.size()) + 1;
      if (number < 1) {
        faults_.add_line(line_number_,
                         "vertex numbers from -" + std::to_string(soup_.vertices.size()), words[i]);
        return;
      }
      face.push_back(static_cast<Index>(number - 1));
    }
    soup_.faces.push_back(std::move(face));
    soup_.group_of.push_back(group());
    names_.faces.push_back({static_cast<Index>(soup_.faces.size()), line()});
  }

  Index line() const { return static_cast<Index>(line_number_); }

  static std::string rest_of(const std::vector<std::string_view>& words) {
    std::string text;
    for (std::size_t i = 1; i < words.size(); ++i) text.append(i > 1 ? " " : "").append(words[i]);
    return text;
  }

  // An o statement begins an object, g a group within it, or goes on with an earlier one.
  Index group() {
    const auto [at, is_new] = groups_.try_emplace(std::pair(object_, group_name_),
                                                  static_cast<Index>(soup_.group_names.size()));
    if (is_new) {
      const bool both = !object_name_.empty() && !group_name_.empty();
      soup_.group_names.push_back(object_name_ + (both ? "/" : "") + group_name_);
    }
    return at->second;
  }

  void check_known(Index vertex, std::size_t line) {
    if (vertex < soup_.vertices.size()) return;
    faults_.add_line(line, "vertex numbers up to " + std::to_string(soup_.vertices.size()),
                     std::to_string(std::uint64_t{vertex} + 1));
  }

  static constexpr std::int64_t kMostVertices = 0x7fffffff;

  std::string_view text_, line_;
  FileFaults& faults_;
  char line_end_;  // some old programs end lines with carriage returns alone
  std::string joined_;
  std::size_t at_ = 0, line_number_ = 1, lines_taken_ = 0;
  PolygonSoup soup_;
  MeshNames names_{{}, {}, "line"};
  int object_ = 0;
  std::string object_name_, group_name_;
  std::map<std::pair<int, std::string>, Index> groups_;
  NumberPrecision precision_;
};

}  // namespace

PolygonSoup read_obj(std::string_view text, FileFaults& faults) {
  return ObjReader(text, faults).read();
}

}  // namespace palpate::stimuli
