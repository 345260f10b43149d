#include "runner/participants/distance_field.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "stimuli/convex_mesh.h"
#include "stimuli/nearest_on_triangle.h"

namespace palpate::runner::participants {
namespace {

constexpr double kNodesAcross = 72;     // across the object's longest side and its margins
constexpr double kLeastMargin = 0.012;  // m
constexpr int kBand = 6;                // nodes; distances are exact this near the surface
constexpr double kRounding = 1e-5;      // m; of places in single precision
constexpr float kUnknown = std::numeric_limits<float>::max();

/// Computes the nodes of a field.
class Filling {
 public:
  Filling(const Vec3& low, double spacing, const std::array<int, 3>& count)
      : low_(low),
        spacing_(spacing),
        count_(count),
        inside_(size(count[0]) * size(count[1]) * size(count[2]), 0),
        distance_(inside_.size(), kUnknown),
        depth_(inside_.size(), kUnknown) {}

  std::vector<float> run(const std::vector<PlacedPart>& parts) {
    for (const PlacedPart& part : parts) mark_inside(part);
    for (const PlacedPart& part : parts) measure(part);
    march(distance_, 0);
    find_depths();
    march(depth_, 1);
    for (std::size_t i = 0; i < inside_.size(); ++i) {
      if (inside_[i] != 0) distance_[i] = -depth_[i];
    }
    return std::move(distance_);
  }

 private:
  using Range = std::array<int, 2>;  // nodes, first and last

  static std::size_t size(int count) { return static_cast<std::size_t>(count); }
  std::size_t index(int x, int y, int z) const {
    return (size(z) * size(count_[1]) + size(y)) * size(count_[0]) + size(x);
  }
  Vec3 place(int x, int y, int z) const { return low_ + spacing_ * Vec3(x, y, z); }
  Range range(double low, double high, std::size_t axis) const {
    const double from = low_[static_cast<int>(axis)];
    return {std::max(0, static_cast<int>(std::ceil((low - from) / spacing_))),
            std::min(count_[axis] - 1, static_cast<int>(std::floor((high - from) / spacing_)))};
  }

  // A node is inside if the crossings of its line with the surface give a positive winding number.
  void mark_inside_surface(const PlacedPart& part) {
    struct Crossing {
      double x;
      int turns;
    };
    std::vector<std::vector<Crossing>> lines(static_cast<std::size_t>(count_[1]) *
                                             static_cast<std::size_t>(count_[2]));
    // Shift the lines so that no corner of a file lies on one.
    const double y0 = low_.y + 1.2345e-7 * spacing_, z0 = low_.z + 2.3456e-7 * spacing_;
    for (const auto& corners : part.surface->triangles) {
      std::array<Vec3, 3> v;
      for (std::size_t k = 0; k < 3; ++k)
        v[k] = part.pose.orientation * part.surface->vertices[corners[k]] + part.pose.position;
      const Vec3 low = glm::min(v[0], glm::min(v[1], v[2])),
                 high = glm::max(v[0], glm::max(v[1], v[2]));
      const Range ys = range(low.y - spacing_, high.y, 1), zs = range(low.z - spacing_, high.z, 2);
      for (int z = zs[0]; z <= zs[1]; ++z) {
        for (int y = ys[0]; y <= ys[1]; ++y) {
          const double py = y0 + spacing_ * y, pz = z0 + spacing_ * z;
          std::array<double, 3> side{};
          for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 &a = v[k], &b = v[(k + 1) % 3];
            side[k] = (a.y - py) * (b.z - pz) - (a.z - pz) * (b.y - py);
          }
          const bool out = side[0] > 0 && side[1] > 0 && side[2] > 0;
          if (!out && !(side[0] < 0 && side[1] < 0 && side[2] < 0)) continue;
          const double area = side[0] + side[1] + side[2];
          const double x = (side[1] * v[0].x + side[2] * v[1].x + side[0] * v[2].x) / area;
          lines[size(z) * size(count_[1]) + size(y)].push_back({x, out ? -1 : 1});
        }
      }
    }
    for (int z = 0; z < count_[2]; ++z) {
      for (int y = 0; y < count_[1]; ++y) {
        auto& line = lines[size(z) * size(count_[1]) + size(y)];
        std::sort(line.begin(), line.end(),
                  [](const Crossing& a, const Crossing& b) { return a.x < b.x; });
        int turns = 0;
        for (std::size_t i = 0; i + 1 < line.size(); ++i) {
          turns += line[i].turns;
          if (turns <= 0) continue;
          const Range x = range(line[i].x, line[i + 1].x, 0);
          for (int k = x[0]; k <= x[1]; ++k) inside_[index(k, y, z)] = 1;
        }
      }
    }
  }

