#include "stimuli/mesh_formats.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "data/base/input_file.h"
#include "data/base/text.h"
#include "stimuli/mesh_names.h"
#include "stimuli/polygon_soup.h"

namespace palpate::stimuli {
namespace {

constexpr std::size_t kShownFaults = 20;

bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

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
  // A backslash at the end of a line continues it on the next, but no comment ("# C:\\models\\").
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
      const bool is_comment = line_.find('#') != std::string_view::npos;
      continued = !line_.empty() && line_.back() == '\\' && !is_comment;
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

  // An o statement begins an object, g a group within it; either may continue an earlier one.
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

constexpr std::size_t kHeader = 84;    // 80 bytes of anything, the number of triangles
constexpr std::size_t kTriangle = 50;  // a normal, three corners, two bytes of anything

// A text that begins with "solid" may still be the header of a binary file; a text has no zero
// byte.
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
        faults.add("byte " + std::to_string(at), "three finite coordinates", "infinity or NaN");
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
  AsciiReader(std::string_view text, FileFaults& faults)
      : text_(text),
        faults_(faults),
        line_end_(text.find('\n') == std::string_view::npos ? '\r' : '\n') {}

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
      } else {  // other text between solids
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
      if (text_[at_++] == line_end_) ++line_;
    }
    const std::size_t begin = at_;
    while (at_ < text_.size() && static_cast<unsigned char>(text_[at_]) > ' ') ++at_;
    word_ = text_.substr(begin, at_ - begin);
  }

  void skip_line() {
    while (at_ < text_.size() && text_[at_] != line_end_) ++at_;
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
  char line_end_;  // some old programs end lines with carriage returns alone
  std::size_t at_ = 0, line_ = 1;
  bool inside_ = false;
  PolygonSoup soup_;
  MeshNames names_{{}, {}, "line"};
  NumberPrecision precision_;
};

}  // namespace

void FileFaults::add(const std::string& location, const std::string& expected,
                     const std::string& found) {
  if (++count_ > kShownFaults) return;
  messages_.push_back(file_ + ": " + (location.empty() ? "" : location + ": ") + "expected " +
                      expected + ", found " + found);
}

void FileFaults::add_line(std::size_t line, const std::string& expected, std::string_view found) {
  add("line " + std::to_string(line), expected,
      found.empty() ? std::string("the end of the line") : in_quotes(found) + point_meant(found));
}

void FileFaults::throw_if_any() const {
  if (count_ == 0) return;
  std::vector<std::string> all = messages_;
  if (count_ > kShownFaults) {
    all.push_back(file_ + ": " + std::to_string(count_ - kShownFaults) + " more faults");
  }
  throw MeshError(std::move(all));
}

std::string in_quotes(std::string_view word) {
  constexpr std::size_t kLongest = 40;
  std::string text = "\"";
  for (const char c : word.substr(0, kLongest)) text += c < ' ' || c > '~' ? '?' : c;
  return text + (word.size() > kLongest ? "...\"" : "\"");
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  std::size_t at = 0;
  while (true) {
    while (at < line.size() && is_blank(line[at])) ++at;
    if (at == line.size()) return words;
    const std::size_t begin = at;
    while (at < line.size() && !is_blank(line[at])) ++at;
    words.push_back(line.substr(begin, at - begin));
  }
}

bool parse_number(std::string_view word, double& value) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const char* end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, value);
  if (stop != end || word.empty()) return false;
  if (error == std::errc::result_out_of_range) {
    const std::size_t exponent = word.find_first_of("eE");
    const bool tiny = exponent == std::string_view::npos ? word.find('.') <= 2
                                                         : word.substr(exponent + 1, 1) == "-";
    value = 0;
    return tiny;
  }
  return error == std::errc() && std::isfinite(value);
}

void NumberPrecision::add(std::string_view word, double value) {
  int digits = 0, decimals = 0, exponent = 0;
  bool point = false;
  for (std::size_t i = 0; i < word.size(); ++i) {
    if (word[i] == '.') {
      point = true;
    } else if (is_digit(word[i])) {
      if (digits > 0 || word[i] != '0') ++digits;
      if (point) ++decimals;
    } else if (word[i] == 'e' || word[i] == 'E') {
      std::string_view power = word.substr(i + 1);
      if (!power.empty() && power[0] == '+') power.remove_prefix(1);
      std::from_chars(power.data(), power.data() + power.size(), exponent);
      break;
    }
  }
  const int decimal = exponent - decimals;
  if (any_ && decimal != last_decimal_) same_decimal_ = false;
  last_decimal_ = decimal;
  any_ = true;
  most_digits_ = std::max(most_digits_, digits);
  largest_ = std::max(largest_, std::abs(value));
  if (static_cast<double>(static_cast<float>(value)) != value) all_single_ = false;
}

double NumberPrecision::coordinate_error() const {
  if (!any_ || largest_ == 0) return 0;
  constexpr double kSingle = 0x1p-24;
  const int digits = std::clamp(most_digits_, 6, 17);
  double error = 0.5 * std::pow(10.0, std::floor(std::log10(largest_)) + 1 - digits);
  // With fewer than four decimals, 0.05 is more likely exact than rounded.
  if (same_decimal_ && last_decimal_ <= -4) error = 0.5 * std::pow(10.0, last_decimal_);
  if (digits <= 9 || all_single_) error = std::max(error, kSingle * largest_);
  return std::min(error, 1e-4 * largest_);
}

// Wavefront .obj: v, f, g and o statements; the others do not describe the solid.

PolygonSoup read_obj(std::string_view text, FileFaults& faults) {
  return ObjReader(text, faults).read();
}

// Object file format (.off) of Geomview, as text: OFF, COFF, NOFF, STOFF and their like.

PolygonSoup read_off(std::string_view text, FileFaults& faults) {
  return OffReader(text, faults).read();
}

// Stereolithography files, binary and ASCII: triangles without shared vertices.

PolygonSoup read_stl(std::string_view bytes, FileFaults& faults) {
  // The size decides: many binary files begin with "solid" as well.
  const bool has_header = bytes.size() >= kHeader;
  const std::size_t count = has_header ? little_endian(bytes, kHeader - 4) : 0;
  const bool exact = has_header && bytes.size() == kHeader + kTriangle * count;
  // Some programs write other data after the triangles.
  const bool longer = has_header && bytes.size() > kHeader + kTriangle * count;
  const bool text = is_text(bytes);
  PolygonSoup soup;
  if (exact || (longer && !text)) {
    soup = read_binary(bytes, faults);
  } else if (text) {
    soup = AsciiReader(bytes, faults).read();
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
