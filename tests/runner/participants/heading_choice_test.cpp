// Choices of headings against the definition, written out once more in double precision.

#include "runner/participants/heading_choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "runner/evidence/tick_meters.h"
#include "tests/runner/participants/ideal_touches.h"

namespace palpate::runner::participants {
namespace {

using test::by_movement;
using test::DeepestReference;
using test::four_shapes;

std::size_t shape_of(const ShapeHypotheses& hypotheses, int h) {
  std::size_t s = 0;
  while (h >= hypotheses.shapes()[s].first + hypotheses.shapes()[s].count) ++s;
  return s;
}

/// Mean entropy of the shapes after the contacts predicted along a heading.
double expected_entropy(const ShapeHypotheses& hypotheses, const ObserverSettings& o,
                        const HeadingSettings& settings, const std::vector<int>& drawn,
                        const SlidingStylus& stylus, const Vec3& heading) {
  const auto predicted = [&](int h, double ahead) {
    const Mat3 r = hypotheses.rotation(h);
    const stimuli::ObjectSpec object = four_shapes()[shape_of(hypotheses, h)];
    const Vec3 tip = stylus.tip + ahead * heading, tail = stylus.tail + ahead * heading;
    if (stylus.ray) return test::deepest_on_segment(object, r, tip, tail);
    const stimuli::SurfaceDistance at = test::turned_distance(object, r, tip);
    return DeepestReference{at.distance, 0, at.normal};
  };
  const std::size_t n = drawn.size();
  std::vector<std::vector<DeepestReference>> seen(static_cast<std::size_t>(settings.places));
  const double step = settings.look_ahead / settings.places;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    for (const int h : drawn) seen[k].push_back(predicted(h, step * (static_cast<double>(k) + 1)));
  }
  const auto square = [](double x) { return x * x; };
  const double v = square(o.contact_sd) + square(o.model_contact_sd);
  const double kappa = 1 / (square(o.direction_sd) + square(o.model_direction_sd));
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) {
    double shapes[4] = {};
    for (std::size_t j = 0; j < n; ++j) {
      double log_likelihood = 0;
      for (std::size_t k = 0; k < seen.size(); ++k) {
        const DeepestReference &a = seen[k][i], &b = seen[k][j];
        const Vec3 before = k == 0 ? stylus.normal : seen[k - 1][i].normal;
        const double turned = std::acos(std::clamp(glm::dot(a.normal, before), -1.0, 1.0));
        double l =
            -square(b.distance - a.distance) / (2 * v) + kappa * (glm::dot(a.normal, b.normal) - 1);
        if (stylus.ray) {
          l += std::max(-square((b.along - a.along) / o.along_sd) / 2, std::log(o.torque_floor));
        }
        log_likelihood += (1 - std::exp(-(step + o.turn_length * turned) / o.movement_scale)) *
                          std::max(l, o.floor);
      }
      shapes[shape_of(hypotheses, drawn[j])] += std::exp(log_likelihood);
    }
    const double total = shapes[0] + shapes[1] + shapes[2] + shapes[3];
    for (const double mass : shapes) {
      if (mass > 0) sum -= mass / total * std::log(mass / total);
    }
  }
  return sum / static_cast<double>(n);
}

struct Choice {
  SlidingStylus stylus;
  Vec3 chosen;
  std::vector<double> entropies;  ///< of the headings at 0, 1, 2, ... steps to the left
  int steps;                      ///< of the chosen heading to the left; -1: none of the headings
};

/// After some touches of an object: the heading chosen by a sliding hand.
Choice choose_on(std::size_t shape, bool ray, int touches, std::uint64_t seed,
                 const ShapeHypotheses& hypotheses, const HeadingSettings& settings) {
  const ObserverSettings o = by_movement();
  ShapeObserver observer(hypotheses, o);
  HeadingChoice choice(hypotheses, o, settings);
  Random random(seed);
  Percept percept;
  for (int i = 0; i <= touches; ++i) {
    percept = test::touch(four_shapes()[shape], Mat3(1), ray, 0.003, 0.2, random);
    percept.moved = 0.01;
    percept.turned = 0.1;
    if (i < touches) observer.update(percept);
  }
  const Vec3 across = glm::cross(percept.direction, test::random_direction(random));
  Choice made;
  made.stylus = {ray, percept.tip, percept.tail, percept.direction, glm::normalize(across)};
  Random for_choice(seed + 1), for_reference(seed + 1);
  made.chosen = choice.choose(observer, made.stylus, for_choice);
  std::vector<int> drawn(static_cast<std::size_t>(settings.hypotheses));
  observer.draw(for_reference, drawn);
  made.steps = -1;
  for (int step = 0; step < settings.headings; ++step) {
    const double angle = 2 * std::numbers::pi * step / settings.headings;
    const Vec3 heading = std::cos(angle) * made.stylus.heading +
                         std::sin(angle) * glm::cross(made.stylus.normal, made.stylus.heading);
    made.entropies.push_back(
        expected_entropy(hypotheses, o, settings, drawn, made.stylus, heading));
    if (glm::length(heading - made.chosen) < 1e-9) made.steps = step;
  }
  return made;
}