  // Each line of nodes crosses a convex part in one interval.
  void mark_inside(const PlacedPart& part) {
    if (part.mesh == nullptr) {
      mark_inside_surface(part);
      return;
    }
    std::vector<std::pair<Vec3, double>> planes;
    for (const stimuli::Facet& facet : part.mesh->facets()) {
      const Vec3 normal = part.pose.orientation * facet.normal;
      // Move planes out slightly: a node on a seam must not be outside both parts.
      planes.emplace_back(normal,
                          facet.offset + glm::dot(normal, part.pose.position) + 1e-3 * spacing_);
    }
    for (int z = 0; z < count_[2]; ++z) {
      for (int y = 0; y < count_[1]; ++y) {
        const Vec3 start = place(0, y, z);
        double from = 0, to = spacing_ * (count_[0] - 1);
        for (const auto& [normal, offset] : planes) {
          const double above = glm::dot(normal, start) - offset;
          if (normal.x > 0) {
            to = std::min(to, -above / normal.x);
          } else if (normal.x < 0) {
            from = std::max(from, -above / normal.x);
          } else if (above > 0) {
            to = -1;
          }
          if (from > to) break;
        }
        if (from > to) continue;
        const Range x = range(start.x + from, start.x + to, 0);
        for (int i = x[0]; i <= x[1]; ++i) inside_[index(i, y, z)] = 1;
      }
    }
  }

  void measure(const PlacedPart& part) {
    if (part.mesh == nullptr) {
      const auto place = [&](std::uint32_t corner) {
        return part.pose.orientation * part.surface->vertices[corner] + part.pose.position;
      };
      for (const auto& t : part.surface->triangles) measure(place(t[0]), place(t[1]), place(t[2]));
      return;
    }
    const stimuli::ConvexMesh& mesh = *part.mesh;
    for (std::uint32_t f = 0; f < mesh.facets().size(); ++f) {
      const stimuli::Facet& facet = mesh.facets()[f];
      const auto corner = [&](std::uint32_t k) {
        const stimuli::Edge& edge = mesh.edges()[mesh.sides()[facet.first_side + k].edge];
        return part.pose.orientation * (edge.left == f ? edge.from : edge.to) + part.pose.position;
      };
      for (std::uint32_t k = 2; k < facet.side_count; ++k)
        measure(corner(0), corner(k - 1), corner(k));
    }
  }

  void measure(const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 low = glm::min(a, glm::min(b, c)) - Vec3(kBand * spacing_);
    const Vec3 high = glm::max(a, glm::max(b, c)) + Vec3(kBand * spacing_);
    const Range xs = range(low.x, high.x, 0), ys = range(low.y, high.y, 1),
                zs = range(low.z, high.z, 2);
    const Vec3 across = glm::cross(b - a, c - a);
    const double twice_area = glm::length(across);
    const Vec3 normal = twice_area > 0 ? across / twice_area : Vec3(0);
    for (int z = zs[0]; z <= zs[1]; ++z) {
      for (int y = ys[0]; y <= ys[1]; ++y) {
        for (int x = xs[0]; x <= xs[1]; ++x) {
          const std::size_t i = index(x, y, z);
          if (inside_[i] != 0) continue;
          const Vec3 p = place(x, y, z);
          const double least = std::min<double>(distance_[i], kBand * spacing_);
          if (std::abs(glm::dot(normal, p - a)) >= least) continue;
          const double apart = glm::distance(p, stimuli::nearest_on_triangle({a, b, c}, p));
          if (apart < least) distance_[i] = static_cast<float>(apart);
        }
      }
    }
  }

