#include "stimuli/mesh_file.h"

#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

#include "stimuli/mesh_text.h"

namespace palpate::stimuli {
namespace {

constexpr std::uintmax_t kLargestFile = std::uintmax_t{1} << 31U;

std::string lower_extension(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c);
  return extension;
}

std::string contents(const std::string& path, FileFaults& faults) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    faults.add("", "a file", error ? error.message() : "something else");
    return {};
  }
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error || size > kLargestFile) {
    faults.add("", "a file of at most 2 GiB", error ? error.message() : std::to_string(size));
    return {};
  }
  std::string bytes(static_cast<std::size_t>(size), '\0');
  std::ifstream file(path, std::ios::binary);
  if (!file.read(bytes.data(), static_cast<std::streamsize>(size))) {
    faults.add("", "a file that can be read", "one that cannot");
  }
  return bytes;
}

/// Or .stl.
bool is_obj_file(const std::string& path, FileFaults& faults) {
  const std::string extension = lower_extension(path);
  const bool is_obj = extension == ".obj";
  if (!is_obj && extension != ".stl") {
    faults.add("", "a name that ends in .obj or .stl", in_quotes(extension));
  }
  return is_obj;
}

}  // namespace

PolygonSoup read_mesh_file(const std::string& path) {
  FileFaults faults(path);
  is_obj_file(path, faults);  // before it is read
  faults.throw_if_any();
  return read_mesh(path, mesh_file_bytes(path));
}

std::string mesh_file_bytes(const std::string& path) {
  FileFaults faults(path);
  std::string bytes = contents(path, faults);
  faults.throw_if_any();
  return bytes;
}

PolygonSoup read_mesh(const std::string& path, const std::string& bytes) {
  FileFaults faults(path);
  const bool is_obj = is_obj_file(path, faults);
  faults.throw_if_any();
  std::string_view text = bytes;
  // Some editors begin a text so. A binary file has no text to begin.
  if (text.starts_with("\xEF\xBB\xBF") && (is_obj || text.substr(3, 5) == "solid"))
    text.remove_prefix(3);
  PolygonSoup soup = is_obj ? read_obj(text, faults) : read_stl(text, faults);
  faults.throw_if_any();
  return soup;
}

}  // namespace palpate::stimuli
