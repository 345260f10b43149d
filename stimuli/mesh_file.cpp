#include "stimuli/mesh_file.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "data/base/text.h"
#include "stimuli/mesh_formats.h"
#include "stimuli/polygon_soup.h"

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

enum class MeshFormat { obj, stl, gltf, ply, off, three_mf, none };

MeshFormat format_of(const std::string& path, FileFaults& faults) {
  const std::string extension = lower_extension(path);
  if (extension == ".obj") return MeshFormat::obj;
  if (extension == ".stl") return MeshFormat::stl;
  if (extension == ".gltf" || extension == ".glb") return MeshFormat::gltf;
  if (extension == ".ply") return MeshFormat::ply;
  if (extension == ".off") return MeshFormat::off;
  if (extension == ".3mf") return MeshFormat::three_mf;
  faults.add("", std::string("a name that ends in ") + kMeshExtensions, in_quotes(extension));
  return MeshFormat::none;
}

/// Decodes a part of a URI (RFC 3986, 2.1); nullopt where it is malformed.
std::optional<std::string> percent_decoded(std::string_view text) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned value = static_cast<unsigned char>(text[i]);
    if (text[i] == '%') {
      const char* begin = text.data() + i + 1;
      if (i + 3 > text.size()) return std::nullopt;
      const auto [end, error] = std::from_chars(begin, begin + 2, value, 16);
      if (error != std::errc() || end != begin + 2) return std::nullopt;
      i += 2;
    }
    if (value == 0) return std::nullopt;  // would end a path
    decoded += static_cast<char>(value);
  }
  return decoded;
}

/// The path of a file that a .gltf names, relative to its folder; "" and a fault where it leads out
/// of that folder.
std::string beside(const std::string& path, const std::string& place, const std::string& uri,
                   FileFaults& faults) {
  const std::optional<std::string> name = percent_decoded(uri);
  if (!name) {
    faults.add(place, "a file name with two hexadecimal digits after each %", in_quotes(uri));
    return {};
  }
  const std::filesystem::path relative(*name);
  const bool leaves = std::find(relative.begin(), relative.end(), "..") != relative.end();
  const bool has_scheme = uri.find(':') < uri.find('/');  // https://..., file:...
  if (name->empty() || relative.is_absolute() || leaves || has_scheme) {
    faults.add(place, "a file in the same folder or one within", in_quotes(uri));
    return {};
  }
  return (std::filesystem::path(path).parent_path() / relative).string();
}

/// Reads the buffers of a .gltf.
class BufferFiles {
 public:
  BufferFiles(std::string path, MeshFileBytes& file, FileFaults& faults)
      : path_(std::move(path)),
        left_(kLargestFile - file.bytes.size()),
        file_(file),
        faults_(faults) {}

  std::string contents_of(const std::string& place, const std::string& uri) {
    const std::string path = beside(path_, place, uri, faults_);
    if (path.empty()) return {};
    // A file named twice would be added twice.
    const auto is_it = [&path](const std::filesystem::path& known) {
      return known.lexically_normal() == std::filesystem::path(path).lexically_normal();
    };
    if (std::any_of(file_.files.begin(), file_.files.end(), is_it)) {
      faults_.add(place, "a file that no other buffer names", in_quotes(uri));
      return {};
    }
    FileFaults own(path_ + ": " + place + ": " + path);
    std::string bytes = contents(path, own);
    own.throw_if_any();
    if (bytes.size() > left_) {
      faults_.add(place, "at most 2 GiB in all files", "more");
      return {};
    }
    left_ -= bytes.size();
    file_.files.push_back(path);
    return bytes;
  }

 private:
  std::string path_;
  std::uintmax_t left_;
  MeshFileBytes& file_;
  FileFaults& faults_;
};

}  // namespace

PolygonSoup read_mesh_file(const std::string& path) {
  FileFaults faults(path);
  format_of(path, faults);  // before it is read
  faults.throw_if_any();
  return read_mesh(path, mesh_file_bytes(path).bytes);
}

MeshFileBytes mesh_file_bytes(const std::string& path) {
  FileFaults faults(path);
  MeshFileBytes file{contents(path, faults), {path}};
  faults.throw_if_any();
  if (lower_extension(path) == ".gltf") {
    BufferFiles buffers(path, file, faults);
    file.bytes = with_buffers(file.bytes, [&](const std::string& place, const std::string& uri) {
      return buffers.contents_of(place, uri);
    });
    faults.throw_if_any();
  }
  return file;
}

bool has_unit(const std::string& path) { return lower_extension(path) == ".3mf"; }

bool is_mesh_file_name(const std::string& path) {
  FileFaults faults(path);
  return format_of(path, faults) != MeshFormat::none;
}

PolygonSoup read_mesh(const std::string& path, const std::string& bytes) {
  FileFaults faults(path);
  const MeshFormat format = format_of(path, faults);
  faults.throw_if_any();
  if (format == MeshFormat::three_mf) {
    PolygonSoup soup = read_3mf(bytes, faults);
    faults.throw_if_any();
    return soup;
  }
  std::string_view text = bytes;
  // Some editors begin a text with a byte order mark. In a binary file the bytes are data.
  if (text.starts_with("\xEF\xBB\xBF") &&
      (format != MeshFormat::stl || text.substr(3, 5) == "solid"))
    text.remove_prefix(3);
  // The header of a binary .stl may be anything.
  const bool may_be_text =
      format != MeshFormat::stl ||
      text.substr(0, 12).find(std::string_view("s\0o\0l", 5)) != std::string_view::npos;
  if (may_be_text && is_utf16(text)) {
    faults.add("", "text in UTF-8 or ASCII", "UTF-16; save it as UTF-8");
    faults.throw_if_any();
  }
  PolygonSoup soup = format == MeshFormat::obj   ? read_obj(text, faults)
                     : format == MeshFormat::stl ? read_stl(text, faults)
                     : format == MeshFormat::ply ? read_ply(text, faults)
                     : format == MeshFormat::off ? read_off(text, faults)
                                                 : read_gltf(text, faults);
  faults.throw_if_any();
  return soup;
}

}  // namespace palpate::stimuli
