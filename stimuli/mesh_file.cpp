#include "stimuli/mesh_file.h"

#include <algorithm>
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

enum class MeshFormat { obj, stl, gltf, none };

MeshFormat format_of(const std::string& path, FileFaults& faults) {
  const std::string extension = lower_extension(path);
  if (extension == ".obj") return MeshFormat::obj;
  if (extension == ".stl") return MeshFormat::stl;
  if (extension == ".gltf" || extension == ".glb") return MeshFormat::gltf;
  faults.add("", std::string("a name that ends in ") + kMeshExtensions, in_quotes(extension));
  return MeshFormat::none;
}

/// What a .gltf names, from the folder that it lies in.
std::string beside(const std::string& path, const std::string& name, FileFaults& faults) {
  const std::filesystem::path relative(name);
  const bool leaves = std::find(relative.begin(), relative.end(), "..") != relative.end();
  if (relative.is_absolute() || leaves || name.find(':') != std::string::npos) {
    faults.add("", "buffers in files of the same folder", in_quotes(name));
    return {};
  }
  const std::filesystem::path file = std::filesystem::path(path).parent_path() / relative;
  FileFaults own(file.string());
  std::string bytes = contents(file.string(), own);
  own.throw_if_any();
  return bytes;
}

}  // namespace

PolygonSoup read_mesh_file(const std::string& path) {
  FileFaults faults(path);
  format_of(path, faults);  // before it is read
  faults.throw_if_any();
  return read_mesh(path, mesh_file_bytes(path));
}

std::string mesh_file_bytes(const std::string& path) {
  FileFaults faults(path);
  std::string bytes = contents(path, faults);
  faults.throw_if_any();
  if (lower_extension(path) == ".gltf") {
    bytes =
        with_buffers(bytes, [&](const std::string& name) { return beside(path, name, faults); });
    faults.throw_if_any();
  }
  return bytes;
}

bool is_mesh_file_name(const std::string& path) {
  FileFaults faults(path);
  return format_of(path, faults) != MeshFormat::none;
}

PolygonSoup read_mesh(const std::string& path, const std::string& bytes) {
  FileFaults faults(path);
  const MeshFormat format = format_of(path, faults);
  faults.throw_if_any();
  std::string_view text = bytes;
  // Some editors begin a text so. A binary file has no text to begin.
  if (text.starts_with("\xEF\xBB\xBF") &&
      (format != MeshFormat::stl || text.substr(3, 5) == "solid"))
    text.remove_prefix(3);
  PolygonSoup soup = format == MeshFormat::obj   ? read_obj(text, faults)
                     : format == MeshFormat::stl ? read_stl(text, faults)
                                                 : read_gltf(text, faults);
  faults.throw_if_any();
  return soup;
}

}  // namespace palpate::stimuli
