#include "runner/participants/shape_observer.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "runner/participants/lane_math.h"
#include "runner/participants/shape_lines.h"

// The loops over the hypotheses of a block are written for the compiler to vectorise; the build
// gives this file -fno-math-errno and -fno-trapping-math, which change no value.

namespace palpate::runner::participants {
namespace {

constexpr int kBlock = ShapeHypotheses::kBlock;
constexpr int kMaxPositions = 64;

/// A percept and the settings, prepared for the loops.
struct Query {
  Line line;
  bool contact = false;
  bool ray = false;

  float half_precision = 0;       // 1 / (2 v), 1/m^2
  float direction_precision = 0;  // 1/rad^2
  float inverse_sd = 0;           // 1 / sqrt v, 1/m
  float free_space_weight = 0;
  /// For percepts without contact, m: a shape with a smaller bounding sphere is so far from the
  /// stylus that contact is impossible in every orientation. Negative: there is no such radius.
  float surely_free = -1;

  float kept = 0;       // share kept of the earlier evidence
  float forgotten = 0;  // the rest
  float weight = 0;     // weight of this percept

  int positions = 0;              // 0: no torque cue
  float position[kMaxPositions];  // m from the tip
  float fit[kMaxPositions];       // likelihood of `along` at that position
  float inverse_scale = 0;        // of the soft minimum, 1/m
  float torque_floor = 0;
  float torque_needed = 0;  // a log likelihood below it stays below the floor
};

template <class ShapeLine>
void add_torque_cue(const ShapeLine& shape, const Query& query, const Deepest& deepest,
                    float* log_likelihood) {
  float weights[kBlock] = {};
  float fits[kBlock] = {};
  for (int k = 0; k < query.positions; ++k) {
    const float position = query.position[k];
    const float fit = query.fit[k];
    for (int i = 0; i < kBlock; ++i) {
      const float height = shape.distance(i, position) - deepest.distance[i];
      const float weight = lane::exp(-height * query.inverse_scale);
      weights[i] += weight;
      fits[i] += weight * fit;
    }
  }
  for (int i = 0; i < kBlock; ++i) {
    log_likelihood[i] += lane::log(fits[i] / weights[i] + query.torque_floor);
  }
}

/// The same, but only for hypotheses that the torque can leave above the floor, because each
/// distance is a costly look into a grid.
void add_torque_cue(const SolidLine& shape, const Query& query, const Deepest& deepest,
                    float* log_likelihood) {
  ChosenLines lines(shape);
  lines.keep_if([&](int i) { return log_likelihood[i] > query.torque_needed; }, [](int, int) {});
  float least[kBlock] = {};
  for (int i = 0; i < lines.count(); ++i) least[i] = deepest.distance[lines.which(i)];
  float weights[kBlock] = {};
  float fits[kBlock] = {};
  for (int k = 0; k < query.positions; ++k) {
    float position[kBlock], distance[kBlock] = {};
    std::fill_n(position, kBlock, query.position[k]);
    lines.distances(position, distance);
    for (int i = 0; i < kBlock; ++i) {
      const float weight = lane::exp(-(distance[i] - least[i]) * query.inverse_scale);
      weights[i] += weight;
      fits[i] += weight * query.fit[k];
    }
  }
  for (int i = 0; i < lines.count(); ++i)
    log_likelihood[lines.which(i)] += lane::log(fits[i] / weights[i] + query.torque_floor);
}

/// Whether a hypothesis of the block is above the floor if the torque fits perfectly. If not, all
/// of them are at the floor, whatever the torque.
bool torque_matters(const Query& query, const float* log_likelihood) {
  float most[8];
  for (int i = 0; i < 8; ++i) most[i] = log_likelihood[i];
  for (int first = 8; first < kBlock; first += 8) {
    for (int i = 0; i < 8; ++i) most[i] = lane::max(most[i], log_likelihood[first + i]);
  }
  return *std::max_element(most, most + 8) > query.torque_needed;
}

template <class ShapeLine>
void find_log_likelihood(const ShapeLine& shape, const Query& query, float* log_likelihood) {
  Deepest deepest;
  if (query.ray) {
    find_along_line(shape, query.line.length, deepest);
  } else {
    find_at_tip(shape, deepest);
  }
  if (query.contact) {
    for (int i = 0; i < kBlock; ++i) {
      const float d = deepest.distance[i];
      log_likelihood[i] =
          query.direction_precision * (deepest.cosine[i] - 1.0f) - d * d * query.half_precision;
    }
    if (query.positions > 0 && torque_matters(query, log_likelihood))
      add_torque_cue(shape, query, deepest, log_likelihood);
  } else {
    for (int i = 0; i < kBlock; ++i) {
      log_likelihood[i] =
          query.free_space_weight * lane::log_normal_cdf(deepest.distance[i] * query.inverse_sd);
    }
  }
}

double weight_of(const Percept& percept, const ObserverSettings& settings) {
  if (percept.contact) return contact_weight(settings, percept.moved, percept.turned);
  return settings.evidence == Evidence::percept ? settings.beta : 1;
}

Query make_query(const Percept& percept, const ObserverSettings& settings) {
  Query query;
  query.contact = percept.contact;
  query.ray = percept.ray;
  query.line = {to_float(percept.tip), {0, 0, 0}, 0, to_float(percept.direction)};
  const Vec3 span = percept.tail - percept.tip;
  const double length = percept.ray ? glm::length(span) : 0;
  if (length > 0) {
    query.line.along = to_float(span / length);
    query.line.length = static_cast<float>(length);
  }

  const double variance = settings.contact_sd * settings.contact_sd +
                          settings.model_contact_sd * settings.model_contact_sd;
  const double direction_variance = settings.direction_sd * settings.direction_sd +
                                    settings.model_direction_sd * settings.model_direction_sd;
  query.half_precision = static_cast<float>(0.5 / variance);
  query.inverse_sd = static_cast<float>(1 / std::sqrt(variance));
  query.direction_precision = static_cast<float>(1 / direction_variance);
  query.free_space_weight = static_cast<float>(settings.free_space_weight);
  query.inverse_scale = static_cast<float>(1 / settings.soft_min_scale);
  query.torque_floor = static_cast<float>(settings.torque_floor);

  if (!percept.contact) {
    constexpr double kErrors = 0.001;  // m; errors of the search along the line, and of rounding
    const double along = length > 0 ? glm::dot(-percept.tip, span) / (length * length) : 0;
    const double away = glm::length(percept.tip + std::clamp(along, 0.0, 1.0) * span);
    query.surely_free =
        static_cast<float>(away - lane::kLogNormalCdfIsZero * std::sqrt(variance) - kErrors);
  }

  const double kept =
      settings.forgetting ? std::exp(-1 / (settings.percept_rate * settings.memory)) : 1;
  query.kept = static_cast<float>(kept);
  query.forgotten = static_cast<float>(1 - kept);
  query.weight = static_cast<float>(weight_of(percept, settings));

  if (percept.contact && percept.ray && percept.along) {
    constexpr double kRoundings = 0.001;
    query.torque_needed =
        static_cast<float>(settings.floor - std::log1p(settings.torque_floor) - kRoundings);
    query.positions = settings.places_along;
    for (int k = 0; k < query.positions; ++k) {
      const double position = length * k / (query.positions - 1);
      const double error = (position - *percept.along) / settings.along_sd;
      query.position[k] = static_cast<float>(position);
      query.fit[k] = lane::exp(static_cast<float>(-0.5 * error * error));
    }
  }
  return query;
}

void check(const ObserverSettings& s) {
  std::string faults;
  const auto want = [&faults](bool good, const char* fault) {
    if (!good) faults += std::string("\n  ") + fault;
  };
  const auto positive = [](double x) { return std::isfinite(x) && x > 0; };
  const auto not_negative = [](double x) { return std::isfinite(x) && x >= 0; };
  want(not_negative(s.contact_sd) && not_negative(s.model_contact_sd) &&
           positive(s.contact_sd + s.model_contact_sd),
       "contact_sd and model_contact_sd: not negative, not both zero");
  want(not_negative(s.direction_sd) && not_negative(s.model_direction_sd) &&
           positive(s.direction_sd + s.model_direction_sd),
       "direction_sd and model_direction_sd: not negative, not both zero");
  want(positive(s.along_sd), "along_sd: positive");
  want(positive(s.soft_min_scale), "soft_min_scale: positive");
  want(s.places_along >= 2 && s.places_along <= kMaxPositions, "places_along: 2 to 64");
  want(s.torque_floor >= 1e-30 && s.torque_floor <= 1, "torque_floor: 1e-30 to 1");
  want(not_negative(s.free_space_weight), "free_space_weight: not negative");
  want(std::isfinite(s.floor) && s.floor <= 0, "floor: not positive");
  want(not_negative(s.beta), "beta: not negative");
  want(positive(s.movement_scale), "movement_scale: positive");
  want(not_negative(s.turn_length), "turn_length: not negative");
  want(positive(s.memory), "memory: positive");
  want(positive(s.percept_rate), "percept_rate: positive");
  want(s.threshold > 0 && s.threshold < 1, "threshold: between 0 and 1");
  if (!faults.empty()) throw std::invalid_argument("settings of the observer:" + faults);
}

float log_prior(const ShapeHypotheses& hypotheses, const ShapeHypotheses::Shape& shape) {
  return static_cast<float>(
      -std::log(static_cast<double>(hypotheses.shapes().size()) * shape.count));
}

/// Radius about the shape's centre, m; infinite if unknown.
float bounding_radius(const ShapeHypotheses::Shape& shape) {
  if (shape.field) return shape.field->reach();
  switch (shape.kind) {
    case stimuli::ShapeKind::sphere:
      return shape.radius;
    case stimuli::ShapeKind::cone:
    case stimuli::ShapeKind::cylinder:
      return std::hypot(shape.radius, shape.half_size);
    case stimuli::ShapeKind::cube:
      return std::sqrt(3.0f) * shape.half_size;
    default:
      return std::numeric_limits<float>::infinity();
  }
}

/// Updates L of all hypotheses of one shape by a percept.
template <class ShapeLine>
void update_shape(const ShapeHypotheses& hypotheses, const ShapeHypotheses::Shape& shape,
                  const Query& query, const ObserverSettings& settings, float* log_posterior) {
  const float regained = query.forgotten * log_prior(hypotheses, shape);
  const auto floor = static_cast<float>(settings.floor);
  if (bounding_radius(shape) < query.surely_free) {
    const int blocks = (shape.count + kBlock - 1) / kBlock;
    for (int h = shape.first; h < shape.first + blocks * kBlock; ++h)
      log_posterior[h] = query.kept * log_posterior[h] + regained;  // likelihood 1
    return;
  }
  const int* const order = hypotheses.nearby_order();
  for (int first = shape.first; first < shape.first + shape.count; first += kBlock) {
    const ShapeLine line(hypotheses, shape, first, query.line);
    float log_likelihood[kBlock];
    find_log_likelihood(line, query, log_likelihood);
    for (int i = 0; i < kBlock; ++i) {
      float& posterior = log_posterior[order[first + i]];
      posterior =
          query.kept * posterior + regained + query.weight * lane::max(log_likelihood[i], floor);
    }
  }
}

}  // namespace

double contact_weight(const ObserverSettings& settings, double moved, double turned) {
  if (settings.evidence == Evidence::percept) return settings.beta;
  return 1 - std::exp(-(moved + settings.turn_length * turned) / settings.movement_scale);
}

ShapeObserver::ShapeObserver(const ShapeHypotheses& hypotheses, const ObserverSettings& settings)
    : hypotheses_(&hypotheses),
      settings_(settings),
      log_posterior_(static_cast<std::size_t>(hypotheses.padded_size())),
      probabilities_(hypotheses.shapes().size()),
      masses_(log_posterior_.size()) {
  check(settings);
  reset();
}

void ShapeObserver::reset() {
  for (const ShapeHypotheses::Shape& shape : hypotheses_->shapes()) {
    const int blocks = (shape.count + kBlock - 1) / kBlock;
    std::fill_n(log_posterior_.begin() + shape.first, blocks * kBlock,
                log_prior(*hypotheses_, shape));
  }
  find_posterior();
}

void ShapeObserver::update(const Percept& percept) {
  const Query query = make_query(percept, settings_);
  for (const ShapeHypotheses::Shape& shape : hypotheses_->shapes()) {
    visit_line_class(shape, [&]<class ShapeLine>(std::type_identity<ShapeLine>) {
      update_shape<ShapeLine>(*hypotheses_, shape, query, settings_, log_posterior_.data());
    });
  }
  find_posterior();
}

void ShapeObserver::find_posterior() {
  // Keep a maximum and a sum for each lane of a block: the compiler may not reorder a single sum.
  const float* const l = log_posterior_.data();
  float most[kBlock];
  std::copy_n(l, kBlock, most);
  for (int first = 0; first < hypotheses_->padded_size(); first += kBlock) {
    for (int i = 0; i < kBlock; ++i) most[i] = lane::max(most[i], l[first + i]);
  }
  const float reference = *std::max_element(most, most + kBlock);

  double total = 0;
  for (std::size_t s = 0; s < probabilities_.size(); ++s) {
    const ShapeHypotheses::Shape& shape = hypotheses_->shapes()[s];
    const int end = shape.first + shape.count;
    float sums[kBlock] = {};
    for (int first = shape.first; first < end; first += kBlock) {
      for (int i = 0; i < kBlock; ++i) {
        const float mass = lane::exp(l[first + i] - reference);
        sums[i] += first + i < end ? mass : 0.0f;
      }
    }
    double sum = 0;
    for (const float part : sums) sum += part;
    probabilities_[s] = sum;
    total += sum;
  }
  for (double& probability : probabilities_) probability /= total;
  best_ = static_cast<int>(std::max_element(probabilities_.begin(), probabilities_.end()) -
                           probabilities_.begin());
}

void ShapeObserver::draw(Random& random, std::span<int> hypotheses) {
  const float reference = *std::max_element(log_posterior_.begin(), log_posterior_.end());
  for (std::size_t h = 0; h < masses_.size(); ++h) {
    masses_[h] = lane::exp(log_posterior_[h] - reference);
  }
  double total = 0;
  for (const ShapeHypotheses::Shape& shape : hypotheses_->shapes()) {
    for (int h = shape.first; h < shape.first + shape.count; ++h) {
      total += masses_[static_cast<std::size_t>(h)];
    }
  }
  const auto count = static_cast<double>(hypotheses.size());
  std::size_t drawn = 0;
  double below = 0;  // mass of the hypotheses up to and including this one
  int last = 0;
  double next = total * random.unit() / count;
  for (const ShapeHypotheses::Shape& shape : hypotheses_->shapes()) {
    for (int h = shape.first; h < shape.first + shape.count; ++h) {
      last = h;
      below += masses_[static_cast<std::size_t>(h)];
      while (drawn < hypotheses.size() && next < below) {
        hypotheses[drawn++] = h;
        next = total * (static_cast<double>(drawn) + random.unit()) / count;
      }
    }
  }
  while (drawn < hypotheses.size()) hypotheses[drawn++] = last;  // if the sum was rounded down
}

}  // namespace palpate::runner::participants
