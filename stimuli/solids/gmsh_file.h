#pragma once
// Reading of Gmsh's mesh files, version 4.1 ASCII, as far as solids of tetrahedra need it.

#include <string>

#include "stimuli/solids/solid_mesh.h"

namespace palpate::stimuli {

/// Whether the path ends in .msh.
bool is_gmsh_file_name(const std::string& path);

/// Reads nodes and tetrahedra of 4 or 10 nodes ($Nodes, $Elements; elements of other dimensions and
/// other sections are passed over). Tetrahedra of 4 nodes get nodes in the middle of their edges;
/// inverted ones are turned. Units are metres as they stand; nodes that no tetrahedron uses are
/// left out.
/// \param name  named in faults
/// \throws MeshError with file, line and what was expected, every fault
SolidMesh read_gmsh(const std::string& name, const std::string& text);

}  // namespace palpate::stimuli
