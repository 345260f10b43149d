#pragma once
// Where a simulated hand slides on: of some headings along the surface, the one that is expected to
// tell most about the shape. After the experiments on eyes that look where they expect to learn
// most (Yang, Lengyel & Wolpert 2016); not fitted to any person.
//
// Some hypotheses are drawn from the observer's posterior. For each heading a and each of them, i,
// the contacts at some places ahead are predicted as the observer would perceive them, without
// noise: distance d, normal n and, with the ray, place s along the stylus. With the observer's own
// noises and weights, after the contacts that i predicts hypothesis j has the log likelihood
//
//   l_ij = sum over places of w_i max(-(d_j - d_i)^2 / (2 v) + k (n_j . n_i - 1)
//                                     + max(-(s_j - s_i)^2 / (2 along_sd^2), ln torque_floor),
//                                     floor)
//
// (shape_observer.h says what v, k and w are). Chosen is the heading whose posterior over the
// shapes has the least entropy, averaged over i; of equals the one that turns least.

#include <span>
#include <vector>

#include "data/base/random.h"
#include "runner/participants/shape_lines.h"
#include "runner/participants/shape_observer.h"

namespace palpate::runner {

struct HeadingSettings {
  bool chosen = false;        ///< by what is expected to be learnt; else it wanders at random alone
  double interval = 0.3;      ///< s, between choices
  double turning_time = 0.1;  ///< s, from one heading to the next
  int hypotheses = 32;        ///< drawn from the posterior; 2 to 32
  int headings = 8;           ///< evenly around the normal, the present one first; 2 to 64
  int places = 2;             ///< looked at ahead, evenly to look_ahead; 1 to 8
  double look_ahead = 0.02;   ///< m
};

/// The stylus that slides, as the participant knows it. Lengths in m, from the believed centre.
struct SlidingStylus {
  bool ray = false;  ///< the whole stylus can touch, not only its tip
  Vec3 tip, tail;    ///< the tip on the surface, where it touches
  Vec3 normal;       ///< unit, of the contact
  Vec3 heading;      ///< unit, across the normal
};

/// Room for the choices of one participant. Does not allocate after its construction.
class HeadingChoice {
 public:
  /// \throws std::invalid_argument naming every setting that is out of range. \param all  must
  /// outlive it, as must the observers that are asked
  HeadingChoice(const ShapeHypotheses& all, const ObserverSettings& observer,
                const HeadingSettings& settings);

  /// Unit, across the normal. \param random  for the draw
  Vec3 choose(ShapeObserver& posterior, const SlidingStylus& stylus, Random& random);

 private:
  static constexpr int kRoom = ShapeHypotheses::kBlock;
  /// What each of the drawn hypotheses predicts at one place.
  struct Prediction {
    float distance[kRoom], along[kRoom], x[kRoom], y[kRoom], z[kRoom];
  };

  /// Of the observer, prepared for the loops.
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
  std::vector<int> drawn_;          // hypotheses, ascending: those of a shape side by side
  std::vector<int> first_, count_;  // of each shape, in drawn_
  std::vector<Prediction> seen_;    // at each place
};

}  // namespace palpate::runner
