#include "rendering/bodies/soft/soft_body.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <map>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

namespace palpate::rendering::elements {

// Shape functions of the elements and their integration points.

/// Derivatives of the shape functions by the element's own coordinates, at an integration point.
template <int kNodes>
struct Derivatives {
  double value[kNodes];
  double slope[kNodes][3];
  double weight;
};

/// Trilinear hexahedron, 2 x 2 x 2 points of Gauss.
inline Derivatives<8> at_point(std::integral_constant<int, 8> /*nodes*/, int point) {
  constexpr int kSigns[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
  const double g = 1 / std::sqrt(3.0);
  double at[3];
  for (int i = 0; i < 3; ++i) at[i] = g * kSigns[point][i];
  Derivatives<8> d{};
  d.weight = 1;
  for (int a = 0; a < 8; ++a) {
    double f[3];
    for (int i = 0; i < 3; ++i) f[i] = 0.5 * (1 + kSigns[a][i] * at[i]);
    d.value[a] = f[0] * f[1] * f[2];
    for (int i = 0; i < 3; ++i)
      d.slope[a][i] = 0.5 * kSigns[a][i] * f[(i + 1) % 3] * f[(i + 2) % 3];
  }
  return d;
}

/// Quadratic tetrahedron, four points, exact to second degree (Keast 1986).
inline Derivatives<10> at_point(std::integral_constant<int, 10> /*nodes*/, int point) {
  constexpr int kEdges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
  const double small = (5 - std::sqrt(5.0)) / 20;
  double l[4];
  for (int i = 0; i < 4; ++i) l[i] = i == point ? 1 - 3 * small : small;
  constexpr double kSlopes[4][3] = {{-1, -1, -1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  Derivatives<10> d{};
  d.weight = 1.0 / 24;
  for (int a = 0; a < 4; ++a) {
    d.value[a] = l[a] * (2 * l[a] - 1);
    for (int i = 0; i < 3; ++i) d.slope[a][i] = (4 * l[a] - 1) * kSlopes[a][i];
  }
  for (int e = 0; e < 6; ++e) {
    const int a = kEdges[e][0], b = kEdges[e][1];
    d.value[4 + e] = 4 * l[a] * l[b];
    for (int i = 0; i < 3; ++i)
      d.slope[4 + e][i] = 4 * (l[a] * kSlopes[b][i] + l[b] * kSlopes[a][i]);
  }
  return d;
}

}  // namespace palpate::rendering::elements

namespace palpate::rendering {
namespace {

/// Several 3 x 3 matrices side by side: [row][column][which].
template <int kPoints>
using Matrices = double[3][3][kPoints];

template <int kPoints>
void cofactors(const Matrices<kPoints>& f, Matrices<kPoints>& cof, double (&det)[kPoints]) {
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
    for (int j = 0; j < 3; ++j) {
      const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      for (int q = 0; q < kPoints; ++q)
        cof[i][j][q] = f[i1][j1][q] * f[i2][j2][q] - f[i1][j2][q] * f[i2][j1][q];
    }
  }
  for (int q = 0; q < kPoints; ++q)
    det[q] = f[0][0][q] * cof[0][0][q] + f[0][1][q] * cof[0][1][q] + f[0][2][q] * cof[0][2][q];
}

constexpr int kPairs[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};

/// Green's strain (F^T F - 1) / 2, six components.
template <int kPoints>
void green_strain(const Matrices<kPoints>& f, double (&green)[6][kPoints]) {
  for (int c = 0; c < 6; ++c) {
    const int i = kPairs[c][0], j = kPairs[c][1];
    for (int q = 0; q < kPoints; ++q) {
      green[c][q] = 0.5 * (f[0][i][q] * f[0][j][q] + f[1][i][q] * f[1][j][q] +
                           f[2][i][q] * f[2][j][q] - (i == j ? 1 : 0));
    }
  }
}

/// Gradient of the deformation at every integration point.
template <int kNodes, int kPoints, class Shape>
void deformation(const Shape& shape, const std::array<std::uint32_t, kNodes>& nodes,
                 std::span<const Vec3> x, Matrices<kPoints>& f) {
  for (auto& row : f) {
    for (auto& entry : row) std::fill(entry, entry + kPoints, 0.0);
  }
  for (int a = 0; a < kNodes; ++a) {
    const Vec3& p = x[nodes[static_cast<std::size_t>(a)]];
    for (int i = 0; i < 3; ++i) {
      const double along = p[i];
      for (int j = 0; j < 3; ++j) {
        for (int q = 0; q < kPoints; ++q) f[i][j][q] += along * shape.gradient[a][j][q];
      }
    }
  }
}

template <int kPoints>
double weighted_mean(const double (&values)[kPoints], const double (&weights)[kPoints],
                     double volume) {
  double sum = 0;
  for (int q = 0; q < kPoints; ++q) sum += weights[q] * values[q];
  return sum / volume;
}

bool is_finite(const Vec3& v) { return std::isfinite(v.x + v.y + v.z); }

std::vector<bool> marked(std::size_t count, const std::vector<std::uint32_t>& which) {
  std::vector<bool> marks(count, false);
  for (const std::uint32_t i : which) marks[i] = true;
  return marks;
}

std::vector<std::uint32_t> unmarked(const std::vector<bool>& marks) {
  std::vector<std::uint32_t> rest;
  for (std::uint32_t i = 0; i < marks.size(); ++i) {
    if (!marks[i]) rest.push_back(i);
  }
  return rest;
}

/// Mass / step^2 + (1 + damping / step) stiffness, of the free nodes.
Factor factorised(const Solid& solid, const std::vector<bool>& is_fixed,
                  const std::vector<std::uint32_t>& free, const SoftSettings& settings) {
  std::vector<std::uint32_t> row(is_fixed.size());
  std::vector<MatrixEntry> entries;
  for (std::uint32_t i = 0; i < free.size(); ++i) {
    row[free[i]] = 3 * i;
    const double mass = solid.masses()[free[i]];
    if (!(mass > 0))
      throw std::invalid_argument("node " + std::to_string(free[i] + 1) + " belongs to no element");
    for (std::uint32_t c = 0; c < 3; ++c)
      entries.push_back({3 * i + c, 3 * i + c, mass / (settings.step * settings.step)});
  }
  const double scale = 1 + settings.material.damping / settings.step;
  for (const Solid::Block& block : solid.stiffness()) {
    if (is_fixed[block.row] || is_fixed[block.column]) continue;
    for (std::uint32_t i = 0; i < 3; ++i) {
      for (std::uint32_t j = 0; j < 3; ++j) {
        entries.push_back(
            {row[block.row] + i, row[block.column] + j, scale * block.value[3 * i + j]});
      }
    }
  }
  return {3 * free.size(), entries};
}

constexpr double kArmijo = 1e-4;  // of the decrease predicted by the slope
constexpr int kHalvings = 30;
constexpr double kRounding = 1e-14;  // of the energy: less is not an increase
// The quadratic model is trusted if a whole step lowers the potential by between this share of the
// predicted decrease and 1 / it. Otherwise another iteration is worth its time.
constexpr double kTrusted = 0.9;

double dot(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += glm::dot(a[i], b[i]);
  return sum;
}

double longest(const std::vector<Vec3>& ways) {
  double square = 0;
  for (const Vec3& way : ways) square = std::max(square, glm::dot(way, way));
  return std::sqrt(square);
}

constexpr std::size_t kClusterTriangles = 16;

/// Halves a list of items with places along their longest extent.
void halve(std::vector<std::uint32_t>& order, std::size_t from, std::size_t to,
           const std::vector<Vec3>& places, std::vector<std::size_t>& ends) {
  if (to - from <= kClusterTriangles) {
    ends.push_back(to);
    return;
  }
  Vec3 low(std::numeric_limits<double>::infinity()), high = -low;
  for (std::size_t i = from; i < to; ++i) {
    low = glm::min(low, places[order[i]]);
    high = glm::max(high, places[order[i]]);
  }
  const Vec3 size = high - low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
  std::stable_sort(
      order.begin() + static_cast<std::ptrdiff_t>(from),
      order.begin() + static_cast<std::ptrdiff_t>(to),
      [&](std::uint32_t a, std::uint32_t b) { return places[a][axis] < places[b][axis]; });
  const std::size_t middle = from + (to - from) / 2;
  halve(order, from, middle, places, ends);
  halve(order, middle, to, places, ends);
}

}  // namespace

Factor::Factor(std::size_t size, const std::vector<MatrixEntry>& entries) {
  using Matrix = Eigen::SparseMatrix<double>;
  std::vector<Eigen::Triplet<double>> triplets;
  triplets.reserve(entries.size());
  for (const MatrixEntry& e : entries) {
    if (e.row >= e.column)
      triplets.emplace_back(static_cast<int>(e.row), static_cast<int>(e.column), e.value);
  }
  const auto n = static_cast<Eigen::Index>(size);
  Matrix matrix(n, n);
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  const Eigen::SimplicialLLT<Matrix> cholesky(matrix);
  if (cholesky.info() != Eigen::Success)
    throw std::invalid_argument("a matrix that is not positive definite");
  const Matrix lower = cholesky.matrixL();
  order_.resize(size);
  for (std::size_t i = 0; i < size; ++i)
    order_[i] =
        static_cast<std::uint32_t>(cholesky.permutationP().indices()[static_cast<Eigen::Index>(i)]);
  const auto pattern = [&](Eigen::Index column) {
    return std::span<const int>(lower.innerIndexPtr() + lower.outerIndexPtr()[column],
                                lower.innerIndexPtr() + lower.outerIndexPtr()[column + 1]);
  };
  entries_ = static_cast<std::size_t>(lower.nonZeros());
  for (Eigen::Index first = 0; first < n;) {
    Eigen::Index next = first + 1;  // each pattern begins with the diagonal
    while (next < n && std::ranges::equal(pattern(next - 1).subspan(1), pattern(next))) ++next;
    const std::span<const int> below = pattern(next - 1).subspan(1);
    Panel panel;
    panel.first_column = static_cast<std::uint32_t>(first);
    panel.columns = static_cast<std::uint32_t>(next - first);
    panel.first_row = static_cast<std::uint32_t>(rows_.size());
    panel.rows = static_cast<std::uint32_t>(below.size());
    panel.triangle = values_.size();
    panel.below = panel.triangle + std::size_t{panel.columns} * panel.columns;
    values_.resize(panel.below + std::size_t{panel.rows} * panel.columns);
    rows_.insert(rows_.end(), below.begin(), below.end());
    for (std::size_t c = 0; c < panel.columns; ++c) {
      const auto column = first + static_cast<Eigen::Index>(c);
      const double* const value = lower.valuePtr() + lower.outerIndexPtr()[column];
      const std::size_t in_triangle = panel.columns - c;
      double* const triangle = values_.data() + panel.triangle + c * panel.columns + c;
      std::copy(value, value + in_triangle, triangle);
      triangle[0] = 1 / triangle[0];
      std::copy(value + in_triangle, value + in_triangle + panel.rows,
                values_.data() + panel.below + c * panel.rows);
    }
    panels_.push_back(panel);
    first = next;
  }
}

// Side s of row i is at [i * kSides + s].
template <std::size_t kSides>
void Factor::solve_sides(double* b, double* work) const {
  const std::size_t n = order_.size();
  double* const gathered = work + n * kSides;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t s = 0; s < kSides; ++s) work[order_[i] * kSides + s] = b[i * kSides + s];
  }
  for (const Panel& panel : panels_) {
    double* const own = work + std::size_t{panel.first_column} * kSides;
    // For a force at a few places, most columns are zero on the way to the root.
    if (std::all_of(own, own + panel.columns * kSides, [](double x) { return x == 0; })) continue;
    const std::size_t rows = panel.rows;
    std::fill(gathered, gathered + rows * kSides, 0.0);
    for (std::size_t c = 0; c < panel.columns; ++c) {
      const double* const triangle = values_.data() + panel.triangle + c * panel.columns;
      const double* const below = values_.data() + panel.below + c * rows;
      double x[kSides];
      for (std::size_t s = 0; s < kSides; ++s)
        x[s] = own[c * kSides + s] = own[c * kSides + s] * triangle[c];
      for (std::size_t k = c + 1; k < panel.columns; ++k) {
        for (std::size_t s = 0; s < kSides; ++s) own[k * kSides + s] -= triangle[k] * x[s];
      }
      for (std::size_t k = 0; k < rows; ++k) {
        for (std::size_t s = 0; s < kSides; ++s) gathered[k * kSides + s] += below[k] * x[s];
      }
    }
    const std::uint32_t* const where = rows_.data() + panel.first_row;
    for (std::size_t k = 0; k < rows; ++k) {
      for (std::size_t s = 0; s < kSides; ++s)
        work[where[k] * kSides + s] -= gathered[k * kSides + s];
    }
  }
  for (std::size_t p = panels_.size(); p-- > 0;) {
    const Panel& panel = panels_[p];
    double* const own = work + std::size_t{panel.first_column} * kSides;
    const std::size_t rows = panel.rows;
    const std::uint32_t* const where = rows_.data() + panel.first_row;
    for (std::size_t k = 0; k < rows; ++k) {
      for (std::size_t s = 0; s < kSides; ++s)
        gathered[k * kSides + s] = work[where[k] * kSides + s];
    }
    for (std::size_t c = panel.columns; c-- > 0;) {
      const double* const triangle = values_.data() + panel.triangle + c * panel.columns;
      const double* const below = values_.data() + panel.below + c * rows;
      double x[kSides];
      for (std::size_t s = 0; s < kSides; ++s) x[s] = own[c * kSides + s];
      for (std::size_t k = c + 1; k < panel.columns; ++k) {
        for (std::size_t s = 0; s < kSides; ++s) x[s] -= triangle[k] * own[k * kSides + s];
      }
      if constexpr (kSides == 1) {
        // Four sums side by side: the additions do not wait for each other.
        double sums[4] = {};
        std::size_t k = 0;
        for (; k + 4 <= rows; k += 4) {
          for (std::size_t i = 0; i < 4; ++i) sums[i] += below[k + i] * gathered[k + i];
        }
        for (; k < rows; ++k) sums[0] += below[k] * gathered[k];
        x[0] -= (sums[0] + sums[1]) + (sums[2] + sums[3]);
      } else {
        for (std::size_t k = 0; k < rows; ++k) {
          for (std::size_t s = 0; s < kSides; ++s) x[s] -= below[k] * gathered[k * kSides + s];
        }
      }
      for (std::size_t s = 0; s < kSides; ++s) own[c * kSides + s] = x[s] * triangle[c];
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t s = 0; s < kSides; ++s) b[i * kSides + s] = work[order_[i] * kSides + s];
  }
}

void Factor::solve(std::span<double> b, std::span<double> work) const {
  solve_sides<1>(b.data(), work.data());
}

void Factor::solve_several(std::span<double> b, std::span<double> work) const {
  solve_sides<kTogether>(b.data(), work.data());
}

Solid::Solid(const stimuli::SolidMesh& mesh, const SoftMaterial& material)
    : mu_(material.young / (2 * (1 + material.poisson))),
      lambda_(material.young * material.poisson /
              ((1 + material.poisson) * (1 - 2 * material.poisson))),
      density_(material.density),
      masses_(mesh.nodes.size(), 0.0) {
  hexahedra_.nodes = mesh.hexahedra;
  tetrahedra_.nodes = mesh.tetrahedra;
  tetrahedra_.first_element = hexahedra_.nodes.size();
  tetrahedra_.first_point = 8 * hexahedra_.nodes.size();
  prepare(mesh.nodes, hexahedra_);
  prepare(mesh.nodes, tetrahedra_);
}

template <int kNodes, int kPoints>
void Solid::prepare(const std::vector<Vec3>& nodes, Elements<kNodes, kPoints>& elements) {
  std::array<Vec3, kNodes> last{};
  for (std::size_t e = 0; e < elements.nodes.size(); ++e) {
    const auto& corners = elements.nodes[e];
    std::array<Vec3, kNodes> own{};
    double size = 0;
    for (std::size_t a = 0; a < corners.size(); ++a) {
      own[a] = nodes[corners[a]] - nodes[corners[0]];
      size = std::max({size, std::abs(own[a].x), std::abs(own[a].y), std::abs(own[a].z)});
    }
    bool same = e > 0;
    for (std::size_t a = 0; same && a < own.size(); ++a) {
      const Vec3 off = own[a] - last[a];
      same = std::max({std::abs(off.x), std::abs(off.y), std::abs(off.z)}) <= 1e-12 * size;
    }
    Shape<kNodes, kPoints> shape{};
    std::array<double, kNodes> share{};  // of the mass: the diagonal, scaled (Hinton 1976)
    for (int q = 0; q < kPoints; ++q) {
      const auto d = elements::at_point(std::integral_constant<int, kNodes>(), q);
      Mat3 jacobian(0);  // column c: derivative of the place by the element's coordinate c
      for (int a = 0; a < kNodes; ++a) {
        for (int c = 0; c < 3; ++c) jacobian[c] += own[static_cast<std::size_t>(a)] * d.slope[a][c];
      }
      const double det = glm::determinant(jacobian);
      if (!(det > 0))
        throw std::invalid_argument("element " + std::to_string(e + 1) + " is flat or inside out");
      const Mat3 inverse = glm::inverse(jacobian);
      shape.weight[q] = det * d.weight;
      shape.volume += shape.weight[q];
      for (int a = 0; a < kNodes; ++a) {
        for (int j = 0; j < 3; ++j) {
          shape.gradient[a][j][q] = d.slope[a][0] * inverse[j][0] + d.slope[a][1] * inverse[j][1] +
                                    d.slope[a][2] * inverse[j][2];
        }
        share[static_cast<std::size_t>(a)] += shape.weight[q] * d.value[a] * d.value[a];
      }
    }
    double all = 0;
    for (const double s : share) all += s;
    for (std::size_t a = 0; a < corners.size(); ++a)
      masses_[corners[a]] += density_ * shape.volume * share[a] / all;
    volume_ += shape.volume;
    if (!same) elements.shapes.push_back(shape);
    elements.shape_of.push_back(static_cast<std::uint32_t>(elements.shapes.size() - 1));
    if (!same) last = own;
  }
}

template <int kNodes, int kPoints, Solid::Terms kTerms>
Solid::Potential Solid::energy_of(const Elements<kNodes, kPoints>& elements,
                                  std::span<const Vec3> x, const Strains* before, double rate,
                                  Vec3* gradient, Strains* now) const {
  constexpr bool kDamps = kTerms != Terms::elastic, kDampedGradient = kTerms == Terms::damped;
  double energy = 0, damping = 0;
  for (std::size_t e = 0; e < elements.nodes.size(); ++e) {
    const auto& shape = elements.shapes[elements.shape_of[e]];
    const auto& nodes = elements.nodes[e];
    Matrices<kPoints> f, cof;
    double det[kPoints];
    deformation<kNodes, kPoints>(shape, nodes, x, f);
    cofactors<kPoints>(f, cof, det);
    double square[kPoints] = {};
    for (const auto& row : f) {
      for (const auto& entry : row) {
        for (int q = 0; q < kPoints; ++q) square[q] += entry[q] * entry[q];
      }
    }
    const double mean = weighted_mean(det, shape.weight, shape.volume);
    double local = 0;
    for (int q = 0; q < kPoints; ++q) {
      const double j = det[q] - 1;
      local += shape.weight[q] * (square[q] - 3 - 2 * j + j * j);
    }
    energy += 0.5 * mu_ * local + 0.5 * shape.volume * lambda_ * (mean - 1) * (mean - 1);
    double green[6][kPoints];
    [[maybe_unused]] double change[6][kPoints];
    double pressure = lambda_ * (mean - 1);
    if (kDamps || now != nullptr) green_strain<kPoints>(f, green);
    if constexpr (kDamps) {
      double spent = 0;
      for (int c = 0; c < 6; ++c) {
        const double* const old =
            before->green.data() + 6 * (elements.first_point + e * kPoints) + c * kPoints;
        for (int q = 0; q < kPoints; ++q) {
          change[c][q] = green[c][q] - old[q];
          spent += (c < 3 ? 1 : 2) * shape.weight[q] * change[c][q] * change[c][q];
        }
      }
      const double swelling = mean - before->dilation[elements.first_element + e];
      damping += rate * (mu_ * spent + 0.5 * shape.volume * lambda_ * swelling * swelling);
      if (kDampedGradient) pressure += rate * lambda_ * swelling;
    }
    if (now != nullptr) {
      std::copy(&green[0][0], &green[0][0] + 6 * kPoints,
                now->green.begin() +
                    static_cast<std::ptrdiff_t>(6 * (elements.first_point + e * kPoints)));
      now->dilation[elements.first_element + e] = mean;
    }
    if (gradient == nullptr) continue;
    Matrices<kPoints> stress;  // first Piola-Kirchhoff, times the weight
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        for (int q = 0; q < kPoints; ++q)
          stress[i][j][q] = mu_ * f[i][j][q] + (mu_ * (det[q] - 2) + pressure) * cof[i][j][q];
      }
    }
    if constexpr (kDampedGradient) {
      constexpr int kIndex[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          for (int k = 0; k < 3; ++k) {
            for (int q = 0; q < kPoints; ++q)
              stress[i][j][q] += 2 * rate * mu_ * f[i][k][q] * change[kIndex[k][j]][q];
          }
        }
      }
    }
    for (auto& row : stress) {
      for (auto& entry : row) {
        for (int q = 0; q < kPoints; ++q) entry[q] *= shape.weight[q];
      }
    }
    for (int a = 0; a < kNodes; ++a) {
      Vec3& g = gradient[nodes[static_cast<std::size_t>(a)]];
      for (int i = 0; i < 3; ++i) {
        double sum[kPoints];
        for (int q = 0; q < kPoints; ++q) {
          sum[q] = stress[i][0][q] * shape.gradient[a][0][q] +
                   stress[i][1][q] * shape.gradient[a][1][q] +
                   stress[i][2][q] * shape.gradient[a][2][q];
        }
        double all = 0;
        for (const double s : sum) all += s;
        g[i] += all;
      }
    }
  }
  return {energy, energy + damping};
}

