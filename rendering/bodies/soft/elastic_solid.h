#pragma once
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

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stimuli/solids/solid_mesh.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

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
  /// Values of a step at a trial, computed together: elastic energy, J, with its gradient (N, one
  /// for each node) and strains (resized if they are not of this solid).
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

}  // namespace palpate::rendering
