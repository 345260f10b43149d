#include "runner/display/scene/scene_drawing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <glm/common.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <span>

#include "rendering/bodies/soft/soft_scene.h"
#include "rendering/tool.h"
#include "runner/display/scene/picture.h"
#include "stimuli/shapes.h"
#include "stimuli/texture.h"

namespace palpate::runner::display {
namespace {

constexpr float kBetween = 2;  // px
constexpr int kMostRows = 6;   // above and below its place

bool labels_overlap(const LabelBox& a, const LabelBox& b) {
  const glm::vec2 apart = glm::abs(a.centre - b.centre);
  const glm::vec2 least = 0.5F * (a.size + b.size) + glm::vec2(kBetween);
  return apart.x < least.x && apart.y < least.y;
}

constexpr int kArcSteps = 42;
constexpr float kHeadLength = 4.6F, kHeadRadius = 2.1F;  // of the shaft's radius

/// Unit, at right angles to z.
glm::vec3 aside_of(const glm::vec3& z) {
  const glm::vec3 other = std::abs(z.x) < 0.7F ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
  return glm::normalize(glm::cross(other, z));
}

/// \param side  +x of the tool; zero: the side at the beginning of a trial
DrawnTool placed(const rendering::Tool& tool, const rendering::LineProbe& stylus,
                 const Vec3& side) {
  DrawnTool out{stylus, {}};
  if (tool.segments.empty()) {
    out.segments = {stylus};
    return out;
  }
  const Vec3 d = stylus.tail - stylus.tip;
  const Mat3 frame = rendering::tool_frame(d, nullptr, side);
  for (const rendering::ToolSegment& segment : tool.segments)
    out.segments.push_back({stylus.tip + frame * segment.from, stylus.tip + frame * segment.to});
  return out;
}

constexpr std::array<glm::vec3, 8> kObjectColours{{{0.42F, 0.60F, 0.83F},
                                                   {0.87F, 0.56F, 0.42F},
                                                   {0.53F, 0.71F, 0.52F},
                                                   {0.87F, 0.73F, 0.40F},
                                                   {0.64F, 0.54F, 0.77F},
                                                   {0.41F, 0.70F, 0.70F},
                                                   {0.80F, 0.54F, 0.65F},
                                                   {0.62F, 0.65F, 0.70F}}};
constexpr std::array<glm::vec3, 4> kLayerColours{
    {{0.91F, 0.63F, 0.36F}, {0.80F, 0.38F, 0.36F}, {0.50F, 0.33F, 0.55F}, {0.30F, 0.36F, 0.55F}}};

// In sizes of the scene.
constexpr double kIdealRadius = 0.020, kVirtualRadius = 0.012, kHeldRadius = 0.05,
                 kContactRadius = 0.035, kArrowRadius = 0.024, kTurnThickness = 0.013,
                 kTurnRadius = 0.28, kLongestArrow = 1.6;
// Shares of the picture's height: the held end of a stretched stylus is near the viewer.
constexpr double kThickestStretched = 0.035, kThickestHeld = 0.06;
constexpr double kLengthOfOneNewton = 1.0 / 6;  // in sizes: a device's largest force is about 1
constexpr double kTurnOfOneNewtonMetre = 8;     // rad
constexpr double kLeastTurn = 0.05, kLongestTurn = 5.5;  // rad
constexpr double kLeastForce = 0.005;                    // N; less is not drawn
constexpr double kLeastTorque = 1e-4;                    // N m; likewise
constexpr double kRedOfSize = 0.2;   // share of the radius: a deformation this large is red
constexpr float kFarthestFloor = 1;  // below the lowest point, in sizes
constexpr float kSkinOpacity = 0.22F, kLayerOpacity = 0.42F;

glm::mat4 place_of(const Pose& pose) {
  glm::mat4 out(glm::mat4_cast(glm::quat(pose.orientation)));
  out[3] = glm::vec4(glm::vec3(pose.position), 1);
  return out;
}

const char* name_of(stimuli::ShapeKind kind) {
  switch (kind) {
    case stimuli::ShapeKind::sphere:
      return "sphere";
    case stimuli::ShapeKind::cone:
      return "cone";
    case stimuli::ShapeKind::cylinder:
      return "cylinder";
    case stimuli::ShapeKind::cube:
      return "cube";
    case stimuli::ShapeKind::box:
      return "box";
    case stimuli::ShapeKind::compound:
      return "compound";
    case stimuli::ShapeKind::mesh:
      return "mesh";
    case stimuli::ShapeKind::none:
      return "fields";
  }
  return "";
}

/// 1, 2 or 5 times a power of ten, at most `most`.
double round_step(double most) {
  const double power = std::pow(10, std::floor(std::log10(most)));
  for (const double step : {5.0, 2.0})
    if (step * power <= most) return step * power;
  return power;
}

/// m/N
double arrow_scale(const SceneDrawingSettings& settings, double size) {
  return settings.metres_per_newton > 0 ? settings.metres_per_newton : kLengthOfOneNewton * size;
}

/// rad/(N m)
double turn_scale(const SceneDrawingSettings& settings) {
  return settings.radians_per_newton_metre > 0 ? settings.radians_per_newton_metre
                                               : kTurnOfOneNewtonMetre;
}

std::string caption_of(const SceneMoment& moment, double grid) {
  char text[160];
  const servo::Sample& sample = moment.sample;
  const double force = glm::length(sample.device1 + sample.device2);
  const double torque = glm::length(torque_on_hand(moment));
  const bool large = torque >= 1;
  std::snprintf(text, sizeof text, "%.2f s    force %.2f N    torque %.*f %s    grid %g mm",
                1e-9 * static_cast<double>(sample.time_ns), force, large ? 2 : 1,
                large ? torque : 1000 * torque, large ? "N m" : "mN m", 1000 * grid);
  return text;
}

}  // namespace

const Theme& light_theme() {
  static const Theme theme{.above = {0.87F, 0.90F, 0.93F},
                           .below = {0.97F, 0.97F, 0.965F},
                           .ground = {0.955F, 0.957F, 0.96F},
                           .text = {0.16F, 0.18F, 0.22F},
                           .halo = {1, 1, 1},
                           .ideal_tool = {0.22F, 0.24F, 0.29F},
                           .virtual_tool = {0.95F, 0.52F, 0.13F},
                           .grip = {0.36F, 0.38F, 0.43F},
                           .force = {0.86F, 0.16F, 0.16F},
                           .torque = {0.48F, 0.20F, 0.72F},
                           .contact = {0.93F, 0.12F, 0.20F}};
  return theme;
}

const Theme& dark_theme() {
  static const Theme theme{.above = {0.085F, 0.098F, 0.115F},
                           .below = {0.13F, 0.15F, 0.175F},
                           .ground = {0.15F, 0.17F, 0.195F},
                           .text = {0.90F, 0.91F, 0.92F},
                           .halo = {0.06F, 0.07F, 0.08F},
                           .ideal_tool = {0.93F, 0.91F, 0.87F},
                           .virtual_tool = {0.95F, 0.55F, 0.25F},
                           .grip = {0.60F, 0.62F, 0.66F},
                           .force = {0.97F, 0.78F, 0.26F},
                           .torque = {0.72F, 0.52F, 0.95F},
                           .contact = {0.95F, 0.35F, 0.30F}};
  return theme;
}

void place_labels(std::vector<LabelBox>& boxes, const glm::vec2& picture) {
  std::ranges::stable_sort(boxes, {}, &LabelBox::distance);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    LabelBox& box = boxes[i];
    const glm::vec2 wanted = box.centre, low = 0.5F * box.size, high = picture - low;
    const bool near_enough = wanted.x >= 0 && wanted.x <= picture.x && wanted.y >= -picture.y / 4 &&
                             wanted.y <= picture.y;
    box.shown = near_enough && low.x <= high.x && low.y <= high.y;
    bool free = false;
    // Try rows above and below its place, at growing distance.
    for (int k = 0; box.shown && !free && k <= 2 * kMostRows; ++k) {
      const int rows = (k + 1) / 2 * (k % 2 == 1 ? -1 : 1);
      const glm::vec2 moved =
          wanted + glm::vec2(0, static_cast<float>(rows) * (box.size.y + kBetween));
      box.centre = glm::clamp(moved, low, high);
      free = std::none_of(
          boxes.begin(), boxes.begin() + static_cast<std::ptrdiff_t>(i),
          [&](const LabelBox& other) { return other.shown && labels_overlap(box, other); });
    }
    box.shown = box.shown && free;
  }
}