double Solid::energy(std::span<const Vec3> x, Vec3* gradient) const {
  if (gradient != nullptr) std::fill(gradient, gradient + nodes(), Vec3(0));
  return energy_of<8, 8, Terms::elastic>(hexahedra_, x, nullptr, 0, gradient, nullptr).elastic +
         energy_of<10, 4, Terms::elastic>(tetrahedra_, x, nullptr, 0, gradient, nullptr).elastic;
}

double Solid::energy(std::span<const Vec3> x, Vec3* gradient, Strains& strains) const {
  if (gradient != nullptr) std::fill(gradient, gradient + nodes(), Vec3(0));
  fit(strains);
  return energy_of<8, 8, Terms::elastic>(hexahedra_, x, nullptr, 0, gradient, &strains).elastic +
         energy_of<10, 4, Terms::elastic>(tetrahedra_, x, nullptr, 0, gradient, &strains).elastic;
}

double Solid::energy(std::span<const Vec3> x, const Strains& before, double rate,
                     Vec3* gradient) const {
  if (gradient != nullptr) std::fill(gradient, gradient + nodes(), Vec3(0));
  return energy_of<8, 8, Terms::damped>(hexahedra_, x, &before, rate, gradient, nullptr).damped +
         energy_of<10, 4, Terms::damped>(tetrahedra_, x, &before, rate, gradient, nullptr).damped;
}

