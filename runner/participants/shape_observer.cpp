#include "runner/participants/shape_observer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "runner/participants/deepest_point.h"
#include "runner/participants/lane_math.h"
#include "runner/participants/shape_lines.h"
#include "runner/participants/solid_lines.h"

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
  /// m; a hypothesis at least that far from the stylus has the likelihood `of_far`.
  float far = 0, of_far = 0;
  /// For percepts without contact, m: a shape with a smaller bounding sphere is so far from the
  /// stylus that contact is impossible in every orientation. Negative: there is no such radius.
  float surely_free = -1;

  float kept = 0;       // share kept of the earlier evidence
  float forgotten = 0;  // the rest
  float weight = 0;     // weight of this percept

  int positions = 0;              // 0: no torque cue
  float position[kMaxPositions];  // m from the tip
  float fit[kMaxPositions];       // likelihood of `along` at that position
  float most_fit[kMaxPositions];  // there and at later positions
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

/// Without the torque.
inline void find_log_likelihoods(const Deepest& deepest, const Query& query,
                                 float* log_likelihood) {
  if (query.contact) {
    for (int i = 0; i < kBlock; ++i) {
      const float d = deepest.distance[i];
      log_likelihood[i] =
          query.direction_precision * (deepest.cosine[i] - 1.0f) - d * d * query.half_precision;
    }
  } else {
    for (int i = 0; i < kBlock; ++i) {
      log_likelihood[i] =
          query.free_space_weight * lane::log_normal_cdf(deepest.distance[i] * query.inverse_sd);
    }
  }
}

