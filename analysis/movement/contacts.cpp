#include "analysis/movement/contacts.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace palpate::analysis {
namespace {

double seconds(std::size_t ticks, double rate) { return static_cast<double>(ticks) / rate; }
std::size_t ticks_of(double seconds, double rate) {
  return std::max<std::size_t>(1, static_cast<std::size_t>(std::llround(seconds * rate)));
}
// A duration of just the limit, in spite of rounding.
constexpr double kRounding = 1e-9;

}  // namespace

std::vector<Stretch> contact_episodes(const std::vector<bool>& contact, double rate) {
  constexpr double kGap = 0.05, kShortest = 0.02;
  std::vector<Stretch> joined;
  for (const Stretch& one : stretches(contact)) {
    if (!joined.empty() && seconds(one.begin - joined.back().end, rate) < kGap - kRounding)
      joined.back().end = one.end;
    else
      joined.push_back(one);
  }
  std::erase_if(joined, [rate](const Stretch& one) {
    return seconds(one.size(), rate) < kShortest - kRounding;
  });
  return joined;
}

std::vector<Stretch> stops(const std::vector<bool>& contact, const std::vector<double>& speed,
                           double rate) {
  constexpr double kSlow = 0.005, kShortest = 0.05;
  std::vector<bool> slow(contact.size());
  for (std::size_t i = 0; i < slow.size(); ++i) slow[i] = contact[i] && speed[i] < kSlow;
  std::vector<Stretch> found = stretches(slow);
  std::erase_if(found, [rate](const Stretch& one) {
    return seconds(one.size(), rate) < kShortest - kRounding;
  });
  return found;
}

std::size_t strokes(const std::vector<bool>& contact, const std::vector<Stretch>& stops,
                    const std::vector<Vec3>& path, double rate) {
  constexpr double kWay = 0.05;
  const std::size_t way = ticks_of(kWay, rate);
  std::vector<bool> moving = contact;
  for (const Stretch& stop : stops) {
    for (std::size_t i = stop.begin; i < stop.end; ++i) moving[i] = false;
  }
  std::size_t count = 0;
  for (const Stretch& one : stretches(moving)) {
    if (one.size() < way) continue;
    ++count;
    bool turning = false;
    for (std::size_t i = one.begin + way; i + way < one.end; ++i) {
      const bool turns = glm::dot(path[i] - path[i - way], path[i + way] - path[i]) < 0;
      count += turns && !turning;
      turning = turns;
    }
  }
  return count;
}

Procedure procedure_of(const std::vector<ContactMotion>& window) {
  constexpr double kFast = 0.01, kPressing = 0.3;
  double speed = 0, force = 0;
  double least = window.front().normal_force, greatest = least;
  std::size_t on_edge = 0;
  for (const ContactMotion& tick : window) {
    speed += tick.tangential_speed;
    force += tick.normal_force;
    least = std::min(least, tick.normal_force);
    greatest = std::max(greatest, tick.normal_force);
    on_edge += tick.on_edge;
  }
  const double n = static_cast<double>(window.size());
  if (speed / n >= kFast)
    return 2 * on_edge >= window.size() ? Procedure::contour : Procedure::lateral;
  return greatest - least > kPressing * (force / n) ? Procedure::pressure : Procedure::stationary;
}

std::vector<Procedure> procedures(const std::vector<bool>& contact,
                                  const std::vector<ContactMotion>& motion, double rate) {
  constexpr double kWindow = 0.1;
  const std::size_t window = ticks_of(kWindow, rate);
  std::vector<Procedure> found;
  for (const Stretch& one : stretches(contact)) {
    for (std::size_t i = one.begin; i + window <= one.end; i += window) {
      const auto first = motion.begin() + static_cast<std::ptrdiff_t>(i);
      found.push_back(procedure_of({first, first + static_cast<std::ptrdiff_t>(window)}));
    }
  }
  return found;
}

}  // namespace palpate::analysis