Solid::Potential Solid::potential(std::span<const Vec3> x, const Strains& before, double rate,
                                  Vec3* gradient, Strains& strains) const {
  std::fill(gradient, gradient + nodes(), Vec3(0));
  fit(strains);
  constexpr Terms kTerms = Terms::elastic_gradient;
  const Potential a = energy_of<8, 8, kTerms>(hexahedra_, x, &before, rate, gradient, &strains);
  const Potential b = energy_of<10, 4, kTerms>(tetrahedra_, x, &before, rate, gradient, &strains);
  return {a.elastic + b.elastic, a.damped + b.damped};
}

void Solid::fit(Strains& strains) const {
  strains.green.resize(6 * (8 * hexahedra_.nodes.size() + 4 * tetrahedra_.nodes.size()));
  strains.dilation.resize(hexahedra_.nodes.size() + tetrahedra_.nodes.size());
}

double Solid::volume(std::span<const Vec3> x) const {
  Strains now;
  energy(x, nullptr, now);
  double sum = 0;
  for (std::size_t e = 0; e < hexahedra_.nodes.size(); ++e)
    sum += now.dilation[e] * hexahedra_.shapes[hexahedra_.shape_of[e]].volume;
  for (std::size_t e = 0; e < tetrahedra_.nodes.size(); ++e)
    sum += now.dilation[hexahedra_.nodes.size() + e] *
           tetrahedra_.shapes[tetrahedra_.shape_of[e]].volume;
  return sum;
}