TEST(HeadingChoice, TakesTheMostInformativeHeading) {
  const ShapeHypotheses hypotheses(four_shapes());
  int turned = 0;
  double gained = 0;
  for (const bool ray : {false, true}) {
    for (std::uint64_t seed = 1; seed <= 24; ++seed) {
      const Choice made =
          choose_on(seed % 4, ray, static_cast<int>(seed % 5), seed, hypotheses, {});
      ASSERT_GE(made.steps, 0) << "none of the headings";
      const double least = *std::min_element(made.entropies.begin(), made.entropies.end());
      // Predictions are in single precision, and within 0.1 mm along the stylus.
      EXPECT_NEAR(made.entropies[static_cast<std::size_t>(made.steps)], least, 0.002)
          << "ray " << ray << ", seed " << seed;
      turned += made.steps != 0 ? 1 : 0;
      gained += made.entropies[0] - least;
    }
  }
  EXPECT_GT(turned, 12) << "nothing was chosen";
  EXPECT_GT(gained / 48, 0.01) << "no heading tells more than another";
}

TEST(HeadingChoice, TakesAnyNumbersOfHeadingsPlacesAndHypotheses) {
  const ShapeHypotheses hypotheses(four_shapes());
  for (const auto& [headings, places, drawn] : {std::array{2, 1, 2}, {3, 8, 7}, {64, 1, 31}}) {
    HeadingSettings settings;
    settings.headings = headings;
    settings.places = places;
    settings.hypotheses = drawn;
    settings.look_ahead = 0.04;
    for (std::uint64_t seed = 50; seed < 53; ++seed) {
      const Choice made = choose_on(seed % 4, seed % 2 == 0, 1, seed, hypotheses, settings);
      ASSERT_GE(made.steps, 0);
      EXPECT_NEAR(made.entropies[static_cast<std::size_t>(made.steps)],
                  *std::min_element(made.entropies.begin(), made.entropies.end()), 0.002);
    }
  }
}

TEST(HeadingChoice, GoesStraightOnIfOneShapeIsCertain) {
  const ShapeHypotheses hypotheses(four_shapes());
  const Choice made = choose_on(0, false, 300, 3, hypotheses, {});
  EXPECT_EQ(made.chosen, made.stylus.heading);
}

TEST(HeadingChoice, AllocatesNothing) {
  if (!evidence::counts_allocations()) GTEST_SKIP() << "a sanitizer brings its own operator new";
  const ShapeHypotheses hypotheses(four_shapes());
  ShapeObserver observer(hypotheses, by_movement());
  HeadingChoice choice(hypotheses, by_movement(), {});
  constexpr std::uint64_t kSeed = 4;
  Random random(kSeed);
  for (const bool ray : {false, true}) {
    const SlidingStylus stylus{ray, {0, 0, 0.03}, {0, 0.05, 0.13}, {0, 0, 1}, {1, 0, 0}};
    const std::uint64_t before = evidence::allocations();
    choice.choose(observer, stylus, random);
    EXPECT_EQ(evidence::allocations(), before) << ray;
  }
}

TEST(HeadingChoice, NamesEverySettingThatIsOutOfRange) {
  const ShapeHypotheses hypotheses(four_shapes());
  HeadingSettings settings;
  settings.interval = 0;
  settings.turning_time = -1;
  settings.hypotheses = 33;
  settings.headings = 1;
  settings.places = 0;
  settings.look_ahead = 0;
  try {
    const HeadingChoice choice(hypotheses, {}, settings);
    FAIL() << "was taken";
  } catch (const std::invalid_argument& error) {
    const std::string what = error.what();
    for (const char* name :
         {"interval", "turning_time", "hypotheses", "headings", "places", "look_ahead"}) {
      EXPECT_NE(what.find(name), std::string::npos) << name << " in: " << what;
    }
  }
}

}  // namespace
}  // namespace palpate::runner::participants
