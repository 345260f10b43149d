#pragma once
// A soft body: an implicit step of its motion, and its surface's compliance. Pure: the state is an
// argument. World frame, SI units.
//
// A step minimises the incremental potential of implicit Euler by quasi-Newton steps with a matrix
// factorised once (Liu, Bouaziz & Kavan 2017, "Quasi-Newton methods for real-time simulation of
// hyperelastic materials", ACM Trans. Graph. 36(3)); departs: the matrix is mass and stiffness at
// rest, not a Laplacian. Guarded: it starts from the last positions and accepts only trials that
// lower the potential, so a step cannot diverge, whatever the forces.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "rendering/bodies/soft/elastic_solid.h"
#include "stimuli/solids/solid_mesh.h"
#include "stimuli/solids/sparse_factor.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

struct SoftSettings {
  SoftMaterial material;
  double step = 0.004;     ///< s
  Vec3 gravity{0, 0, 0};   ///< m/s^2
  int iterations = 1;      ///< quasi-Newton iterations of a step, at most
  bool compliance = true;  ///< compute the compliance; its memory grows with nodes^2
};

/// A force on a node of the surface.
struct NodeForce {
  std::uint32_t surface_node = 0;
  Vec3 force;  ///< N
};

struct SoftState {
  std::vector<Vec3> x, v;  ///< m, m/s, of all nodes
  Strains strains;
  double energy = 0;           ///< J, elastic
  std::vector<Vec3> gradient;  ///< N, of the elastic energy
  std::vector<Vec3> load;      ///< N, on the nodes in the last step
  std::vector<Vec3> ahead;     ///< m, motion in one more step with that load, by the linear model
  std::vector<Vec3> by_load;   ///< m, the part of `ahead` due to that load
  std::vector<double> pack, work;  ///< working memory for solving
  std::vector<Vec3> trial, step, trial_gradient;
  std::uint64_t steps = 0;  ///< so far
  // Elastic values of the last trial; the state takes them over if the trial is accepted:
  std::vector<Vec3> next_gradient;
  Strains next_strains;
  double next_energy = 0;
  bool next_is_trial = false;
};

/// Immutable.
class SoftBody {
 public:
  /// \param mesh   world frame, at rest
  /// \param fixed  nodes that do not move, in any order
  /// \throws std::invalid_argument: a flat element, or nodes that belong to no element
  SoftBody(stimuli::SolidMesh mesh, const std::vector<std::uint32_t>& fixed,
           const SoftSettings& settings);

  const Solid& solid() const { return solid_; }
  const stimuli::SolidMesh& mesh() const { return mesh_; }
  const SoftSettings& settings() const { return settings_; }
  const std::vector<stimuli::SolidFace>& surface() const { return surface_; }
  /// Nodes of the surface; a surface node is an index into this.
  const std::vector<std::uint32_t>& surface_nodes() const { return surface_nodes_; }
  static constexpr std::uint32_t kInside = 0xffffffff;
  /// The surface node of a node; kInside: not on the surface.
  std::uint32_t surface_index(std::uint32_t node) const { return surface_index_[node]; }
  bool is_fixed(std::uint32_t node) const { return is_fixed_[node]; }
  std::size_t factor_entries() const { return factor_.entries(); }

  SoftState rest() const;
  /// One step. Does not allocate or throw. Forces that are not finite count as 0.
  void step(SoftState& state, std::span<const NodeForce> forces) const noexcept;

  /// m/N, row-major 3 x 3: motion of surface node `a` in a step by a force on surface node `b`.
  const float* compliance(std::uint32_t a, std::uint32_t b) const {
    return compliance_.data() + 9 * (std::size_t{a} * surface_nodes_.size() + b);
  }

 private:
  void find_surface();
  void find_compliance();
  void solve(SoftState& state, std::vector<Vec3>& b) const noexcept;
  void look_ahead(SoftState& state) const noexcept;
  void add_forces(SoftState& state, std::span<const NodeForce> forces) const noexcept;
  double work_against(const SoftState& state, std::span<const Vec3> x, Vec3* gradient) const;
  double change_at_trial(SoftState& state) const noexcept;
  void find_trial_gradient(SoftState& state) const noexcept;
  enum class LineSearch { stays, moves, as_expected };  ///< by the quadratic model
  LineSearch search_line(SoftState& state, double& change) const noexcept;
  Vec3 rigid_way(const SoftState& state) const noexcept;

  stimuli::SolidMesh mesh_;
  SoftSettings settings_;
  Solid solid_;
  double extent_ = 0;  ///< m, of the body at rest, from its first node
  std::vector<bool> is_fixed_;
  std::vector<std::uint32_t> free_nodes_;
  stimuli::Factor factor_;
  std::vector<stimuli::SolidFace> surface_;
  std::vector<std::uint32_t> surface_nodes_, surface_index_;
  std::vector<float> compliance_;
};

}  // namespace palpate::rendering