  // Inside, the distances of parts include those to seams. A node q outside at distance s has a
  // ball of radius s free of the solid, so |p - q| - s bounds the depth of p; for a node next to
  // the surface the least bound is nearly exact.
  void find_depths() {
    for (int z = 1; z + 1 < count_[2]; ++z) {
      for (int y = 1; y + 1 < count_[1]; ++y) {
        for (int x = 1; x + 1 < count_[0]; ++x) {
          if (inside_[index(x, y, z)] != 0 && beside_surface(x, y, z))
            depth_[index(x, y, z)] = depth_by_balls(x, y, z);
        }
      }
    }
  }

  bool beside_surface(int x, int y, int z) const {
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          if (inside_[index(x + dx, y + dy, z + dz)] == 0) return true;
        }
      }
    }
    return false;
  }

  float depth_by_balls(int x, int y, int z) const {
    constexpr int kWindow = 3;
    float least = kUnknown;
    for (int dz = -kWindow; dz <= kWindow; ++dz) {
      for (int dy = -kWindow; dy <= kWindow; ++dy) {
        for (int dx = -kWindow; dx <= kWindow; ++dx) {
          const int a = x + dx, b = y + dy, c = z + dz;
          if (a < 0 || b < 0 || c < 0 || a >= count_[0] || b >= count_[1] || c >= count_[2])
            continue;
          const std::size_t i = index(a, b, c);
          if (inside_[i] != 0) continue;
          const double apart = spacing_ * std::sqrt(double(dx * dx + dy * dy + dz * dz));
          least = std::min(least, static_cast<float>(apart) - distance_[i]);
        }
      }
    }
    return std::max(least, 0.0F);
  }

  // Extends known distances by the eikonal equation (Zhao 2005, "A fast sweeping method for eikonal
  // equations"): one sweep in each of the eight directions. Nodes wait until a neighbour changes
  // (Bak, McLaughlin & Renzi 2010, "Some improvements for the fast sweeping method").
  void march(std::vector<float>& values, char side) const {
    std::vector<char> open(values.size()), waits(values.size());
    for (std::size_t i = 0; i < values.size(); ++i)
      open[i] = inside_[i] == side && !(values[i] < kUnknown) ? 1 : 0;
    const std::size_t row = size(count_[0]), layer = row * size(count_[1]);
    const auto wake_neighbours = [&](int x, int y, int z) {
      const std::size_t here = index(x, y, z);
      const auto wake = [&](bool there, std::size_t i) {
        if (there) waits[i] = open[i];
      };
      wake(x > 0, here - 1);
      wake(x + 1 < count_[0], here + 1);
      wake(y > 0, here - row);
      wake(y + 1 < count_[1], here + row);
      wake(z > 0, here - layer);
      wake(z + 1 < count_[2], here + layer);
    };
    for (int z = 0; z < count_[2]; ++z) {
      for (int y = 0; y < count_[1]; ++y) {
        for (int x = 0; x < count_[0]; ++x) {
          if (values[index(x, y, z)] < kUnknown) wake_neighbours(x, y, z);
        }
      }
    }
    const auto order = [&](int k, int sweep, std::size_t axis) {
      return (sweep >> axis & 1) != 0 ? count_[axis] - 1 - k : k;
    };
    for (int sweep = 0; sweep < 8; ++sweep) {
      for (int k = 0; k < count_[2]; ++k) {
        for (int j = 0; j < count_[1]; ++j) {
          const int y = order(j, sweep, 1), z = order(k, sweep, 2);
          for (int i = 0; i < count_[0]; ++i) {
            const int x = order(i, sweep, 0);
            const std::size_t here = index(x, y, z);
            if (waits[here] == 0) continue;
            waits[here] = 0;
            const float found = from_neighbours(values, x, y, z);
            if (!(found < values[here])) continue;
            values[here] = found;
            wake_neighbours(x, y, z);
          }
        }
      }
    }
  }

  float from_neighbours(const std::vector<float>& values, int x, int y, int z) const {
    const auto less = [&](int before, int after, std::size_t step, std::size_t here) {
      const float a = before >= 0 ? values[here - step] : kUnknown;
      const float b = after > 0 ? values[here + step] : kUnknown;
      return std::min(a, b);
    };
    const std::size_t here = index(x, y, z);
    const auto row = static_cast<std::size_t>(count_[0]);
    const float a = less(x - 1, count_[0] - 1 - x, 1, here),
                b = less(y - 1, count_[1] - 1 - y, row, here),
                c = less(z - 1, count_[2] - 1 - z, row * size(count_[1]), here);
    const float low = std::min(a, b), high = std::max(a, b);
    const std::array<float, 3> least{std::min(low, c), std::max(low, std::min(high, c)),
                                     std::max(high, c)};
    if (least[0] == kUnknown) return kUnknown;
    const auto h = static_cast<float>(spacing_);
    const float one = least[0] + h;
    if (one <= least[1]) return one;
    const float sum = least[0] + least[1], difference = least[0] - least[1];
    const float two = 0.5F * (sum + std::sqrt(std::max(2 * h * h - difference * difference, 0.0F)));
    if (two <= least[2]) return two;
    const float all = sum + least[2];
    const float squares = least[0] * least[0] + least[1] * least[1] + least[2] * least[2] - h * h;
    return (all + std::sqrt(std::max(all * all - 3 * squares, 0.0F))) / 3;
  }

  const Vec3 low_;
  const double spacing_;
  const std::array<int, 3> count_;
  std::vector<char> inside_;
  std::vector<float> distance_, depth_;  // m; valid outside and inside
};

}  // namespace

