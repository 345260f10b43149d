#include "stimuli/texture.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <glm/geometric.hpp>
#include <numbers>
#include <stdexcept>

namespace palpate::stimuli {
namespace {

constexpr int kLineValues = 4096;  // of a period
constexpr int kWindowPlaces = 32;  // of a window over a texture that is not linear
constexpr double kNoSpan = 1e-9;   // cycles; a shorter window is a place
constexpr double kOnAxis = 1e-9;   // m; nearer to it, ridges around an axis have no direction
constexpr double kLineMargin = 1.001,
                 kTableMargin = 1.05;  // of slopes between a table's values over those at them

/// The four values about a place of a cyclic table.
struct Cell {
  std::array<std::size_t, 4> at;
  double fraction;  ///< of the way from the second to the third
};

Cell cell_of(double cycles, int count) {
  // Both sizes of tables are powers of two.
  const double scaled = cycles * count;
  auto whole = static_cast<std::int64_t>(scaled);
  whole -= scaled < static_cast<double>(whole);
  const auto last = static_cast<std::uint64_t>(count - 1);
  const auto first = static_cast<std::uint64_t>(whole);
  return {{(first - 1) & last, first & last, (first + 1) & last, (first + 2) & last},
          scaled - static_cast<double>(whole)};
}

/// Weights of a cubic through the middle two of four values (Catmull & Rom 1974), and of its
/// derivatives by the distance of values.
struct CubicWeights {
  std::array<double, 4> value, slope, bend;
};

CubicWeights cubic_weights(double f) {
  const double f2 = f * f, f3 = f2 * f;
  return {{-0.5 * f3 + f2 - 0.5 * f, 1.5 * f3 - 2.5 * f2 + 1, -1.5 * f3 + 2 * f2 + 0.5 * f,
           0.5 * f3 - 0.5 * f2},
          {-1.5 * f2 + 2 * f - 0.5, 4.5 * f2 - 5 * f, -4.5 * f2 + 4 * f + 0.5, 1.5 * f2 - f},
          {-3 * f + 2, 9 * f - 5, -9 * f + 4, 3 * f - 1}};
}

double weighted(const std::array<double, 4>& weights, const std::array<double, 4>& values) {
  return weights[0] * values[0] + weights[1] * values[1] + weights[2] * values[2] +
         weights[3] * values[3];
}

/// sin(pi x) / (pi x)
double sinc(double x) {
  const double a = std::numbers::pi * x;
  return std::abs(a) < 1e-4 ? 1 - a * a / 6 : std::sin(a) / a;
}

/// The second direction of a tile: along the surface of a plate in the object's x and y.
Vec3 across_direction(const Vec3& direction) {
  const Vec3 up = std::abs(direction.z) < 0.9 ? Vec3(0, 0, 1) : Vec3(0, 1, 0);
  return glm::normalize(glm::cross(up, direction));
}

}  // namespace

double ridge_of(const TextureSpec& spec) { return spec.ridge.value_or(spec.period / 2); }
double ramp_of(const TextureSpec& spec) { return spec.ramp.value_or(spec.period / 8); }

const char* to_string(TextureSpec::Kind kind) {
  constexpr std::array kNames = {"sine", "trapezoid", "cones", "noise", "image"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string in_words(const TextureSpec& spec) {
  char text[80];
  std::snprintf(text, sizeof text, "%s of %.4g mm, %.4g mm deep", to_string(spec.kind),
                1e3 * spec.period, 1e3 * spec.depth);
  return text;
}

double asked_slope(const TextureSpec& spec) {
  switch (spec.kind) {
    case TextureSpec::Kind::sine:
      return std::numbers::pi * spec.depth / spec.period;
    case TextureSpec::Kind::trapezoid:
    case TextureSpec::Kind::cones:
      return 1.5 * spec.depth / ramp_of(spec);
    case TextureSpec::Kind::noise:
    case TextureSpec::Kind::image:
      return 0;
  }
  return 0;
}

Texture::Texture(const TextureSpec& spec, double radius)
    : kind_(spec.kind),
      depth_(spec.depth),
      period_(spec.period),
      ridge_(ridge_of(spec) / spec.period),
      ramp_(ramp_of(spec) / spec.period),
      phase_(spec.phase / 360),
      wave_(spec.direction / spec.period),
      origin_(0),
      across_(0),
      around_(spec.around),
      radius_(radius),
      axis_(0, 0, 1),
      first_(1, 0, 0),
      second_(0, 1, 0) {
  if (around_) {
    ridges_ = std::max(1.0, std::round(kFullTurn * radius / spec.period));
    period_ = kFullTurn * radius / ridges_;
    ridge_ *= spec.period / period_;
    ramp_ *= spec.period / period_;
  }
  if (kind_ == TextureSpec::Kind::trapezoid && !(ridge_ + 2 * ramp_ <= 1))
    throw std::invalid_argument("expected ridge_m and two flanks of ramp_m within period_m");
  if (kind_ == TextureSpec::Kind::sine || kind_ == TextureSpec::Kind::trapezoid) {
    if (spec.tip_radius > 0 && depth_ > 0) dilate_line(spec.tip_radius);
  } else {
    const double side = tile_side(spec);
    double height = side;
    auto table = std::make_shared<TileTable>();
    table->heights = tile_heights(spec, side, height);
    table_ = std::move(table);
    wave_ = spec.direction / side;
    across_ = across_direction(spec.direction) / height;
    if (around_) {
      ridges_ = std::max(1.0, std::round(kFullTurn * radius / side));
      period_ = spec.period;
      across_ = axis_ / height;
    }
  }
  find_bounds();
}

Texture Texture::in_frame(const Pose& frame) const {
  Texture out = *this;
  const Quat back = glm::conjugate(frame.orientation);
  for (Vec3 Texture::*const vector :
       {&Texture::wave_, &Texture::across_, &Texture::axis_, &Texture::first_, &Texture::second_})
    out.*vector = back * (this->*vector);
  out.origin_ = back * (origin_ - frame.position);
  return out;
}

bool Texture::same_as(const Texture& other) const {
  const auto same_table = [](const auto& a, const auto& b) {
    return a == b || (a && b && a->heights == b->heights);
  };
  return kind_ == other.kind_ && depth_ == other.depth_ && period_ == other.period_ &&
         ridge_ == other.ridge_ && ramp_ == other.ramp_ && phase_ == other.phase_ &&
         wave_ == other.wave_ && origin_ == other.origin_ && across_ == other.across_ &&
         around_ == other.around_ && ridges_ == other.ridges_ && radius_ == other.radius_ &&
         axis_ == other.axis_ && first_ == other.first_ && second_ == other.second_ &&
         same_table(line_, other.line_) && same_table(table_, other.table_);
}

double Texture::cycles(const Vec3& place) const {
  return glm::dot(wave_, place - origin_) + phase_;
}

LineHeight Texture::trapezoid(double cycles) const {
  const double nearest = nearest_whole(cycles), aside = cycles - nearest;
  const double along = (std::abs(aside) - 0.5 * ridge_) / ramp_;
  if (along <= 0) return {};
  if (along >= 1) return {-depth_, 0, 0};
  const double side = aside < 0 ? -1 : 1;
  return {-depth_ * along * along * (3 - 2 * along),
          -side * depth_ * 6 * along * (1 - along) / ramp_,
          -depth_ * (6 - 12 * along) / (ramp_ * ramp_)};
}

LineHeight Texture::profile(double cycles) const {
  if (line_) {
    const Cell cell = cell_of(cycles, kLineValues);
    const CubicWeights weights = cubic_weights(cell.fraction);
    std::array<double, 4> values;
    for (std::size_t k = 0; k < 4; ++k) values[k] = line_->heights[cell.at[k]];
    return {weighted(weights.value, values), weighted(weights.slope, values) * kLineValues,
            weighted(weights.bend, values) * kLineValues * kLineValues};
  }
  if (kind_ == TextureSpec::Kind::trapezoid) return trapezoid(cycles);
  return SineHeight{0.5 * depth_, 0.5 * depth_}(cycles);
}

/// m times cycles, of the profile from 0 to `cycles`.
double Texture::integral(double cycles) const {
  if (line_) {
    const double whole = std::floor(cycles);
    const Cell cell = cell_of(cycles, kLineValues);
    std::array<double, 4> v;
    for (std::size_t k = 0; k < 4; ++k) v[k] = line_->heights[cell.at[k]];
    const double f = cell.fraction, f2 = f * f, f3 = f2 * f, f4 = f2 * f2;
    const double in_cell = v[1] * (f - f3 + f4 / 2) + v[2] * (f3 - f4 / 2) +
                           0.5 * (v[2] - v[0]) * (f2 / 2 - 2 * f3 / 3 + f4 / 4) +
                           0.5 * (v[3] - v[1]) * (f4 / 4 - f3 / 3);
    return whole * line_->integrals.back() + line_->integrals[cell.at[1]] + in_cell / kLineValues;
  }
  const double nearest = std::round(cycles), aside = cycles - nearest;
  const auto half = [&](double to) {
    const double along = (to - 0.5 * ridge_) / ramp_;
    if (along <= 0) return 0.0;
    if (along >= 1) return -depth_ * ramp_ * (0.5 + along - 1);
    return -depth_ * ramp_ * along * along * along * (1 - along / 2);
  };
  return nearest * 2 * half(0.5) + (aside < 0 ? -half(-aside) : half(aside));
}

SineHeight Texture::mean_sine(double span) const {
  const double half = 0.5 * depth_;
  return {std::abs(span) < kNoSpan ? half : half * sinc(span), half};
}

LineHeight Texture::mean_height(double cycles, double span) const {
  span = std::abs(span);
  if (span < kNoSpan) return profile(cycles);
  if (kind_ == TextureSpec::Kind::sine && !line_) return mean_sine(span)(cycles);
  const double low = cycles - 0.5 * span, high = cycles + 0.5 * span;
  const LineHeight at_low = profile(low), at_high = profile(high);
  return {(integral(high) - integral(low)) / span, (at_high.height - at_low.height) / span,
          (at_high.slope - at_low.slope) / span};
}

PlaneHeight Texture::on_tile(const Vec3& place, const Vec3& along1, const Vec3& along2) const {
  const Vec3 from = place - origin_;
  const Cell x = cell_of(glm::dot(wave_, from) + phase_, kTileSide);
  const Cell y = cell_of(glm::dot(across_, from), kTileSide);
  const CubicWeights by_x = cubic_weights(x.fraction), by_y = cubic_weights(y.fraction);
  std::array<double, 4> value, slope, bend, row;
  for (std::size_t j = 0; j < 4; ++j) {
    const double* const values = &table_->heights[y.at[j] * kTileSide];
    for (std::size_t i = 0; i < 4; ++i) row[i] = values[x.at[i]];
    value[j] = weighted(by_x.value, row);
    slope[j] = weighted(by_x.slope, row);
    bend[j] = weighted(by_x.bend, row);
  }
  const double hx = weighted(by_y.value, slope) * kTileSide,
               hy = weighted(by_y.slope, value) * kTileSide;
  constexpr double kSquare = double{kTileSide} * kTileSide;
  const double hxx = weighted(by_y.value, bend) * kSquare,
               hxy = weighted(by_y.slope, slope) * kSquare,
               hyy = weighted(by_y.bend, value) * kSquare;
  const double x1 = glm::dot(wave_, along1), x2 = glm::dot(wave_, along2);
  const double y1 = glm::dot(across_, along1), y2 = glm::dot(across_, along2);
  return {weighted(by_y.value, value),
          {hx * x1 + hy * y1, hx * x2 + hy * y2},
          {hxx * x1 * x1 + 2 * hxy * x1 * y1 + hyy * y1 * y1,
           hxx * x1 * x2 + hxy * (x1 * y2 + x2 * y1) + hyy * y1 * y2,
           hxx * x2 * x2 + 2 * hxy * x2 * y2 + hyy * y2 * y2}};
}

/// Ridges along meridians. Their depth falls with the distance from the axis, so that their slope
/// is the same everywhere.
PlaneHeight Texture::around_axis(const Vec3& place, const Vec3& along1, const Vec3& along2) const {
  const Vec3 from = place - origin_;
  const double x = glm::dot(first_, from), y = glm::dot(second_, from);
  const double rho = std::max(std::hypot(x, y), kOnAxis);
  const Vec3 out = (x * first_ + y * second_) / rho;
  const Vec3 turn = (x * second_ - y * first_) / rho;
  const double rate = ridges_ / (kFullTurn * rho);
  const LineHeight h = profile(ridges_ * std::atan2(y, x) / kFullTurn + phase_);
  const double share = rho / radius_;
  PlaneHeight result;
  result.height = share * h.height;
  const std::array<double, 2> outwards{glm::dot(out, along1), glm::dot(out, along2)};
  const std::array<double, 2> turned{glm::dot(turn, along1), glm::dot(turn, along2)};
  for (std::size_t i = 0; i < 2; ++i)
    result.slope[i] = outwards[i] / radius_ * h.height + share * rate * turned[i] * h.slope;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t i = k == 2 ? 1 : 0, j = k == 0 ? 0 : 1;
    const double both = outwards[i] * turned[j] + outwards[j] * turned[i];
    result.bend[k] =
        turned[i] * turned[j] / (rho * radius_) * h.height + both * rate / radius_ * h.slope +
        share * (h.curvature * rate * rate * turned[i] * turned[j] - h.slope * rate / rho * both);
  }
  return result;
}

PlaneHeight Texture::at(const Vec3& place, const Vec3& along1, const Vec3& along2) const {
  if (table_) return on_tile(place, along1, along2);
  if (around_) return around_axis(place, along1, along2);
  const LineHeight h = profile(cycles(place));
  const double a = glm::dot(wave_, along1), b = glm::dot(wave_, along2);
  return {h.height,
          {h.slope * a, h.slope * b},
          {h.curvature * a * a, h.curvature * a * b, h.curvature * b * b}};
}

PlaneHeight Texture::mean_height(const Vec3& place, const Vec3& window, const Vec3& along1,
                                 const Vec3& along2) const {
  if (is_linear()) {
    const LineHeight h = mean_height(cycles(place), glm::dot(wave_, window));
    const double a = glm::dot(wave_, along1), b = glm::dot(wave_, along2);
    return {h.height,
            {h.slope * a, h.slope * b},
            {h.curvature * a * a, h.curvature * a * b, h.curvature * b * b}};
  }
  if (window == Vec3(0)) return at(place, along1, along2);
  PlaneHeight sum;
  for (int i = 0; i < kWindowPlaces; ++i) {
    const double share = (i + 0.5) / kWindowPlaces - 0.5;
    const PlaneHeight h = at(place + share * window, along1, along2);
    sum.height += h.height / kWindowPlaces;
    for (std::size_t k = 0; k < 2; ++k) sum.slope[k] += h.slope[k] / kWindowPlaces;
    for (std::size_t k = 0; k < 3; ++k) sum.bend[k] += h.bend[k] / kWindowPlaces;
  }
  return sum;
}

/// Dilation by a ball: the height of its lowest point when it rests on the profile,
/// max over a of h(x + a) + sqrt(r^2 - a^2) - r. The best of the table's values, then Newton's
/// steps: without them the curvature would be that of the rounding.
void Texture::dilate_line(double tip_radius) {
  const double r = tip_radius / period_;  // in periods, as all lengths here but heights
  const double far = std::min(r, 0.5);
  const auto drop = [&](double a) {
    return (std::sqrt(std::max(0.0, r * r - a * a)) - r) * period_;
  };
  const int reach = static_cast<int>(far * kLineValues);
  std::vector<double> plain(kLineValues), drops(static_cast<std::size_t>(reach) + 1);
  for (int i = 0; i < kLineValues; ++i)
    plain[static_cast<std::size_t>(i)] = profile(double(i) / kLineValues).height;
  for (int a = 0; a <= reach; ++a)
    drops[static_cast<std::size_t>(a)] = drop(double(a) / kLineValues);
  auto table = std::make_shared<LineTable>();
  table->heights.resize(kLineValues);
  for (int i = 0; i < kLineValues; ++i) {
    int best = 0;
    double height = -HUGE_VAL;
    for (int a = -reach; a <= reach; ++a) {
      const double here = plain[static_cast<std::size_t>((i + a + kLineValues) % kLineValues)] +
                          drops[static_cast<std::size_t>(std::abs(a))];
      if (here <= height) continue;
      height = here;
      best = a;
    }
    const double x = double(i) / kLineValues;
    double a = double(best) / kLineValues;
    for (int step = 0; step < 8; ++step) {
      const LineHeight h = profile(x + a);
      const double under = std::sqrt(std::max(0.0, r * r - a * a));
      if (!(under > 0)) break;
      const double rise = h.slope - a / under * period_;
      const double bend = h.curvature - r * r / (under * under * under) * period_;
      if (!(bend < 0)) break;
      const double next = std::clamp(a - rise / bend, -far, far);
      const double there = profile(x + next).height + drop(next);
      if (!(there > height)) break;
      height = there;
      a = next;
    }
    table->heights[static_cast<std::size_t>(i)] = std::min(0.0, height);
  }
  table->integrals.resize(kLineValues + 1);
  const std::vector<double>& h = table->heights;
  const auto value = [&](int i) {
    return h[static_cast<std::size_t>((i + kLineValues) % kLineValues)];
  };
  for (int i = 0; i < kLineValues; ++i) {
    const double slope0 = 0.5 * (value(i + 1) - value(i - 1)),
                 slope1 = 0.5 * (value(i + 2) - value(i));
    table->integrals[static_cast<std::size_t>(i) + 1] =
        table->integrals[static_cast<std::size_t>(i)] +
        (0.5 * (value(i) + value(i + 1)) + (slope0 - slope1) / 12) / kLineValues;
  }
  line_ = std::move(table);
}

void Texture::find_bounds() {
  if (table_) {
    const Vec3 x = wave_ / glm::dot(wave_, wave_), y = across_ / glm::dot(across_, across_);
    const Vec3 unit_x = glm::normalize(x), unit_y = glm::normalize(y);
    for (int j = 0; j < kTileSide; ++j) {
      for (int i = 0; i < kTileSide; ++i) {
        const Vec3 place = x * (double(i) / kTileSide - phase_) + y * (double(j) / kTileSide);
        const PlaneHeight h = on_tile(place, unit_x, unit_y);
        greatest_slope_ = std::max(greatest_slope_, std::hypot(h.slope[0], h.slope[1]));
        const double mean = 0.5 * (h.bend[0] + h.bend[2]),
                     apart = std::hypot(0.5 * (h.bend[0] - h.bend[2]), h.bend[1]);
        greatest_curvature_ = std::max(greatest_curvature_, mean + apart);
      }
    }
    greatest_slope_ *= kTableMargin;
    return;
  }
  for (int i = 0; i < kLineValues; ++i) {
    const LineHeight h = profile(double(i) / kLineValues);
    greatest_slope_ = std::max(greatest_slope_, std::abs(h.slope) / period_);
    greatest_curvature_ = std::max(greatest_curvature_, h.curvature / (period_ * period_));
  }
  if (kind_ == TextureSpec::Kind::trapezoid || line_) greatest_slope_ *= kLineMargin;
  if (around_) greatest_slope_ += depth_ / radius_;
}

}  // namespace palpate::stimuli
