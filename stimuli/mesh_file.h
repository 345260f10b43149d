#pragma once
// Reading of mesh files: Wavefront .obj and .stl.

#include <string>

#include "stimuli/convex_mesh.h"

namespace palpate::stimuli {

/// Reads a Wavefront .obj (v, f; other statements ignored; negative and v/vt/vn indices) or an .stl
/// (ASCII or binary). Units are metres as they stand. Convexity is checked by ConvexMesh, not here.
/// \throws MeshError with file, line (text formats) or byte (binary) and what was expected.
PolygonSoup read_mesh_file(const std::string& path);

/// The same of a file that has been read. `path` gives its format and names it in messages.
PolygonSoup read_mesh(const std::string& path, const std::string& bytes);

/// The bytes of a mesh file, whatever they are. \throws MeshError: it cannot be read or is too
/// large.
std::string mesh_file_bytes(const std::string& path);

}  // namespace palpate::stimuli
