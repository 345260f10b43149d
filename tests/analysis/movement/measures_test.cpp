// Measures of movement against closed forms, and what must not change them.

#include "analysis/movement/measures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>

#include "analysis/movement/coverage.h"
#include "analysis/movement/pictures.h"
#include "analysis/movement/signal.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {

constexpr double kPi = std::numbers::pi;

std::vector<double> bell() {
  std::vector<double> speed;
  for (int i = 0; i < 200; ++i) {
    const double t = -1 + 0.01 * i;
    speed.push_back(std::exp(-5 * t * t));
  }
  return speed;
}

std::vector<Vec3> circle(double angle, double radius, std::size_t ticks) {
  std::vector<Vec3> path;
  for (std::size_t i = 0; i < ticks; ++i) {
    const double a = angle * static_cast<double>(i) / static_cast<double>(ticks - 1);
    path.emplace_back(radius * std::cos(a), radius * std::sin(a), 0);
  }
  return path;
}

std::vector<Vec3> minimum_jerk(std::size_t ticks) {
  std::vector<Vec3> path;
  for (std::size_t i = 0; i < ticks; ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(ticks - 1);
    path.emplace_back(t * t * t * (10 + t * (-15 + 6 * t)), 0, 0);
  }
  return path;
}

/// Evenly on a sphere by latitude and longitude.
std::vector<SurfaceTriangle> sphere(double radius) {
  constexpr int kAround = 90, kDown = 45;
  const auto at = [radius](int i, int j) {
    const double a = 2 * kPi * i / kAround, b = kPi * j / kDown;
    return radius * Vec3(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b));
  };
  std::vector<SurfaceTriangle> surface;
  for (int i = 0; i < kAround; ++i) {
    for (int j = 0; j < kDown; ++j) {
      surface.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      surface.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
    }
  }
  return surface;
}

double value(const MeasureValues& values, const char* name) {
  const auto& found = values[measure_named(name)];
  EXPECT_TRUE(found.has_value()) << name;
  return found.value_or(std::nan(""));
}

/// To and fro over the top of a sphere of 30 mm, pressed by a changing force, off it now and then.
MovementTrial strokes_on_a_sphere(std::size_t ticks, double rate) {
  MovementTrial trial;
  trial.rate = rate;
  for (std::size_t i = 0; i < ticks; ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(ticks);
    const double a = std::sin(12 * kPi * t), b = 0.4 * std::sin(2 * kPi * t + 0.3);
    const Vec3 normal = glm::normalize(Vec3(std::sin(a) * std::cos(b), std::sin(b), std::cos(a)));
    const bool contact = i % (ticks / 5) > ticks / 20;
    trial.tip.push_back((contact ? 0.03 : 0.032) * normal);
    trial.contact.push_back(contact);
    trial.point.push_back(0.03 * normal);
    trial.normal.push_back(normal);
    trial.force.push_back((1 + 0.5 * std::sin(60 * kPi * t)) * normal + Vec3(0.1, 0, 0));
    trial.on_edge.push_back(a > 0.8);
  }
  return trial;
}

TEST(Smoothness, ABellHasThePublishedValues) {
  EXPECT_NEAR(*sparc(bell(), 100), -1.41403, 1e-5);
  EXPECT_NEAR(*log_dimensionless_jerk_of_speed(bell(), 100), -5.81636, 1e-5);
}

TEST(Smoothness, MinimumJerkConvergesToItsClosedForm) {
  const double exact = -std::log(720 / (1.875 * 1.875));
  double before = 1;
  for (const std::size_t ticks : {100U, 1000U, 4000U}) {
    const double off = std::abs(
        *log_dimensionless_jerk(minimum_jerk(ticks), static_cast<double>(ticks - 1)) - exact);
    EXPECT_LT(off, before / 3);
    before = off;
  }
  EXPECT_LT(before, 0.01);
}

TEST(Smoothness, ACircleHasTheJerkOfItsAngle) {
  for (const double angle : {2.0, 3 * kPi}) {
    EXPECT_NEAR(*log_dimensionless_jerk(circle(angle, 0.02, 4001), 1000), -4 * std::log(angle),
                0.005);
  }
}

