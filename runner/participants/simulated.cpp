#include "runner/participants/simulated.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <numbers>

#include "runner/scene_builder.h"

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

constexpr double kLongestWait = 60;  // s of simulated time, from the start of a trial to time zero

/// Place of the grip while the device is at its centre, virtual frame, m. With a stylus that
/// reaches farther, the hand stays near it.
Vec3 hand_place(const WorkspaceMap& map) {
  const Vec3 centre = map.to_virtual(Vec3(0));
  return map.reach->in_world ? stretched(*map.reach, {centre, centre}).tip : centre;
}

bool is_far(const WorkspaceMap& map) { return map.reach && glm::length(hand_place(map)) > 1e-6; }

/// Turns +z to `direction`, by the smallest rotation.
Quat turn_up_to(const Vec3& direction) {
  const Vec3 to = glm::normalize(direction), up(0, 0, 1);
  const Vec3 axis = glm::cross(up, to);
  const double w = 1 + glm::dot(up, to);
  return w > 1e-9 ? glm::normalize(Quat(w, axis)) : Quat(0, 1, 0, 0);
}

/// Settings for a hand far from the object: it approaches from its own side, and leans the stylus
/// as far as its workspace allows.
SimulatedSettings as_far_hand(SimulatedSettings own, const protocols::Protocol& protocol) {
  const WorkspaceMap map = workspace_of(protocol);
  if (!is_far(map)) return own;
  const double length = grip_from_virtual_tip(protocol);
  const double radius =
      own.device.workspace_radius * map.scale * (map.reach->in_world ? map.reach->factor : 1);
  const double room =
      radius - own.motor.approach_distance - std::abs(glm::length(hand_place(map)) - length);
  constexpr double kLeast = 0.1;  // rad; the device itself stops at the end of its workspace
  const double lean = 2 * std::asin(std::clamp(room / (2 * length), 0.0, 1.0));
  own.motor.approach_min_rise =
      std::max(own.motor.approach_min_rise, std::cos(std::max(lean, kLeast)));
  own.stylus.tilt = own.stylus.tilt_sd = 0;
  return own;
}

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

SimulatedParticipant::SimulatedParticipant(const SimulatedSettings& own,
                                           const ShapeHypotheses& hypotheses,
                                           devices::SimulatedStylus& stylus,
                                           const protocols::Protocol& protocol, std::uint64_t seed,
                                           int number)
    : settings_(own),
      stylus_(stylus),
      protocol_(protocol),
      wall_stiffness_(protocol.material.stiffness),
      period_(1 / protocol.servo_rate),
      low_pass_(1 - std::exp(-period_ / own.percept.force_low_pass)),
      surely_unfelt2_((1 - 1e-12) * own.percept.force_threshold * own.percept.force_threshold),
      seed_(seed),
      number_(number),
      workspace_(workspace_of(protocol)),
      far_(is_far(workspace_)),
      hand_side_(far_ ? turn_up_to(hand_place(workspace_)) : Quat(1, 0, 0, 0)),
      explorer_(as_far_hand(own, protocol), grip_from_virtual_tip(protocol), wall_stiffness_,
                period_),
      observer_(hypotheses, own.observer),
      heading_choice_(hypotheses, own.observer, own.heading) {}

void SimulatedParticipant::begin_trial(const protocols::Trial& trial) {
  const auto stream = [&](std::uint64_t use) {
    return Random(seed_,
                  {static_cast<std::uint64_t>(number_), static_cast<std::uint64_t>(trial.session),
                   static_cast<std::uint64_t>(trial.trial), use});
  };
  trial_ = trial;
  ticks_before_ = 0;
  random_ = stream(1);
  devices::HandTarget start = explorer_.begin(stream(2));
  put_in_device(start);
  stylus_.reset(start);
  heading_random_ = stream(3);  // separate from hand and percepts
  observer_.reset();
  ray_ = renderer_for(trial.renderer).side_contact();
  for (int k = 0; k < 3; ++k) centre_error_[k] = settings_.percept.centre_jitter * random_.normal();
  force_ = torque_ = Vec3(0);
  next_percept_ = 1 / settings_.observer.percept_rate;
  answer_at_.reset();
  touched_ = false;
}

