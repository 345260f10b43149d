#pragma once
// Height profiles of textured surfaces: h <= 0, carved into an object's surface, 0 at a crest. Pure
// functions of a place in the object's frame (a solid texture: nothing is unwrapped). SI units.

#include <array>
#include <cstdint>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "stimuli/shapes.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {

/// A height along a line and its derivatives by the line's coordinate.
struct LineHeight {
  double height = 0;     ///< m, <= 0
  double slope = 0;      ///< m by unit of the coordinate
  double curvature = 0;  ///< m by its square
};

inline constexpr double kFullTurn = 2 * std::numbers::pi;

/// The nearest whole number; |x| < 2^51. Quicker than a call of the library.
inline double nearest_whole(double x) {
  constexpr double kShift = 6755399441055744;  // 1.5 * 2^52: beyond it doubles are whole
  return (x + kShift) - kShift;
}

/// Cosine and sine of an angle in turns, by their series over an eighth of a turn: exact to
/// rounding, the same on every machine, and quicker than the library's.
struct CosineAndSine {
  double cosine, sine;
};
inline CosineAndSine of_turns(double turns) {
  const double quarters = nearest_whole(4 * turns);
  const double x = kFullTurn * (turns - 0.25 * quarters), x2 = x * x;
  // Estrin's order: short chains.
  const double x4 = x2 * x2, x8 = x4 * x4;
  const double sine =
      x + x * x2 *
              (((-1.0 / 6 + x2 * (1.0 / 120)) + x4 * (-1.0 / 5040 + x2 * (1.0 / 362880))) +
               x8 * ((-1.0 / 39916800 + x2 * (1.0 / 6227020800)) - x4 * (1.0 / 1307674368000)));
  const double cosine =
      1 + x2 * (((-1.0 / 2 + x2 * (1.0 / 24)) + x4 * (-1.0 / 720 + x2 * (1.0 / 40320))) +
                x8 * ((-1.0 / 3628800 + x2 * (1.0 / 479001600)) +
                      x4 * (-1.0 / 87178291200 + x2 * (1.0 / 20922789888000))));
  // A selection without a branch, which could not be predicted.
  constexpr std::array<double, 4> kSigns{1, 1, -1, -1};
  const auto quarter = static_cast<std::uint64_t>(static_cast<std::int64_t>(quarters));
  const bool swapped = (quarter & 1) != 0;
  return {kSigns[(quarter + 1) & 3] * (swapped ? sine : cosine),
          kSigns[quarter & 3] * (swapped ? cosine : sine)};
}

/// A sine from 0 to -2 `half`, by turns from a crest.
struct SineHeight {
  double half = 0, middle = 0;  ///< m; its mean is -middle
  LineHeight operator()(double cycles) const {
    const auto [cosine, sine] = of_turns(cycles);
    const double wave = half * cosine;
    return {wave - middle, -kFullTurn * half * sine, -kFullTurn * kFullTurn * wave};
  }
};

/// A height over two directions in a surface, and its derivatives by them.
struct PlaneHeight {
  double height = 0;              ///< m, <= 0
  std::array<double, 2> slope{};  ///< along the first and the second
  std::array<double, 3> bend{};   ///< second derivatives: 11, 12, 22, 1/m
};

/// A texture, ready for ticks: nothing here allocates but the constructor. Its frame is the
/// object's; in_frame gives the same texture as a mesh in that object sees it.
class Texture {
 public:
  /// \param radius  m, of the object about +z; `around` only
  /// \throws std::invalid_argument with what is expected: an image that cannot be read, a ridge and
  /// flanks longer than the period
  explicit Texture(const TextureSpec& spec, double radius = 0);

  /// \param frame  pose of the new frame in this texture's
  Texture in_frame(const Pose& frame) const;

  /// Whether both give the same heights everywhere, to the bit.
  bool same_as(const Texture& other) const;

