#pragma once
// Reading of mesh files: Wavefront .obj, .stl, glTF 2.0.

#include <string>

#include "stimuli/convex_mesh.h"

namespace palpate::stimuli {

inline constexpr const char* kMeshExtensions = ".obj, .stl, .gltf or .glb";

/// Whether it ends in one of them.
bool is_mesh_file_name(const std::string& path);

/// Reads a Wavefront .obj (v, f, g, o; other statements ignored; negative and v/vt/vn indices), an
/// .stl (ASCII or binary) or glTF 2.0 (.gltf, .glb: triangles of the default scene, node transforms
/// applied, each primitive a group; turned from +y up to +z up). Units are metres as they stand.
/// Whether it is a solid is checked by convex_parts(), not here.
/// \throws MeshError with file, line (text formats) or byte (binary) and what was expected.
PolygonSoup read_mesh_file(const std::string& path);

/// The same of a file that has been read. `path` gives its format and names it in messages.
PolygonSoup read_mesh(const std::string& path, const std::string& bytes);

/// The bytes of a mesh file, whatever they are; of a .gltf with the buffers that it names taken in,
/// so that they are all of it. \throws MeshError: it cannot be read or is too
/// large.
std::string mesh_file_bytes(const std::string& path);

}  // namespace palpate::stimuli