std::optional<Answer> SimulatedParticipant::step(const servo::Sample& sample) {
  percept_.reset();
  if (sample.phase != servo::Phase::feeling) {
    wait_for_time_zero(sample);
    return std::nullopt;  // rests in the home zone
  }
  const double time = sample.tick * period_;
  const SensedStylus stylus(sample.probe);
  const TouchState touch = sense_touch(sample, stylus);
  move_hand(touch, sample.probe.tip, stylus.axis);
  if (answer_at_) {
    if (time < *answer_at_) return std::nullopt;
    return Answer{observer_.best(), sample.time_ns};
  }
  if (time >= next_percept_) {
    next_percept_ += 1 / settings_.observer.percept_rate;
    percept_ = perceive(sample, stylus, touch);
    observer_.update(*percept_);
    if (observer_.decided()) answer_at_ = time + settings_.non_decision;
  }
  if (explorer_.wants_heading()) choose_heading(sample, touch);
  return std::nullopt;
}

// The hand rests at the start of the first approach: if that is not in the home zone, it will never
// be.
void SimulatedParticipant::wait_for_time_zero(const servo::Sample& sample) {
  const double waited = static_cast<double>(++ticks_before_) * period_;
  if (waited < kLongestWait + protocol_.home.rest) return;
  char text[600];
  std::snprintf(
      text, sizeof text,
      "participant %d, session %d, trial %d (%s, %s): time zero has not come within %.0f s of "
      "simulated time, because the stylus %s. It begins %.3g m from the centre "
      "(/motor/approach_distance_m), tilted by %.0f degrees, sd %.0f (/stylus/tilt_deg, "
      "/stylus/tilt_sd_deg), in a direction that rises by at least %.2g "
      "(/motor/approach_min_rise): "
      "with other settings, a smaller /home/margin_m or smaller stimuli in the protocol it begins "
      "in the home zone",
      number_, trial_.session, trial_.trial, protocols::to_string(trial_.renderer),
      protocol_.stimuli[static_cast<std::size_t>(trial_.stimulus)].name.c_str(), waited,
      sample.waiting == servo::Waiting::for_rest ? "does not come to rest"
                                                 : "is not in the home zone",
      settings_.motor.approach_distance, settings_.stylus.tilt * 180 / std::numbers::pi,
      settings_.stylus.tilt_sd * 180 / std::numbers::pi, settings_.motor.approach_min_rise);
  throw StuckParticipant(text);
}

/// Rotates a vector of the world into the explorer's frame.
Vec3 SimulatedParticipant::explored(const Vec3& world) const {
  return far_ ? glm::conjugate(hand_side_) * world : world;
}

Vec3 SimulatedParticipant::explored_in_world(const Vec3& explored) const {
  return far_ ? hand_side_ * explored : explored;
}

void SimulatedParticipant::move_hand(const TouchState& touch, const Vec3& tip, const Vec3& axis) {
  devices::HandTarget target;
  if (far_) {
    const TouchState known{touch.contact, explored(touch.normal), explored(touch.surface),
                           touch.along};
    target = explorer_.step(known, explored(tip), explored(axis));
  } else {
    target = explorer_.step(touch, tip, axis);
  }
  put_in_device(target);
  stylus_.set_target(target);
}

void SimulatedParticipant::put_in_device(devices::HandTarget& target) const {
  if (far_) {
    target.grip = explored_in_world(target.grip);
    target.velocity = explored_in_world(target.velocity);
    target.axis = explored_in_world(target.axis);
  }
  if (workspace_.reach && workspace_.reach->in_world)
    target.grip = unstretched(*workspace_.reach, {target.grip, target.grip}).tip;
  target.grip = workspace_.to_device(target.grip);
  target.velocity /= workspace_.shift_gain();
}

