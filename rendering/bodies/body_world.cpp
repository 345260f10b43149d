#include "rendering/bodies/body_world.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace palpate::rendering {

void BodyWorld::pair_up() {
  pairs.clear();
  part_pairs.clear();
  first_part.assign(1, 0);
  for (const MovingBody& body : bodies)
    first_part.push_back(first_part.back() + static_cast<std::uint32_t>(body.parts.size()));
  const auto add = [this](std::uint32_t a, std::uint32_t b, bool obstacle, std::size_t parts_of_b) {
    BodyPair pair;
    pair.a = a;
    pair.b = b;
    pair.obstacle = obstacle;
    pair.first = static_cast<std::uint32_t>(part_pairs.size());
    const stimuli::Body& of_a = bodies[a].of;
    const stimuli::Body& of_b = obstacle ? of_a : bodies[b].of;
    pair.restitution = std::sqrt(of_a.restitution * of_b.restitution);
    pair.friction = std::sqrt(of_a.friction * of_b.friction);
    for (std::uint32_t i = 0; i < bodies[a].parts.size(); ++i) {
      for (std::uint32_t k = 0; k < parts_of_b; ++k) part_pairs.push_back({i, k});
    }
    pair.count = static_cast<std::uint32_t>(part_pairs.size()) - pair.first;
    pairs.push_back(pair);
  };
  for (std::uint32_t a = 0; a < bodies.size(); ++a) {
    for (std::uint32_t b = a + 1; b < bodies.size(); ++b) add(a, b, false, bodies[b].parts.size());
    for (std::uint32_t k = 0; k < obstacles.size(); ++k) add(a, k, true, obstacles[k].parts.size());
  }
}

void BodyWorldState::make_room() {
  near.reserve(most_pairs);
  near_parts.reserve(most_parts);
  contacts.reserve(kMostContacts);
  rows.reserve(ComplementarityProblem::kMostRows);
  problem.make_room();
  for (std::vector<Vec3>* polygon : {&clip.polygon, &clip.next}) polygon->reserve(most_corners);
  clip.points.reserve(most_corners);
}

BodyWorldState initial_state(const BodyWorld& world) {
  BodyWorldState state;
  const std::size_t count = world.bodies.size();
  for (const MovingBody& body : world.bodies) state.motion.push_back(body.start);
  state.gaps.resize(world.part_pairs.size());
  state.measured.resize(world.pairs.size());
  state.sleep.resize(count);
  state.island.resize(count);
  state.velocity.resize(count);
  state.spin.resize(count);
  state.push.resize(count);
  state.twist.resize(count);
  state.per_inertia.resize(count);
  state.pushed.resize(count);
  state.placed.resize(count);
  state.part_centres.resize(world.first_part.empty() ? 0 : world.first_part.back());
  std::size_t most_sides = 0;
  const auto look = [&most_sides](const std::vector<CollidingPart>& parts) {
    for (const CollidingPart& part : parts) {
      for (const stimuli::Facet& facet : part.mesh->facets())
        most_sides = std::max<std::size_t>(most_sides, facet.side_count);
    }
  };
  for (const MovingBody& body : world.bodies) look(body.parts);
  for (const Obstacle& obstacle : world.obstacles) look(obstacle.parts);
  state.most_pairs = world.pairs.size();
  state.most_parts = world.part_pairs.size();
  state.most_corners = 2 * most_sides + 2;  // each side of a facet adds at most one corner
  state.make_room();
  return state;
}

ConvexPlace place_of(const CollidingPart& part, const Pose& frame) {
  ConvexPlace place;
  place.mesh = part.mesh.get();
  place.axes = glm::mat3_cast(frame.orientation * part.pose.orientation);
  place.position = frame.orientation * part.pose.position + frame.position;
  place.inside = part.inside;
  return place;
}

double kinetic_energy(const BodyWorld& world, const BodyWorldState& state) {
  double sum = 0;
  for (std::size_t i = 0; i < world.bodies.size(); ++i)
    sum += kinetic_energy(world.bodies[i].inertia, state.motion[i]);
  return sum;
}

Vec3 momentum(const BodyWorld& world, const BodyWorldState& state) {
  Vec3 sum(0);
  for (std::size_t i = 0; i < world.bodies.size(); ++i)
    sum += world.bodies[i].inertia.mass * state.motion[i].velocity;
  return sum;
}

Vec3 angular_momentum(const BodyWorld& world, const BodyWorldState& state) {
  Vec3 sum(0);
  for (std::size_t i = 0; i < world.bodies.size(); ++i) {
    const BodyMotion& motion = state.motion[i];
    sum += motion.spin_momentum +
           world.bodies[i].inertia.mass * glm::cross(motion.centre, motion.velocity);
  }
  return sum;
}

}  // namespace palpate::rendering