TEST(Smoothness, DoesNotDependOnSizeOrDuration) {
  std::vector<double> larger = bell();
  for (double& v : larger) v *= 7;
  EXPECT_NEAR(*sparc(larger, 100), *sparc(bell(), 100), 1e-12);
  const auto path = minimum_jerk(500);
  EXPECT_NEAR(*log_dimensionless_jerk(path, 1000), *log_dimensionless_jerk(path, 250), 1e-9);
  EXPECT_NEAR(*log_dimensionless_jerk_of_speed(bell(), 100),
              *log_dimensionless_jerk_of_speed(bell(), 300), 1e-9);
}

TEST(Smoothness, NothingThatMovesHasNoValue) {
  EXPECT_FALSE(sparc(std::vector<double>(50, 0.0), 100));
  EXPECT_FALSE(sparc({}, 100));
  EXPECT_FALSE(log_dimensionless_jerk(std::vector<Vec3>(50, Vec3(1)), 100));
  EXPECT_TRUE(movements(std::vector<double>(500, 0.0), 1000).empty());
}

TEST(Smoothness, PeaksNeedTheirProminence) {
  EXPECT_EQ(peaks({0, 1, 0, 1, 1, 0}, 0.5), 2U);
  EXPECT_EQ(peaks({0, 1, 0.8, 1, 0}, 0.5), 1U);
  EXPECT_EQ(peaks({1, 0, 1}, 0.5), 0U);  // the ends are no maxima
}

TEST(Smoothness, MovementsLastLongEnough) {
  std::vector<double> speed(1000, 0.0);
  for (std::size_t i = 100; i < 200; ++i) speed[i] = 1;
  for (std::size_t i = 500; i < 599; ++i) speed[i] = 1;
  EXPECT_EQ(movements(speed, 1000), (std::vector<Stretch>{{100, 200}}));
}

TEST(Signal, FilterLosesThreeDecibelAtTheCutOff) {
  std::vector<double> wave;
  for (int i = 0; i < 8000; ++i) wave.push_back(std::sin(2 * kPi * 20 * i / 1000.0));
  const std::vector<double> passed = low_pass(wave, 1000, 20);
  const double greatest = *std::max_element(passed.begin() + 2000, passed.end() - 2000);
  EXPECT_NEAR(greatest, std::sqrt(0.5), 0.005);
  EXPECT_EQ(low_pass(wave, 1000, 0), wave);
  for (const double v : low_pass(std::vector<double>(30, 2.5), 1000, 20)) EXPECT_NEAR(v, 2.5, 1e-9);
}

TEST(Signal, FilterRemovesThePathThatNoiseAdds) {
  constexpr std::uint64_t kSeed = 7;
  Random random(kSeed);
  std::vector<Vec3> rest;
  for (int i = 0; i < 20000; ++i)
    rest.push_back(30e-6 * Vec3(random.normal(), random.normal(), random.normal()));
  EXPECT_NEAR(path_length(rest) / 20, 4 * 30e-6 * 1000 / std::sqrt(kPi), 0.001);
  EXPECT_LT(path_length(low_pass(rest, 1000, 20)) / 20, 0.0025);
}

TEST(Contacts, EpisodesJoinShortGapsAndDropTouches) {
  std::vector<bool> contact(1000, false);
  const auto set = [&](std::size_t begin, std::size_t end) {
    std::fill(contact.begin() + static_cast<std::ptrdiff_t>(begin),
              contact.begin() + static_cast<std::ptrdiff_t>(end), true);
  };
  set(100, 110);
  set(159, 200);  // 49 ms later
  set(250, 300);  // 50 ms later
  set(500, 519);  // 19 ms
  set(700, 720);
  EXPECT_EQ(contact_episodes(contact, 1000),
            (std::vector<Stretch>{{100, 200}, {250, 300}, {700, 720}}));
}

