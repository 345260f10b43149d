#include "runner/display/seen.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtx/transform.hpp>
#include <numbers>
#include <utility>

#include "data/base/random.h"
#include "stimuli/texture.h"

namespace palpate::runner::display {
namespace {

constexpr double kDent = 0.010;       // m, radius of a drawn indentation
constexpr double kDentStep = 0.0025;  // m, longest edge of triangles that can show it
constexpr std::size_t kMostCorners = 600'000;
constexpr float kToolRadius = 0.0016F;  // m
constexpr double kSecond_ns = 1e9;

glm::mat4 seen_place(const Pose& pose, double size_ratio) {
  glm::mat4 out(glm::mat4_cast(glm::quat(pose.orientation)));
  out[3] = glm::vec4(glm::vec3(pose.position), 1);
  return glm::scale(out, glm::vec3(static_cast<float>(size_ratio)));
}

/// The same triangles, halved at their longest edge until none is longer than kDentStep.
DrawnMesh refined(const DrawnMesh& mesh) {
  DrawnMesh todo = mesh, out;
  const auto middle = [](const DrawnVertex& a, const DrawnVertex& b) {
    DrawnVertex m;
    m.position = 0.5F * (a.position + b.position);
    m.normal = glm::normalize(a.normal + b.normal);
    m.tint = 0.5F * (a.tint + b.tint);
    return m;
  };
  while (!todo.empty()) {
    std::array<DrawnVertex, 3> t;
    for (std::size_t i = 3; i-- > 0;) {
      t[i] = todo.back();
      todo.pop_back();
    }
    std::size_t longest = 0;
    float most = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const float length = glm::distance(t[i].position, t[(i + 1) % 3].position);
      if (length > most) {
        most = length;
        longest = i;
      }
    }
    if (most <= static_cast<float>(kDentStep) || out.size() + todo.size() > kMostCorners) {
      out.insert(out.end(), t.begin(), t.end());
      continue;
    }
    const DrawnVertex a = t[longest], b = t[(longest + 1) % 3], c = t[(longest + 2) % 3];
    const DrawnVertex m = middle(a, b);
    todo.insert(todo.end(), {a, m, c, m, b, c});
  }
  return out;
}

/// Whether the drawn surface gives way.
bool gives(const protocols::SeenSpec& seen) { return seen.give_stiffness || seen.gives_as_felt; }

/// m, by which it does.
double give_of(const protocols::SeenSpec& seen, const SeenMoment& moment) {
  if (!moment.touching) return 0;
  if (seen.give_stiffness) return moment.pressing / *seen.give_stiffness;
  return seen.gives_as_felt ? moment.depth : 0;
}

rendering::LineProbe shifted(const rendering::LineProbe& probe, const Vec3& by) {
  return {probe.tip + by, probe.tail + by};
}

}  // namespace

PictureWindow window_of(const SeenTrial& trial, double right) {
  const protocols::ViewSpec& view = trial.view;
  const Vec3 across = glm::normalize(view.lower_right - view.lower_left);
  const auto place = [&](const Vec3& device) {
    return glm::vec3(trial.workspace.to_virtual(device));
  };
  return {place(view.lower_left), place(view.lower_right), place(view.upper_left),
          place(view.eye + right * across)};
}

SeenMoment moment_of(const servo::Sample& sample, const SeenMoment* before) {
  SeenMoment out;
  out.time_ns = sample.time_ns;
  out.hand = sample.probe;
  out.ideal = sample.probe;
  out.forces = sample.phase == servo::Phase::feeling;
  out.touching = out.forces && sample.rendering.contacts > 0;
  out.touched = out.touching || (out.forces && before != nullptr && before->touched);
  if (!out.touching) return out;
  const auto& deepest = sample.rendering.deepest;
  out.ideal = sample.rendering.ideal;
  out.normal = deepest.normal;
  out.contact = deepest.point;
  out.depth = deepest.depth;
  out.pressing = std::max(0.0, glm::dot(sample.rendering.force, deepest.normal));
  return out;
}