template <int kNodes, int kPoints>
void Solid::add_stiffness(const Elements<kNodes, kPoints>& elements,
                          std::vector<Block>& blocks) const {
  for (std::size_t e = 0; e < elements.nodes.size(); ++e) {
    const auto& shape = elements.shapes[elements.shape_of[e]];
    double mean[kNodes][3] = {};
    for (int a = 0; a < kNodes; ++a) {
      for (int i = 0; i < 3; ++i)
        mean[a][i] = weighted_mean(shape.gradient[a][i], shape.weight, shape.volume);
    }
    for (int a = 0; a < kNodes; ++a) {
      for (int b = 0; b < kNodes; ++b) {
        Block block{elements.nodes[e][static_cast<std::size_t>(a)],
                    elements.nodes[e][static_cast<std::size_t>(b)],
                    {}};
        for (int i = 0; i < 3; ++i) {
          for (int j = 0; j < 3; ++j) {
            double sum = shape.volume * lambda_ * mean[a][i] * mean[b][j];
            for (int q = 0; q < kPoints; ++q) {
              double along = shape.gradient[b][i][q] * shape.gradient[a][j][q];
              if (i == j) {
                for (int k = 0; k < 3; ++k)
                  along += shape.gradient[a][k][q] * shape.gradient[b][k][q];
              }
              sum += shape.weight[q] * mu_ * along;
            }
            block.value[3 * i + j] = sum;
          }
        }
        blocks.push_back(block);
      }
    }
  }
}