glm::mat4 rod_place(const glm::vec3& from, const glm::vec3& to, float radius) {
  const glm::vec3 axis = to - from;
  const float length = glm::length(axis);
  const glm::vec3 z = length > 0 ? axis / length : glm::vec3(0, 0, 1);
  const glm::vec3 x = aside_of(z), y = glm::cross(z, x);
  return {glm::vec4(radius * x, 0), glm::vec4(radius * y, 0),
          glm::vec4(std::max(length, 1e-3F * radius) * z, 0), glm::vec4(from, 1)};
}

float radius_seen(const DrawnRod& rod, const Camera& camera) {
  if (rod.thickest == 0) return rod.radius;
  const float height = std::min(camera.height_at(rod.from), camera.height_at(rod.to));
  return std::min(rod.radius, 0.5F * rod.thickest * height);
}

glm::mat4 ball_place(const glm::vec3& centre, float radius) {
  return glm::scale(glm::translate(glm::mat4(1), centre), glm::vec3(radius));
}

ArrowPlaces arrow_places(const glm::vec3& from, const glm::vec3& to, float radius) {
  const float length = glm::distance(from, to);
  const float head = std::min(kHeadLength * radius, 0.5F * length);
  const glm::vec3 neck = length > 0 ? to - head / length * (to - from) : to;
  return {rod_place(from, neck, radius), rod_place(neck, to, kHeadRadius / kHeadLength * head)};
}

