#include "runner/participants/heading_choice.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "runner/participants/deepest_point.h"
#include "runner/participants/lane_math.h"
#include "runner/participants/shape_lines.h"

// The loops over the drawn hypotheses are written to be vectorised, as in shape_observer.cpp.

namespace palpate::runner::participants {
namespace {

void check(const HeadingSettings& s) {
  std::string faults;
  const auto want = [&faults](bool good, const char* fault) {
    if (!good) faults += std::string("\n  ") + fault;
  };
  const auto positive = [](double x) { return std::isfinite(x) && x > 0; };
  want(positive(s.interval), "interval: positive");
  want(positive(s.turning_time), "turning_time: positive");
  want(s.hypotheses >= 2 && s.hypotheses <= ShapeHypotheses::kBlock, "hypotheses: 2 to 32");
  want(s.headings >= 2 && s.headings <= 64, "headings: 2 to 64");
  want(s.places >= 1 && s.places <= 8, "places: 1 to 8");
  want(positive(s.look_ahead), "look_ahead: positive");
  if (!faults.empty()) throw std::invalid_argument("settings of the choice of headings:" + faults);
}

}  // namespace

HeadingChoice::HeadingChoice(const ShapeHypotheses& all, const ObserverSettings& observer,
                             const HeadingSettings& settings)
    : all_(&all),
      observer_(observer),
      settings_(settings),
      few_(ShapeHypotheses::one_block_each(all)),
      first_(all.shapes().size()),
      count_(all.shapes().size()) {
  check(settings);
  const auto square = [](double x) { return x * x; };
  precisions_ = {
      static_cast<float>(0.5 / (square(observer.contact_sd) + square(observer.model_contact_sd))),
      static_cast<float>(1 / (square(observer.direction_sd) + square(observer.model_direction_sd))),
      static_cast<float>(0.5 / square(observer.along_sd)),
      static_cast<float>(std::log(observer.torque_floor)), static_cast<float>(observer.floor)};
  drawn_.resize(static_cast<std::size_t>(settings.hypotheses));
  seen_.resize(static_cast<std::size_t>(settings.places));
}

Vec3 HeadingChoice::choose(ShapeObserver& posterior, const SlidingStylus& stylus, Random& random) {
  if (!draw(posterior, random)) return stylus.heading;
  const Vec3 side = glm::cross(stylus.normal, stylus.heading);
  Vec3 best = stylus.heading;
  double least = 0;
  for (int turn = 0; turn < settings_.headings; ++turn) {
    // Try 0, 1, -1, 2, -2, ...: of equal headings the first is kept.
    const int steps = (turn + 1) / 2 * (turn % 2 == 1 ? 1 : -1);
    const double angle = 2 * std::numbers::pi * steps / settings_.headings;
    const Vec3 heading = std::cos(angle) * stylus.heading + std::sin(angle) * side;
    const double expected = expected_entropy(stylus, heading);
    if (turn > 0 && expected >= least) continue;
    least = expected;
    best = heading;
  }
  return best;
}

/// Fills drawn_ and few_. \return whether they have more than one shape
bool HeadingChoice::draw(ShapeObserver& posterior, Random& random) {
  posterior.draw(random, drawn_);
  std::size_t next = 0;
  int shapes = 0;
  for (std::size_t s = 0; s < few_.shapes().size(); ++s) {
    const ShapeHypotheses::Shape& in_all = all_->shapes()[s];
    first_[s] = static_cast<int>(next);
    int slot = few_.shapes()[s].first;
    while (next < drawn_.size() && drawn_[next] < in_all.first + in_all.count) {
      few_.copy_rotation(slot++, *all_, drawn_[next++]);
    }
    count_[s] = static_cast<int>(next) - first_[s];
    shapes += count_[s] > 0 ? 1 : 0;
  }
  return shapes > 1;
}

double HeadingChoice::expected_entropy(const SlidingStylus& stylus, const Vec3& heading) {
  for (int place = 0; place < settings_.places; ++place) {
    const double ahead = settings_.look_ahead * (place + 1) / settings_.places;
    predict(stylus, ahead * heading, seen_[static_cast<std::size_t>(place)]);
  }
  double sum = 0;
  for (int i = 0; i < settings_.hypotheses; ++i) {
    float log_likelihood[kRoom] = {};
    FloatVec normal = to_float(stylus.normal);
    for (const Prediction& seen : seen_) {
      add_log_likelihood(i, seen, normal, stylus.ray, log_likelihood);
      normal = {seen.x[i], seen.y[i], seen.z[i]};
    }
    sum += entropy(log_likelihood);
  }
  return sum / settings_.hypotheses;
}

void HeadingChoice::predict(const SlidingStylus& stylus, const Vec3& shift, Prediction& out) const {
  const Vec3 span = stylus.tail - stylus.tip;
  const double length = glm::length(span);
  Line line{to_float(stylus.tip + shift), {0, 0, 0}, 0, {0, 0, 0}};
  if (stylus.ray && length > 0) {
    line.along = to_float(span / length);
    line.length = static_cast<float>(length);
  }
  for (std::size_t s = 0; s < few_.shapes().size(); ++s) {
    if (count_[s] == 0) continue;
    const ShapeHypotheses::Shape& shape = few_.shapes()[s];
    visit_line_class(shape, [&]<class ShapeLine>(std::type_identity<ShapeLine>) {
      const ShapeLine to_shape(few_, shape, shape.first, line);
      Deepest deepest;
      if (line.length > 0) {
        find_along_line(to_shape, line.length, deepest, count_[s]);
      } else {
        find_at_tip(to_shape, deepest, count_[s]);
      }
      for (int i = 0; i < count_[s]; ++i) {
        const FloatVec n = to_shape.world(i, {deepest.x[i], deepest.y[i], deepest.z[i]});
        const int k = first_[s] + i;
        out.distance[k] = deepest.distance[i];
        out.along[k] = deepest.along[i];
        out.x[k] = n.x;
        out.y[k] = n.y;
        out.z[k] = n.z;
      }
    });
  }
}

/// Adds, for every drawn hypothesis, the log likelihood of the contact that drawn hypothesis i
/// predicts at one place.
void HeadingChoice::add_log_likelihood(int i, const Prediction& seen, const FloatVec& normal_before,
                                       bool ray, float* log_likelihood) const {
  const FloatVec n{seen.x[i], seen.y[i], seen.z[i]};
  const double turned = std::acos(lane::clamp(dot(n, normal_before), -1.0f, 1.0f));
  const double moved = settings_.look_ahead / settings_.places;
  const auto weight = static_cast<float>(contact_weight(observer_, moved, turned));
  const Precisions k = precisions_;
  const float along_precision = ray ? k.along : 0.0f;
  const float distance = seen.distance[i];
  const float along = seen.along[i];
  for (int j = 0; j < kRoom; ++j) {
    const float off = seen.distance[j] - distance;
    const float shifted = seen.along[j] - along;
    const float cosine = n.x * seen.x[j] + n.y * seen.y[j] + n.z * seen.z[j];
    const float l = k.direction * (cosine - 1.0f) - off * off * k.distance +
                    lane::max(-shifted * shifted * along_precision, k.least_along);
    log_likelihood[j] += weight * lane::max(l, k.floor);
  }
}

/// Entropy of the shapes, nat, if the drawn hypotheses were equally likely before.
float HeadingChoice::entropy(const float* log_likelihood) const {
  float masses[kRoom];
  for (int j = 0; j < kRoom; ++j) masses[j] = lane::exp(log_likelihood[j]);
  float total = 0;
  float sum = 0;  // of m ln m
  for (std::size_t s = 0; s < first_.size(); ++s) {
    float mass = 0;
    for (int j = first_[s]; j < first_[s] + count_[s]; ++j) mass += masses[j];
    total += mass;
    if (mass > 0) sum += mass * lane::log(mass);
  }
  return lane::log(total) - sum / total;
}

}  // namespace palpate::runner::participants
