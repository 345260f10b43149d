#include "runner/evidence/stability/effect_stability.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <numbers>
#include <optional>

#include "rendering/renderer.h"
#include "runner/scene_builder.h"
#include "runner/servo/field_demand.h"

namespace palpate::runner::evidence {
namespace {

constexpr double kPeriod = 1e-3;          // s
constexpr double kTestedStiffness = 800;  // N/m
constexpr double kTop = 0.01;             // m, of the plate
constexpr double kSlow = 60;              // ticks in a radian's time: the case of the theory
constexpr double kComesToRest = 1e-2;     // of the first swing
constexpr double kFinest = 1.01;          // factor between dampings that are told apart
constexpr int kFirstTicks = 1 << 14, kLongest = 1 << 18;

/// A mass under a force that is held over each tick, with viscous damping, integrated exactly.
struct Mass {
  Vec3 place, velocity;
  double mass = 1, damping = 0;

  void step(const Vec3& force) {
    if (damping <= 0) {
      place += kPeriod * (velocity + 0.5 * kPeriod / mass * force);
      velocity += kPeriod / mass * force;
      return;
    }
    const double fade = std::exp(-damping * kPeriod / mass);
    const Vec3 end = force / damping;
    place += kPeriod * end + (velocity - end) * (mass / damping) * (1 - fade);
    velocity = end + (velocity - end) * fade;
  }
};

struct Case {
  std::string what;
  stimuli::ObjectSpec object;
  Vec3 start, velocity;  ///< m, m/s
  Vec3 press;            ///< N
  double mass = 0;       ///< kg
  double theory = 0;     ///< N s/m
};

/// Whether the mass comes to rest, or swings less and less.
bool rests(const Case& of, double damping) {
  SceneBuilder builder;
  const rendering::Scene scene = builder.build({of.object}, false);
  const rendering::Renderer& renderer = rendering::point_renderer();
  rendering::RenderState state = scene.initial_state();
  const auto force_at = [&](const Vec3& tip) {
    return renderer.tick(scene, state, {tip, tip + Vec3(0, 0, 0.12)}, kPeriod).force;
  };
  force_at(of.start + Vec3(0, 0, 0.02));
  Mass mass{of.start, of.velocity, of.mass, damping};
  double first = 0, before = 0;
  for (int length = kFirstTicks; length <= kLongest; length *= 2) {
    // The swing of speed in the second half of the run so far.
    double early = 0, late = 0;
    for (int i = length == kFirstTicks ? 0 : length / 2; i < length; ++i) {
      mass.step(force_at(mass.place) + of.press);
      const double speed = glm::length(mass.velocity);
      if (!(speed < 1e3)) return false;
      if (i < kFirstTicks / 8) first = std::max(first, speed);
      (i < 3 * length / 4 ? early : late) = std::max(i < 3 * length / 4 ? early : late, speed);
    }
    if (late <= kComesToRest * first) return true;
    if (late > 0.98 * early && before > 0 && late > 0.98 * before) return false;
    before = late;
  }
  return before <= kComesToRest * first;
}

double least_damping(const Case& of) {
  if (rests(of, 0)) return 0;
  double low = of.theory / 64, high = of.theory;
  while (!rests(of, high)) {
    high *= 2;
    if (high > 64 * of.theory) return high;
  }
  if (rests(of, low)) return low;
  while (high > kFinest * low) {
    const double middle = std::sqrt(low * high);
    (rests(of, middle) ? high : low) = middle;
  }
  return high;
}

stimuli::ObjectSpec plate() {
  stimuli::ObjectSpec out;
  out.shape = stimuli::ShapeKind::box;
  out.size = {0.2, 0.2, 2 * kTop};
  out.material.stiffness = kTestedStiffness;
  return out;
}

std::string named(const char* format, double a, double b, double c = 0) {
  char text[96];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

double slow_mass() {
  return kTestedStiffness * std::pow(kSlow * kPeriod / (2 * std::numbers::pi), 2);
}

void add_textures(std::vector<Case>& out) {
  for (const double depth : {0.0001, 0.0004}) {
    for (const double period : {0.001, 0.002, 0.004}) {
      for (const double press : {0.5, 2.0}) {
        Case one;
        one.what = named("sine %g mm on %g mm, %g N", 1e3 * depth, 1e3 * period, press);
        one.object = plate();
        one.object.texture.emplace();
        one.object.texture->period = period;
        one.object.texture->depth = depth;
        one.start = {period / 2, 0, kTop - depth - press / kTestedStiffness};
        one.velocity = {0.002, 0, 0};
        one.press = {0, 0, -press};
        one.mass = slow_mass();
        one.theory = kTestedStiffness * kPeriod / 2;
        out.push_back(one);
      }
    }
  }
}

void add_fields(std::vector<Case>& out) {
  using Kind = stimuli::FieldSpec::Kind;
  for (const Kind kind : {Kind::viscous, Kind::curl}) {
    for (const double low_pass : {0.0, 0.002, 0.01}) {
      stimuli::FieldSpec field;
      field.kind = kind;
      field.damping = Mat3(20);
      field.low_pass = low_pass;
      Case one;
      one.what = named(kind == Kind::viscous ? "viscous %g N s/m, low pass %g ms"
                                             : "curl %g N s/m, low pass %g ms",
                       20, 1e3 * low_pass);
      one.object.shape = stimuli::ShapeKind::none;
      one.object.fields = {field};
      one.velocity = {0.1, 0, 0};
      one.mass = 0.005;
      one.theory = servo::demand_of({field}, 1 / kPeriod, 0).damping;
      out.push_back(one);
    }
  }
}

void add_knocks(std::vector<Case>& out) {
  for (const double amplitude : {10.0, 100.0}) {
    Case one;
    one.what = named("knock of %g N s/m at %g Hz, 1 N", amplitude, 100);
    one.object = plate();
    one.object.transient = stimuli::TransientSpec{amplitude, 100, 0.01};
    one.start = {0, 0, kTop + 1e-4};
    one.velocity = {0, 0, -0.05};
    one.press = {0, 0, -1};
    one.mass = slow_mass();
    one.theory = kTestedStiffness * kPeriod / 2;
    out.push_back(one);
  }
}

}  // namespace

std::vector<EffectStability> effect_stability() {
  std::vector<Case> cases;
  add_textures(cases);
  add_fields(cases);
  add_knocks(cases);
  std::vector<EffectStability> out;
  out.reserve(cases.size());
  for (const Case& one : cases) out.push_back({one.what, least_damping(one), one.theory});
  return out;
}

std::string effect_stability_text(const std::vector<EffectStability>& rows) {
  std::string out =
      "Textures, fields and knocks: a mass at 1 kHz, released; the least damping that is stable\n";
  char line[120];
  std::snprintf(line, sizeof line, "  %-38s%10s%16s\n", "case", "measured", "theory, N s/m");
  out += line;
  std::size_t held = 0;
  for (const EffectStability& row : rows) {
    std::snprintf(line, sizeof line, "  %-38s%10.3f%16.3f%s\n", row.what.c_str(), row.measured,
                  row.theory, row.holds() ? "" : "  above theory");
    out += line;
    held += row.holds();
  }
  return out + "  " + std::to_string(held) + " of " + std::to_string(rows.size()) +
         " are stable where the theory promises it.\n";
}

}  // namespace palpate::runner::evidence
