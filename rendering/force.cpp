#include "rendering/force.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace palpate::rendering {
namespace {

/// The shortest translation x with dot(n_i, x) >= depth_i for all contacts, as x = sum of share_i
/// n_i with share_i >= 0. Hildreth 1957: one contact at a time is satisfied, until none moves.
void satisfy(std::span<LoadedContact> contacts) {
  constexpr int kRounds = 60;
  Vec3 x(0);
  for (int round = 0; round < kRounds; ++round) {
    double moved = 0;
    for (auto& c : contacts) {
      const double step = std::max(c.contact.depth - glm::dot(c.contact.normal, x), -c.share);
      c.share += step;
      x += step * c.contact.normal;
      moved = std::max(moved, std::abs(step));
    }
    if (moved == 0) break;
  }
}

}  // namespace

void share_depths(std::span<LoadedContact> contacts) {
  for (std::size_t begin = 0; begin < contacts.size();) {
    std::size_t end = begin + 1;
    while (end < contacts.size() && contacts[end].object == contacts[begin].object) ++end;
    if (end - begin == 1) {
      contacts[begin].share = contacts[begin].contact.depth;
    } else {
      satisfy(contacts.subspan(begin, end - begin));
    }
    begin = end;
  }
}

double layered_force(const stimuli::Material& material, double share) {
  double force = 0, from = 0, stiffness = material.stiffness;
  for (const stimuli::Layer& layer : material.layers) {
    if (share <= layer.depth) break;
    force += stiffness * (layer.depth - from);
    from = layer.depth;
    stiffness = layer.stiffness;
  }
  return force + stiffness * (share - from);
}

void rub(LoadedContact& c, const stimuli::Material& material, const Vec3& motion, Grip& grip) {
  const Vec3& n = c.contact.normal;
  Vec3 lag = grip.lag - motion;
  lag -= glm::dot(lag, n) * n;
  const double pull = c.stiffness * glm::length(lag);
  const double holds = (grip.sliding ? material.friction_dynamic : material.friction_static);
  grip.sliding = pull > holds * c.force;
  if (grip.sliding) lag *= material.friction_dynamic * c.force / pull;
  grip.lag = c.lag = lag;
  grip.held = true;
}

}  // namespace palpate::rendering