TEST(Contacts, CircleIsOneStrokeToAndFroTwo) {
  const std::vector<bool> all(1000, true);
  EXPECT_EQ(strokes(all, {}, circle(3 * kPi, 0.02, 1000), 1000), 1U);
  std::vector<Vec3> back;
  for (int i = 0; i < 1000; ++i) back.emplace_back(0.0001 * (i < 500 ? i : 1000 - i), 0, 0);
  EXPECT_EQ(strokes(all, {}, back, 1000), 2U);
  EXPECT_EQ(strokes(all, {{400, 600}}, back, 1000), 2U);
  EXPECT_EQ(strokes(std::vector<bool>(1000, false), {}, back, 1000), 0U);
}

TEST(Contacts, StopsAreSlowForLongEnough) {
  std::vector<double> speed(300, 0.1);
  std::fill(speed.begin() + 100, speed.begin() + 150, 0.004);
  std::fill(speed.begin() + 200, speed.begin() + 249, 0.004);
  EXPECT_EQ(stops(std::vector<bool>(300, true), speed, 1000), (std::vector<Stretch>{{100, 150}}));
  EXPECT_TRUE(stops(std::vector<bool>(300, false), speed, 1000).empty());
}

TEST(Contacts, ClassifiesProceduresBySpeedForceAndEdge) {
  const auto window = [](double speed, double least, double most, bool edge) {
    std::vector<ContactMotion> ticks(100, {speed, least, edge});
    ticks[50].normal_force = most;
    return procedure_of(ticks);
  };
  EXPECT_EQ(window(0.02, 1, 1, true), Procedure::contour);
  EXPECT_EQ(window(0.02, 1, 2, false), Procedure::lateral);
  EXPECT_EQ(window(0.001, 1, 1.5, true), Procedure::pressure);
  EXPECT_EQ(window(0.001, 1, 1.2, false), Procedure::stationary);
}

TEST(Coverage, CapAndBandCoverTheirShares) {
  const TouchedSurface surface(draw_places(sphere(0.03), TouchedSurface::kPlaces));
  EXPECT_NEAR(surface.coverage({{0, 0, 0.03}}).back(), 25.0 / 3600, 0.003);
  EXPECT_NEAR(surface.coverage(circle(2 * kPi, 0.03, 2000)).back(),
              std::sin(2 * std::asin(1.0 / 12)), 0.012);
  EXPECT_EQ(surface.coverage({{1, 1, 1}, {-9, 0, 0}}).back(), 0);
  EXPECT_EQ(surface.coverage(surface.places()).back(), 1);
}

TEST(Coverage, PartsAreEqual) {
  const TouchedSurface surface(draw_places(sphere(0.03), TouchedSurface::kPlaces));
  std::vector<std::size_t> parts, counts(TouchedSurface::kParts);
  for (const Vec3& place : surface.places()) {
    parts.push_back(surface.part_of(place));
    ++counts.at(parts.back());
  }
  for (const std::size_t count : counts) EXPECT_NEAR(static_cast<double>(count), 156.25, 1);
  EXPECT_NEAR(*entropy(parts), 1, 1e-3);
  EXPECT_EQ(*entropy(std::vector<std::size_t>(50, 3)), 0);
  EXPECT_FALSE(entropy({}));
  EXPECT_EQ(transitions({1, 1, 2, 1}), 2U);
}

TEST(Measures, RotationOfTheWorldChangesNothing) {
  const MovementTrial trial = strokes_on_a_sphere(4000, 1000);
  MovementTrial turned = trial;
  const Quat turn = glm::normalize(Quat(0.3, -0.5, 0.7, 0.2));
  for (auto* vectors : {&turned.tip, &turned.point, &turned.normal, &turned.force}) {
    for (Vec3& vector : *vectors) vector = turn * vector;
  }
  const TouchedSurface surface(draw_places(sphere(0.03), TouchedSurface::kPlaces));
  std::vector<Vec3> places = surface.places();
  for (Vec3& place : places) place = turn * place;
  const TouchedSurface turned_surface(places);
  const MeasureValues one = measure(trial, &surface, {}),
                      other = measure(turned, &turned_surface, {});
  for (std::size_t i = 0; i < kMeasures; ++i) {
    const std::string name = measure_definitions()[i].name;
    if (name == "entropy" || name == "transitions") continue;  // the parts lie along the axes
    ASSERT_EQ(one[i].has_value(), other[i].has_value()) << name;
    if (one[i]) {
      EXPECT_NEAR(*one[i], *other[i], 1e-6 * (1 + std::abs(*one[i]))) << name;
    }
  }
}

