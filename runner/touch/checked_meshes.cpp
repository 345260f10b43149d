#include "runner/touch/checked_meshes.h"

#include <cstddef>
#include <stdexcept>

#include "runner/touch/scene_notes.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/parts/convex_parts.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/solids/gmsh_file.h"

namespace palpate::runner::touch {

void check_meshes(const stimuli::ObjectSpec& object, const std::string& pointer,
                  const std::string& file, SceneBuilder& builder,
                  std::vector<protocols::Fault>& faults) {
  if (object.shape == stimuli::ShapeKind::compound) {
    for (std::size_t i = 0; i < object.parts.size(); ++i) {
      check_meshes(object.parts[i], pointer + "/parts/" + std::to_string(i), file, builder, faults);
    }
    return;
  }
  if (object.shape == stimuli::ShapeKind::none) return;
  const std::string where = object.shape == stimuli::ShapeKind::mesh ? pointer + "/file" : pointer;
  try {
    if (stimuli::is_gmsh_file_name(object.file)) {
      stimuli::solid_of_file(object);
    } else if (object.shape == stimuli::ShapeKind::mesh) {
      builder.mesh(object);
    } else {
      stimuli::convex_parts(object);
    }
  } catch (const stimuli::MeshError& error) {
    for (const std::string& fault : error.faults()) faults.push_back({file, where, fault});
  } catch (const std::runtime_error& error) {
    faults.push_back({file, where, error.what()});
  }
}

std::vector<protocols::Fault> mesh_faults(const protocols::Protocol& protocol,
                                          const std::string& file, SceneBuilder& builder) {
  std::vector<protocols::Fault> faults;
  for (std::size_t i = 0; i < protocol.stimuli.size(); ++i) {
    check_meshes(protocol.stimuli[i].object,
                 "/stimuli/" + std::to_string(protocol.stimuli[i].place), file, builder, faults);
  }
  for (std::size_t g = 0; g < protocol.group_protocols.size(); ++g) {
    const std::vector<protocols::StimulusSpec>& stimuli = protocol.group_protocols[g]->stimuli;
    for (std::size_t i = 0; i < stimuli.size() && faults.empty(); ++i)
      check_meshes(stimuli[i].object,
                   "/groups/patch/" + protocol.groups.true_name(g) + "/stimuli/" +
                       std::to_string(stimuli[i].place),
                   file, builder, faults);
  }
  return faults;
}

std::vector<std::string> stimulus_notes(const protocols::Protocol& protocol,
                                        SceneBuilder& builder) {
  std::vector<std::string> out;
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli) {
    for (const std::string& note : mesh_notes(stimulus.object, builder))
      out.push_back("stimulus " + stimulus.name + ": " + note);
  }
  return out;
}

}  // namespace palpate::runner::touch
