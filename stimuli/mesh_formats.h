#pragma once
// Common parts of the readers of mesh files: faults with their location, words, numbers and the
// error of the numbers.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "stimuli/polygon_soup.h"

namespace palpate::stimuli {

/// Faults of one file, each "file: location: expected ..., found ...".
class FileFaults {
 public:
  explicit FileFaults(std::string file) : file_(std::move(file)) {}

  void add(const std::string& location, const std::string& expected, const std::string& found);
  void add_line(std::size_t line, const std::string& expected, std::string_view found);
  void throw_if_any() const;  ///< \throws MeshError: the first 20 faults and how many more

 private:
  std::string file_;
  std::vector<std::string> messages_;
  std::size_t count_ = 0;
};

/// A word as it can be shown in a message: quoted, cut short, without control characters.
std::string in_quotes(std::string_view word);

/// The words of a line, separated by blanks.
std::vector<std::string_view> words_of(std::string_view line);

/// A finite decimal number, independent of the locale; underflow gives 0.
/// False when the word is anything else.
bool parse_number(std::string_view word, double& value);

/// Estimates from the numbers of a file how exact they are.
class NumberPrecision {
 public:
  void add(std::string_view word, double value);

  /// m, error of a coordinate. Numbers that all end at the same decimal (printf's %f) are known to
  /// half of that decimal; otherwise (%g, or written by hand) as many
  /// digits count as the longest number has, but at least six. Up to nine digits, or nothing but
  /// single-precision numbers: no better than single precision.
  double coordinate_error() const;

 private:
  int most_digits_ = 0;
  int last_decimal_ = 0;  // power of ten of the last digit, where it is the same for all
  bool any_ = false, same_decimal_ = true, all_single_ = true;
  double largest_ = 0;
};

PolygonSoup read_obj(std::string_view text, FileFaults& faults);
PolygonSoup read_stl(std::string_view bytes, FileFaults& faults);
PolygonSoup read_gltf(std::string_view bytes, FileFaults& faults);
PolygonSoup read_ply(std::string_view bytes, FileFaults& faults);
PolygonSoup read_off(std::string_view text, FileFaults& faults);
PolygonSoup read_3mf(std::string_view bytes, FileFaults& faults);

/// Contents of a buffer's file. \param place  where it is named, a JSON pointer \param uri  the
/// name
using ContentsOf = std::function<std::string(const std::string& place, const std::string& uri)>;

/// The bytes of a .gltf with its external buffers inside, as it stands where it has none.
std::string with_buffers(const std::string& bytes, const ContentsOf& contents_of);

}  // namespace palpate::stimuli