SimulatedParticipant::SensedStylus::SensedStylus(const rendering::LineProbe& probe)
    : span(probe.tail - probe.tip), length(glm::length(span)), axis(span / length) {}

TouchState SimulatedParticipant::sense_touch(const servo::Sample& sample,
                                             const SensedStylus& stylus) {
  // A person who holds a stylus knows its lever, and infers the forces at its ends from the hand.
  const rendering::EndForces ends{sample.device1, sample.device2};
  const rendering::EndForces forces =
      workspace_.reach ? rendering::on_virtual(*workspace_.reach, ends) : ends;
  force_ += low_pass_ * (forces.tip + forces.tail - force_);
  torque_ += low_pass_ * (glm::cross(stylus.span, forces.tail) - torque_);
  TouchState touch;
  const double strength2 = glm::dot(force_, force_);
  if (strength2 < surely_unfelt2_) return touch;  // most ticks without contact need no root
  const double strength = std::sqrt(strength2);
  touch.contact = strength > settings_.percept.force_threshold;
  if (!touch.contact) return touch;
  touch.normal = force_ / strength;
  const Vec3 lever = glm::cross(stylus.axis, force_);
  const double lever2 = glm::dot(lever, lever);
  along_known_ = ray_ && lever2 > 0.01 * strength * strength;
  if (along_known_) touch.along = std::clamp(glm::dot(lever, torque_) / lever2, 0.0, stylus.length);
  touch.surface = sample.probe.tip + touch.along * stylus.axis + force_ / wall_stiffness_;
  return touch;
}

/// Shift from the displayed stylus to the one with its contact on the surface, m.
Vec3 SimulatedParticipant::perceived_shift() const {
  return settings_.percept.place == PerceivedPlace::surface ? force_ / wall_stiffness_ : Vec3(0);
}

void SimulatedParticipant::choose_heading(const servo::Sample& sample, const TouchState& touch) {
  const Vec3 shift = (touch.contact ? perceived_shift() : Vec3(0)) - centre_error_;
  const SlidingStylus stylus{ray_, sample.probe.tip + shift, sample.probe.tail + shift,
                             explored_in_world(explorer_.known_normal()),
                             explored_in_world(explorer_.heading())};
  explorer_.turn_to(explored(heading_choice_.choose(observer_, stylus, heading_random_)));
}

Percept SimulatedParticipant::perceive(const servo::Sample& sample, const SensedStylus& stylus,
                                       const TouchState& touch) {
  const auto noise = [this](double sd) {
    return sd * Vec3(random_.normal(), random_.normal(), random_.normal());
  };
  const auto tilted = [&noise](const Vec3& direction, double sd) {
    const Vec3 e = noise(sd);  // only the part at right angles to the direction matters
    return glm::normalize(direction + e - glm::dot(e, direction) * direction);
  };
  Percept percept;
  percept.contact = touch.contact;
  percept.ray = ray_;
  percept.tip = sample.probe.tip - centre_error_ + noise(settings_.observer.contact_sd);
  if (touch.contact) percept.tip += perceived_shift();
  percept.tail = percept.tip + stylus.length * tilted(stylus.axis, settings_.percept.axis_sd);
  if (touch.contact) {
    percept.direction = tilted(touch.normal, settings_.observer.direction_sd);
    if (touched_) {
      percept.moved = glm::length(sample.probe.tip - touched_tip_);
      percept.turned = std::acos(std::clamp(glm::dot(touch.normal, touched_normal_), -1.0, 1.0));
    }
    touched_ = true;
    touched_tip_ = sample.probe.tip;
    touched_normal_ = touch.normal;
    if (along_known_) {
      percept.along = std::clamp(touch.along + settings_.observer.along_sd * random_.normal(), 0.0,
                                 stylus.length);
    }
  }
  return percept;
}

}  // namespace palpate::runner::participants
