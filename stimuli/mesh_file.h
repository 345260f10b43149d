#pragma once
// Reading of mesh files: Wavefront .obj, .stl, glTF 2.0, .ply, .off, .3mf.

#include <string>
#include <vector>

#include "stimuli/polygon_soup.h"

namespace palpate::stimuli {

inline constexpr const char* kMeshExtensions = ".obj, .stl, .gltf, .glb, .ply, .off or .3mf";

/// Whether the path ends in one of them.
bool is_mesh_file_name(const std::string& path);
/// Whether the file names the unit of its coordinates: .3mf.
bool has_unit(const std::string& path);

/// Reads a Wavefront .obj (v, f, g, o; other statements ignored; negative and v/vt/vn indices), an
/// .stl (ASCII or binary) or glTF 2.0 (.gltf, .glb: triangles, strips and fans of the default scene
/// or else the first, node transforms applied, each primitive a group; turned from +y up to +z up;
/// no morph targets, no compression), a .ply (ASCII, binary in both byte
/// orders; properties that are no coordinates or corners skipped) an .off (text; colours and
/// normals skipped) or a .3mf (items of the build with their components and transforms, in the unit
/// that it names). Units of the others are metres as they stand.
/// Whether it is a solid is checked by convex_parts(), not here.
/// \throws MeshError with file, line (text formats) or byte (binary) and what was expected.
PolygonSoup read_mesh_file(const std::string& path);

/// The same of a file that has been read. `path` gives its format and names it in messages.
PolygonSoup read_mesh(const std::string& path, const std::string& bytes);

/// A mesh file as it was read.
struct MeshFileBytes {
  /// As in the file. A .gltf has the buffers that it names embedded, so that the bytes are
  /// complete.
  std::string bytes;
  std::vector<std::string> files;  ///< paths of all that was read: its own, its buffers'
};

/// \throws MeshError: a file cannot be read, they are more than 2 GiB, or a .gltf names a buffer
/// that does not lie in its folder or one within.
MeshFileBytes mesh_file_bytes(const std::string& path);

}  // namespace palpate::stimuli
