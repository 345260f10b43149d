#pragma once
// Whether the meshes of objects can be built, as a session builds them, and what is to be said of
// them.

#include <string>
#include <vector>

#include "protocols/parse.h"
#include "runner/scene_builder.h"

namespace palpate::runner::touch {

/// Builds every mesh of an object and adds its faults.
/// \param pointer  of the object. \param file  that describes it
void check_meshes(const stimuli::ObjectSpec& object, const std::string& pointer,
                  const std::string& file, SceneBuilder& builder,
                  std::vector<protocols::Fault>& faults);

/// The same of all stimuli of a protocol and of its groups.
std::vector<protocols::Fault> mesh_faults(const protocols::Protocol& protocol,
                                          const std::string& file, SceneBuilder& builder);

/// Notes on the mesh files of a protocol's stimuli, a sentence each.
std::vector<std::string> stimulus_notes(const protocols::Protocol& protocol, SceneBuilder& builder);

}  // namespace palpate::runner::touch