std::vector<Solid::Block> Solid::stiffness() const {
  std::vector<Block> blocks;
  add_stiffness(hexahedra_, blocks);
  add_stiffness(tetrahedra_, blocks);
  return blocks;
}

SoftBody::SoftBody(stimuli::SolidMesh mesh, const std::vector<std::uint32_t>& fixed,
                   const SoftSettings& settings)
    : mesh_(std::move(mesh)),
      settings_(settings),
      solid_(mesh_, settings.material),
      is_fixed_(marked(mesh_.nodes.size(), fixed)),
      free_nodes_(unmarked(is_fixed_)),
      factor_(factorised(solid_, is_fixed_, free_nodes_, settings)),
      surface_(stimuli::surface_of(mesh_)) {
  for (const Vec3& node : mesh_.nodes)
    extent_ = std::max(extent_, glm::distance(node, mesh_.nodes.front()));
  find_surface();
  if (settings.compliance) find_compliance();
}

void SoftBody::find_surface() {
  surface_index_.assign(mesh_.nodes.size(), kInside);
  for (const stimuli::SurfaceTriangle& triangle : surface_) {
    for (const std::uint32_t node : triangle) {
      if (surface_index_[node] != kInside) continue;
      surface_index_[node] = static_cast<std::uint32_t>(surface_nodes_.size());
      surface_nodes_.push_back(node);
    }
  }
}

