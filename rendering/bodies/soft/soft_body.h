#pragma once
// A soft body: an implicit step of its motion, and its surface's compliance. Pure: the state is an
// argument. World frame, SI units.
//
// A step minimises the incremental potential of implicit Euler by quasi-Newton steps with a matrix
// factorised once (Liu, Bouaziz & Kavan 2017, "Quasi-Newton methods for real-time simulation of
// hyperelastic materials", ACM Trans. Graph. 36(3)); departs: the matrix is mass and stiffness at
// rest, not a Laplacian. Guarded: it starts from the last positions and accepts only trials that
// lower the potential, so a step cannot diverge, whatever the forces.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "stimuli/solids/solid_mesh.h"

namespace palpate::rendering {

// The elastic energy of a solid of finite elements, its gradient, and its stiffness at rest. Pure.
// SI units, world frame or any other.
//
// Neo-Hookean in the stable form of Smith, de Goes & Kim 2018 ("Stable neo-Hookean flesh
// simulation", ACM Trans. Graph. 37(2)): finite and smooth where elements are flat or turned inside
// out, equal to Hooke's law for small strains. Departs: the part that belongs to Lame's lambda acts
// on the mean dilatation of each element (Hughes 1980, selective reduced integration), so nearly
// incompressible elements do not lock:
//   E = sum of elements [ integral mu/2 (|F|^2 - 3) - mu (J - 1) + mu/2 (J - 1)^2
//                         + volume lambda/2 (mean J - 1)^2 ]
// Damping is the same quadratic form in the change of Green's strain (and of the mean dilatation),
// so a rotation of the whole body is not damped.

// A symmetric positive definite sparse matrix, factorised once (Eigen's Cholesky, approximate
// minimum degree order) for many solutions. Pure.

/// An entry of a sparse matrix; several at one place are added up.
struct MatrixEntry {
  std::uint32_t row = 0, column = 0;
  double value = 0;
};

/// Immutable.
class Factor {
 public:
  /// \throws std::invalid_argument: not positive definite
  Factor(std::size_t size, const std::vector<MatrixEntry>& entries);

  std::size_t size() const { return order_.size(); }
  std::size_t entries() const { return entries_; }  ///< of the triangular factor
  /// In place; does not allocate. \param work  twice as long as b
  void solve(std::span<double> b, std::span<double> work) const;

  static constexpr std::size_t kTogether = 16;
  /// For kTogether right-hand sides at once, interleaved row by row.
  void solve_several(std::span<double> b, std::span<double> work) const;

 private:
  template <std::size_t kSides>
  void solve_sides(double* b, double* work) const;

  /// Adjacent columns with the same rows below them (a supernode).
  struct Panel {
    std::uint32_t first_column = 0, columns = 0;
    std::uint32_t first_row = 0, rows = 0;  ///< below the triangle; in rows_
    std::size_t triangle = 0;  ///< in values_: columns^2, column by column, with 1 / diagonal
    std::size_t below = 0;     ///< in values_: rows x columns, column by column
  };

  std::vector<std::uint32_t> order_;  ///< of the matrix's row i: row order_[i] of the factor
  std::vector<Panel> panels_;
  std::vector<std::uint32_t> rows_;
  std::vector<double> values_;
  std::size_t entries_ = 0;
};

struct SoftMaterial {
  double young = 20000;   ///< Pa
  double poisson = 0.45;  ///< 0 to below 0.5
  double density = 1000;  ///< kg/m^3
  double damping = 0.01;  ///< s; stress by rate of strain over stress by strain
};

/// Strains of every element at some time.
struct Strains {
  std::vector<double> green;     ///< six for each integration point
  std::vector<double> dilation;  ///< mean J of each element
};

/// Immutable.
class Solid {
 public:
  /// \throws std::invalid_argument: an element is flat or inside out
  Solid(const stimuli::SolidMesh& mesh, const SoftMaterial& material);

  std::size_t nodes() const { return masses_.size(); }
  const std::vector<double>& masses() const { return masses_; }  ///< kg, of the nodes
  double volume() const { return volume_; }                      ///< m^3, at rest

  /// J.
  /// \param gradient  N, one for each node; null: not wanted
  double energy(std::span<const Vec3> x, Vec3* gradient) const;
  /// The same, and sets the strains (resized if they are not of this solid).
  double energy(std::span<const Vec3> x, Vec3* gradient, Strains& strains) const;
  /// J, with the incremental potential of damping over a step.
  /// \param before  strains at its start
  /// \param rate  damping / duration of the step
  double energy(std::span<const Vec3> x, const Strains& before, double rate, Vec3* gradient) const;
  /// A step's values at a trial, all at once: elastic energy, J, with its gradient (N, one for each
  /// node) and strains (resized if they are not of this solid).
  struct Potential {
    double elastic = 0;  ///< J
    double damped = 0;   ///< J, with the incremental potential of damping
  };
  Potential potential(std::span<const Vec3> x, const Strains& before, double rate, Vec3* gradient,
                      Strains& strains) const;
  /// m^3, of the deformed solid.
  double volume(std::span<const Vec3> x) const;

