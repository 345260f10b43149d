#pragma once
// Gmsh's mesh files, versions 1, 2 to 2.2 and 4.1, ASCII and binary, as far as solids of tetrahedra
// need them (Gmsh reference manual, "MSH file format").

#include <string>

#include "stimuli/polygon_soup.h"
#include "stimuli/shapes.h"
#include "stimuli/solids/solid_mesh.h"

namespace palpate::stimuli {

/// Whether the path ends in .msh.
bool is_gmsh_file_name(const std::string& path);

/// Reads nodes and tetrahedra of 4 or 10 nodes ($Nodes, $Elements; elements of other dimensions and
/// other sections are passed over). Tetrahedra of 4 nodes get nodes in the middle of their edges;
/// inverted ones are turned. Units are metres as they stand; nodes that no tetrahedron uses are
/// left out.
/// \param name  named in faults
/// \throws MeshError with file, line (binary: byte) and what was expected, every fault
SolidMesh read_gmsh(const std::string& name, const std::string& text);

/// The same of an object's file, scaled. \throws MeshError
SolidMesh solid_of_file(const ObjectSpec& spec);

}  // namespace palpate::stimuli
