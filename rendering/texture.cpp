#include "rendering/texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "stimuli/texture.h"

namespace palpate::rendering {
namespace {

using stimuli::LineHeight;
using stimuli::PlaneHeight;
using stimuli::Texture;

// A place that was left far behind in one tick is as far as the profile's steepest flank could hold
// it; from there to the first minimum it is a few periods.
constexpr int kMostSteps = 4096;
constexpr int kMostPlaneSteps = 512;
constexpr double kDownhill = 1.0 / 20;  // of the period: a step where the energy is not convex
constexpr double kNewton = 1.0 / 8;     // of the period: the longest step of Newton's method
// Of the period. The step after one of Newton's this short would be its square: nothing.
constexpr double kAtRest = 1e-5;
// Sine of the angle between probe and edge: nearer to it, the probe lies along the edge, and the
// place on it runs away from under it.
constexpr double kAlongEdge = 0.1;
constexpr double kNoWave = 1e-9;  // of the wave number: the surface lies along the ridges

/// A search for the local minimum.
template <class Displacement>
struct Minimum {
  Displacement at;    ///< m, of the ideal probe
  double height = 0;  ///< m, of the profile there
  bool lost = false;
};

/// Of the energy over one direction: 1/2 u^2 + 1/2 (depth + h(u))^2.
/// \param height  of u, m, with derivatives by it
/// \param scale   m; a period along u
template <class Height>
Minimum<double> lowest_on_line(const Height& height, double depth, double start, double scale) {
  double u = start, low = -HUGE_VAL, high = HUGE_VAL;
  for (int i = 0; i < kMostSteps; ++i) {
    const LineHeight h = height(u);
    const double over = depth + h.height, residual = u + over * h.slope;
    const double rise = 1 + h.slope * h.slope + over * h.curvature;
    (residual > 0 ? high : low) = u;
    const double most = (rise > 0 ? kNewton : kDownhill) * scale;
    double step =
        rise > 0 ? std::clamp(-residual / rise, -most, most) : (residual > 0 ? -most : most);
    const bool at_rest = std::abs(step) <= kAtRest * scale;
    if (at_rest) return {u + step, h.height + step * (h.slope + 0.5 * step * h.curvature), false};
    const bool bracketed = low > -HUGE_VAL && high < HUGE_VAL;
    if (bracketed && !(u + step > low && u + step < high)) step = 0.5 * (low + high) - u;
    if (u + step == u) return {u, h.height, false};  // a kink of the profile
    u += step;
  }
  return {start, height(start).height, true};
}

using Pair = std::array<double, 2>;

/// Places in m and slopes are far from the ends of a double's range: the library's hypot guards
/// against these for 20 ns.
double length_of(double a, double b) { return std::sqrt(a * a + b * b); }

/// The step of Newton's method, downhill also along directions in which the energy is concave:
/// there the sign of its second derivative is turned (Dauphin et al. 2014, saddle-free Newton).
/// Straight down, it would zigzag between steep slopes. \param r  gradient. \param a, b, c  second
/// derivatives 11, 12, 22
Pair down(const Pair& r, double a, double b, double c) {
  const double mean = 0.5 * (a + c), half = 0.5 * (a - c), apart = length_of(half, b);
  if (mean > apart) {
    const double determinant = a * c - b * b;
    return {(b * r[1] - c * r[0]) / determinant, (b * r[0] - a * r[1]) / determinant};
  }
  // The eigenvector of the larger eigenvalue, mean + apart.
  Pair e = half > 0 ? Pair{half + apart, b} : Pair{b, apart - half};
  const double length = length_of(e[0], e[1]);
  e = length > 0 ? Pair{e[0] / length, e[1] / length} : Pair{1, 0};
  constexpr double kLeast = 1e-3;  // the energy's curvature far from the texture is 1
  const double first = (r[0] * e[0] + r[1] * e[1]) / std::max(std::abs(mean + apart), kLeast),
               second = (r[1] * e[0] - r[0] * e[1]) / std::max(std::abs(mean - apart), kLeast);
  return {-first * e[0] + second * e[1], -first * e[1] - second * e[0]};
}

/// The same over two directions.
template <class Height>
Minimum<Pair> lowest_on_plane(const Height& height, double depth, const Pair& start, double scale) {
  const auto energy = [depth](const Pair& u, const PlaneHeight& h) {
    return u[0] * u[0] + u[1] * u[1] + (depth + h.height) * (depth + h.height);
  };
  Pair u = start;
  PlaneHeight h = height(u);
  for (int i = 0; i < kMostPlaneSteps; ++i) {
    const double over = depth + h.height;
    const Pair r{u[0] + over * h.slope[0], u[1] + over * h.slope[1]};
    const double a = 1 + h.slope[0] * h.slope[0] + over * h.bend[0],
                 b = h.slope[0] * h.slope[1] + over * h.bend[1],
                 c = 1 + h.slope[1] * h.slope[1] + over * h.bend[2];
    const bool convex = a > 0 && a * c - b * b > 0;
    Pair step = down(r, a, b, c);
    double stride = length_of(step[0], step[1]);
    const double most = (convex ? kNewton : kDownhill) * scale;
    if (stride > most) {
      step = {step[0] * most / stride, step[1] * most / stride};
      stride = most;
    }
    if (stride <= kAtRest * scale) {
      return {{u[0] + step[0], u[1] + step[1]},
              h.height + step[0] * h.slope[0] + step[1] * h.slope[1],
              false};
    }
    const double before = energy(u, h);
    while (true) {
      const Pair next{u[0] + step[0], u[1] + step[1]};
      const PlaneHeight there = height(next);
      // A valley of rounding: it is at rest.
      if (stride <= kAtRest * scale || energy(next, there) <= before) {
        u = next;
        h = there;
        break;
      }
      step = {0.5 * step[0], 0.5 * step[1]};
      stride *= 0.5;
    }
    if (stride <= kAtRest * scale) return {u, h.height, false};
  }
  return {start, height(start).height, true};
}

/// Searches from the last place, and where the profile there is below the virtual probe, from the
/// probe's own place.
template <class Displacement, class Search>
bool settle(const Search& search, double depth, const Displacement& start, const Displacement& own,
            Minimum<Displacement>& found, bool& lost) {
  found = search(start);
  lost = found.lost;
  if (depth + found.height > 0) return true;
  found = search(own);
  lost = found.lost;
  return depth + found.height > 0;
}

/// Where height changes along one direction of the ideal probe's displacement alone.
/// \param along   unit, that direction
/// \param motion  of the place on the surface, by the displacement
template <class Height>
CarvedContact carve_line(const Texture& texture, const SmoothContact& contact, const Vec3& along,
                         const Vec3& motion, const Height& height, TextureState& state) {
  CarvedContact out;
  // Below the valleys it is below the profile everywhere.
  if (contact.depth <= texture.depth() && !(contact.depth + height(0).height > 0)) {
    state.touching = false;
    return out;
  }
  const double rate2 = glm::dot(motion, motion), rate = std::sqrt(rate2);
  // At rest, u = -(d + h) h': no minimum is farther away.
  const double farthest = contact.depth * texture.greatest_slope() * rate;
  const double start =
      state.touching
          ? std::clamp(glm::dot(state.place - contact.place, motion) / rate2, -farthest, farthest)
          : 0;
  Minimum<double> found;
  const double scale = texture.period() / rate;
  out.touches = settle<double>(
      [&](double from) { return lowest_on_line(height, contact.depth, from, scale); },
      contact.depth, start, 0, found, out.lost);
  state.touching = out.touches;
  if (!out.touches) return out;
  state.place = contact.place + found.at * motion;
  out.shift = found.at * along + (contact.depth + found.height) * contact.normal;
  return out;
}

/// The same for ridges. \param rate  1/m, of their cycles by the displacement
CarvedContact carve_waves(const Texture& texture, const SmoothContact& contact, const Vec3& along,
                          const Vec3& motion, double rate, TextureState& state) {
  const double cycles = texture.cycles(contact.place),
               span = glm::dot(texture.wave(), contact.window);
  const auto by_displacement = [&](const auto& height) {
    return carve_line(
        texture, contact, along, motion,
        [&](double u) {
          const LineHeight h = height(cycles + u * rate);
          return LineHeight{h.height, h.slope * rate, h.curvature * rate * rate};
        },
        state);
  };
  if (texture.is_sine()) return by_displacement(texture.mean_sine(span));
  return by_displacement([&](double at) { return texture.mean_height(at, span); });
}

/// Along an edge of the object: the probe's displacement moves the place along the edge alone.
CarvedContact carve_edge(const Texture& texture, const SmoothContact& contact, const Vec3& across,
                         TextureState& state) {
  const double length = glm::length(across);
  const Vec3 along = across / length, motion = length * contact.edge;
  if (texture.is_linear())
    return carve_waves(texture, contact, along, motion, glm::dot(texture.wave(), motion), state);
  return carve_line(
      texture, contact, along, motion,
      [&](double u) {
        const PlaneHeight h =
            texture.mean_height(contact.place + u * motion, contact.window, motion, motion);
        return LineHeight{h.height, h.slope[0], h.bend[0]};
      },
      state);
}

CarvedContact carve_ridges(const Texture& texture, const SmoothContact& contact,
                           TextureState& state) {
  const Vec3& n = contact.normal;
  const Vec3 wave = texture.wave() - glm::dot(texture.wave(), n) * n;
  const double rate = glm::length(wave);
  if (rate * texture.period() < kNoWave) {  // along the ridges: one height
    const double over =
        contact.depth +
        texture.mean_height(texture.cycles(contact.place), glm::dot(texture.wave(), contact.window))
            .height;
    state = {contact.place, over > 0};
    return {over > 0, over * n, false};
  }
  const Vec3 along = wave / rate;
  return carve_waves(texture, contact, along, along, rate, state);
}

CarvedContact carve_face(const Texture& texture, const SmoothContact& contact,
                         TextureState& state) {
  const Vec3& n = contact.normal;
  const Vec3 aside = std::abs(n.x) < 0.6 ? Vec3(1, 0, 0) : Vec3(0, 1, 0);
  const Vec3 first = glm::normalize(glm::cross(n, aside)), second = glm::cross(n, first);
  const auto height = [&](const Pair& u) {
    return texture.mean_height(contact.place + u[0] * first + u[1] * second, contact.window, first,
                               second);
  };
  CarvedContact out;
  if (contact.depth <= texture.depth() && !(contact.depth + height({0, 0}).height > 0)) {
    state.touching = false;
    return out;
  }
  Pair start{0, 0};
  if (state.touching) {
    const Vec3 from = state.place - contact.place;
    start = {glm::dot(from, first), glm::dot(from, second)};
    const double farthest = contact.depth * texture.greatest_slope(),
                 away = length_of(start[0], start[1]);
    if (away > farthest) start = {start[0] * farthest / away, start[1] * farthest / away};
  }
  Minimum<Pair> found;
  out.touches = settle<Pair>(
      [&](const Pair& from) {
        return lowest_on_plane(height, contact.depth, from, texture.period());
      },
      contact.depth, start, Pair{0, 0}, found, out.lost);
  state.touching = out.touches;
  if (!out.touches) return out;
  const Vec3 displacement = found.at[0] * first + found.at[1] * second;
  state.place = contact.place + displacement;
  out.shift = displacement + (contact.depth + found.height) * n;
  return out;
}

}  // namespace

CarvedContact carve(const Texture& texture, const SmoothContact& contact,
                    TextureState& state) noexcept {
  if (contact.edge != Vec3(0)) {
    // The dual vector of the edge in the facet's plane: nothing is felt along the probe itself.
    const Vec3 across = glm::cross(contact.probe, contact.normal);
    const double turned = glm::dot(contact.edge, across);
    const double least = kAlongEdge * glm::length(contact.edge) * glm::length(across);
    if (std::abs(turned) > least) return carve_edge(texture, contact, across / turned, state);
  }
  return texture.is_linear() ? carve_ridges(texture, contact, state)
                             : carve_face(texture, contact, state);
}

}  // namespace palpate::rendering
