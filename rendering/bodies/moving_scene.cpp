#include "rendering/bodies/moving_scene.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "rendering/bodies/body_world.h"
#include "rendering/bodies/moving_bodies.h"
#include "stimuli/convex_mesh.h"

namespace palpate::rendering {
namespace {

Pose inverse(const Pose& pose) {
  const Quat back = glm::conjugate(pose.orientation);
  return {-(back * pose.position), back};
}

[[noreturn]] void refuse(int object, const std::string& why) {
  throw std::invalid_argument("/objects/" + std::to_string(object) + "/body: " + why);
}

CollidingPart colliding(const SceneObject& part, const Pose& in_frame) {
  CollidingPart out;
  out.mesh = part.mesh;
  out.pose = in_frame;
  for (const Vec3& vertex : part.mesh->vertices())
    out.inside += vertex / static_cast<double>(part.mesh->vertices().size());
  out.centre = in_frame.orientation * part.mesh->centre() + in_frame.position;
  return out;
}

/// The parts of one object in a scene, at their first places.
struct OwnParts {
  std::vector<SceneObject> felt;
  std::vector<SceneSurface> surfaces;
  std::vector<SceneObject> solid;       ///< its colliding parts
  const SceneSurface* whole = nullptr;  ///< its colliding surface
};

/// In the frame in which its own has this pose.
std::shared_ptr<const stimuli::CollisionSurface> colliding(const SceneSurface& surface,
                                                           const Pose& pose) {
  return std::make_shared<const stimuli::CollisionSurface>(*surface.surface, pose);
}

/// The same of convex parts.
std::shared_ptr<const stimuli::CollisionSurface> colliding(
    const std::vector<CollidingPart>& parts) {
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const CollidingPart& part : parts) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    const stimuli::PolygonSoup soup = part.mesh->polygons();
    for (const Vec3& v : soup.vertices)
      vertices.push_back(part.pose.orientation * v + part.pose.position);
    for (const std::vector<std::uint32_t>& face : soup.faces) {
      for (std::size_t k = 2; k < face.size(); ++k)
        triangles.push_back({first + face[0], first + face[k - 1], first + face[k]});
    }
  }
  return std::make_shared<const stimuli::CollisionSurface>(std::move(vertices), triangles);
}

/// Gives surfaces to bodies and obstacles of convex parts, if any other has only its surface.
void meet_by_surface(BodyWorld& world) {
  const auto has_no_parts = [](const auto& one) {
    return one.parts.empty() && one.surface != nullptr;
  };
  const bool moves = std::ranges::any_of(world.bodies, has_no_parts);
  const auto complete = [](auto& one) {
    if (!one.parts.empty()) one.surface = colliding(one.parts);
  };
  if (moves || std::ranges::any_of(world.obstacles, has_no_parts))
    std::ranges::for_each(world.bodies, complete);
  if (moves) std::ranges::for_each(world.obstacles, complete);
}

MovingBody make_body(const MovingObject& moving, const OwnParts& own) {
  MovingBody body;
  body.object = moving.object;
  body.of = moving.body;
  std::vector<stimuli::PlacedMesh> solids;
  const Pose to_object = inverse(moving.pose);
  for (const SceneObject& part : own.felt)
    body.stiffness = std::max(body.stiffness, part.material.stiffness);
  for (const SceneSurface& surface : own.surfaces) {
    for (const stimuli::Material& material : surface.surface->materials())
      body.stiffness = std::max(body.stiffness, material.stiffness);
  }
  for (const SceneObject& part : own.solid)
    solids.push_back({part.mesh.get(), stimuli::compose(to_object, part.pose)});
  if (solids.empty() && own.surfaces.empty() && own.whole == nullptr)
    refuse(moving.object, "expected an object with a surface");
  const auto outer = std::ranges::find(own.surfaces, 0, &SceneSurface::layer);
  const stimuli::VolumeMoments moments =
      moving.solid != nullptr ? stimuli::moments_of_surface(*moving.solid, Pose{})
      : outer == own.surfaces.end()
          ? stimuli::moments_of_union(solids)
          : stimuli::moments_of_surface(*outer->surface, stimuli::compose(to_object, outer->pose));
  const stimuli::MassProperties properties =
      moving.body.mass ? stimuli::with_mass(moments, *moving.body.mass)
                       : stimuli::with_density(moments, *moving.body.density);
  try {
    body.inertia = inertia_of(properties);
  } catch (const std::invalid_argument& error) {
    refuse(moving.object, error.what());
  }
  body.placed = {moving.pose.orientation * properties.centre + moving.pose.position,
                 moving.pose.orientation};
  body.start.centre = body.placed.position;
  body.start.orientation = body.placed.orientation;
  body.start.velocity = moving.body.velocity;
  body.start.spin_momentum =
      spin_momentum_of(body.inertia, body.start.orientation, moving.body.spin);
  const Pose to_body = inverse(body.placed);
  if (own.whole != nullptr)
    body.surface = colliding(*own.whole, stimuli::compose(to_body, own.whole->pose));
  for (const SceneObject& part : own.solid) {
    body.parts.push_back(colliding(part, stimuli::compose(to_body, part.pose)));
    const CollidingPart& placed = body.parts.back();
    for (const Vec3& vertex : part.mesh->vertices())
      body.radius = std::max(body.radius,
                             glm::length(placed.pose.orientation * vertex + placed.pose.position));
  }
  const auto reach_over = [&](const SceneSurface& surface) {
    const Pose placed = stimuli::compose(to_body, surface.pose);
    for (const Vec3& vertex : surface.surface->vertices())
      body.radius =
          std::max(body.radius, glm::length(placed.orientation * vertex + placed.position));
  };
  std::ranges::for_each(own.surfaces, reach_over);
  if (own.whole != nullptr) reach_over(*own.whole);
  return body;
}

