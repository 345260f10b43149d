#pragma once
// Notes on parts of a scene that are not rendered as expected.

#include <optional>
#include <string>
#include <vector>

#include "protocols/parse.h"
#include "rendering/bodies/soft/soft_object.h"
#include "runner/scene_builder.h"

namespace palpate::runner::touch {

/// A sentence if the tool is smaller than the object's elements, so that it feels each of them.
std::optional<std::string> elements_felt(const rendering::SoftObject& object);

/// For each mesh file of an object: its size in mm, so that wrong units are noticed, and the
/// changes to its polygons. Without line ends.
/// \param builder  of its scene: it has read the files
std::vector<std::string> mesh_notes(const stimuli::ObjectSpec& object, SceneBuilder& builder);

/// All these notes of a scene, with places.
std::vector<std::string> scene_notes(const protocols::SceneSpec& spec,
                                     const rendering::Scene& scene, SceneBuilder& builder);

}  // namespace palpate::runner::touch