void SoftBody::find_compliance() {
  constexpr std::size_t kTogether = Factor::kTogether;
  const std::size_t count = surface_nodes_.size(), size = factor_.size();
  std::vector<std::uint32_t> row(mesh_.nodes.size());
  for (std::uint32_t i = 0; i < free_nodes_.size(); ++i) row[free_nodes_[i]] = 3 * i;
  compliance_.assign(9 * count * count, 0);
  std::vector<double> sides(size * kTogether), work(2 * size * kTogether);
  for (std::size_t first = 0; first < 3 * count; first += kTogether) {
    const std::size_t last = std::min(first + kTogether, 3 * count);
    std::fill(sides.begin(), sides.end(), 0.0);
    for (std::size_t c = first; c < last; ++c) {
      const std::uint32_t node = surface_nodes_[c / 3];
      if (!is_fixed_[node]) sides[(row[node] + c % 3) * kTogether + (c - first)] = 1;
    }
    factor_.solve_several(sides, work);
    for (std::size_t a = 0; a < count; ++a) {
      const std::uint32_t node = surface_nodes_[a];
      if (is_fixed_[node]) continue;
      for (std::size_t c = first; c < last; ++c) {
        for (std::size_t i = 0; i < 3; ++i) {
          compliance_[9 * (a * count + c / 3) + 3 * i + c % 3] =
              static_cast<float>(sides[(row[node] + i) * kTogether + (c - first)]);
        }
      }
    }
  }
}

SoftState SoftBody::rest() const {
  SoftState state;
  const std::size_t n = mesh_.nodes.size();
  state.x = mesh_.nodes;
  for (auto* const field : {&state.v, &state.gradient, &state.load, &state.ahead, &state.by_load,
                            &state.trial, &state.step, &state.trial_gradient, &state.next_gradient})
    field->assign(n, Vec3(0));
  state.pack.resize(factor_.size());
  state.work.resize(2 * factor_.size());
  state.energy = solid_.energy(state.x, state.gradient.data(), state.strains);
  state.next_strains = state.strains;
  look_ahead(state);
  return state;
}

