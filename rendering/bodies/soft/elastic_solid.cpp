#include "rendering/bodies/soft/elastic_solid.h"

#include <algorithm>
#include <cmath>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>

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

}  // namespace

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

}  // namespace palpate::rendering
