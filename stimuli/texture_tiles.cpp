#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "data/base/random.h"
#include "stimuli/texture.h"

#ifdef PALPATE_PNG
#include <png.h>
#endif

namespace palpate::stimuli {
namespace {

constexpr int kCones = 16;            // along each side of a tile
constexpr double kWavesOfNoise = 16;  // periods of the longest wave, by default
constexpr auto kSide = static_cast<std::size_t>(kTileSide);

/// Truncated cones on a square grid, jittered, with tops of ridge_m and flanks of ramp_m.
std::vector<double> cones(const TextureSpec& spec) {
  Random random(spec.seed);
  const double free = std::max(0.0, 1 - ridge_of(spec) / spec.period);
  std::vector<std::pair<double, double>> centres;
  for (int j = 0; j < kCones; ++j) {
    for (int i = 0; i < kCones; ++i) {
      const double dx = random.unit() - 0.5, dy = random.unit() - 0.5;
      centres.emplace_back(i + spec.jitter * free * dx, j + spec.jitter * free * dy);
    }
  }
  const double top = 0.5 * ridge_of(spec) / spec.period, ramp = ramp_of(spec) / spec.period;
  std::vector<double> heights(kSide * kSide, -spec.depth);
  const double step = double{kCones} / kTileSide;
  const int reach = static_cast<int>(std::ceil((top + ramp) / step)) + 1;
  for (const auto& [x, y] : centres) {
    const int ci = static_cast<int>(std::round(x / step)),
              cj = static_cast<int>(std::round(y / step));
    for (int j = cj - reach; j <= cj + reach; ++j) {
      for (int i = ci - reach; i <= ci + reach; ++i) {
        const double along =
            std::clamp((std::hypot(i * step - x, j * step - y) - top) / ramp, 0.0, 1.0);
        const auto wrap = [](int k) {
          return static_cast<std::size_t>((k % kTileSide + kTileSide) % kTileSide);
        };
        double& height = heights[wrap(j) * kSide + wrap(i)];
        height = std::max(height, -spec.depth * along * along * (3 - 2 * along));
      }
    }
  }
  return heights;
}

/// A sum of waves that fit into the tile, of wavelengths period_m to longest_m and amplitudes as
/// 1 / f^exponent; its range is the depth.
std::vector<double> noise(const TextureSpec& spec, double side) {
  using Complex = std::complex<double>;
  Random random(spec.seed);
  const double most = side / spec.period, least = side / spec.longest.value_or(side);
  const int reach = static_cast<int>(std::floor(most));
  const auto waves = static_cast<std::size_t>(reach) + 1;
  const auto columns = 2 * waves - 1;
  std::vector<Complex> amplitude(waves * columns);
  for (int a = 0; a <= reach; ++a) {
    for (int b = -reach; b <= reach; ++b) {
      const Complex drawn(random.normal(), random.normal());
      const double f = std::hypot(a, b);
      if (f < least - 1e-9 || f > most + 1e-9 || f == 0) continue;
      amplitude[static_cast<std::size_t>(a) * columns + static_cast<std::size_t>(b + reach)] =
          drawn * std::pow(f, -spec.exponent);
    }
  }
  std::vector<Complex> turns(kSide);
  for (std::size_t i = 0; i < kSide; ++i)
    turns[i] = std::polar(1.0, 2 * std::numbers::pi * static_cast<double>(i) / kTileSide);
  const auto turn = [&](int by) {
    return turns[static_cast<std::size_t>((by % kTileSide + kTileSide) % kTileSide)];
  };
  std::vector<double> heights(kSide * kSide);
  std::vector<Complex> row(waves);
  for (int y = 0; y < kTileSide; ++y) {
    for (int a = 0; a <= reach; ++a) {
      Complex& sum = row[static_cast<std::size_t>(a)] = 0;
      for (int b = -reach; b <= reach; ++b)
        sum +=
            amplitude[static_cast<std::size_t>(a) * columns + static_cast<std::size_t>(b + reach)] *
            turn(b * y);
    }
    for (int x = 0; x < kTileSide; ++x) {
      double height = 0;
      for (int a = 0; a <= reach; ++a)
        height += (row[static_cast<std::size_t>(a)] * turn(a * x)).real();
      heights[static_cast<std::size_t>(y) * kSide + static_cast<std::size_t>(x)] = height;
    }
  }
  const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
  const double bottom = *low, top = *high, range = top - bottom;
  for (double& height : heights) height = range > 0 ? spec.depth * (height - top) / range : 0;
  return heights;
}

struct Picture {
  std::size_t width = 0, height = 0;
  std::vector<double> grey;  ///< 0 to 1, row by row
};

Picture read_picture([[maybe_unused]] const std::string& bytes) {
#ifdef PALPATE_PNG
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()) == 0)
    throw std::invalid_argument(std::string("expected a PNG file: ") + image.message);
  constexpr std::uint32_t kMostPixels = 1U << 26;
  if (image.width == 0 || image.height == 0 || image.width > kMostPixels / image.height) {
    png_image_free(&image);
    throw std::invalid_argument("expected a PNG file of 1 to 67 million pixels");
  }
  image.format = PNG_FORMAT_GRAY;  // 8 bits, as they are in the file
  std::vector<std::uint8_t> pixels(std::size_t{image.width} * image.height);
  const std::size_t width = image.width, height = image.height;
  if (png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr) == 0)
    throw std::invalid_argument(std::string("expected a PNG file: ") + image.message);
  Picture picture{width, height, std::vector<double>(pixels.size())};
  for (std::size_t i = 0; i < pixels.size(); ++i) picture.grey[i] = pixels[i] / 255.0;
  return picture;
