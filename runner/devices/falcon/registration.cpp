#include "runner/devices/falcon/registration.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>
#include <sstream>
#include <vector>

namespace palpate::runner::falcon {
namespace {

constexpr std::int64_t kTickNs = 1'000'000;
constexpr double kStillness = 0.001;     // m
constexpr double kApart = 0.015;         // m, from every earlier point
constexpr double kMostResidual = 0.003;  // m; more: a point was wrong

class Procedure {
 public:
  Procedure(Device& tip, Device& tail, Clock& clock, Guide& guide)
      : tip_(tip), tail_(tail), clock_(clock), guide_(guide), due_ns_(clock.now_ns()) {}

  /// Asks until a valid point was taken.
  PairedPoint take(const std::string& question, const std::vector<PairedPoint>& earlier,
                   const RegistrationSettings& settings) {
    for (;;) {
      guide_.ask(question);
      while (!answered()) tick();
      const auto point = rest(settings.still);
      if (!point) {
        guide_.say("  it moved; once more");
        continue;
      }
      const bool apart = std::all_of(earlier.begin(), earlier.end(), [&](const PairedPoint& old) {
        return glm::length(old.tip_frame - settings.offset - point->tip_frame) >= kApart;
      });
      if (apart) return {point->tip_frame + settings.offset, point->tail_frame};
      guide_.say("  that is too near to an earlier point; move farther away");
    }
  }

 private:
  PairedPoint tick() {
    // Missed ticks are not made up for.
    due_ns_ = std::max(due_ns_ + kTickNs, clock_.now_ns());
    clock_.wait_until(due_ns_);
    return {free_position(tip_), free_position(tail_)};
  }

  static Vec3 free_position(Device& device) {
    const DeviceReading reading = device.read();
    device.write(Vec3(0), Vec3(0));
    // The guard has commanded zero force: harmless, as no force is used here.
    if (reading.lost && reading.trouble != DeviceTrouble::guarded) {
      throw GuideError(device.capabilities().serial + ": " + advice(reading.trouble));
    }
    return reading.stylus.tip;
  }

  /// The mean position during a rest; nullopt where either grip moved.
  std::optional<PairedPoint> rest(double seconds) {
    const PairedPoint first = tick();
    PairedPoint mean;
    const long ticks = std::lround(seconds * 1e9 / static_cast<double>(kTickNs));
    for (long i = 0; i < ticks; ++i) {
      const PairedPoint now = tick();
      if (glm::length(now.tip_frame - first.tip_frame) > kStillness ||
          glm::length(now.tail_frame - first.tail_frame) > kStillness) {
        return std::nullopt;
      }
      mean.tip_frame += now.tip_frame / static_cast<double>(ticks);
      mean.tail_frame += now.tail_frame / static_cast<double>(ticks);
    }
    return mean;
  }

  bool answered() {
    const Guide::Answer answer = guide_.answer();
    if (answer == Guide::Answer::stop) throw GuideError("stopped; nothing was stored");
    return answer == Guide::Answer::go_on;
  }

  Device &tip_, &tail_;
  Clock& clock_;
  Guide& guide_;
  std::int64_t due_ns_;
};

}  // namespace

PairRegistration register_pair(Device& tip, Device& tail, Clock& clock, Guide& guide,
                               const RegistrationSettings& settings) {
  Procedure procedure(tip, tail, clock, guide);
  guide.say(glm::length(settings.offset) == 0
                ? "Pin the two grips together, centre on centre."
                : "Put the stylus with both grips into its jig; its direction must not change.");
  std::vector<PairedPoint> points;
  points.reserve(static_cast<std::size_t>(settings.points));
  for (int i = 1; i <= settings.points; ++i) {
    std::ostringstream question;
    question
        << "Point " << i << " of " << settings.points
        << ": move both to a new position (right, left, near, far, up, down), hold them still, "
           "and press ENTER.";
    points.push_back(procedure.take(question.str(), points, settings));
  }
  const RigidFit fit = fit_rigid(points);
  if (fit.residual > kMostResidual) {
    std::ostringstream text;
    text << "the points fit only within " << std::round(fit.residual * 1e4) / 10 << " mm ("
         << kMostResidual * 1e3 << " mm are allowed; the worst is "
         << std::round(fit.worst * 1e4) / 10
         << " mm off): are the grips firmly together, and both devices homed?";
    throw GuideError(text.str());
  }
  PairRegistration pair;
  pair.tip_serial = tip.capabilities().serial;
  pair.tail_serial = tail.capabilities().serial;
  pair.tail_in_tip = fit.tail_in_tip;
  pair.stylus_length = settings.stylus_length;
  pair.residual = fit.residual;
  pair.points = settings.points;
  return pair;
}

}  // namespace palpate::runner::falcon