void SeenTrail::add(const SeenMoment& moment) {
  const std::lock_guard lock(mutex_);
  if (!moments_.empty() && moment.time_ns <= moments_.back().time_ns) return;
  moments_.push_back(moment);
  while (moments_.front().time_ns < moment.time_ns - kKept_ns) moments_.pop_front();
}

void SeenTrail::clear() {
  const std::lock_guard lock(mutex_);
  moments_.clear();
}

std::optional<SeenMoment> SeenTrail::newest() const {
  const std::lock_guard lock(mutex_);
  return moments_.empty() ? std::nullopt : std::optional(moments_.back());
}

std::optional<SeenMoment> SeenTrail::at(std::int64_t time_ns) const {
  const std::lock_guard lock(mutex_);
  if (moments_.empty()) return std::nullopt;
  const auto after = std::ranges::lower_bound(moments_, time_ns, {}, &SeenMoment::time_ns);
  if (after == moments_.end()) return moments_.back();
  if (after == moments_.begin()) return moments_.front();
  const SeenMoment& before = *std::prev(after);
  const double share = static_cast<double>(time_ns - before.time_ns) /
                       static_cast<double>(after->time_ns - before.time_ns);
  SeenMoment out = share < 0.5 ? before : *after;
  const auto mix = [&](const Vec3& a, const Vec3& b) { return a + share * (b - a); };
  out.hand = {mix(before.hand.tip, after->hand.tip), mix(before.hand.tail, after->hand.tail)};
  out.ideal = {mix(before.ideal.tip, after->ideal.tip), mix(before.ideal.tail, after->ideal.tail)};
  out.pressing = before.pressing + share * (after->pressing - before.pressing);
  out.time_ns = time_ns;
  return out;
}

bool is_visible(const protocols::SeenSpec& seen, const SeenMoment& moment) {
  using When = protocols::SeenSpec::When;
  switch (seen.when) {
    case When::forces:
      return moment.forces;
    case When::contact:
      return moment.forces && moment.touched;
    case When::before:
      return moment.forces && !moment.touched;
    case When::always:
      return true;
  }
  return false;
}

Vec3 noise_at(const SeenTrial& trial, std::int64_t time_ns) {
  if (!(trial.seen.noise > 0)) return Vec3(0);
  const double step = std::floor(static_cast<double>(time_ns) / kSecond_ns * trial.seen.noise_hz);
  Random random(trial.seed, {static_cast<std::uint64_t>(static_cast<std::int64_t>(step))});
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return trial.seen.noise * Vec3(x, y, z);
}

DrawnTool drawn_tool(const SeenTrial& trial, const SeenMoment& moment) {
  const protocols::SeenSpec& seen = trial.seen;
  servo::Sample sample;
  sample.probe = moment.hand;
  sample.rendering.ideal = moment.ideal;
  sample.rendering.contacts = moment.touching ? 1 : 0;
  const bool stops = seen.tool_stops || gives(seen);
  DrawnTool tool =
      stops && moment.touching ? ideal_tool(trial.tool, sample) : tool_in_hand(trial.tool, sample);
  Vec3 by = (seen.tool_gain - 1) * tool.stylus.tip + seen.tool_offset;
  // The drawn surface gives way, and the tool with it.
  by -= give_of(seen, moment) * moment.normal;
  tool.stylus = shifted(tool.stylus, by);
  for (rendering::LineProbe& segment : tool.segments) segment = shifted(segment, by);
  return tool;
}

Pose drawn_pose(const SeenTrial& trial, std::int64_t time_ns) {
  const protocols::SeenSpec& seen = trial.seen;
  const double half = seen.turn_deg * std::numbers::pi / 360;
  const Quat turn(std::cos(half), std::sin(half) * seen.axis);
  return {trial.object.pose.position + seen.offset + noise_at(trial, time_ns),
          turn * trial.object.pose.orientation};
}

float grey_of(double luminance) {
  const double x = std::clamp(luminance, 0.0, 1.0);
  return static_cast<float>(x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055);
}

