#include "runner/participants/explorer.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

namespace palpate::runner::participants {
namespace {

Vec3 unit_or(const Vec3& v, const Vec3& otherwise) {
  const double length = glm::length(v);
  return length > 1e-9 ? v / length : otherwise;
}

Vec3 any_perpendicular(const Vec3& n) {
  return glm::normalize(glm::cross(n, std::abs(n.x) < 0.7 ? Vec3(1, 0, 0) : Vec3(0, 1, 0)));
}

Vec3 random_perpendicular(Random& random, const Vec3& n) {
  const double angle = 2 * std::numbers::pi * random.unit();
  const Vec3 a = any_perpendicular(n);
  return std::cos(angle) * a + std::sin(angle) * glm::cross(n, a);
}

Vec3 normal_vector(Random& random) { return {random.normal(), random.normal(), random.normal()}; }

}  // namespace

Explorer::Explorer(const SimulatedSettings& settings, double grip, double wall_stiffness,
                   double tick)
    : settings_(settings),
      grip_(grip),
      tick_(tick),
      aim_depth_(settings.motor.indentation * (1 + wall_stiffness / settings.hand.stiffness)),
      max_offset_(settings.motor.max_indentation * wall_stiffness / settings.hand.stiffness),
      wander_(std::sqrt(2 * tick / settings.motor.heading_time)),
      turn_cosine_(std::cos(settings.stylus.turning * tick)),
      turn_sine_(std::sin(settings.stylus.turning * tick)),
      past_(static_cast<std::size_t>(
          std::max(1.0, std::round(settings.motor.reaction_delay / tick)))) {}

devices::HandTarget Explorer::begin(Random random) {
  random_ = random;
  std::fill(past_.begin(), past_.end(), TouchState{});
  now_ = 0;
  draw_approach();
  motion_ = Motion::approach;
  last_normal_ = Vec3(0);
  since_choice_ = settings_.heading.interval;
  turn_left_ = 0;
  tip_ = start_;
  axis_ = goal_axis_;
  return {tip_ + grip_ * axis_, Vec3(0), axis_};
}

void Explorer::draw_approach() {
  Vec3 direction;
  do {
    direction = unit_or(normal_vector(random_), Vec3(0, 0, 1));
  } while (direction.z < settings_.motor.approach_min_rise);
  start_ = settings_.motor.approach_distance * direction;
  aim_ = settings_.search.aim_sd * normal_vector(random_);
  const double tilt = settings_.stylus.tilt + settings_.stylus.tilt_sd * random_.normal();
  goal_axis_ =
      std::cos(tilt) * direction + std::sin(tilt) * random_perpendicular(random_, direction);
  // Keep the axis upwards: the hand stays above the table.
  goal_axis_.z = std::max(goal_axis_.z, settings_.motor.approach_min_rise);
  goal_axis_ = glm::normalize(goal_axis_);
}

devices::HandTarget Explorer::step(const TouchState& now, const Vec3& stylus_tip,
                                   const Vec3& stylus_axis) {
  TouchState& oldest = past_[now_];
  const Vec3 v = velocity(oldest);
  oldest.contact = now.contact;
  if (now.contact) oldest = now;
  if (++now_ == past_.size()) now_ = 0;
  tip_ += tick_ * v;
  turn_axis();
  limit_force(stylus_tip + grip_ * stylus_axis);
  return {tip_ + grip_ * axis_, v, axis_};
}

Vec3 Explorer::velocity(const TouchState& known) {
  const auto& motor = settings_.motor;
  if (known.contact) last_normal_ = known.normal;
  left_ -= tick_;
  since_choice_ += tick_;
  switch (motion_) {
    case Motion::approach:
      if (known.contact) {
        motion_ = Motion::follow;
        left_ = -motor.mean_follow * std::log(1 - random_.unit());
        heading_ = random_perpendicular(random_, known.normal);
        return slide(known);
      }
      // Missed the object: approach again.
      if (glm::dot(tip_ - aim_, aim_ - start_) > 0 && glm::length(tip_) > motor.approach_distance) {
        motion_ = Motion::retreat;
        draw_approach();
      }
      return motor.approach_speed * unit_or(aim_ - start_, Vec3(0, 0, -1));
    case Motion::follow:
      if (left_ <= 0) break;
      if (known.contact) return slide(known);
      motion_ = Motion::search;
      left_ = settings_.search.give_up;
      [[fallthrough]];
    case Motion::search:
      if (left_ <= 0) break;
      if (known.contact) {
        motion_ = Motion::follow;
        left_ = -motor.mean_follow * std::log(1 - random_.unit());
        return slide(known);
      }
      return search();
    case Motion::retreat:
      return move_to_start();
  }
  motion_ = Motion::retreat;
  draw_approach();
  return move_to_start();
}

Vec3 Explorer::search() {
  const double speed = settings_.motor.slide_speed;
  const Vec3 to_centre = unit_or(-tip_, Vec3(0));
  turn_left_ = 0;
  switch (settings_.search.after_loss) {
    case AfterLoss::press_on:
      return speed *
             unit_or(-last_normal_ + settings_.search.press_on_pull * to_centre, Vec3(0, 0, -1));
    case AfterLoss::turn_to_centre:
      heading_ = unit_or(heading_ + settings_.search.pull_to_centre * tick_ * to_centre, heading_);
      break;
  }
  return speed * heading_;
}

bool Explorer::wants_heading() const {
  // Subtract half a tick: the sum of many ticks equals the interval except for rounding.
  return settings_.heading.chosen && motion_ == Motion::follow &&
         since_choice_ > settings_.heading.interval - tick_ / 2;
}

void Explorer::turn_to(const Vec3& heading) {
  const double across = glm::dot(glm::cross(heading_, heading), last_normal_);
  turn_rate_ = std::atan2(across, glm::dot(heading_, heading)) / settings_.heading.turning_time;
  turn_left_ = settings_.heading.turning_time;
  since_choice_ = 0;
}

Vec3 Explorer::slide(const TouchState& known) {
  const double speed = settings_.motor.slide_speed;
  // The heading walks randomly within the surface; its correlation decays as exp(-t /
  // heading_time).
  double turn = wander_ * random_.normal();
  if (turn_left_ > 0) {
    turn += turn_rate_ * std::min(tick_, turn_left_);
    turn_left_ -= tick_;
  }
  heading_ -= glm::dot(heading_, known.normal) * known.normal;
  heading_ = unit_or(heading_, any_perpendicular(known.normal));
  heading_ = std::cos(turn) * heading_ + std::sin(turn) * glm::cross(known.normal, heading_);
  // Move towards the depth that gives the light force at the sensed contact point.
  const Vec3 aimed = tip_ + known.along * axis_;
  const double rise = glm::dot(known.surface - aimed, known.normal) - aim_depth_;
  return speed * heading_ + std::clamp(rise / tick_, -speed, speed) * known.normal;
}

Vec3 Explorer::move_to_start() {
  const double speed = settings_.motor.approach_speed;
  const double radius = glm::length(tip_), shell = settings_.motor.approach_distance;
  const Vec3 out = unit_or(tip_, Vec3(0, 0, 1));
  if (radius < shell - speed * tick_) return speed * out;
  const Vec3 way = start_ - tip_;
  const double distance = glm::length(way);
  if (distance <= speed * tick_) {
    motion_ = Motion::approach;
    return way / tick_;
  }
  // Move around the object, not through it.
  const Vec3 round = way - glm::dot(way, out) * out;
  const Vec3 level = (shell - radius) / tick_ * out;
  Vec3 v = speed * unit_or(round, any_perpendicular(out)) + level;
  if (glm::length(v) > speed) v *= speed / glm::length(v);
  return v;
}

void Explorer::turn_axis() {
  const double cosine = std::clamp(glm::dot(axis_, goal_axis_), -1.0, 1.0);
  if (cosine >= turn_cosine_) {
    axis_ = goal_axis_;
    return;
  }
  const Vec3 side = unit_or(goal_axis_ - cosine * axis_, any_perpendicular(axis_));
  axis_ = glm::normalize(turn_cosine_ * axis_ + turn_sine_ * side);
}

void Explorer::limit_force(const Vec3& held) {
  const Vec3 offset = tip_ + grip_ * axis_ - held;
  const double length2 = glm::dot(offset, offset);
  if (length2 < (1 - 1e-12) * max_offset_ * max_offset_) return;  // margin for rounding
  const double length = std::sqrt(length2);
  if (length > max_offset_) tip_ -= (1 - max_offset_ / length) * offset;
}

}  // namespace palpate::runner::participants
