#include "rendering/verification/explain.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <set>

namespace palpate::rendering {
namespace {

std::string counted(std::size_t count, const std::string& one, const std::string& many) {
  return std::to_string(count) + ' ' + (count == 1 ? one : many);
}

/// How many of the scene's meshes have a certain tree, and the largest count of its primitives.
struct MeshTally {
  std::size_t meshes = 0, with = 0, most = 0;
};

template <class Has, class Count>
MeshTally tally(const Scene& scene, Has has, Count count) {
  MeshTally result;
  std::set<const stimuli::ConvexMesh*> seen;
  for (const ScenePart& part : scene.parts()) {
    if (!seen.insert(part.mesh.get()).second) continue;
    ++result.meshes;
    if (has(*part.trees)) ++result.with;
    result.most = std::max(result.most, count(*part.mesh));
  }
  return result;
}

TickStage structure(std::string name, const MeshTally& t, const std::string& things,
                    std::size_t limit) {
  const bool built = t.with > 0;
  std::string why = built ? "for " + std::to_string(t.with) + " of " +
                                counted(t.meshes, "mesh", "meshes") + ": more than " +
                                std::to_string(limit) + ' ' + things
                          : "not more than " + std::to_string(limit) + ' ' + things +
                                " (here up to " + std::to_string(t.most) + ")";
  return {std::move(name), StageTime::once, built, std::move(why)};
}

void add_structures(const Scene& scene, const Renderer& renderer, std::vector<TickStage>& stages) {
  const auto facets = [](const stimuli::ConvexMesh& m) { return m.facets().size(); };
  const auto edges = [](const stimuli::ConvexMesh& m) { return m.edges().size(); };
  const auto vertices = [](const stimuli::ConvexMesh& m) { return m.vertices().size(); };
  stages.push_back(
      structure("tree of polygons",
                tally(
                    scene, [](const ContactTrees& t) { return t.polygons() != nullptr; }, facets),
                "facets to scan", ContactTrees::kScanLimit));
  const MeshTally with_edges = tally(
      scene, [](const ContactTrees& t) { return t.edges() != nullptr; }, edges);
  if (with_edges.with == 0 && !renderer.side_contact()) {
    stages.push_back({"tree of edges", StageTime::once, false, "a point meets no edges"});
  } else {
    stages.push_back(
        structure("tree of edges", with_edges, "edges to scan", ContactTrees::kScanLimit));
  }
  stages.push_back(structure(
      "support map",
      tally(
          scene, [](const ContactTrees& t) { return t.support_map() != nullptr; }, vertices),
      "vertices to climb", SupportMap::kSmallMesh));
  stages.push_back(structure(
      "facet map",
      tally(
          scene, [](const ContactTrees& t) { return t.facet_map() != nullptr; }, vertices),
      "vertices to walk past", SupportMap::kSmallMesh));
}

/// Parts that a point anywhere on the first part's bounding sphere cannot reach.
std::size_t out_of_reach(const Scene& scene) {
  const auto& parts = scene.parts();
  return static_cast<std::size_t>(
      std::count_if(parts.begin(), parts.end(), [&](const ScenePart& part) {
        const ScenePart& first = parts.front();
        const double gap = glm::length(part.sphere_centre - first.sphere_centre) -
                           first.sphere_radius - part.sphere_radius;
        return !in_reach(part, gap, 0);
      }));
}

void add_parts(const Scene& scene, std::vector<TickStage>& stages) {
  const std::size_t parts = scene.parts().size();
  const bool several = scene.features().several_parts;
  stages.push_back({"several parts", StageTime::tick, several,
                    several ? "broad phase by bounding spheres, a list of contacts, sums over it"
                            : "a single part is always near and has one contact at most"});
  const bool tree = !scene.part_tree().nodes().empty();
  stages.push_back({"tree of parts", StageTime::once, tree,
                    "not more than " + std::to_string(Scene::kFewParts) +
                        " parts are looked at one by one (here " + std::to_string(parts) + ")"});
  if (tree) stages.back().why = "of their bounding spheres, for the broad phase";
  const std::size_t far = out_of_reach(scene);
  stages.push_back({"objects out of reach", StageTime::tick, false,
                    far == 0 ? "there are none while the first is touched"
                             : std::to_string(far) + " of " + counted(parts, "part", "parts") +
                                   " while the first is touched"});
}

void add_materials(const TickFeatures& features, std::vector<TickStage>& stages) {
  const auto add = [&](const char* name, bool runs, const char* what) {
    stages.push_back({name, StageTime::contact, runs, runs ? what : "no material asks for it"});
  };
  add("damping", features.damping, "against the normal speed, never pulling");
  add("friction", features.friction, "Coulomb's, by the ideal probe's tangential offset");
}

}  // namespace

const char* to_string(StageTime time) {
  switch (time) {
    case StageTime::once:
      return "once a scene";
    case StageTime::tick:
      return "every tick";
    case StageTime::free:
      return "in free space";
    case StageTime::entry:
      return "at first contact";
    case StageTime::contact:
      return "in contact";
  }
  return "";
}

std::vector<TickStage> explain(const Scene& scene, const Renderer& renderer) {
  const bool sides = renderer.side_contact();
  std::vector<TickStage> stages;
  add_structures(scene, renderer, stages);
  stages.push_back({"pose check", StageTime::tick, true,
                    "no force where a coordinate is not finite or beyond 1000 km"});
  add_parts(scene, stages);
  stages.push_back({"frame of the part", StageTime::tick, true, "the pose as the mesh sees it"});
  stages.push_back({"separating plane", StageTime::free, true,
                    "while the plane of an earlier tick separates them, nothing else is computed"});
  stages.push_back({"first contact", StageTime::entry, true,
                    "the feature through which the probe enters, once that plane is crossed"});
  stages.push_back({"neighbourhood watch", StageTime::contact, true,
                    "the walk from the last feature to the one that holds the ideal probe now"});
  stages.push_back({"side contact", StageTime::contact, sides,
                    sides ? "the walk crosses silhouette edges too (its cost is counted there); "
                            "equation (2) places the contact"
                          : "only the tip touches"});
  const bool unions = scene.features().unions;
  stages.push_back({"unions and tools", StageTime::contact, unions,
                    unions ? "one ideal tool for all parts of a surface: turn, push out, cast, "
                             "active planes"
                           : "no object has several parts or layers, and the stylus has no tool"});
  if (!scene.surfaces().empty())
    stages.push_back({"closed surfaces", StageTime::contact, true,
                      "one ideal tool for each, off the patches of its triangles and edges"});
  stages.push_back({"spring", StageTime::contact, true, "stiffness times depth along the normal"});
  add_materials(scene.features(), stages);
  stages.push_back({"torque and second device", StageTime::contact, sides,
                    sides ? "the moment about the tip; equations (1), (4) and (5)"
                          : "a force at the tip has no moment about it"});
  stages.push_back({"sample log", StageTime::tick, false,
                    "not part of the scene: a protocol asks for it (\"samples\": true)"});
  return stages;
}

}  // namespace palpate::rendering