std::vector<glm::vec3> points_of(const DrawnTurn& turn) {
  const glm::vec3 x = aside_of(turn.axis), y = glm::cross(turn.axis, x);
  std::vector<glm::vec3> out;
  for (int i = 0; i <= kArcSteps; ++i) {
    const float angle = turn.sweep * static_cast<float>(i) / static_cast<float>(kArcSteps);
    out.push_back(turn.centre + turn.radius * (std::cos(angle) * x + std::sin(angle) * y));
  }
  return out;
}

DrawnTool tool_in_hand(const rendering::Tool& tool, const servo::Sample& sample) {
  return placed(tool, sample.probe, sample.rendering.ideal_side);
}

DrawnTool ideal_tool(const rendering::Tool& tool, const servo::Sample& sample) {
  if (sample.rendering.contacts == 0) return tool_in_hand(tool, sample);
  return placed(tool, sample.rendering.ideal, sample.rendering.ideal_side);
}

std::vector<servo::ContactPlace> contact_places(const rendering::Scene& scene,
                                                const rendering::RenderState& state,
                                                const rendering::Rendering& rendering) {
  constexpr std::size_t kMostPlaces = 1024;
  std::vector<servo::ContactPlace> out(kMostPlaces);
  out.resize(servo::find_contact_places(scene, state, rendering, out));
  return out;
}

std::vector<std::shared_ptr<const SoftSurfaceNow>> soft_surfaces(
    const rendering::Scene& scene, const rendering::RenderState& state) {
  std::vector<std::shared_ptr<const SoftSurfaceNow>> out;
  for (const rendering::SoftShape& shape : rendering::soft_shapes(scene, state)) {
    out.push_back(std::make_shared<const SoftSurfaceNow>(
        SoftSurfaceNow{shape.object, {shape.now.begin(), shape.now.end()}}));
  }
  return out;
}

std::vector<Pose> object_poses(const std::vector<stimuli::ObjectSpec>& objects,
                               const rendering::RenderState& state) {
  return object_poses(objects, state.motion.bodies());
}

std::vector<Pose> object_poses(const std::vector<stimuli::ObjectSpec>& objects,
                               std::span<const rendering::BodyPose> bodies) {
  if (bodies.empty()) return {};
  std::vector<Pose> out;
  out.reserve(objects.size());
  for (const stimuli::ObjectSpec& object : objects) out.push_back(object.pose);
  for (const rendering::BodyPose& body : bodies) {
    if (static_cast<std::size_t>(body.object) >= out.size()) continue;  // belongs to another scene
    Pose& pose = out[static_cast<std::size_t>(body.object)];
    pose = stimuli::compose(body.moved, pose);
  }
  return out;
}

Vec3 torque_on_hand(const SceneMoment& moment) {
  const rendering::LineProbe& held = moment.held ? *moment.held : moment.sample.probe;
  return 0.5 * glm::cross(held.tail - held.tip, moment.sample.device2 - moment.sample.device1);
}