Obstacle make_obstacle(const std::vector<SceneObject>& parts) {
  Obstacle obstacle;
  obstacle.object = parts.front().object;
  for (const SceneObject& part : parts) {
    obstacle.parts.push_back(colliding(part, part.pose));
    obstacle.centre += obstacle.parts.back().centre;
  }
  obstacle.centre /= static_cast<double>(std::max<std::size_t>(1, obstacle.parts.size()));
  for (const CollidingPart& part : obstacle.parts)
    obstacle.radius =
        std::max(obstacle.radius, glm::length(part.centre - obstacle.centre) + part.mesh->radius());
  return obstacle;
}

Obstacle make_obstacle(const SceneSurface& surface) {
  Obstacle obstacle;
  obstacle.object = surface.object;
  obstacle.surface = colliding(surface, surface.pose);
  obstacle.centre = surface.pose.orientation * surface.surface->centre() + surface.pose.position;
  obstacle.radius = surface.surface->radius();
  return obstacle;
}

/// Limits that a step of a millisecond can follow.
void check_limits(const MovingBody& body) {
  constexpr double kFastest = 100, kFastestTurn = 1000;  // m/s, rad/s
  constexpr double kLeastTurn = 1e-6;                    // of the largest moment of inertia
  std::ostringstream text;
  const Vec3 spin = spin_of(body.inertia, body.start);
  if (glm::length(body.start.velocity) > kFastest)
    text << "velocity " << glm::length(body.start.velocity) << " m/s; expected at most "
         << kFastest;
  else if (glm::length(spin) > kFastestTurn)
    text << "spin " << glm::length(spin) << " rad/s; expected at most " << kFastestTurn;
  else if (body.inertia.mass < 1e-6)
    text << "mass " << body.inertia.mass << " kg; expected at least 1e-6 kg";
  const Mat3& inertia = body.inertia.inertia;
  const double largest = std::max({inertia[0][0], inertia[1][1], inertia[2][2]});
  const double least = std::min({inertia[0][0], inertia[1][1], inertia[2][2]});
  if (text.str().empty() && least < kLeastTurn * largest)
    text << "moments of inertia of a ratio of " << largest / least << "; expected at most 1e6";
  if (!text.str().empty()) refuse(body.object, text.str());
}

void check_masses(const BodyWorld& world) {
  constexpr double kMostRatio = 1e6;
  const MovingBody *lightest = nullptr, *heaviest = nullptr;
  for (const MovingBody& body : world.bodies) {
    if (lightest == nullptr || body.inertia.mass < lightest->inertia.mass) lightest = &body;
    if (heaviest == nullptr || body.inertia.mass > heaviest->inertia.mass) heaviest = &body;
  }
  if (lightest == nullptr || heaviest->inertia.mass <= kMostRatio * lightest->inertia.mass) return;
  std::ostringstream text;
  text << "a mass of " << lightest->inertia.mass << " kg beside one of " << heaviest->inertia.mass
       << " kg (object " << heaviest->object << "); expected a ratio of at most 1e6";
  refuse(lightest->object, text.str());
}

/// Bodies that overlap at the start would fly apart.
void check_overlaps(const BodyWorld& world) {
  constexpr double kMostOverlap = 1e-4;  // m; less comes apart slowly
  for (const BodyPair& pair : world.pairs) {
    const MovingBody& a = world.bodies[pair.a];
    const std::vector<CollidingPart>& parts =
        pair.obstacle ? world.obstacles[pair.b].parts : world.bodies[pair.b].parts;
    const Pose frame = pair.obstacle ? Pose{} : world.bodies[pair.b].placed;
    double overlap = 0;
    if (pair.by_surface) {
      const stimuli::CollisionSurface& surface =
          pair.obstacle ? *world.obstacles[pair.b].surface : *world.bodies[pair.b].surface;
      overlap = overlap_of(place_of(*a.surface, a.placed), place_of(surface, frame));
    }
    for (std::uint32_t k = pair.by_surface ? pair.first + 1 : pair.first;
         k < pair.first + pair.count; ++k) {
      GapMemory memory;
      const PartPair& both = world.part_pairs[k];
      const ConvexPlace at_a = place_of(a.parts[both.part_a], a.placed);
      const ConvexPlace at_b = place_of(parts[both.part_b], frame);
      overlap = std::max(overlap, -gap_between(at_a, at_b, 0, memory).distance);
    }
    if (overlap <= kMostOverlap) continue;
    std::ostringstream text;
    text << "is " << 1e3 * overlap << " mm inside of object "
         << (pair.obstacle ? world.obstacles[pair.b].object : world.bodies[pair.b].object)
         << " at the start; expected at most " << 1e3 * kMostOverlap << " mm";
    refuse(a.object, text.str());
  }
}

}  // namespace

