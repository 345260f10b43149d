#include "rendering/force.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace palpate::rendering {
namespace {

/// The shortest translation x with dot(n_i, x) >= depth_i for all contacts, as x = sum of s_i n_i
/// with s_i >= 0 the normal_displacement. Hildreth's method for quadratic programs (1957): one
/// constraint at a time, until none changes.
void shortest_translation(std::span<LoadedContact> contacts) {
  constexpr int kRounds = 60;
  Vec3 x(0);
  for (int round = 0; round < kRounds; ++round) {
    double moved = 0;
    for (auto& c : contacts) {
      const double step =
          std::max(c.contact.depth - glm::dot(c.contact.normal, x), -c.normal_displacement);
      c.normal_displacement += step;
      x += step * c.contact.normal;
      moved = std::max(moved, std::abs(step));
    }
    if (moved == 0) break;
  }
}

}  // namespace

void distribute_depths(std::span<LoadedContact> contacts) {
  for (std::size_t begin = 0; begin < contacts.size();) {
    std::size_t end = begin + 1;
    while (end < contacts.size() && contacts[end].object == contacts[begin].object) ++end;
    if (end - begin == 1) {
      contacts[begin].normal_displacement = contacts[begin].contact.depth;
    } else {
      shortest_translation(contacts.subspan(begin, end - begin));
    }
    begin = end;
  }
}

double layered_force(const stimuli::Material& material, double depth) {
  double force = 0, from = 0, stiffness = material.stiffness;
  for (const stimuli::Layer& layer : material.layers) {
    if (depth <= layer.depth) break;
    force += stiffness * (layer.depth - from);
    from = layer.depth;
    stiffness = layer.stiffness;
  }
  return force + stiffness * (depth - from);
}

void apply_friction(LoadedContact& c, const stimuli::Material& material, const Vec3& motion,
                    FrictionState& friction) {
  const Vec3& n = c.contact.normal;
  Vec3 offset = friction.tangential_offset - motion;
  offset -= glm::dot(offset, n) * n;
  const double pull = c.stiffness * glm::length(offset);
  const double coefficient =
      (friction.sliding ? material.friction_dynamic : material.friction_static);
  friction.sliding = pull > coefficient * c.force;
  if (friction.sliding) offset *= material.friction_dynamic * c.force / pull;
  friction.tangential_offset = c.tangential_offset = offset;
  friction.in_contact = true;
}

}  // namespace palpate::rendering