SceneDrawing::SceneDrawing(const std::vector<stimuli::ObjectSpec>& objects, rendering::Tool tool)
    : tool_(std::move(tool)) {
  for (std::size_t i = 0; i < objects.size(); ++i) {
    DrawnMesh mesh = triangles_of(objects[i]);
    std::string label = std::to_string(i) + " " + name_of(objects[i].shape);
    if (const auto& texture = objects[i].texture; texture && texture->depth > 0) {
      label += ", " + stimuli::in_words(*texture);
      mesh = with_texture(mesh, stimuli::Texture(*texture, objects[i].radius));
    }
    Object object{.mesh = std::make_shared<const DrawnMesh>(std::move(mesh)),
                  .pose = objects[i].pose,
                  .colour = kObjectColours[i % kObjectColours.size()],
                  .label = std::move(label),
                  .layers = {},
                  .felt = objects[i].material.stiffness > 0};
    for (const DrawnVertex& corner : *object.mesh)
      object.reach = std::max(object.reach, glm::length(corner.position));
    if (!object.mesh->empty()) object.low = object.high = object.mesh->front().position;
    for (const DrawnVertex& corner : *object.mesh) {
      object.low = glm::min(object.low, corner.position);
      object.high = glm::max(object.high, corner.position);
    }
    objects_.push_back(std::move(object));
  }
  const std::vector<glm::vec3> points = outline();
  if (points.empty()) return;
  glm::vec3 low = points.front(), high = points.front();
  for (const glm::vec3& point : points) {
    low = glm::min(low, point);
    high = glm::max(high, point);
  }
  middle_ = 0.5F * (low + high);
  float radius = 0;
  for (const glm::vec3& point : points) radius = std::max(radius, glm::distance(point, middle_));
  size_ = std::max<double>(radius, 1e-4);
  // If all objects hover above z = 0 and it is near, draw the floor there.
  const bool above_floor = low.z > 0 && low.z < kFarthestFloor * radius;
  ground_ = above_floor ? 0 : low.z;
}

void SceneDrawing::add_compiled(const rendering::Scene& scene) {
  add_layers(scene);
  for (const auto& soft : rendering::soft_objects(scene))
    objects_[static_cast<std::size_t>(soft->object)].soft = soft;
}

std::shared_ptr<const DrawnMesh> SceneDrawing::drawn_soft(const Object& object,
                                                          const SoftSurfaceNow& now) {
  const std::vector<Vec3>& rest = object.soft->rest;
  const std::vector<Vec3> places(now.places.begin(), now.places.end());
  std::vector<float> tints;
  tints.reserve(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double moved = glm::distance(places[i], rest[i]) / (kRedOfSize * object.reach);
    tints.push_back(static_cast<float>(std::clamp(moved, 0.0, 1.0)));
  }
  return std::make_shared<const DrawnMesh>(
      surface_mesh(places, object.soft->surface.triangles(), tints));
}

void SceneDrawing::add_layers(const rendering::Scene& scene) {
  std::vector<std::vector<DrawnMesh>> found(objects_.size());
  for (const rendering::ScenePart& part : scene.parts()) {
    if (part.layer < 1) continue;
    auto& layers = found[static_cast<std::size_t>(part.object)];
    layers.resize(std::max(layers.size(), static_cast<std::size_t>(part.layer)));
    // In the frame of the object: it may move.
    const Pose& of = objects_[static_cast<std::size_t>(part.object)].pose;
    const Quat back = glm::conjugate(of.orientation);
    add_facets(*part.mesh,
               {back * (part.position - of.position), back * glm::quat_cast(part.to_world)},
               layers[static_cast<std::size_t>(part.layer) - 1]);
  }
  for (const rendering::PlacedSurface& placed : scene.surfaces()) {
    if (placed.layer < 1) continue;
    for (const std::uint32_t t : placed.surface->file_order()) {
      const stimuli::SurfaceTriangle& triangle = placed.surface->triangles()[t];
      const auto object = static_cast<std::size_t>(placed.of_shell[triangle.shell]);
      auto& layers = found[object];
      layers.resize(std::max(layers.size(), static_cast<std::size_t>(placed.layer)));
      const Pose& of = objects_[object].pose;
      const Quat back = glm::conjugate(of.orientation);
      const glm::vec3 normal(back * placed.world_vector(triangle.normal));
      for (const std::uint32_t corner : triangle.corners) {
        const Vec3 place =
            placed.world_vector(placed.surface->vertices()[corner]) + placed.position;
        layers[static_cast<std::size_t>(placed.layer) - 1].push_back(
            {glm::vec3(back * (place - of.position)), normal});
      }
    }
  }
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    objects_[i].layers.clear();
    for (DrawnMesh& mesh : found[i]) {
      smooth(mesh);
      objects_[i].layers.push_back(std::make_shared<const DrawnMesh>(std::move(mesh)));
    }
  }
}