  double depth() const { return depth_; }    ///< m, from crest to valley, before dilation
  double period() const { return period_; }  ///< m; `around`: of the whole number of ridges
  double greatest_slope() const { return greatest_slope_; }  ///< of the height over the surface
  /// 1/m, the greatest second derivative of the height, in a valley.
  double greatest_curvature() const { return greatest_curvature_; }

  /// Whether it depends on one coordinate, cycles(place), alone.
  bool is_linear() const { return !table_ && !around_; }
  /// 1/m; its direction is that across the ridges, its length 1 / period. Linear textures.
  const Vec3& wave() const { return wave_; }
  /// Periods from a crest. Linear textures.
  double cycles(const Vec3& place) const;
  /// Whether it is a sine by its formula.
  bool is_sine() const { return kind_ == TextureSpec::Kind::sine && !line_ && !around_; }
  /// Its mean over cycles - span/2 to cycles + span/2. Sines by formula.
  SineHeight mean_sine(double span) const;
  /// The mean over cycles - span/2 to cycles + span/2; its derivatives by cycles. Linear textures.
  LineHeight mean_height(double cycles, double span) const;

  /// The mean over place - window/2 to place + window/2, with derivatives along two vectors.
  /// Windows of textures that are not linear are sampled at 32 places.
  PlaneHeight mean_height(const Vec3& place, const Vec3& window, const Vec3& along1,
                          const Vec3& along2) const;

 private:
  /// One period of a profile by values at equal distances, with cubics between them.
  struct LineTable {
    std::vector<double> heights, integrals;  ///< m; m times cycles from 0
  };
  /// One tile of a profile in two dimensions, likewise.
  struct TileTable {
    std::vector<double> heights;  ///< m, row by row
  };
  LineHeight profile(double cycles) const;
  LineHeight trapezoid(double cycles) const;
  double integral(double cycles) const;
  PlaneHeight at(const Vec3& place, const Vec3& along1, const Vec3& along2) const;
  PlaneHeight on_tile(const Vec3& place, const Vec3& along1, const Vec3& along2) const;
  PlaneHeight around_axis(const Vec3& place, const Vec3& along1, const Vec3& along2) const;
  void dilate_line(double tip_radius);
  void find_bounds();

  TextureSpec::Kind kind_ = TextureSpec::Kind::sine;
  double depth_ = 0, period_ = 0;
  double ridge_ = 0, ramp_ = 0;  ///< in periods
  double phase_ = 0;             ///< in periods
  double greatest_slope_ = 0, greatest_curvature_ = 0;
  Vec3 wave_, origin_;
  Vec3 across_;  ///< 1/m; of tiles: the second direction, by a tile's height
  bool around_ = false;
  double ridges_ = 0, radius_ = 0;          ///< around
  Vec3 axis_, first_, second_;              ///< around: +z, +x and +y
  std::shared_ptr<const LineTable> line_;   ///< null: by formula
  std::shared_ptr<const TileTable> table_;  ///< null: one-dimensional
};

/// Side of a tile's table, in values.
inline constexpr int kTileSide = 512;

/// The heights of a tile of cones, noise or an image, row by row, 0 to -depth, m, dilated by the
/// tip. \param side  m, of the tile; an image's height follows from its picture
/// \throws std::invalid_argument an image that cannot be read
std::vector<double> tile_heights(const TextureSpec& spec, double side, double& height);

/// "sine", ...
const char* to_string(TextureSpec::Kind kind);

/// "sine of 2 mm, 0.4 mm deep"
std::string in_words(const TextureSpec& spec);

/// m, along the ridges' direction: of a tile.
double tile_side(const TextureSpec& spec);

/// m: flat tops and flanks of trapezoids and cones, with their defaults.
double ridge_of(const TextureSpec& spec);
double ramp_of(const TextureSpec& spec);

/// The greatest slope that a spec asks for, before its tip: pi depth / period for a sine, 1.5 depth
/// / ramp for flanks; 0 for noise and images, whose slope is known from their table.
double asked_slope(const TextureSpec& spec);

}  // namespace palpate::stimuli
