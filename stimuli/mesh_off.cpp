// Object file format (.off) of Geomview, as text: OFF, COFF, NOFF, STOFF and their like.

#include <charconv>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "stimuli/mesh_text.h"

namespace palpate::stimuli {
namespace {

class OffReader {
 public:
  OffReader(std::string_view text, FileFaults& faults)
      : text_(text),
        faults_(faults),
        line_end_(text.find('\n') == std::string_view::npos ? '\r' : '\n') {}

  PolygonSoup read() {
    if (!read_header()) return {};
    names_.place_kind = "line";
    if (vertices_ == 0) faults_.add("", "at least one vertex", "none");
    for (std::uint64_t v = 0; v < vertices_; ++v) {
      if (!next("vertices", vertices_, v)) return {};
      add_vertex();
    }
    for (std::uint64_t f = 0; f < faces_; ++f) {
      if (!next("faces", faces_, f)) return {};
      add_face();
    }
    if (soup_.faces.empty()) faults_.add("", "at least one face", "none");
    soup_.coordinate_error = precision_.coordinate_error();
    soup_.names = std::make_shared<const MeshNames>(std::move(names_));
    return std::move(soup_);
  }

 private:
  // The words of the next line that has some, without comments. False at the end.
  bool next_words() {
    words_.clear();
    while (words_.empty() && at_ < text_.size()) {
      std::size_t end = text_.find(line_end_, at_);
      if (end == std::string_view::npos) end = text_.size();
      const std::string_view line = text_.substr(at_, end - at_);
      words_ = words_of(line.substr(0, line.find('#')));
      at_ = end + 1;
      ++line_;
    }
    return !words_.empty();
  }

  bool next(const char* what, std::uint64_t count, std::uint64_t found) {
    if (next_words()) return true;
    faults_.add("line " + std::to_string(line_ + 1), std::to_string(count) + " lines of " + what,
                "the end of the file after " + std::to_string(found));
    return false;
  }

  // A word that ends in OFF, the number of vertices, faces and edges.
  bool read_header() {
    if (!next_words()) {
      faults_.add("line 1", "OFF", "an empty file");
      return false;
    }
    if (words_[0].ends_with("OFF")) {
      const std::string_view kind = words_[0].substr(0, words_[0].size() - 3);
      const bool is_binary = words_.size() > 1 && words_[1] == "BINARY";
      if (is_binary || kind.find_first_not_of("STCN") != std::string_view::npos) {
        faults_.add_line(line_, "OFF as text in three dimensions",
                         is_binary ? words_[1] : words_[0]);
        return false;
      }
      words_.erase(words_.begin());
      if (words_.empty() && !next("numbers", 1, 0)) return false;
    }
    if (words_.size() >= 2 && whole(words_[0], vertices_) && whole(words_[1], faces_) &&
        vertices_ < kMost && faces_ < kMost)
      return true;
    faults_.add_line(line_, "OFF, and the number of vertices and of faces below 2^31", words_[0]);
    return false;
  }

  static bool whole(std::string_view word, std::uint64_t& value) {
    const char* end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, value);
    return error == std::errc() && stop == end;
  }

  // Normals and colours follow the coordinates and are not used.
  void add_vertex() {
    Vec3 position;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::string_view word = i < words_.size() ? words_[i] : std::string_view();
      double value = 0;
      if (!parse_number(word, value)) {
        faults_.add_line(line_, "three finite coordinates", word);
        break;
      }
      position[static_cast<int>(i)] = value;
      precision_.add(word, value);
    }
    names_.vertices.push_back({static_cast<std::uint32_t>(soup_.vertices.size()), place()});
    soup_.vertices.push_back(position);
  }

  // The number of corners, the corners, a colour that is not used.
  void add_face() {
    std::uint64_t count = 0;
    if (!whole(words_[0], count) || count < 3 || count > words_.size() - 1) {
      faults_.add_line(line_, "a number from 3 and as many vertex numbers", words_[0]);
      return;
    }
    std::vector<std::uint32_t> face;
    for (std::size_t i = 1; i <= count; ++i) {
      std::uint64_t vertex = 0;
      if (!whole(words_[i], vertex) || vertex >= vertices_) {
        faults_.add_line(line_, "vertex numbers from 0 to " + std::to_string(vertices_ - 1),
                         words_[i]);
        return;
      }
      face.push_back(static_cast<std::uint32_t>(vertex));
    }
    names_.faces.push_back({static_cast<std::uint32_t>(soup_.faces.size()), place()});
    soup_.faces.push_back(std::move(face));
  }

  std::uint32_t place() const { return static_cast<std::uint32_t>(line_); }

  static constexpr std::uint64_t kMost = 0x7fffffff;

  std::string_view text_;
  FileFaults& faults_;
  char line_end_;  // some old programs end lines with carriage returns alone
  std::size_t at_ = 0, line_ = 0;
  std::vector<std::string_view> words_;
  std::uint64_t vertices_ = 0, faces_ = 0;
  PolygonSoup soup_;
  MeshNames names_;
  NumberPrecision precision_;
};

}  // namespace

PolygonSoup read_off(std::string_view text, FileFaults& faults) {
  return OffReader(text, faults).read();
}

}  // namespace palpate::stimuli
