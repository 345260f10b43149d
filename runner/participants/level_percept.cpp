#include "runner/participants/level_percept.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <tuple>

#include "protocols/parse.h"
#include "protocols/tasks/levels.h"
#include "stimuli/signed_distance.h"

namespace palpate::runner {
namespace {

constexpr double kLeastDepth = 2e-4;        // m; below it force over depth is noise
constexpr double kLevelStep = 1e-3;         // of the level, for the derivative
constexpr double kLeastSensitivity = 1e-3;  // m of surface for a m of the level

double box_distance(const Vec3& size, const Vec3& point) {
  const Vec3 beyond = glm::abs(point) - 0.5 * size;
  return glm::length(glm::max(beyond, Vec3(0))) +
         std::min(std::max({beyond.x, beyond.y, beyond.z}), 0.0);
}

/// Of the surface, m; not a number for a mesh.
double distance_to(const stimuli::ObjectSpec& object, const Vec3& point) {
  const Vec3 local = glm::conjugate(object.pose.orientation) * (point - object.pose.position);
  switch (object.shape) {
    case stimuli::ShapeKind::mesh:
      return std::numeric_limits<double>::quiet_NaN();
    case stimuli::ShapeKind::box:
      return box_distance(object.size, local);
    case stimuli::ShapeKind::compound: {
      double least = std::numeric_limits<double>::infinity();
      for (const stimuli::ObjectSpec& part : object.parts) {
        const double one = distance_to(part, local);
        if (!(one >= least)) least = one;
      }
      return least;
    }
    default:
      return stimuli::signed_distance(object, local).distance;
  }
}

bool is_length(const std::string& pointer) {
  return pointer.ends_with("_m") || pointer.find("_m/") != std::string::npos;
}

}  // namespace

bool have_one_form(const stimuli::ObjectSpec& a, const stimuli::ObjectSpec& b) {
  const auto form = [](const stimuli::ObjectSpec& o) {
    return std::tuple(o.shape, o.radius, o.height, o.edge, o.size.x, o.size.y, o.size.z, o.file,
                      o.parts.size(), o.pose.position.x, o.pose.position.y, o.pose.position.z,
                      o.pose.orientation.w, o.pose.orientation.x, o.pose.orientation.y,
                      o.pose.orientation.z);
  };
  if (form(a) != form(b)) return false;
  for (std::size_t i = 0; i < a.parts.size(); ++i) {
    if (!have_one_form(a.parts[i], b.parts[i])) return false;
  }
  return true;
}

bool differ_in_stiffness(const protocols::Protocol& protocol, const protocols::TaskBlock& block) {
  const auto object = [&](std::size_t i) -> const stimuli::ObjectSpec& {
    return protocol.stimuli[static_cast<std::size_t>(block.stimuli[i])].object;
  };
  for (std::size_t i = 0; i < block.stimuli.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (!have_one_form(object(i), object(k)) ||
          object(i).material.stiffness == object(k).material.stiffness)
        return false;
    }
  }
  return block.stimuli.size() > 1;
}

void LevelPercept::begin(const protocols::Trial& trial, const protocols::Interval& interval) {
  const auto& block = protocol_.blocks[static_cast<std::size_t>(trial.task_block)];
  orientation_ = trial.orientation;
  stiffness_sum_ = squares_ = products_ = 0;
  contact_ticks_ = 0;
  level_.reset();
  of_stiffness_ = block.level ? block.level->pointer == "/stiffness_n_per_m"
                              : block.task == protocols::TaskKind::identify &&
                                    differ_in_stiffness(protocol_, block);
  if (block.level && interval.stimulus >= 0 && is_length(block.level->pointer))
    know_object(block, interval);
}

void LevelPercept::know_object(const protocols::TaskBlock& block,
                               const protocols::Interval& interval) {
  const std::optional<double> level =
      interval.level ? interval.level : protocols::own_level(protocol_, block, interval.stimulus);
  if (!level) return;
  for (const double step : {kLevelStep * std::abs(*level), -kLevelStep * std::abs(*level)}) {
    try {
      object_ = protocols::at_level(protocol_, block, interval.stimulus, *level).object;
      other_ = protocols::at_level(protocol_, block, interval.stimulus, *level + step).object;
      step_ = step;
      if (step != 0) level_ = level;
      return;
    } catch (const protocols::InputError&) {  // beyond what it can have: the other way
    }
  }
}

void LevelPercept::add(const Sample& sample) {
  const rendering::Rendering& felt = sample.rendering;
  if (felt.contacts == 0 || !(felt.deepest.depth > kLeastDepth)) return;
  stiffness_sum_ += glm::length(felt.force) / felt.deepest.depth;
  ++contact_ticks_;
}

void LevelPercept::add(const Percept& percept) {
  if (!level_ || !percept.contact || (percept.ray && !percept.along)) return;
  Vec3 place = percept.tip;
  if (percept.ray) place += *percept.along * glm::normalize(percept.tail - percept.tip);
  place = glm::conjugate(orientation_) * place;
  const double outside = distance_to(object_, place);
  const double slope = (distance_to(other_, place) - outside) / step_;
  if (!std::isfinite(outside) || !std::isfinite(slope)) return;
  squares_ += slope * slope;
  products_ += slope * outside;
}

std::optional<double> LevelPercept::stiffness() const {
  if (!of_stiffness_ || contact_ticks_ == 0) return std::nullopt;
  return stiffness_sum_ / contact_ticks_;
}

std::optional<double> LevelPercept::length() const {
  if (!level_ || !(squares_ > kLeastSensitivity * kLeastSensitivity)) return std::nullopt;
  return *level_ - products_ / squares_;
}

}  // namespace palpate::runner