std::vector<glm::vec3> SceneDrawing::outline() const {
  std::vector<glm::vec3> out;
  for (const Object& object : objects_) {
    const glm::mat4 place = place_of(object.pose);
    for (const DrawnVertex& corner : *object.mesh)
      out.emplace_back(place * glm::vec4(corner.position, 1));
  }
  return out;
}

void SceneDrawing::add_outline(const SceneMoment& moment, const SceneDrawingSettings& settings,
                               std::vector<glm::vec3>& points) const {
  const auto add = [&points](const Vec3& point) {
    if (finite(point)) points.emplace_back(point);
  };
  ScenePicture forces;
  add_forces(moment, light_theme(), settings, forces);
  for (const DrawnArrow& arrow : forces.arrows) add(Vec3(arrow.from + arrow.by));
  const DrawnTool tool = tool_in_hand(tool_, moment.sample);
  if (moment.held || !tool_.segments.empty()) {
    for (const rendering::LineProbe& segment : tool.segments) {
      add(segment.tip);
      add(segment.tail);
    }
  }
  if (moment.held) {
    add(moment.held->tail);
    return;
  }
  const Vec3 along = tool.stylus.tail - tool.stylus.tip;
  const double length = glm::length(along);
  if (!(length > 0)) return;
  add(tool.stylus.tip);
  add(tool.stylus.tip + std::min(1.0, 1.6 * size_ / length) * along);
}

std::optional<SceneDrawing::Hit> SceneDrawing::hit(const glm::vec3& from, const glm::vec3& along,
                                                   const std::vector<Pose>& poses) const {
  std::optional<Hit> nearest;
  float least = 0;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const glm::mat4 back = glm::inverse(place_of(poses.empty() ? objects_[i].pose : poses[i]));
    const auto distance = distance_to(*objects_[i].mesh, glm::vec3(back * glm::vec4(from, 1)),
                                      glm::vec3(back * glm::vec4(along, 0)));
    if (!distance || (nearest && *distance >= least)) continue;
    least = *distance;
    nearest = Hit{i, from + least * along};
  }
  return nearest;
}

void SceneDrawing::add_objects(const SceneMoment& moment, const SceneDrawingSettings& settings,
                               ScenePicture& out) const {
  const auto add_label = [&](std::size_t i, const glm::mat4& place) {
    if (!settings.labels) return;
    const Object& object = objects_[i];
    const glm::vec3 middle(place * glm::vec4(0.5F * (object.low + object.high), 1));
    const glm::vec3 half = 0.5F * (object.high - object.low);
    const float top =
        std::min(object.reach, std::abs(place[0].z) * half.x + std::abs(place[1].z) * half.y +
                                   std::abs(place[2].z) * half.z);
    const glm::vec3 above(0, 0, top + 0.06F * static_cast<float>(size_));
    out.labels.push_back({middle + above, object.label});
  };
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const Object& object = objects_[i];
    const glm::mat4 place = place_of(i < moment.poses.size() ? moment.poses[i] : object.pose);
    const auto index = static_cast<int>(i);
    const bool skin = !object.layers.empty() || !object.felt;
    const auto now = std::ranges::find_if(
        moment.soft, [&](const auto& surface) { return surface->object == index; });
    if (now != moment.soft.end() && object.soft != nullptr &&
        (*now)->places.size() == object.soft->rest.size()) {
      out.objects.push_back(
          {drawn_soft(object, **now), glm::mat4(1), object.colour, 1.0F, index, 0});
      add_label(i, place);
      continue;
    }
    out.objects.push_back(
        {object.mesh, place, object.colour, skin ? kSkinOpacity : 1.0F, index, 0});
    for (std::size_t k = 0; k < object.layers.size(); ++k) {
      if (object.layers[k]->empty()) continue;
      out.objects.push_back({object.layers[k], place, kLayerColours[k % kLayerColours.size()],
                             kLayerOpacity, index, static_cast<int>(k) + 1});
    }
    add_label(i, place);
  }
}

