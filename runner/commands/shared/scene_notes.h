#pragma once
// What a scene asks for that is left out, said to whoever renders it.

#include <optional>
#include <string>
#include <vector>

#include "protocols/parse.h"
#include "rendering/bodies/soft/soft_scene.h"

namespace palpate::runner {

/// A sentence with its place for each object that falls through others: soft objects touch nothing
/// but the tool. Without line ends.
std::vector<std::string> objects_passed_through(const protocols::SceneSpec& scene);

/// A sentence if the tool is smaller than the object's elements, which it feels then; else nothing.
std::optional<std::string> elements_felt(const rendering::SoftObject& object);

/// Of each mesh file in an object: its size in mm, so that one in other units is seen, and what was
/// done to its polygons. Without line ends.
std::vector<std::string> mesh_notes(const stimuli::ObjectSpec& object);

/// All of that of a scene, with places.
std::vector<std::string> scene_notes(const protocols::SceneSpec& spec,
                                     const rendering::Scene& scene);

}  // namespace palpate::runner
