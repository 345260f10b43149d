#pragma once
// How a simulated participant identifies a shape: Bayes' rule over shapes and orientations of known
// size and centre, from a few percepts a second. A mechanistic model, not fitted to any person.
//
// With v = contact_sd^2 + model_contact_sd^2, k = 1 / (direction_sd^2 + model_direction_sd^2), and
// for each hypothesis the signed distance d and outward normal n_h (point: at the tip; ray: the
// minimum over the stylus, and the normal there):
//
//   contact      l  = -d^2 / (2 v) + k (n_h . direction - 1)
//   torque cue   l += ln(sum_k w_k exp(-(s_k - along)^2 / (2 along_sd^2)) / sum_k w_k
//                        + torque_floor),       w_k = exp(-(d_k - d) / soft_min_scale)
//   free space   l  = free_space_weight ln Phi(d / sqrt v)
//   update       L <- lambda L + (1 - lambda) L0 + w max(l, floor),
//                L0 = -ln(shapes * hypotheses of shape)
//                lambda = exp(-1 / (percept_rate memory)), or 1 without forgetting
//                w = beta; or, with evidence by movement, 1 for a percept without contact and
//                1 - exp(-(moved + turn_length turned) / movement_scale) for one with contact
//
// Where the minimum over the stylus lies on a kink inside the object (the perceived stylus cuts
// through an edge), the distance has no gradient. n_h is then the one element of its
// subdifferential that is perpendicular to the stylus: it makes the point a minimum, and is the
// normal of a contact between stylus and edge.

#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "data/base/random.h"
#include "runner/participants/shape_hypotheses.h"
#include "stimuli/vec.h"

namespace palpate::runner::participants {

/// Basis of a percept's weight.
enum class Evidence { percept, movement };

struct ObserverSettings {
  double contact_sd = 0.003;                                ///< m; of the perceived position
  double model_contact_sd = 0.003;                          ///< m; tolerance of the hypotheses
  double direction_sd = 15 * std::numbers::pi / 180;        ///< rad; of the perceived force
  double model_direction_sd = 12 * std::numbers::pi / 180;  ///< rad; tolerance of the hypotheses
  double along_sd = 0.015;         ///< m; of the contact's position along the stylus
  double soft_min_scale = 0.0015;  ///< m; scale of the soft minimum over depths along the stylus
  int places_along = 15;           ///< positions along the stylus, both ends included; 2 to 64
  double torque_floor = 1e-4;      ///< least likelihood of a position
  double free_space_weight = 0.2;  ///< weight of the evidence of a percept without contact
  double floor = -6;               ///< least log likelihood of one percept
  Evidence evidence = Evidence::percept;
  double beta = 0.25;            ///< weight of a percept; unused with evidence by movement
  double movement_scale = 0.03;  ///< m; scale of the movement that makes evidence new
  double turn_length = 0.03;     ///< m/rad; movement equivalent to a turn of the normal
  bool forgetting = true;        ///< whether old evidence fades at all
  double memory = 15;            ///< s; time constant of forgetting
  double percept_rate = 6;       ///< Hz
  double threshold = 0.95;       ///< posterior of a shape at which the observer responds
};

/// One percept, noise included. Lengths in m, from the object's centre.
struct Percept {
  bool contact = false;
  bool ray = false;  ///< the whole stylus can touch, not only its tip
  Vec3 tip;
  Vec3 tail;                    ///< ray only
  Vec3 direction;               ///< unit, of the force: outward normal; contact only
  std::optional<double> along;  ///< m from the tip to the contact, torque over force; ray only
  /// Since the last percept with contact: m that the tip moved (infinite for the first), rad that
  /// the force turned. Contact only; used with evidence by movement.
  double moved = std::numeric_limits<double>::infinity(), turned = 0;
};

/// Weight of a percept with contact after this much movement.
double contact_weight(const ObserverSettings& settings, double moved, double turned);

/// One posterior. Observers may share the hypotheses, which must outlive them. The same percepts
/// give the same bits in every thread and at every optimisation level.
class ShapeObserver {
 public:
  /// \throws std::invalid_argument naming every setting that is out of range.
  explicit ShapeObserver(const ShapeHypotheses& hypotheses, const ObserverSettings& settings = {});

  void reset();  ///< Sets the prior: shapes equal, orientations of a shape equal.

  /// Updates the posterior with a percept; call it percept_rate times a second. Does not allocate.
  /// Single precision: posteriors are within 0.001 of double precision.
  void update(const Percept& percept);

  int best() const { return best_; }  ///< Most probable shape; the first of equals.
  double probability(int shape) const { return probabilities_[static_cast<std::size_t>(shape)]; }
  /// Draws hypotheses from the posterior, in ascending order: one from each of equal parts of its
  /// mass (stratified). Does not allocate.
  void draw(Random& random, std::span<int> hypotheses);
  bool decided() const { return probability(best_) > settings_.threshold; }

 private:
  void find_posterior();

  const ShapeHypotheses* hypotheses_;
  ObserverSettings settings_;
  std::vector<float> log_posterior_;   // L, of every hypothesis; not normalised
  std::vector<float> log_likelihood_;  // l, of every hypothesis with a field
  std::vector<double> probabilities_;
  std::vector<double> masses_;  // of the hypotheses of each shape up to this one; for draws
  int best_ = 0;
  bool backwards_ = false;  // order of the shapes in an update
};

}  // namespace palpate::runner::participants