/// Replaces forces b by the displacements that they cause.
void SoftBody::solve(SoftState& state, std::vector<Vec3>& b) const noexcept {
  for (std::size_t i = 0; i < free_nodes_.size(); ++i) {
    for (int c = 0; c < 3; ++c)
      state.pack[3 * i + static_cast<std::size_t>(c)] = b[free_nodes_[i]][c];
  }
  factor_.solve(state.pack, state.work);
  std::fill(b.begin(), b.end(), Vec3(0));
  for (std::size_t i = 0; i < free_nodes_.size(); ++i)
    b[free_nodes_[i]] = {state.pack[3 * i], state.pack[3 * i + 1], state.pack[3 * i + 2]};
}

void SoftBody::look_ahead(SoftState& state) const noexcept {
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    state.ahead[i] = solid_.masses()[i] * (state.v[i] / settings_.step + settings_.gravity) +
                     state.load[i] - state.gradient[i];
  }
  solve(state, state.ahead);
}

/// Replaces the last load by the forces; adds the effect of the change to `ahead` and `by_load`.
void SoftBody::add_forces(SoftState& state, std::span<const NodeForce> forces) const noexcept {
  std::vector<Vec3>& change = state.step;
  for (std::size_t i = 0; i < state.load.size(); ++i) change[i] = -state.load[i];
  std::fill(state.load.begin(), state.load.end(), Vec3(0));
  bool any = false;
  for (const NodeForce& f : forces) {
    if (!is_finite(f.force)) continue;
    const std::uint32_t node = surface_nodes_[f.surface_node];
    state.load[node] += f.force;
    any |= f.force != Vec3(0);
  }
  bool changes = false;
  for (std::size_t i = 0; i < state.load.size(); ++i) {
    change[i] += state.load[i];
    changes |= change[i] != Vec3(0);
  }
  if (!changes) return;
  solve(state, change);
  for (std::size_t i = 0; i < state.load.size(); ++i) {
    state.ahead[i] += change[i];
    state.by_load[i] = any ? state.by_load[i] + change[i] : Vec3(0);
  }
}

/// J, of inertia, gravity and load from the step's start to x.
/// \param gradient  receives the sum; null: not wanted
double SoftBody::work_against(const SoftState& state, std::span<const Vec3> x,
                              Vec3* gradient) const {
  const double h = settings_.step;
  double change = 0;
  for (const std::uint32_t i : free_nodes_) {
    const double mass = solid_.masses()[i];
    const Vec3 moved = x[i] - state.x[i];
    const Vec3 pull = mass * (state.v[i] / h + settings_.gravity) + state.load[i];
    change += glm::dot(moved, 0.5 * mass / (h * h) * moved - pull);
    if (gradient != nullptr) gradient[i] += mass / (h * h) * moved - pull;
  }
  return change;
}

/// Incremental potential at the trial less that at the step's start. Also computes the next step's
/// initial values, in case this step ends there.
double SoftBody::change_at_trial(SoftState& state) const noexcept {
  const Solid::Potential there =
      solid_.potential(state.trial, state.strains, settings_.material.damping / settings_.step,
                       state.next_gradient.data(), state.next_strains);
  state.next_energy = there.elastic;
  state.next_is_trial = true;
  return there.damped - state.energy + work_against(state, state.trial, nullptr);
}

/// Sets the gradient of the incremental potential at the trial.
void SoftBody::find_trial_gradient(SoftState& state) const noexcept {
  solid_.energy(state.trial, state.strains, settings_.material.damping / settings_.step,
                state.trial_gradient.data());
  work_against(state, state.trial, state.trial_gradient.data());
}

// One step of a soft body: quasi-Newton with a guard.

/// m, motion of the whole body in a step if nothing holds it: the minimisation must not remove its
/// momentum.
Vec3 SoftBody::rigid_way(const SoftState& state) const noexcept {
  if (free_nodes_.size() < state.x.size()) return Vec3(0);
  Vec3 momentum(0);
  double mass = 0;
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    momentum += solid_.masses()[i] * state.v[i];
    mass += solid_.masses()[i];
  }
  return settings_.step * (momentum / mass + settings_.step * settings_.gravity);
}

/// Searches from state.trial along state.step for a lower potential; sets state.trial to it.
/// \param change  the potential at the trial; updated with it
SoftBody::LineSearch SoftBody::search_line(SoftState& state, double& change) const noexcept {
  const double slope = dot(state.trial_gradient, state.step);
  const double rounding = kRounding * (std::abs(state.energy) + std::abs(change));
  if (!(-slope > rounding)) return LineSearch::stays;
  // Where elements are inside out, the stiffness at rest may predict motions of many times the
  // body's size.
  const double most = longest(state.step);
  double part = most > extent_ ? extent_ / most : 1;
  for (int halving = 0; halving <= kHalvings; ++halving, part *= 0.5) {
    for (std::size_t i = 0; i < state.trial.size(); ++i) state.trial[i] += part * state.step[i];
    const double there = change_at_trial(state);
    if (there <= change + kArmijo * part * slope + rounding) {
      const double share = (change - there) / (-0.5 * slope);
      change = there;
      if (part < 1) ++state.shortened;
      return part == 1 && share > kTrusted && share < 1 / kTrusted ? LineSearch::as_expected
                                                                   : LineSearch::moves;
    }
    for (std::size_t i = 0; i < state.trial.size(); ++i) state.trial[i] -= part * state.step[i];
    state.next_is_trial = false;
  }
  return LineSearch::stays;
}

