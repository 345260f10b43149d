#pragma once
// Chooses the heading of a sliding simulated hand: of some headings along the surface, the one
// expected to give the most information about the shape. After experiments on eye movements to the
// most informative places (Yang, Lengyel & Wolpert 2016); not fitted to any person.
//
// Some hypotheses are drawn from the observer's posterior. For each heading and each drawn
// hypothesis i, contacts at some places ahead are predicted as the observer would perceive them,
// without noise: distance d, normal n and, with the ray, place s along the stylus. Given these
// contacts, hypothesis j has, with the observer's own noises and weights, the log likelihood
//
//   l_ij = sum over places of w_i max(-(d_j - d_i)^2 / (2 v) + k (n_j . n_i - 1)
//                                     + max(-(s_j - s_i)^2 / (2 along_sd^2), ln torque_floor),
//                                     floor)
//
// (shape_observer.h defines v, k and w). The chosen heading has the least entropy of the posterior
// over shapes, averaged over i; of equals, the one that turns least.

#include <span>
#include <vector>

#include "data/base/random.h"
#include "runner/participants/shape_lines.h"
#include "runner/participants/shape_observer.h"

namespace palpate::runner::participants {

struct HeadingSettings {
  bool chosen = false;        ///< choose by expected information; false: wander at random only
  double interval = 0.3;      ///< s, between choices
  double turning_time = 0.1;  ///< s, from one heading to the next
  int hypotheses = 32;        ///< drawn from the posterior; 2 to 32
  int headings = 8;           ///< evenly around the normal, the present one first; 2 to 64
  int places = 2;             ///< places ahead, evenly spaced to look_ahead; 1 to 8
  double look_ahead = 0.02;   ///< m
};

/// The sliding stylus as the participant perceives it. Lengths in m, from the believed centre.
struct SlidingStylus {
  bool ray = false;  ///< the whole stylus can touch, not only its tip
  Vec3 tip, tail;    ///< the tip on the surface, where it touches
  Vec3 normal;       ///< unit, of the contact
  Vec3 heading;      ///< unit, at right angles to the normal
};

/// Makes the choices of one participant. Does not allocate after construction.
class HeadingChoice {
 public:
  /// \throws std::invalid_argument naming every setting that is out of range. \param all  must
  /// outlive it
  HeadingChoice(const ShapeHypotheses& all, const ObserverSettings& observer,
                const HeadingSettings& settings);

  /// \return the heading: unit, at right angles to the normal. \param random  for the draw
  Vec3 choose(ShapeObserver& posterior, const SlidingStylus& stylus, Random& random);

 private:
  static constexpr int kRoom = ShapeHypotheses::kBlock;
  /// Predictions of the drawn hypotheses at one place.
  struct Prediction {
    float distance[kRoom], along[kRoom], x[kRoom], y[kRoom], z[kRoom];
  };

  /// The observer's settings, prepared for the loops.
  struct Precisions {
    float distance;     // 1 / (2 v), 1/m^2
    float direction;    // k, 1/rad^2
    float along;        // 1 / (2 along_sd^2), 1/m^2
    float least_along;  // ln torque_floor
    float floor;
  };

  bool draw(ShapeObserver& posterior, Random& random);
  double expected_entropy(const SlidingStylus& stylus, const Vec3& heading);
  void predict(const SlidingStylus& stylus, const Vec3& shift, Prediction& out) const;
  void add_log_likelihood(int i, const Prediction& seen, const FloatVec& normal_before, bool ray,
                          float* log_likelihood) const;
  float entropy(const float* log_likelihood) const;

  const ShapeHypotheses* all_;
  ObserverSettings observer_;
  HeadingSettings settings_;
  Precisions precisions_{};
  ShapeHypotheses few_;
  std::vector<int> drawn_;          // indices of hypotheses, ascending, so grouped by shape
  std::vector<int> first_, count_;  // of each shape, in drawn_
  std::vector<Prediction> seen_;    // at each place
};

}  // namespace palpate::runner::participants