std::optional<MovingSummary> moving_summary(const Scene& scene) {
  const auto* const moving = dynamic_cast<const MovingBodies*>(scene.motion());
  if (moving == nullptr) return std::nullopt;
  const BodyWorld& world = moving->world();
  MovingSummary out;
  out.bodies = world.bodies.size();
  out.obstacles = world.obstacles.size();
  out.part_pairs = world.part_pairs.size();
  out.lightest = HUGE_VAL;
  for (const MovingBody& body : world.bodies) {
    out.lightest = std::min(out.lightest, body.inertia.mass);
    out.heaviest = std::max(out.heaviest, body.inertia.mass);
  }
  return out;
}

Scene moving_scene(std::vector<SceneObject> parts, const std::vector<MovingObject>& moving,
                   const Vec3& gravity, bool side_contact, const Tool& tool, bool sleeps,
                   std::vector<SceneSurface> surfaces, std::vector<SceneSurface> solids) {
  if (moving.empty())
    return Scene(std::move(parts), side_contact, tool, nullptr, std::move(surfaces));
  if (moving.size() > kMostBodies)
    refuse(moving[kMostBodies].object,
           "expected at most " + std::to_string(kMostBodies) + " moving objects in a scene");
  // Search trees are built once and shared.
  for (SceneObject& part : parts) {
    if (!part.trees) part.trees = std::make_shared<const ContactTrees>(*part.mesh, side_contact);
  }
  BodyWorld world;
  world.gravity = gravity;
  world.sleeps = sleeps;
  const auto is_of = [](int object) {
    return [object](const auto& part) { return part.object == object; };
  };
  std::vector<SceneObject> collide;  // the convex parts of all objects that have some
  std::copy_if(parts.begin(), parts.end(), std::back_inserter(collide),
               [&](const SceneObject& part) {
                 return part.layer <= 0 &&
                        std::none_of(surfaces.begin(), surfaces.end(), [&](const auto& surface) {
                          return surface.layer <= 0 && surface.object == part.own_solid();
                        });
               });
  std::vector<Scene> shapes;
  for (const MovingObject& object : moving) {
    OwnParts own;
    const auto is_own = is_of(object.object);
    std::copy_if(parts.begin(), parts.end(), std::back_inserter(own.felt), is_own);
    std::copy_if(surfaces.begin(), surfaces.end(), std::back_inserter(own.surfaces), is_own);
    std::copy_if(collide.begin(), collide.end(), std::back_inserter(own.solid), is_own);
    if (const auto whole = std::ranges::find_if(solids, is_own); whole != solids.end())
      own.whole = &*whole;
    MovingBody body = make_body(object, own);
    check_limits(body);
    const Pose to_body = inverse(body.placed);
    for (SceneObject& part : own.felt) part.pose = stimuli::compose(to_body, part.pose);
    for (SceneSurface& surface : own.surfaces)
      surface.pose = stimuli::compose(to_body, surface.pose);
    shapes.emplace_back(std::move(own.felt), side_contact, tool, nullptr, std::move(own.surfaces));
    world.bodies.push_back(std::move(body));
  }
  check_masses(world);
  const auto moves = [&](const auto& part) {
    return std::any_of(moving.begin(), moving.end(),
                       [&](const MovingObject& m) { return m.object == part.object; });
  };
  std::erase_if(collide, moves);
  std::vector<int> met;
  for (const SceneObject& part : collide) {
    if (std::find(met.begin(), met.end(), part.object) != met.end()) continue;
    met.push_back(part.object);
    std::vector<SceneObject> own;
    std::copy_if(collide.begin(), collide.end(), std::back_inserter(own), is_of(part.object));
    world.obstacles.push_back(make_obstacle(own));
  }
  for (const SceneSurface& surface : solids) {
    if (!moves(surface)) world.obstacles.push_back(make_obstacle(surface));
  }
  meet_by_surface(world);
  world.pair_up();
  check_overlaps(world);
  std::vector<SceneObject> fixed = parts;
  std::vector<SceneSurface> fixed_surfaces = surfaces;
  std::erase_if(fixed, moves);
  std::erase_if(fixed_surfaces, moves);
  auto motion = std::make_shared<const MovingBodies>(
      std::move(world),
      Scene(std::move(fixed), side_contact, tool, nullptr, std::move(fixed_surfaces)),
      std::move(shapes));
  return Scene(std::move(parts), side_contact, tool, std::move(motion), std::move(surfaces));
}

}  // namespace palpate::rendering
