#include "runner/session/live_forces.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "runner/session/session_end.h"
#include "runner/session/station.h"

namespace palpate::runner::session {

void ContactLog::begin(const SharpEdges& edges, const Quat& orientation) {
  *this = {};
  edges_ = &edges;
  to_object_ = glm::conjugate(orientation);
}

void ContactLog::add(const servo::Sample& sample) noexcept {
  ++ticks_;
  if (sample.rendering.contacts == 0) return;
  ++contact_ticks_;
  if (!edges_->too_many() && on_edge(sample.rendering.deepest.point)) ++edge_ticks_;
}

/// The distance to the edges changes by at most the way of the point, so most ticks need no new
/// one.
bool ContactLog::on_edge(const Vec3& point) noexcept {
  const Vec3 moved = point - known_;
  if (margin_ >= 0 && glm::dot(moved, moved) < margin_ * margin_) return known_on_edge_;
  const double distance = edges_->distance(to_object_ * point);
  constexpr double kRoundings = 1e-9;  // m
  known_ = point;
  margin_ = std::fmax(std::fabs(distance - kReach) - kRoundings, 0);
  known_on_edge_ = distance <= kReach;
  return known_on_edge_;
}

double ContactLog::contact_share() const {
  return ticks_ > 0 ? static_cast<double>(contact_ticks_) / static_cast<double>(ticks_) : 0;
}

std::optional<double> ContactLog::edge_dwell(double period) const {
  if (edges_->too_many()) return std::nullopt;
  return static_cast<double>(edge_ticks_) * period;
}

namespace {

constexpr double kReadingPatience = 0.5;  // s, for a reading; a servo gives several in that time
constexpr double kPlugging = 2;           // s; a bus reports a new device with some delay

bool is_well(const servo::Sample& sample) {
  return (sample.faults & servo::servo_fault::kDeviceLost) == 0;
}

/// Whether the sample shows a lasting state, not a transient one.
bool is_settled(const servo::Sample& sample) {
  return is_well(sample) || (sample.trouble != servo::DeviceTrouble::guarded &&
                             sample.trouble != servo::DeviceTrouble::guard_late &&
                             sample.trouble != servo::DeviceTrouble::reopening);
}

}  // namespace

void LiveForces::off() noexcept {
  times_off_.fetch_add(1);  // first: allow() must not overlook it
  if (guard_ != nullptr) guard_->emergency_zero();
  servo_.emergency_zero();
}

const servo::Sample& LiveForces::newest() noexcept {
  servo_.latest(sample_);
  return sample_;
}

bool LiveForces::device_is_gone() noexcept {
  return !is_well(newest()) && is_settled(sample_) &&
         sample_.trouble != servo::DeviceTrouble::guard_lost;
}

void LiveForces::end_without_guard() const {
  if (sample_.trouble == servo::DeviceTrouble::guard_lost)
    throw EndOfSession(data::RunEnd::aborted, servo::advice(servo::DeviceTrouble::guard_lost),
                       true);
}

/// Whether a later sample satisfies the wish. The newest sample stays.
template <class Wished>
bool LiveForces::await(Wished wished, double seconds, const std::function<bool()>& stop) {
  const std::int64_t began_ns = clock_.now_ns();
  const std::int64_t end_ns = began_ns + static_cast<std::int64_t>(seconds * 1e9);
  while (!stop()) {
    const servo::Sample& sample = newest();
    if (sample.time_ns > began_ns && wished(sample)) return true;
    if (clock_.now_ns() >= end_ns) return false;
    clock_.wait_until(clock_.now_ns() + kSessionNap_ns);
  }
  return false;
}

std::string LiveForces::open_again(const std::function<bool()>& stop) {
  const std::int64_t end_ns = clock_.now_ns() + static_cast<std::int64_t>(kPlugging * 1e9);
  while (true) {
    guard_->ask_to_reopen();
    while (guard_->reopening() && newest().trouble != servo::DeviceTrouble::guard_lost && !stop())
      clock_.wait_until(clock_.now_ns() + kSessionNap_ns);
    if (guard_->reopening()) return servo::advice(sample_.trouble);
    std::string trouble = guard_->reopen_trouble();
    if (trouble.empty() || clock_.now_ns() >= end_ns || stop()) return trouble;
    clock_.wait_until(clock_.now_ns() + 20 * kSessionNap_ns);
  }
}

std::string LiveForces::allow(const std::function<bool()>& stop,
                              std::optional<std::uint32_t> known) {
  constexpr const char* kLater = "zero force was asked for after that";
  const std::uint32_t times = known.value_or(times_off());
  if (times_off() != times) return kLater;
  std::string trouble = allow_now(stop);
  if (times_off() == times) return trouble;
  off();  // in case the request came just before it was cleared
  return kLater;
}

std::string LiveForces::allow_now(const std::function<bool()>& stop) {
  const std::int64_t asked_ns = clock_.now_ns();
  // A request for zero force from now on is kept, however long this takes.
  servo_.clear_fault();
  await(is_settled, kReadingPatience, stop);
  if (guard_ != nullptr && servo::needs_reopening(sample_.trouble)) {
    std::string trouble = open_again(stop);
    if (!trouble.empty()) return trouble;
    await(is_well, kReadingPatience, stop);
  }
  if (sample_.time_ns <= asked_ns)
    return "the servo gives no more samples: start the program again";
  if (!is_well(sample_)) return servo::advice(sample_.trouble);
  servo_.clear_trip();
  const auto is_on = [](const servo::Sample& sample) {
    return (sample.faults & servo::servo_fault::kTripped) == 0;
  };
  if (await(is_on, kReadingPatience, stop)) return "";
  return trip_reason(sample_.faults, sample_.trouble);
}

}  // namespace palpate::runner::session
