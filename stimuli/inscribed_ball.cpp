#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <limits>

#include "stimuli/inset.h"

namespace palpate::stimuli {
namespace {

// The largest ball (c, r): the linear program "maximise r with n_i.c + r <= d_i for all facets", by
// the dual simplex method (Lemke 1954). Its basis is four planes that a ball touches on all sides;
// each round takes in the plane that is violated most and leaves out the one that then must go.
class BallProgram {
 public:
  explicit BallProgram(const ConvexMesh& mesh) : mesh_(mesh) {
    // A regular tetrahedron far outside, whose planes all must go.
    const double a = 1 / std::sqrt(3.0), far = 10 * mesh.size();
    basis_ = {Row{{a, a, a, 1}, far}, Row{{a, -a, -a, 1}, far}, Row{{-a, a, -a, 1}, far},
              Row{{-a, -a, a, 1}, far}};
    weight_.fill(0.25);
  }

  Ball solve() {
    constexpr int kMostRounds = 100000, kBlandFrom = 1000;
    const double rounding = 4 * std::numeric_limits<double>::epsilon() * mesh_.size();
    for (int round = 0; round < kMostRounds; ++round) {
      Matrix rows{};
      std::array<double, 4> offsets{};
      for (int i = 0; i < 4; ++i) {
        rows[i] = basis_[i].a;
        offsets[i] = basis_[i].d;
      }
      const std::array<double, 4> x = solved(rows, offsets);
      const Vec3 centre(x[0], x[1], x[2]);
      const std::size_t enters = violated(centre, x[3], rounding, round >= kBlandFrom);
      if (enters == kNone || !exchange(row_of(enters)))
        return {mesh_.centre() + centre, clearance(centre)};
    }
    return {mesh_.centre(), clearance(Vec3(0))};
  }

 private:
  using Matrix = std::array<std::array<double, 4>, 4>;
  struct Row {
    std::array<double, 4> a;  // unit outward normal, 1
    double d = 0;             // m, from the mesh's centre
  };
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  Row row_of(std::size_t facet) const {
    const Facet& f = mesh_.facets()[facet];
    return {{f.normal.x, f.normal.y, f.normal.z, 1}, f.offset - glm::dot(f.normal, mesh_.centre())};
  }

  double room(const Facet& f, const Vec3& centre) const {
    return f.offset - glm::dot(f.normal, mesh_.centre() + centre);
  }

  double clearance(const Vec3& centre) const {
    double least = std::numeric_limits<double>::infinity();
    for (const Facet& f : mesh_.facets()) least = std::min(least, room(f, centre));
    return least;
  }

  /// The facet that the ball is through most, or (Bland 1977: then no basis comes again) the first.
  std::size_t violated(const Vec3& centre, double radius, double rounding, bool first) const {
    std::size_t worst = kNone;
    double least = -rounding;
    for (std::size_t i = 0; i < mesh_.facets().size(); ++i) {
      const double left = room(mesh_.facets()[i], centre) - radius;
      if (left >= least) continue;
      least = left;
      worst = i;
      if (first) break;
    }
    return worst;
  }

  /// False: nothing may go, within rounding.
  bool exchange(const Row& enters) {
    Matrix columns{};
    for (int r = 0; r < 4; ++r) {
      for (int c = 0; c < 4; ++c) columns[r][c] = basis_[c].a[r];
    }
    const std::array<double, 4> share = solved(columns, enters.a);
    int goes = -1;
    double step = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 4; ++i) {
      if (share[i] <= 1e-12) continue;
      const double ratio = std::max(0.0, weight_[i]) / share[i];
      if (goes >= 0 && (ratio > step || (ratio == step && share[i] <= share[goes]))) continue;
      step = ratio;
      goes = i;
    }
    if (goes < 0) return false;
    for (int i = 0; i < 4; ++i) weight_[i] -= step * share[i];
    weight_[goes] = step;
    basis_[goes] = enters;
    return true;
  }

  /// Gaussian elimination with partial pivoting.
  static std::array<double, 4> solved(Matrix m, std::array<double, 4> b) {
    for (int k = 0; k < 4; ++k) {
      int pivot = k;
      for (int r = k + 1; r < 4; ++r) {
        if (std::abs(m[r][k]) > std::abs(m[pivot][k])) pivot = r;
      }
      std::swap(m[k], m[pivot]);
      std::swap(b[k], b[pivot]);
      for (int r = k + 1; r < 4; ++r) {
        const double factor = m[r][k] / m[k][k];
        for (int c = k; c < 4; ++c) m[r][c] -= factor * m[k][c];
        b[r] -= factor * b[k];
      }
    }
    for (int k = 3; k >= 0; --k) {
      for (int c = k + 1; c < 4; ++c) b[k] -= m[k][c] * b[c];
      b[k] /= m[k][k];
    }
    return b;
  }

  const ConvexMesh& mesh_;
  std::array<Row, 4> basis_;
  std::array<double, 4> weight_{};  // of the rows of the basis in the objective, r
};

}  // namespace

Ball largest_inscribed_ball(const ConvexMesh& mesh) { return BallProgram(mesh).solve(); }

}  // namespace palpate::stimuli