  /// A 3 x 3 block of the stiffness matrix at rest, N/m; row-major. A block may occur several
  /// times; add them up.
  struct Block {
    std::uint32_t row = 0, column = 0;  ///< nodes
    double value[9] = {};
  };
  std::vector<Block> stiffness() const;

 private:
  template <int kNodes, int kPoints>
  struct Shape {
    double gradient[kNodes][3][kPoints];  ///< of the shape functions, 1/m
    double weight[kPoints];               ///< m^3
    double volume;
  };
  template <int kNodes, int kPoints>
  struct Elements {
    std::vector<std::array<std::uint32_t, kNodes>> nodes;
    std::vector<Shape<kNodes, kPoints>> shapes;  ///< equal elements share one
    std::vector<std::uint32_t> shape_of;
    std::size_t first_point = 0, first_element = 0;  ///< in Strains
  };
  using Hexahedra = Elements<8, 8>;
  using Tetrahedra = Elements<10, 4>;

  template <int kNodes, int kPoints>
  void prepare(const std::vector<Vec3>& nodes, Elements<kNodes, kPoints>& elements);
  enum class Terms { elastic, damped, elastic_gradient };  ///< the last: damping in the sum alone
  template <int kNodes, int kPoints, Terms kTerms>
  Potential energy_of(const Elements<kNodes, kPoints>& elements, std::span<const Vec3> x,
                      const Strains* before, double rate, Vec3* gradient, Strains* now) const;
  void fit(Strains& strains) const;
  template <int kNodes, int kPoints>
  void add_stiffness(const Elements<kNodes, kPoints>& elements, std::vector<Block>& blocks) const;

  double mu_, lambda_, density_;  // Pa, Pa, kg/m^3
  Hexahedra hexahedra_;
  Tetrahedra tetrahedra_;
  std::vector<double> masses_;
  double volume_ = 0;
};

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
  std::uint64_t steps = 0, shortened = 0;  ///< so far; iterations that the guard shortened
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
  const std::vector<stimuli::SurfaceTriangle>& surface() const { return surface_; }
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
  Factor factor_;
  std::vector<stimuli::SurfaceTriangle> surface_;
  std::vector<std::uint32_t> surface_nodes_, surface_index_;
  std::vector<float> compliance_;
};

// The moving surface of a soft body, for contact with a tool: triangles, edges and corners. World
// frame, m.

/// A servo's view of a soft body between two of its steps; all by surface node. With the load of
/// the last step held, a node moves from x to x + ahead within a step.
struct SoftView {
  std::vector<Vec3> x, ahead;
  std::vector<Vec3> by_load;  ///< the part of a node's place due to the load, by the compliance
  std::vector<Vec3> normals;  ///< of the triangles, outwards, unit; zero for a flat one
  struct Box {
    Vec3 low, high;
  };
  std::vector<Box> boxes;  ///< of the clusters, at x and two steps later
};

/// Immutable.
class SoftSurface {
 public:
  struct Edge {
    std::array<std::uint32_t, 2> nodes;      ///< surface nodes
    std::array<std::uint32_t, 2> triangles;  ///< on both sides
    std::array<bool, 2> owns;                ///< whether contacts at its ends count for this edge
  };
  /// Edges and triangles that are near each other.
  struct Cluster {
    std::uint32_t first_triangle = 0, triangles = 0, first_edge = 0, edges = 0;
  };

  explicit SoftSurface(const SoftBody& body);

  const std::vector<std::array<std::uint32_t, 3>>& triangles() const { return triangles_; }
  const std::vector<Edge>& edges() const { return edges_; }
  const std::vector<Cluster>& clusters() const { return clusters_; }

  SoftView first_view(const SoftBody& body, const SoftState& state) const;
  /// Does not allocate if the view is of this surface.
  void look(const SoftBody& body, const SoftState& state, SoftView& view) const noexcept;

 private:
  std::vector<std::array<std::uint32_t, 3>> triangles_;  ///< surface nodes; by cluster
  std::vector<Edge> edges_;                              ///< by cluster
  std::vector<Cluster> clusters_;
};

}  // namespace palpate::rendering