void SceneDrawing::add_tool(const SceneMoment& moment, const Theme& theme,
                            const SceneDrawingSettings& settings, ScenePicture& out) const {
  const servo::Sample& sample = moment.sample;
  if (!finite(sample.probe.tip) || !finite(sample.probe.tail)) return;
  const bool touching = sample.rendering.contacts > 0 && finite(sample.rendering.ideal.tip) &&
                        finite(sample.rendering.ideal.tail);
  const DrawnTool in_hand = tool_in_hand(tool_, sample);
  const DrawnTool seen = touching ? ideal_tool(tool_, sample) : in_hand;
  const auto radius = [&](double of_size) {
    return static_cast<float>(of_size * size_ * settings.thickness);
  };
  const auto add_rod = [&](const rendering::LineProbe& line, double thick, const glm::vec3& colour,
                           float through, double thickest) {
    out.rods.push_back({line.tip, line.tail, radius(thick), colour, through,
                        moment.held ? static_cast<float>(thickest * settings.thickness) : 0});
  };
  const bool tip_alone = !settings.sides && tool_.segments.empty();
  for (const rendering::LineProbe& segment : seen.segments)
    add_rod(segment, tip_alone ? 0.4 * kIdealRadius : kIdealRadius, theme.ideal_tool, 0.30F,
            kThickestStretched);
  if (tip_alone)
    out.balls.push_back({seen.stylus.tip, radius(1.8 * kIdealRadius), theme.ideal_tool, 0.30F});
  // The part that is held but does not touch.
  if (!tool_.segments.empty())
    add_rod(seen.stylus, 0.4 * kIdealRadius, theme.ideal_tool, 0.2F, kThickestStretched);
  if (moment.held && finite(moment.held->tip) && finite(moment.held->tail))
    add_rod(*moment.held, kHeldRadius, theme.grip, 0, kThickestHeld);
  if (!touching) return;
  for (const rendering::LineProbe& segment : in_hand.segments)
    add_rod(segment, tip_alone ? 0.5 * kVirtualRadius : kVirtualRadius, theme.virtual_tool, 0.75F,
            kThickestStretched);
  if (tip_alone)
    out.balls.push_back(
        {in_hand.stylus.tip, radius(1.8 * kIdealRadius), theme.virtual_tool, 0.75F});
}

void SceneDrawing::add_forces(const SceneMoment& moment, const Theme& theme,
                              const SceneDrawingSettings& settings, ScenePicture& out) const {
  const double scale = arrow_scale(settings, size_);
  for (const servo::ContactPlace& contact : moment.contacts) {
    const double force = glm::length(contact.force);
    if (!finite(contact.place) || !std::isfinite(force)) continue;
    out.balls.push_back(
        {contact.place, static_cast<float>(kContactRadius * size_), theme.contact, 0.5F});
    if (force < kLeastForce) continue;
    const double length = std::min(scale * force, kLongestArrow * size_);
    out.arrows.push_back({contact.place, length / force * contact.force,
                          static_cast<float>(kArrowRadius * size_), theme.force});
  }
  const Vec3 torque = torque_on_hand(moment);
  const double size = glm::length(torque);
  const double sweep = size * turn_scale(settings);
  if (!finite(torque) || size < kLeastTorque || sweep < kLeastTurn) return;
  const rendering::LineProbe& held = moment.held ? *moment.held : moment.sample.probe;
  out.turns.push_back({0.5 * (held.tip + held.tail), torque / size,
                       static_cast<float>(kTurnRadius * size_),
                       static_cast<float>(kTurnThickness * size_),
                       static_cast<float>(std::min(sweep, kLongestTurn)), theme.torque});
}

std::array<std::string, 2> SceneDrawing::scale_words(const SceneDrawingSettings& settings) const {
  char arrow[48], turn[48];
  // For a round force and torque whose signs are about as large as the scene.
  const double force = round_step(size_ / arrow_scale(settings, size_));
  const double torque = round_step(kLongestTurn / turn_scale(settings));
  std::snprintf(arrow, sizeof arrow, "%g N: %.0f mm", force,
                1000 * force * arrow_scale(settings, size_));
  std::snprintf(turn, sizeof turn, "%g mN m: %.0f degrees", 1000 * torque,
                torque * turn_scale(settings) * 180 / M_PI);
  return {arrow, turn};
}

ScenePicture SceneDrawing::picture(const SceneMoment& moment, const Theme& theme,
                                   const SceneDrawingSettings& settings) const {
  ScenePicture out;
  out.middle = middle_;
  out.size = static_cast<float>(size_);
  out.ground = ground_;
  out.grid = static_cast<float>(round_step(size_ / 2.5));
  add_objects(moment, settings, out);
  add_tool(moment, theme, settings, out);
  add_forces(moment, theme, settings, out);
  out.caption.push_back(caption_of(moment, static_cast<double>(out.grid)));
  if (!out.arrows.empty() || !out.turns.empty()) {
    const auto [arrow, turn] = scale_words(settings);
    out.caption.push_back(arrow + "    " + turn);
  }
  return out;
}

}  // namespace palpate::runner::display