TEST(Measures, HalfTheTimeDoublesSpeedsAndKeepsShares) {
  MovementTrial trial = strokes_on_a_sphere(8000, 1000);
  const MeasureValues slow = measure(trial, nullptr, {0});
  trial.rate = 2000;
  const MeasureValues fast = measure(trial, nullptr, {0});
  for (const char* name : {"path_length", "contact_path", "contact_share", "ldlj", "force_mean"})
    EXPECT_NEAR(value(fast, name), value(slow, name), 1e-9 * (1 + std::abs(value(slow, name))))
        << name;
  EXPECT_NEAR(value(fast, "speed_mean"), 2 * value(slow, "speed_mean"), 1e-9);
  EXPECT_NEAR(value(fast, "speed_contact"), 2 * value(slow, "speed_contact"), 1e-9);
  EXPECT_NEAR(value(fast, "episode_time"), value(slow, "episode_time") / 2, 1e-9);
}

TEST(Measures, TwiceTheNoiseChangesFewOfThem) {
  const MovementTrial still = strokes_on_a_sphere(4000, 1000);
  const TouchedSurface surface(draw_places(sphere(0.03), TouchedSurface::kPlaces));
  const auto noisy = [&](double sd) {
    MovementTrial trial = still;
    constexpr std::uint64_t kSeed = 5;
    Random random(kSeed);
    for (Vec3& tip : trial.tip) tip += sd * Vec3(random.normal(), random.normal(), random.normal());
    return measure(trial, &surface, {});
  };
  const MeasureValues once = noisy(30e-6), twice = noisy(60e-6);
  for (const char* name : {"coverage", "approaches", "contact_share", "strokes"})
    EXPECT_EQ(value(once, name), value(twice, name)) << name;
  EXPECT_NEAR(value(twice, "path_length") / value(once, "path_length"), 1, 0.01);
}

TEST(Measures, NoContactHasNoValuesOfContact) {
  MovementTrial trial = strokes_on_a_sphere(1000, 1000);
  trial.contact.assign(1000, false);
  const MeasureValues values = measure(trial, nullptr, {});
  EXPECT_EQ(value(values, "approaches"), 0);
  EXPECT_EQ(value(values, "contact_share"), 0);
  for (const char* name : {"episode_time", "force_mean", "press_peak", "share_static", "entropy",
                           "coverage", "speed_contact"})
    EXPECT_FALSE(values[measure_named(name)]) << name;
  EXPECT_FALSE(measure({}, nullptr, {})[0]);
}

/// Twice the same, the second half as far away as one likes: nothing is made of the way there.
TEST(Measures, AGapSplitsTheTrial) {
  const MovementTrial one = strokes_on_a_sphere(2000, 1000);
  MovementTrial both = one;
  both.breaks = {one.tip.size()};
  const Vec3 far(0.2, 0.1, 0);
  for (const Vec3& tip : one.tip) both.tip.push_back(tip + far);
  for (const bool contact : one.contact) both.contact.push_back(contact);
  for (const auto& [from, to] :
       {std::pair(&one.point, &both.point), {&one.normal, &both.normal}, {&one.force, &both.force}})
    to->insert(to->end(), from->begin(), from->end());
  for (const bool edge : one.on_edge) both.on_edge.push_back(edge);
  EXPECT_EQ(pieces_of(both), (std::vector<Stretch>{{0, 2000}, {2000, 4000}}));
  const MeasureValues once = measure(one, nullptr, {}), twice = measure(both, nullptr, {});
  for (const char* name :
       {"path_length", "contact_path", "approaches", "movements", "stops", "strokes", "duration"})
    EXPECT_NEAR(value(twice, name), 2 * value(once, name), 1e-9) << name;
  for (const char* name : {"speed_mean", "speed_p95", "speed_peaks_per_m", "sparc", "ldlj",
                           "contact_share", "episode_time", "force_rate", "press_peak"})
    EXPECT_NEAR(value(twice, name), value(once, name), 1e-3 * (1 + std::abs(value(once, name))))
        << name;
  both.breaks.clear();
  EXPECT_GT(value(measure(both, nullptr, {}), "path_length"),
            2 * value(once, "path_length") + 0.9 * glm::length(far));
}