void SoftBody::step(SoftState& state, std::span<const NodeForce> forces) const noexcept {
  const double h = settings_.step;
  add_forces(state, forces);
  ++state.steps;
  const Vec3 way = rigid_way(state);
  double change = 0;
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    const double mass = solid_.masses()[i];
    const Vec3 pull = state.load[i] + mass * (state.v[i] / h + settings_.gravity);
    const Vec3 inertia = mass / (h * h) * way;
    state.trial[i] = state.x[i] + way;
    state.trial_gradient[i] = is_fixed_[i] ? Vec3(0) : state.gradient[i] - pull + inertia;
    state.step[i] = state.ahead[i] - way;
    change += glm::dot(way, 0.5 * inertia - pull);
  }
  state.next_is_trial = false;
  LineSearch found = search_line(state, change);
  for (int iteration = 1; found == LineSearch::moves && iteration < settings_.iterations;
       ++iteration) {
    find_trial_gradient(state);
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      if (is_fixed_[i]) state.trial_gradient[i] = Vec3(0);
      state.step[i] = -state.trial_gradient[i];
    }
    solve(state, state.step);
    found = search_line(state, change);
  }
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    state.v[i] = (state.trial[i] - state.x[i]) / h;
    state.x[i] = state.trial[i];
  }
  if (state.next_is_trial) {
    state.energy = state.next_energy;
    std::swap(state.gradient, state.next_gradient);
    std::swap(state.strains, state.next_strains);
  } else {
    state.energy = solid_.energy(state.x, state.gradient.data(), state.strains);
  }
  look_ahead(state);
}

SoftSurface::SoftSurface(const SoftBody& body) {
  const auto& surface = body.surface();
  std::vector<Vec3> places;
  places.reserve(surface.size());
  for (const stimuli::SurfaceTriangle& t : surface) {
    places.push_back((body.mesh().nodes[t[0]] + body.mesh().nodes[t[1]] + body.mesh().nodes[t[2]]) /
                     3.0);
  }
  std::vector<std::uint32_t> order(surface.size());
  std::iota(order.begin(), order.end(), 0U);
  std::vector<std::size_t> ends;
  halve(order, 0, order.size(), places, ends);
  for (const std::uint32_t t : order) {
    triangles_.push_back({body.surface_index(surface[t][0]), body.surface_index(surface[t][1]),
                          body.surface_index(surface[t][2])});
  }
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> known;
  std::vector<bool> owned(body.surface_nodes().size(), false);
  std::uint32_t first = 0;
  for (const std::size_t end : ends) {
    Cluster cluster{first, static_cast<std::uint32_t>(end) - first,
                    static_cast<std::uint32_t>(edges_.size()), 0};
    for (std::uint32_t t = first; t < end; ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = triangles_[t][k], b = triangles_[t][(k + 1) % 3];
        const auto [found, is_new] = known.try_emplace(std::minmax(a, b), edges_.size());
        if (!is_new) {
          edges_[found->second].triangles[1] = t;
          continue;
        }
        edges_.push_back({{a, b}, {t, t}, {!owned[a], !owned[b]}});
        owned[a] = owned[b] = true;
      }
    }
    cluster.edges = static_cast<std::uint32_t>(edges_.size()) - cluster.first_edge;
    clusters_.push_back(cluster);
    first = static_cast<std::uint32_t>(end);
  }
}

SoftView SoftSurface::first_view(const SoftBody& body, const SoftState& state) const {
  SoftView view;
  for (auto* const field : {&view.x, &view.ahead, &view.by_load})
    field->resize(body.surface_nodes().size());
  view.normals.resize(triangles_.size());
  view.boxes.resize(clusters_.size());
  look(body, state, view);
  return view;
}

void SoftSurface::look(const SoftBody& body, const SoftState& state,
                       SoftView& view) const noexcept {
  const auto& nodes = body.surface_nodes();
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    view.x[i] = state.x[nodes[i]];
    view.ahead[i] = state.ahead[nodes[i]];
    view.by_load[i] = state.by_load[nodes[i]];
  }
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const auto& [a, b, c] = triangles_[t];
    const Vec3 normal = glm::cross(view.x[b] - view.x[a], view.x[c] - view.x[a]);
    const double length = glm::length(normal);
    view.normals[t] = length > 0 ? normal / length : Vec3(0);
  }
  for (std::size_t c = 0; c < clusters_.size(); ++c) {
    SoftView::Box box{Vec3(std::numeric_limits<double>::infinity()),
                      Vec3(-std::numeric_limits<double>::infinity())};
    const auto add = [&](std::uint32_t node) {
      const Vec3 later = view.x[node] + 2.0 * view.ahead[node];
      box.low = glm::min(box.low, glm::min(view.x[node], later));
      box.high = glm::max(box.high, glm::max(view.x[node], later));
    };
    const Cluster& of = clusters_[c];
    for (std::uint32_t t = of.first_triangle; t < of.first_triangle + of.triangles; ++t) {
      for (const std::uint32_t node : triangles_[t]) add(node);
    }
    view.boxes[c] = box;
  }
}

}  // namespace palpate::rendering