SeenScene::SeenScene(std::shared_ptr<const SeenTrial> trial) : trial_(std::move(trial)) {
  DrawnMesh mesh = triangles_of(trial_->object);
  if (const auto& texture = trial_->object.texture; texture && texture->depth > 0)
    mesh = with_texture(mesh, stimuli::Texture(*texture, trial_->object.radius));
  if (gives(trial_->seen)) mesh = refined(mesh);
  for (const DrawnVertex& corner : mesh)
    size_ = std::max(size_, static_cast<double>(glm::length(corner.position)));
  mesh_ = std::make_shared<const DrawnMesh>(std::move(mesh));
}

/// A bump (1 - r^2/R^2)^2 about the contact, inwards.
std::shared_ptr<const DrawnMesh> SeenScene::dented(const SeenMoment& moment,
                                                   const Pose& pose) const {
  const double deep = give_of(trial_->seen, moment);
  const Quat back = glm::conjugate(pose.orientation);
  const Vec3 centre = back * (moment.contact - pose.position) / trial_->seen.size_ratio;
  const double inwards = deep / trial_->seen.size_ratio;
  const glm::vec3 normal(back * moment.normal);
  const auto radius = static_cast<float>(kDent / trial_->seen.size_ratio);
  DrawnMesh out = *mesh_;
  for (DrawnVertex& corner : out) {
    const glm::vec3 from = corner.position - glm::vec3(centre);
    const float r = glm::length(from) / radius;
    if (r >= 1) continue;
    const float rest = 1 - r * r;
    corner.position -= static_cast<float>(inwards) * rest * rest * normal;
    const glm::vec3 aside = from - glm::dot(from, normal) * normal;
    const float slope = 4 * static_cast<float>(inwards) * rest / (radius * radius);
    corner.normal = glm::normalize(corner.normal - slope * aside);
  }
  return std::make_shared<const DrawnMesh>(std::move(out));
}

ScenePicture SeenScene::picture(const SeenMoment& moment, std::int64_t time_ns) const {
  const protocols::SeenSpec& seen = trial_->seen;
  ScenePicture out;
  out.with_ground = false;
  out.size = static_cast<float>(2 * size_ * seen.size_ratio);
  const Pose pose = drawn_pose(*trial_, time_ns);
  out.middle = glm::vec3(pose.position);
  const auto light = grey_of(trial_->view.light);
  if (seen.object) {
    out.objects.push_back({give_of(seen, moment) > 0 ? dented(moment, pose) : mesh_,
                           seen_place(pose, seen.size_ratio),
                           light * glm::vec3(0.75F, 0.72F, 0.66F), 1, 0, 0});
  }
  if (seen.tool) {
    for (const rendering::LineProbe& segment : drawn_tool(*trial_, moment).segments)
      out.rods.push_back({glm::vec3(segment.tip), glm::vec3(segment.tail), kToolRadius,
                          light * glm::vec3(0.30F, 0.48F, 0.70F), 0, 0});
  }
  return out;
}

Theme SeenScene::theme() const {
  Theme out = dark_theme();
  out.above = out.below = out.ground = glm::vec3(grey_of(trial_->view.background));
  return out;
}

SeenScene::Place SeenScene::picture_place(std::int64_t time_ns) const {
  const PictureWindow window = window_of(*trial_);
  const glm::vec3 x = window.lower_right - window.lower_left,
                  y = window.upper_left - window.lower_left;
  const glm::mat4 matrix = window.matrix();
  const glm::vec3 centre(drawn_pose(*trial_, time_ns).position);
  const auto half = static_cast<float>(size_ * trial_->seen.size_ratio);
  const auto project = [&](const glm::vec3& point) {
    const glm::vec4 clip = matrix * glm::vec4(point, 1);
    return glm::vec2((clip.x / clip.w + 1) / 2, (1 - clip.y / clip.w) / 2);
  };
  const glm::vec2 middle = project(centre), right = project(centre + half * glm::normalize(x)),
                  up = project(centre + half * glm::normalize(y));
  return {middle.x, middle.y, right.x - middle.x, middle.y - up.y};
}

}  // namespace palpate::runner::display
