#include "runner/evidence/stability/scene_boundary.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <memory>
#include <set>
#include <stdexcept>
#include <thread>
#include <tuple>
#include <utility>

#include "rendering/tool.h"
#include "runner/evidence/stability/boundary.h"
#include "runner/evidence/verification/surface_stroke.h"
#include "runner/scene_builder.h"
#include "runner/touch/forces.h"

namespace palpate::runner::evidence {
namespace {

constexpr std::size_t kMostPlaces = 8;
constexpr int kStrokeTicks = 4000;
constexpr double kNearDepth = 1e-3, kMassOfEnd = 0.1;  // m, kg

/// The virtual stylus in contact, and what it touches.
struct Found {
  rendering::LineProbe probe;
  rendering::Rendering rendering;
};

Quat turn_to_up(const Vec3& direction) {
  const Vec3 from = glm::normalize(direction), up(0, 0, 1);
  const double along = glm::dot(from, up);
  if (along < -1 + 1e-9) return {0, 1, 0, 0};
  return glm::normalize(Quat(1 + along, glm::cross(from, up)));
}

rendering::LineProbe turned(const rendering::LineProbe& probe, const Quat& turn) {
  return {turn * probe.tip, turn * probe.tail};
}

/// A sphere round what is compiled of an object: centre and radius, m.
std::pair<Vec3, double> sphere_of(const rendering::Scene& scene, int object) {
  Vec3 low(HUGE_VAL), high(-HUGE_VAL);
  const auto add = [&](const Vec3& centre, double radius) {
    low = glm::min(low, centre - radius);
    high = glm::max(high, centre + radius);
  };
  for (const rendering::ScenePart& part : scene.parts()) {
    if (part.object == object) add(part.sphere_centre, part.sphere_radius);
  }
  for (const rendering::PlacedSurface& placed : scene.surfaces()) {
    if (std::ranges::find(placed.of_shell, object) != placed.of_shell.end() ||
        placed.object == object)
      add(placed.sphere_centre, placed.sphere_radius);
  }
  if (!(low.x <= high.x)) return {Vec3(0), 0};
  return {0.5 * (low + high), 0.5 * std::max({high.x - low.x, high.y - low.y, high.z - low.z})};
}

/// One place of each kind, by a hand that strokes each object.
std::vector<Found> places_of(const rendering::Scene& scene, const rendering::Renderer& renderer,
                             std::size_t objects) {
  std::vector<Found> all;
  std::set<std::tuple<int, rendering::ContactType, int>> kinds;
  for (std::size_t object = 0; object < objects; ++object) {
    const auto [centre, radius] = sphere_of(scene, static_cast<int>(object));
    if (!(radius > 0)) continue;
    SurfaceStroke hand({.centre = centre, .radius = radius, .side = renderer.side_contact()});
    rendering::RenderState state = scene.initial_state();
    double depth = 0;
    for (int i = 0; i < kStrokeTicks && all.size() < kMostPlaces; ++i) {
      const rendering::LineProbe probe = hand.next(depth);
      const rendering::Rendering r = renderer.tick(scene, state, probe, 1e-3);
      depth = r.deepest.depth;
      if (r.contacts == 0 || depth < kNearDepth) continue;
      if (kinds.insert({r.object, r.deepest.type, std::min(r.contacts, 3)}).second)
        all.push_back({probe, r});
    }
  }
  return all;
}

/// The scene turned so that the contact pushes up.
protocols::SceneSpec turned(protocols::SceneSpec spec, const Quat& turn) {
  for (stimuli::ObjectSpec& object : spec.objects) {
    object.pose = stimuli::compose(Pose{Vec3(0), turn}, object.pose);
    if (!object.body) continue;
    object.body->velocity = turn * object.body->velocity;
    object.body->spin = turn * object.body->spin;
  }
  spec.gravity = turn * spec.gravity;
  return spec;
}

/// Turns the tool about the stylus so that it lies in the turned scene as it lay in the first one:
/// without a measured roll its +x follows from the world's axes.
void keep_roll(protocols::SceneSpec& spec, const rendering::LineProbe& start, const Vec3& side) {
  if (spec.tool.segments.empty() || side == Vec3(0)) return;
  const Mat3 frame = rendering::tool_frame(start.tail - start.tip, nullptr, Vec3(0));
  const double angle = std::atan2(glm::dot(side, frame[1]), glm::dot(side, frame[0]));
  const Quat roll(std::cos(angle / 2), 0, 0, std::sin(angle / 2));
  for (protocols::ToolSegmentSpec& segment : spec.tool.segments) {
    segment.from = roll * segment.from;
    segment.to = roll * segment.to;
  }
}

struct Place {
  BuzzingPlace shown;
  LoopSettings settings;
  std::unique_ptr<LoopScene> loop;
};

}  // namespace

SceneBoundary scene_boundary(const std::string& name, const protocols::SceneSpec& spec,
                             const rendering::Renderer& renderer, const LoopSettings* device,
                             int threads, const std::function<void(double)>& progress) {
  SceneBoundary out;
  protocols::SceneSpec rigid = spec;
  std::erase_if(rigid.objects, [](const stimuli::ObjectSpec& one) { return one.soft.has_value(); });
  if (rigid.objects.size() < spec.objects.size()) {
    out.notes.emplace_back(
        "Soft objects are left out: palpate stability --soft has the map of their moduli, springs "
        "and rates.");
  }
  if (rigid.objects.empty()) return out;
  SceneBuilder builder;
  const rendering::Scene scene = touch::build_scene(builder, name, rigid, renderer);
  std::vector<Place> places;
  for (const Found& found : places_of(scene, renderer, rigid.objects.size())) {
    const Vec3 force = found.rendering.force;
    if (!(glm::length(force) > 0)) continue;
    const Quat turn = turn_to_up(force);
    Place place;
    place.shown.object = found.rendering.object;
    place.shown.type = rendering::to_string(found.rendering.deepest.type);
    place.shown.contacts = found.rendering.contacts;
    place.shown.point = found.rendering.deepest.point;
    place.settings.mass = kMassOfEnd;
    rendering::LineProbe start = turned(found.probe, turn);
    start.tip.z += found.rendering.deepest.depth;
    start.tail.z += found.rendering.deepest.depth;
    if (spec.reach) {
      // The virtual stylus is as long as the real one times the factor.
      const double length = glm::distance(start.tip, start.tail);
      place.settings.reach =
          reach_of(*spec.reach, length / spec.reach->factor, 0.5 * length / spec.reach->factor);
      if (place.settings.reach->in_world) place.settings.reach->point = turn * spec.reach->point;
    }
    try {
      protocols::SceneSpec pressed = turned(rigid, turn);
      keep_roll(pressed, start, turn * found.rendering.ideal_side);
      SceneBuilder turned_builder;
      place.loop = std::make_unique<LoopScene>(
          touch::build_scene(turned_builder, name, pressed, renderer), renderer, start);
    } catch (const std::runtime_error&) {
      continue;  // the way down is not free
    }
    const double gain =
        place.settings.reach ? rendering::stiffness_gain(*place.settings.reach, 0) : 1;
    place.shown.stiffness = gain * place.loop->stiffness();
    if (!(place.shown.stiffness > 0)) continue;
    for (const double rate : kSceneRates) {
      for (int delay = 0; delay < kSceneDelays; ++delay) {
        place.shown.map.push_back({rate, delay, 0, place.shown.stiffness / rate * (0.5 + delay)});
      }
    }
    places.push_back(std::move(place));
  }
  const std::size_t points = std::size(kSceneRates) * kSceneDelays;
  std::atomic<std::size_t> next{0};
  const auto work = [&](bool shows) {
    constexpr double kClose = 1.02;
    for (std::size_t i = next++; i < places.size() * points; i = next++) {
      Place& place = places[i / points];
      DampingNeeded& point = place.shown.map[i % points];
      LoopSettings settings = place.settings;
      settings.rate = point.rate;
      settings.delay = point.delay;
      point.needed = least_stable_damping(settings, *place.loop, kClose);
      if (device != nullptr && i % points == 0) {
        LoopSettings on_device = *device;
        on_device.mass = place.settings.mass;
        on_device.reach = place.settings.reach;
        place.shown.buzzes = !run_loop(on_device, *place.loop).stable;
      }
      if (shows) progress(static_cast<double>(i) / static_cast<double>(places.size() * points));
    }
  };
  std::vector<std::thread> others;
  for (int j = 1; j < threads; ++j) others.emplace_back(work, false);
  work(true);
  for (std::thread& thread : others) thread.join();
  for (Place& place : places) out.places.push_back(std::move(place.shown));
  if (out.places.empty()) out.notes.emplace_back("No place of contact was found.");
  return out;
}

}  // namespace palpate::runner::evidence