#else
  throw std::invalid_argument("expected another kind: this program was built without libpng");
#endif
}

/// The picture's mean over each cell of the table. Its upper edge is at the end of the tile.
std::vector<double> image(const TextureSpec& spec, double side, double& height) {
  if (spec.file_bytes == nullptr) throw std::invalid_argument("expected a PNG file");
  const Picture picture = read_picture(*spec.file_bytes);
  height = side * static_cast<double>(picture.height) / static_cast<double>(picture.width);
  std::vector<double> heights(kSide * kSide);
  const auto range = [](std::size_t cell, std::size_t pixels) {
    const std::size_t first = cell * pixels / kSide;
    return std::pair(first, std::max(first + 1, (cell + 1) * pixels / kSide));
  };
  for (std::size_t y = 0; y < kSide; ++y) {
    const auto [low, high] = range(kSide - 1 - y, picture.height);
    for (std::size_t x = 0; x < kSide; ++x) {
      const auto [left, right] = range(x, picture.width);
      double sum = 0;
      for (std::size_t j = low; j < high; ++j) {
        for (std::size_t i = left; i < right; ++i) sum += picture.grey[j * picture.width + i];
      }
      const double mean = sum / static_cast<double>((high - low) * (right - left));
      heights[y * kSide + x] = spec.depth * (mean - 1);
    }
  }
  return heights;
}

/// Dilation by a ball, on the table's places.
std::vector<double> dilated(const std::vector<double>& plain, double radius, double depth,
                            double width, double height) {
  const double dx = width / kTileSide, dy = height / kTileSide;
  // Farther out the ball's surface is above every crest.
  const double far = radius <= depth ? radius : std::sqrt(depth * (2 * radius - depth));
  const int nx = std::min(kTileSide / 2, static_cast<int>(far / dx)),
            ny = std::min(kTileSide / 2, static_cast<int>(far / dy));
  std::vector<double> out = plain;
  for (int b = -ny; b <= ny; ++b) {
    for (int a = -nx; a <= nx; ++a) {
      const double away2 = a * dx * (a * dx) + b * dy * (b * dy);
      if (away2 > far * far) continue;
      const double drop = std::sqrt(radius * radius - away2) - radius;
      for (int y = 0; y < kTileSide; ++y) {
        const auto from = static_cast<std::size_t>((y + b + kTileSide) % kTileSide) * kSide;
        double* const to = &out[static_cast<std::size_t>(y) * kSide];
        for (int x = 0; x < kTileSide; ++x) {
          const auto at = static_cast<std::size_t>((x + a + kTileSide) % kTileSide);
          to[x] = std::max(to[x], plain[from + at] + drop);
        }
      }
    }
  }
  return out;
}

}  // namespace

double tile_side(const TextureSpec& spec) {
  switch (spec.kind) {
    case TextureSpec::Kind::cones:
      return kCones * spec.period;
    case TextureSpec::Kind::noise:
      return spec.longest.value_or(kWavesOfNoise * spec.period);
    case TextureSpec::Kind::sine:
    case TextureSpec::Kind::trapezoid:
    case TextureSpec::Kind::image:
      return spec.period;
  }
  return spec.period;
}

std::vector<double> tile_heights(const TextureSpec& spec, double side, double& height) {
  std::vector<double> heights;
  height = side;
  if (spec.kind == TextureSpec::Kind::cones) {
    heights = cones(spec);
  } else if (spec.kind == TextureSpec::Kind::noise) {
    heights = noise(spec, side);
  } else {
    heights = image(spec, side, height);
  }
  if (!(spec.tip_radius > 0 && spec.depth > 0)) return heights;
  return dilated(heights, spec.tip_radius, spec.depth, side, height);
}

}  // namespace palpate::stimuli
