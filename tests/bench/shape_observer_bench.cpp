// Cost of one percept to a simulated participant: 6 of them in each simulated second.

#include <benchmark/benchmark.h>

#include <cstdint>
#include <glm/geometric.hpp>
#include <vector>

#include "data/base/random.h"
#include "runner/participants/shape_observer.h"

namespace palpate {
namespace {

std::vector<stimuli::ObjectSpec> four_shapes() {
  std::vector<stimuli::ObjectSpec> stimuli(4);
  stimuli[0].shape = stimuli::ShapeKind::sphere;
  stimuli[1].shape = stimuli::ShapeKind::cone;
  stimuli[2].shape = stimuli::ShapeKind::cylinder;
  stimuli[3].shape = stimuli::ShapeKind::cube;
  return stimuli;
}

/// Touches all over a sphere of the size of the stimuli, the stylus leaning on it.
std::vector<runner::participants::Percept> percepts(bool ray, bool contact) {
  constexpr std::uint64_t kSeed = 1;
  Random random(kSeed);
  const auto direction = [&random] {
    return glm::normalize(Vec3(random.normal(), random.normal(), random.normal()));
  };
  std::vector<runner::participants::Percept> made(64);
  for (runner::participants::Percept& percept : made) {
    percept.ray = ray;
    percept.contact = contact;
    percept.direction = direction();
    const Vec3 along = glm::normalize(glm::cross(percept.direction, direction()));
    const double place = ray ? 0.12 * random.unit() : 0;
    percept.tip = 0.031 * percept.direction - place * along;
    percept.tail = percept.tip + 0.12 * along;
    if (ray && contact) percept.along = place;
  }
  return made;
}

void update(benchmark::State& state, bool ray, bool contact) {
  const runner::participants::ShapeHypotheses hypotheses(four_shapes());
  runner::participants::ShapeObserver observer(hypotheses);
  const std::vector<runner::participants::Percept> made = percepts(ray, contact);
  std::size_t next = 0;
  for (auto _ : state) {
    observer.update(made[next]);
    next = (next + 1) % made.size();
    benchmark::DoNotOptimize(observer.probability(0));
  }
}

BENCHMARK_CAPTURE(update, point_contact, false, true);
BENCHMARK_CAPTURE(update, point_free_space, false, false);
BENCHMARK_CAPTURE(update, ray_contact, true, true);
BENCHMARK_CAPTURE(update, ray_free_space, true, false);

void build_hypotheses(benchmark::State& state) {
  const std::vector<stimuli::ObjectSpec> stimuli = four_shapes();
  for (auto _ : state) {
    runner::participants::ShapeHypotheses hypotheses(stimuli);
    benchmark::DoNotOptimize(hypotheses.padded_size());
  }
}
BENCHMARK(build_hypotheses);

}  // namespace
}  // namespace palpate
