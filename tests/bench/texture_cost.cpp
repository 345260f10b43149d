// Cost of a texture or a field in a tick, beside the bare tick over the same path: a stylus that
// slides over the face of a box, always in contact.
//
// Each tick is timed by itself in some rounds, the cases by turns, and has its least time: other
// programs only make it longer. A case has the mean over its ticks; what reading the clock takes is
// in all of them.
//
// Usage: texture_cost [ROUNDS]   15 if not given: ten seconds

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <limits>
#include <string>
#include <vector>

#include "rendering/renderer.h"
#include "runner/evidence/tick_meters.h"
#include "runner/scene_builder.h"
#include "stimuli/shapes.h"

namespace palpate::bench {
namespace {

using stimuli::FieldSpec;
using stimuli::TextureSpec;

constexpr std::size_t kTicks = 20'000;
constexpr std::size_t kWarm = 500;  // ticks, not counted
constexpr double kPeriod = 1e-3;    // s

struct Case {
  std::string name;
  stimuli::ObjectSpec object;
  double goal = 0;  ///< ns more than the bare tick; 0: none
  rendering::Scene scene;
  std::vector<std::uint64_t> least;  ///< counts of each tick
  std::size_t allocated = 0;         ///< by the ticks of a round

  double counts() const {
    double sum = 0;
    for (std::size_t i = kWarm; i < least.size(); ++i) sum += static_cast<double>(least[i]);
    return sum / static_cast<double>(least.size() - kWarm);
  }
};

stimuli::ObjectSpec box() {
  stimuli::ObjectSpec out;
  out.shape = stimuli::ShapeKind::box;
  out.size = Vec3(0.12, 0.12, 0.02);
  return out;
}

stimuli::ObjectSpec textured(TextureSpec::Kind kind, double tip_radius = 0) {
  TextureSpec texture;
  texture.kind = kind;
  texture.period = 0.002;
  texture.depth = 0.0002;
  texture.tip_radius = tip_radius;
  stimuli::ObjectSpec out = box();
  out.texture = texture;
  return out;
}

stimuli::ObjectSpec in_field(FieldSpec::Kind kind) {
  FieldSpec field;
  field.kind = kind;
  field.force = Vec3(0, 0, 0.1);
  field.centre = Vec3(-0.05, 0, 0.01);
  field.to = Vec3(0.05, 0, 0.01);
  field.stiffness = 20;
  field.damping = Mat3(2);
  field.amplitude = 0.1;
  field.frequency = 100;
  field.destabilising = true;
  stimuli::ObjectSpec out = box();
  out.fields = {field};
  return out;
}

std::vector<Case> cases(bool ray) {
  constexpr double kSine = 60, kTable = 100, kField = 15;  // ns
  std::vector<Case> out;
  const auto add = [&](const std::string& name, stimuli::ObjectSpec object, double goal) {
    runner::SceneBuilder builder;
    rendering::Scene scene = builder.build({object}, ray);
    out.push_back({name, std::move(object), goal, std::move(scene),
                   std::vector<std::uint64_t>(kTicks, std::numeric_limits<std::uint64_t>::max())});
  };
  add("bare", box(), 0);
  add("sine", textured(TextureSpec::Kind::sine), kSine);
  add("trapezoid", textured(TextureSpec::Kind::trapezoid), kSine);
  add("sine, ball tip (line table)", textured(TextureSpec::Kind::sine, 0.0005), kTable);
  add("cones (tile table)", textured(TextureSpec::Kind::cones), kTable);
  add("noise (tile table)", textured(TextureSpec::Kind::noise), kTable);
  add("constant field", in_field(FieldSpec::Kind::constant), kField);
  add("spring", in_field(FieldSpec::Kind::spring), kField);
  add("channel", in_field(FieldSpec::Kind::channel), kField);
  add("viscous field", in_field(FieldSpec::Kind::viscous), kField);
  add("curl field", in_field(FieldSpec::Kind::curl), kField);
  add("vibration", in_field(FieldSpec::Kind::vibration), kField);
  return out;
}

/// 80 mm/s in loops over the face, 0.4 to 0.8 mm deep; the ray stands aslant on its tip.
rendering::LineProbe pose_at(std::size_t tick, bool ray) {
  const double t = static_cast<double>(tick) * kPeriod;
  const double depth = 0.0006 + 0.0002 * std::sin(9 * t);
  const Vec3 tip(0.03 * std::sin(2.3 * t), 0.03 * std::sin(1.7 * t + 1), 0.01 - depth);
  return {tip, ray ? tip + 0.12 * Vec3(0.6, 0, 0.8) : tip};
}

void run_round(Case& one, bool ray) {
  const rendering::Renderer& renderer =
      ray ? rendering::ray_renderer() : rendering::point_renderer();
  rendering::RenderState state = one.scene.initial_state();
  const Vec3 above(0, 0, 0.02);
  renderer.tick(one.scene, state, {above, above}, kPeriod);
  std::size_t touched = 0;
  const std::uint64_t before = runner::evidence::allocations();
  for (std::size_t i = 0; i < kTicks; ++i) {
    const rendering::LineProbe probe = pose_at(i, ray);
    const std::uint64_t start = runner::evidence::begin_count();
    const rendering::Rendering made = renderer.tick(one.scene, state, probe, kPeriod);
    one.least[i] = std::min(one.least[i], runner::evidence::end_count() - start);
    touched += made.contacts > 0 ? 1 : 0;
  }
  one.allocated = runner::evidence::allocations() - before;
  if (touched < kTicks / 2) throw std::runtime_error(one.name + " was not touched");
}

void print(const std::vector<Case>& all, const char* probe, double ns) {
  const double bare = ns * all.front().counts();
  for (const Case& one : all) {
    const double mine = ns * one.counts();
    std::printf("%-30s%-7s%8.1f%9.1f%8.2f", one.name.c_str(), probe, mine, mine - bare,
                mine / bare);
    if (one.goal > 0) std::printf("%8.0f", one.goal);
    if (one.goal > 0 && mine - bare > one.goal) std::printf("  missed");
    if (one.allocated > 0) std::printf("  %zu allocations", one.allocated);
    std::printf("\n");
  }
}

int main_with(int argc, char** argv) {
  int rounds = 15;
  if (argc > 2 ||
      (argc == 2 &&
       std::from_chars(argv[1], argv[1] + std::strlen(argv[1]), rounds).ec != std::errc{}) ||
      rounds < 1) {
    std::fprintf(stderr, "usage: texture_cost [ROUNDS]\n");
    return 2;
  }
  const double ns = runner::evidence::nanoseconds_per_count();
  std::printf("%-30s%-7s%8s%9s%8s%8s\n", "case", "probe", "ns", "more", "ratio", "goal");
  for (const bool ray : {false, true}) {
    std::vector<Case> all = cases(ray);
    for (int round = 0; round < rounds; ++round) {
      for (Case& one : all) run_round(one, ray);
    }
    print(all, ray ? "ray" : "point", ns);
  }
  return 0;
}

}  // namespace
}  // namespace palpate::bench

int main(int argc, char** argv) {
  try {
    return palpate::bench::main_with(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "texture_cost: %s\n", error.what());
    return 1;
  }
}