void PlacedPart::for_each_corner(const std::function<void(const Vec3&)>& visit) const {
  const auto all = [&](const auto& vertices) {
    for (const Vec3& vertex : vertices) visit(pose.orientation * vertex + pose.position);
  };
  if (mesh != nullptr)
    all(mesh->vertices());
  else
    all(surface->vertices);
}

DistanceField::DistanceField(const std::vector<PlacedPart>& parts) {
  Vec3 low(std::numeric_limits<double>::max()), high = -low;
  for (const PlacedPart& part : parts) {
    part.for_each_corner([&](const Vec3& place) {
      low = glm::min(low, place);
      high = glm::max(high, place);
    });
  }
  const Vec3 size = high - low;
  const double longest = std::max({size.x, size.y, size.z});
  margin_ = kLeastMargin + 0.1 * longest;
  spacing_ = (longest + 2 * margin_) / kNodesAcross;
  low_ = low - Vec3(margin_);
  for (std::size_t a = 0; a < 3; ++a) {
    const auto axis = static_cast<int>(a);
    count_[a] = static_cast<std::int32_t>(std::ceil((size[axis] + 2 * margin_) / spacing_)) + 1;
    origin_[a] = static_cast<float>(low_[axis]);
    last_[a] = static_cast<float>(count_[a] - 1);
    high_[axis] = low_[axis] + spacing_ * (count_[a] - 1);
  }
  per_spacing_ = static_cast<float>(1 / spacing_);
  step_ = static_cast<float>(spacing_);
  const std::vector<float> values = Filling(low_, spacing_, count_).run(parts);
  nodes_.assign(values.begin(), values.end());
  row_ = count_[0];
  layer_ = row_ * count_[1];
  std::size_t i = 0;
  double near = 0;  // m; most that a node is nearer than its distance from the box
  for (int z = 0; z < count_[2]; ++z) {
    for (int y = 0; y < count_[1]; ++y) {
      for (int x = 0; x < count_[0]; ++x) {
        // |p| is convex, so what holds at the nodes holds between them; beyond the grid the
        // distance to it is added. The same is true of the farthest plane of a box.
        const Vec3 p = low_ + spacing_ * Vec3(x, y, z);
        const float value = nodes_[i++];
        reach_ = std::max(reach_, static_cast<float>(glm::length(p) + kRounding) - value);
        const Vec3 off = glm::max(low - p, p - high);
        near = std::max(near, std::max({off.x, off.y, off.z}) - static_cast<double>(value));
      }
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    box_.middle[axis] = static_cast<float>((low[axis] + high[axis]) / 2);
    box_.half[axis] = static_cast<float>(size[axis] / 2 + near + kRounding);
  }
}

}  // namespace palpate::runner::participants