/// On a plate: what is within the reach of a line of length L is 2 r L + pi r^2.
TEST(Coverage, TheTouchedPartOfASegmentCovers) {
  constexpr double kSide = 0.1, kLength = 0.04, kReach = TouchedSurface::kReach;
  const Vec3 a(0, 0, 0), b(kSide, 0, 0), c(kSide, kSide, 0), d(0, kSide, 0);
  const TouchedSurface plate(draw_places({{a, b, c}, {a, c, d}}, TouchedSurface::kPlaces));
  MovementTrial trial;
  trial.tip.assign(2, Vec3(0.05, 0.05, 0));
  trial.contact = {false, true};
  trial.point = trial.tip;
  EXPECT_NEAR(coverage_by_tick(trial, plate).back(), kPi * kReach * kReach / (kSide * kSide),
              0.003);
  const std::array<Vec3, 2> segment = {Vec3(0.03, 0.05, 0), Vec3(0.03 + kLength, 0.05, 0)};
  trial.touched = {{a, a}, segment};
  const std::vector<double> covered = coverage_by_tick(trial, plate);
  ASSERT_EQ(covered.size(), 1U);  // of the tick in contact
  // Placed every half reach, circles leave 3 % of the strip's edge out.
  EXPECT_NEAR(covered.back(), (2 * kReach * kLength + kPi * kReach * kReach) / (kSide * kSide),
              0.006);
}

TEST(Pictures, EvenContactIsOneOnTheWholeMap) {
  const TouchedSurface surface(draw_places(sphere(0.03), TouchedSurface::kPlaces));
  MovementTable table;
  table.trials.participants = {"P1"};
  table.trials.renderers = {"point"};
  table.trials.shapes = {"ball"};
  table.trials.rows = {TrialRow{.correct = true, .response_time = 1}};
  table.values.resize(1);
  table.values[0][measure_named("duration")] = 10.0;
  MovementTrial trial;
  trial.tip = trial.point = surface.places();
  trial.contact.assign(trial.tip.size(), true);
  MovementPictures pictures;
  pictures.outlines = {{surface.places(), {}}};
  add_up(table, {tally_of(trial, surface)}, pictures);
  const ContactMap& map = pictures.contact[0][0];
  ASSERT_EQ(map.density.size(), SurfaceMap::kCells);
  for (const double density : map.density) EXPECT_NEAR(density, 1, 1e-4);
  const CoverageCurve& curve = pictures.coverage[0][0];
  EXPECT_EQ(curve.mean.front(), 0);
  EXPECT_TRUE(std::is_sorted(curve.mean.begin(), curve.mean.end()));
  EXPECT_NEAR(curve.mean.back(), 1, 1e-6);  // the 10,000 ticks are over after 10 s
  EXPECT_EQ(curve.mean[40], curve.mean.back());
  EXPECT_LT(curve.mean[1], 0.95);
  EXPECT_EQ(curve.median_duration, 10);
}

TEST(Pictures, TypicalTrialIsCorrectAndNearTheMedian) {
  MovementTable table;
  table.trials.participants = {"P1"};
  table.trials.renderers = {"point"};
  table.trials.shapes = {"ball"};
  const std::size_t duration = measure_named("duration");
  for (const auto& [seconds, correct] :
       {std::pair(9.0, true), {3.0, false}, {3.5, true}, {1.0, true}, {2.0, true}}) {
    table.trials.rows.push_back(TrialRow{.correct = correct, .response_time = seconds});
    table.values.emplace_back()[duration] = seconds;
  }
  table.trials.rows.push_back(TrialRow{.correct = true, .response_time = 3});
  table.values.emplace_back();  // not measured
  EXPECT_EQ(typical_rows(table), std::vector<std::size_t>{2});
}

}  // namespace
}  // namespace palpate::analysis