template <class ShapeLine>
void find_log_likelihood(const ShapeLine& shape, const Query& query, float* log_likelihood) {
  Deepest deepest;
  if (query.ray) {
    find_along_line(shape, query.line.length, deepest);
  } else {
    find_at_tip(shape, deepest);
  }
  find_log_likelihoods(deepest, query, log_likelihood);
  if (query.positions > 0 && torque_matters(query, log_likelihood))
    add_torque_cue(shape, query, deepest, log_likelihood);
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

  constexpr double kRoundings = 0.001;
  const double needed = settings.floor - std::log1p(settings.torque_floor) - kRoundings;
  if (percept.contact) {
    const double room = kRoundings + 1e-5 / direction_variance;
    query.far = static_cast<float>(std::sqrt(2 * variance * (room - needed)));
    query.of_far = static_cast<float>(settings.floor);
  } else {
    query.far = static_cast<float>(lane::kLogNormalCdfIsZero * std::sqrt(variance) * (1 + 1e-6));
  }
  if (percept.contact && percept.ray && percept.along) {
    query.torque_needed = static_cast<float>(needed);
    query.positions = settings.places_along;
    for (int k = 0; k < query.positions; ++k) {
      const double position = length * k / (query.positions - 1);
      const double error = (position - *percept.along) / settings.along_sd;
      query.position[k] = static_cast<float>(position);
      query.fit[k] = lane::exp(static_cast<float>(-0.5 * error * error));
    }
    float most = 0;
    for (int k = query.positions; k-- > 0;)
      query.most_fit[k] = most = lane::max(most, query.fit[k]);
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

/// The likelihoods of hypotheses of one solid without a formula. A look into its grid is costly, so
/// hypotheses that need one are collected, to fill the registers.
class SolidLikelihoods {
 public:
  /// \param log_likelihood  of every hypothesis
  SolidLikelihoods(const ShapeHypotheses& hypotheses, const DistanceField& field,
                   const Query& query, float* log_likelihood)
      : hypotheses_(hypotheses), field_(field), query_(query), log_likelihood_(log_likelihood) {}

  /// Hypotheses `first` and following of the nearby order, as many as there are lanes.
  void add(int first) {
    const auto in_solid = [&](int a, const FloatVec& v) {
      const auto component = [&](int c) {
        return lane::load(hypotheses_.nearby_component(a, c) + first);
      };
      return component(0) * v.x + component(1) * v.y + component(2) * v.z;
    };
    LanesOfLines line;
    line.field = &field_;
    for (int a = 0; a < 3; ++a) {
      line.start[a] = in_solid(a, query_.line.start);
      line.along[a] = in_solid(a, query_.line.along);
    }
    const lane::Ints near = near_lines(line);
    if (!lane::any(near)) return;
    const auto put = [&](const auto& row, auto* waiting) {
      return lane::store_flagged(row, near, waiting + lines_.count);
    };
    for (int a = 0; a < 3; ++a) {
      put(line.start[a], lines_.rows.start[a]);
      put(line.along[a], lines_.rows.along[a]);
      if (query_.contact) put(in_solid(a, query_.line.direction), lines_.rows.direction[a]);
    }
    lane::Ints which;
    std::memcpy(&which, hypotheses_.nearby_order() + first, sizeof which);
    lines_.count += put(which, lines_.which);
    if (lines_.count >= kBatch) {
      find(kBatch);
      lines_.drop_batch();
    }
  }
  void finish() {
    lines_.add_zeros();
    find(lines_.count);
    torque_.add_zeros();
    add_torque(torque_.count);
  }

 private:
  static constexpr int kBatch = 128;  // lines, a multiple of all numbers of lanes
  /// Less than a batch, the next one, and the lanes that are stored with its last lines. What is
  /// not filled has no value.
  struct Waiting {
    static constexpr int kRoom = 2 * kBatch + lane::kWidth;
    int count = 0;
    int which[kRoom];
    LineRows<kRoom> rows;
    float distance[kRoom], log_likelihood[kRoom];  // for the torque cue

    void drop_batch() {
      for_each_row([&](auto* row) { std::copy_n(row + kBatch, count - kBatch, row); });
      count -= kBatch;
    }
    /// So that the lanes after the last line have values.
    void add_zeros() {
      for_each_row([&](auto* row) { std::fill_n(row + count, lane::kWidth, 0); });
    }

   private:
    template <class Visit>
    void for_each_row(const Visit& visit) {
      visit(which);
      for (int a = 0; a < 3; ++a) {
        visit(rows.start[a]);
        visit(rows.along[a]);
        visit(rows.direction[a]);
      }
      visit(distance);
      visit(log_likelihood);
    }
  };

  /// Lines that come so near the solid that their likelihood depends on the distance.
  lane::Ints near_lines(const LanesOfLines& line) const {
    if (query_.ray) {
      const BoxCrossing crossing(line);
      const lane::Floats far = lane::all(query_.far);
      return lane::max(crossing.begin(far), lane::Floats{}) <=
             lane::min(crossing.end(far), lane::all(query_.line.length));
    }
    const DistanceField::Box& box = field_.box();
    const auto beyond = [&](int a) {
      return lane::abs(line.start[a] - box.middle[a]) - box.half[a];
    };
    return lane::max(lane::max(beyond(0), beyond(1)), beyond(2)) <= query_.far;
  }

  void find(int count) {
    float along[Waiting::kRoom], least[Waiting::kRoom];
    if (query_.ray) search_lines(field_, lines_.rows, count, query_.line.length, along, least);
    float found[Waiting::kRoom];
    for (int i = 0; i < count; i += lane::kWidth) {
      const LanesOfLines lines(field_, lines_.rows, i);
      lane::Floats distance, log_likelihood;
      if (query_.contact) {
        const lane::Floats place = query_.ray ? lane::load(along + i) : lane::Floats{};
        const LanesOfSurface there = surface_at(lines, place, query_.line.length);
        const auto& [x, y, z] = lines_.rows.direction;
        const LanesOfVectors direction{lane::load(x + i), lane::load(y + i), lane::load(z + i)};
        distance = there.distance;
        log_likelihood = query_.direction_precision * (dot(there.normal, direction) - 1.0f) -
                         distance * distance * query_.half_precision;
      } else {
        distance = query_.ray ? lane::load(least + i) : lines.distances(lane::Floats{});
        log_likelihood =
            query_.free_space_weight * lane::log_normal_cdf(distance * query_.inverse_sd);
      }
      lane::store(log_likelihood, found + i);
      if (query_.positions > 0) wait_for_torque(i, count, distance, log_likelihood);
    }
    for (int i = 0; i < count; ++i) log_likelihood_[lines_.which[i]] = found[i];
    if (torque_.count >= kBatch) {
      add_torque(kBatch);
      torque_.drop_batch();
    }
  }

  /// Those that the torque can leave above the floor.
  void wait_for_torque(int first, int count, const lane::Floats& distance,
                       const lane::Floats& log_likelihood) {
    const lane::Ints needed =
        (log_likelihood > query_.torque_needed) & lane::first_lanes(count - first);
    const auto put = [&](const auto& row, auto* waiting) {
      return lane::store_flagged(row, needed, waiting + torque_.count);
    };
    for (int a = 0; a < 3; ++a) {
      put(lane::load(lines_.rows.start[a] + first), torque_.rows.start[a]);
      put(lane::load(lines_.rows.along[a] + first), torque_.rows.along[a]);
    }
    lane::Ints which;
    std::memcpy(&which, lines_.which + first, sizeof which);
    put(which, torque_.which);
    put(distance, torque_.distance);
    torque_.count += put(log_likelihood, torque_.log_likelihood);
  }

  void add_torque(int count) {
    for (int i = 0; i < count; i += lane::kWidth) {
      const LanesOfLines lines(field_, torque_.rows, i);
      const lane::Floats least = lane::load(torque_.distance + i);
      const lane::Floats far_off =
          BoxCrossing(lines).end(least + kFarHeights / query_.inverse_scale);
      lane::Floats weights{}, fits{};
      for (int k = 0; k < query_.positions; ++k) {
        // Places far off the solid come last. A summand of less than half a unit in the last place
        // changes nothing.
        constexpr float kUnit = 0x1p-26F;
        const lane::Ints needed = (query_.position[k] <= far_off) |
                                  (kFarWeight >= weights * kUnit) |
                                  (kFarWeight * query_.most_fit[k] >= fits * kUnit);
        if (!lane::any(needed)) break;
        const lane::Floats distance = lines.distances(lane::all(query_.position[k]));
        const lane::Floats weight = lane::exp(-(distance - least) * query_.inverse_scale);
        weights += weight;
        fits += weight * query_.fit[k];
      }
      const lane::Floats cue = lane::log(fits / weights + query_.torque_floor);
      lane::store(lane::load(torque_.log_likelihood + i) + cue, torque_.log_likelihood + i);
    }
    for (int i = 0; i < count; ++i) log_likelihood_[torque_.which[i]] = torque_.log_likelihood[i];
  }

  // A place that is farther from the solid than the nearest one by this many scales of the soft
  // minimum has a smaller weight than this.
  static constexpr float kFarHeights = 24, kFarWeight = 3.8e-11F;  // e^-24 = 3.775e-11

  const ShapeHypotheses& hypotheses_;
  const DistanceField& field_;
  const Query& query_;
  float* log_likelihood_;
  Waiting lines_;   // to be searched
  Waiting torque_;  // that the torque can leave above the floor
};

/// Of whole blocks. Has a maximum for each lane, because the compiler may not reorder a single one.
float greatest(const std::vector<float>& all) {
  float most[kBlock];
  std::copy_n(all.begin(), kBlock, most);
  for (std::size_t first = 0; first < all.size(); first += kBlock) {
    for (std::size_t i = 0; i < kBlock; ++i) most[i] = lane::max(most[i], all[first + i]);
  }
  return *std::max_element(most, most + kBlock);
}

/// Updates L of all hypotheses of one shape by a percept.
template <class ShapeLine>
void update_shape(const ShapeHypotheses& hypotheses, const ShapeHypotheses::Shape& shape,
                  const Query& query, const ObserverSettings& settings, float* log_posterior,
                  float* all_log_likelihoods) {
  const float regained = query.forgotten * log_prior(hypotheses, shape);
  const auto floor = static_cast<float>(settings.floor);
  if (bounding_radius(shape) < query.surely_free) {
    const int blocks = (shape.count + kBlock - 1) / kBlock;
    for (int h = shape.first; h < shape.first + blocks * kBlock; ++h)
      log_posterior[h] = query.kept * log_posterior[h] + regained;  // likelihood 1
    return;
  }
  const auto add = [&](int first, const float* log_likelihood) {
    for (int i = 0; i < kBlock; ++i) {
      float& posterior = log_posterior[first + i];
      posterior =
          query.kept * posterior + regained + query.weight * lane::max(log_likelihood[i], floor);
    }
  };
  const int end = shape.first + shape.count;
  if constexpr (std::is_same_v<ShapeLine, SolidLine>) {
    const int blocks = (shape.count + kBlock - 1) / kBlock;
    std::fill_n(all_log_likelihoods + shape.first, blocks * kBlock, query.of_far);
    SolidLikelihoods likelihoods(hypotheses, *shape.field, query, all_log_likelihoods);
    for (int first = shape.first; first < shape.first + blocks * kBlock; first += lane::kWidth)
      likelihoods.add(first);
    likelihoods.finish();
    for (int first = shape.first; first < end; first += kBlock)
      add(first, all_log_likelihoods + first);
  } else {
    for (int first = shape.first; first < end; first += kBlock) {
      const ShapeLine line(hypotheses, shape, first, query.line);
      float log_likelihood[kBlock];
      find_log_likelihood(line, query, log_likelihood);
      add(first, log_likelihood);
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
      log_likelihood_(log_posterior_.size()),
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
  // Back and forth: the fields together exceed the cache, and the last one is still in it.
  const std::size_t shapes = hypotheses_->shapes().size();
  backwards_ = !backwards_;
  for (std::size_t s = 0; s < shapes; ++s) {
    const ShapeHypotheses::Shape& shape = hypotheses_->shapes()[backwards_ ? shapes - 1 - s : s];
    visit_line_class(shape, [&]<class ShapeLine>(std::type_identity<ShapeLine>) {
      update_shape<ShapeLine>(*hypotheses_, shape, query, settings_, log_posterior_.data(),
                              log_likelihood_.data());
    });
  }
  find_posterior();
}

void ShapeObserver::find_posterior() {
  const float* const l = log_posterior_.data();
  const float reference = greatest(log_posterior_);

  double total = 0;
  for (std::size_t s = 0; s < probabilities_.size(); ++s) {
    const ShapeHypotheses::Shape& shape = hypotheses_->shapes()[s];
    const int end = shape.first + shape.count;
    float sums[kBlock] = {};  // one for each lane: the compiler may not reorder a single sum
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
  const float reference = greatest(log_posterior_);
  double total = 0;
  for (const ShapeHypotheses::Shape& shape : hypotheses_->shapes()) {
    const int end = shape.first + shape.count;
    for (int first = shape.first; first < end; first += kBlock) {
      float mass[kBlock];
      const float* const l = log_posterior_.data() + first;
      for (int i = 0; i < kBlock; ++i) mass[i] = lane::exp(l[i] - reference);
      for (int h = first; h < std::min(first + kBlock, end); ++h)
        masses_[static_cast<std::size_t>(h)] = total += mass[h - first];
    }
  }
  const auto count = static_cast<double>(hypotheses.size());
  std::size_t drawn = 0;
  int last = 0;
  double next = total * random.unit() / count;
  for (const ShapeHypotheses::Shape& shape : hypotheses_->shapes()) {
    auto at = masses_.begin() + shape.first;
    const auto end = at + shape.count;
    while (drawn < hypotheses.size()) {
      at = std::upper_bound(at, end, next);
      if (at == end) break;
      hypotheses[drawn++] = static_cast<int>(at - masses_.begin());
      next = total * (static_cast<double>(drawn) + random.unit()) / count;
    }
    last = shape.first + shape.count - 1;
  }
  while (drawn < hypotheses.size()) hypotheses[drawn++] = last;  // if the sum was rounded down
}

}  // namespace palpate::runner::participants
