#include "runner/commands/explore/frames.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <glm/geometric.hpp>
#include <optional>
#include <utility>

#include "data/files/atomic_file.h"
#include "data/files/atomic_folder.h"
#include "runner/commands/explore/live_touch.h"
#include "runner/commands/render/forces.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/progress_line.h"
#include "runner/commands/shared/scene_notes.h"
#include "runner/display/scene/painter.h"
#include "runner/display/scene/scene_drawing.h"
#include "runner/safety/fault_signals.h"
#include "runner/scene_builder.h"

namespace palpate::runner::commands {
namespace {

namespace fs = std::filesystem;

constexpr double kLongestOfSize = 0.85;  // the longest arrow, of the size of the scene
constexpr double kWidestTurn = 5;        // rad, of the largest torque
constexpr double kSlack = 1e-9;          // s

std::string frame_name(std::size_t index) {
  char name[32];
  std::snprintf(name, sizeof name, "frame-%05zu.png", index);
  return name;
}

bool is_frame_name(const std::string& name) {
  constexpr std::string_view kBefore = "frame-", kAfter = ".png";
  if (!name.starts_with(kBefore) || !name.ends_with(kAfter)) return false;
  const std::string_view number =
      std::string_view(name).substr(kBefore.size(), name.size() - kBefore.size() - kAfter.size());
  return number.size() >= 5 && number.find_first_not_of("0123456789") == std::string_view::npos;
}

/// The rows of the path to draw: at each multiple of `every` the last one before it.
std::vector<std::size_t> shown_rows(const std::vector<TimedPose>& poses, double every) {
  const double length = poses.back().t - poses.front().t;
  const double count = std::floor(length / every + kSlack) + 1;
  if (count > static_cast<double>(kMostFrames))
    throw UsageError("--every: this path would give " + std::to_string(std::llround(count)) +
                     " pictures; at most " + std::to_string(kMostFrames) + " are drawn");
  std::vector<std::size_t> rows;
  std::size_t row = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
    const double t = poses.front().t + static_cast<double>(k) * every + kSlack;
    while (row + 1 < poses.size() && poses[row + 1].t <= t) ++row;
    rows.push_back(row);
  }
  return rows;
}

/// The scene along the path: the moments to draw, and the values that scale arrows and camera.
struct TouchedScene {
  std::vector<display::SceneMoment> moments;  ///< of the pictures
  double strongest = 0;                       ///< N, at one place
  double most_torque = 0;                     ///< N m
};

TouchedScene touch(const rendering::Scene& scene, const protocols::SceneSpec& spec,
                   const rendering::Renderer& renderer, const std::vector<TimedPose>& poses,
                   const std::vector<std::size_t>& rows) {
  TouchedScene out;
  std::size_t row = 0, next = 0;
  render_along(
      scene, spec, renderer, poses,
      [&](const TimedPose& pose, const rendering::Rendering& rendering,
          const rendering::RenderState& state) {
        const bool shown = next < rows.size() && rows[next] == row++;
        // Scale arrows by the whole path, not only by the drawn rows.
        for (const servo::ContactPlace& contact : display::contact_places(scene, state, rendering))
          out.strongest = std::max(out.strongest, glm::length(contact.force));
        if (!shown) return;
        const display::SceneMoment moment = moment_of(pose, spec, scene, rendering, state);
        out.most_torque = std::max(out.most_torque, glm::length(display::torque_on_hand(moment)));
        // A path with gaps shows a row more than once.
        for (; next < rows.size() && rows[next] == row - 1; ++next) out.moments.push_back(moment);
      });
  return out;
}

display::SceneDrawingSettings drawing_settings(const display::SceneDrawing& drawing,
                                               const TouchedScene& touched,
                                               const rendering::Renderer& renderer, bool labels) {
  display::SceneDrawingSettings out{.sides = renderer.side_contact(), .labels = labels};
  if (touched.strongest > 0)
    out.metres_per_newton = kLongestOfSize * drawing.size() / touched.strongest;
  if (touched.most_torque > 0) out.radians_per_newton_metre = kWidestTurn / touched.most_torque;
  return out;
}

/// The cost of the path's ticks without pictures: {median, 99th percentile}, ns.
std::pair<double, double> tick_costs(const rendering::Scene& scene,
                                     const protocols::SceneSpec& spec,
                                     const rendering::Renderer& renderer,
                                     const std::vector<TimedPose>& poses) {
  std::vector<double> costs;
  costs.reserve(poses.size());
  double before = now_ns();
  render_along(scene, spec, renderer, poses,
               [&](const TimedPose&, const rendering::Rendering&, const rendering::RenderState&) {
                 const double now = now_ns();
                 costs.push_back(now - before);
                 before = now_ns();
               });
  std::ranges::sort(costs);
  return {costs[costs.size() / 2], costs[costs.size() * 99 / 100]};
}

display::Camera camera_for(const display::SceneDrawing& drawing, const TouchedScene& touched,
                           const display::SceneDrawingSettings& looks,
                           const FrameSettings& settings) {
  display::Camera camera;
  camera.resize(static_cast<float>(settings.size.width), static_cast<float>(settings.size.height));
  camera.look_from(settings.view.yaw, settings.view.pitch);
  std::vector<glm::vec3> points = drawing.outline();
  // The tool where it touches; where it does not, it may come from far away.
  const bool touches = std::ranges::any_of(
      touched.moments, [](const display::SceneMoment& moment) { return !moment.contacts.empty(); });
  for (const display::SceneMoment& moment : touched.moments)
    if (!touches || !moment.contacts.empty()) drawing.add_outline(moment, looks, points);
  camera.fit(points);
  camera.zoom(settings.view.closer);
  return camera;
}

}  // namespace

void check_frames_folder(const std::string& folder, bool may_replace) {
  const std::string named = "--frames " + folder + ": ";
  if (folder.empty()) throw UsageError("--frames: expected a folder");
  std::error_code error;
  if (!fs::exists(folder, error)) return;
  if (!fs::is_directory(folder, error))
    throw UsageError(named + "expected a folder; this is a file");
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (!is_frame_name(entry.path().filename().string()) || !entry.is_regular_file())
      throw UsageError(named + "expected a new or empty folder; it holds " +
                       entry.path().filename().string() + ", which is no frame");
    if (!may_replace) throw UsageError(named + "it holds frames; --force replaces them all");
  }
  if (error) throw std::runtime_error(named + error.message());
}

DrawnFrames draw_frames(const std::string& scene_path, const protocols::SceneSpec& spec,
                        const rendering::Renderer& renderer, const std::vector<TimedPose>& poses,
                        const FrameSettings& settings) {
  const std::vector<std::size_t> rows = shown_rows(poses, settings.every);
  SceneBuilder builder;
  const rendering::Scene scene = build_scene(builder, scene_path, spec, renderer);
  const TouchedScene touched = touch(scene, spec, renderer, poses, rows);
  display::SceneDrawing drawing(spec.objects, tool_of(spec.tool));
  drawing.add_compiled(scene);
  const display::SceneDrawingSettings looks =
      drawing_settings(drawing, touched, renderer, settings.labels);
  const display::Camera camera = camera_for(drawing, touched, looks, settings);
  const std::unique_ptr<display::ScenePainter> painter =
      display::make_painter(settings.size.width, settings.size.height);
  std::optional<data::AtomicFolder> folder;
  if (!settings.folder.empty()) folder.emplace(settings.folder);
  ProgressLine progress("pictures");
  for (std::size_t i = 0; i < touched.moments.size(); ++i) {
    display::ScenePicture picture =
        drawing.picture(touched.moments[i], display::light_theme(), looks);
    const std::uint32_t faults = touched.moments[i].sample.faults;
    if (faults != 0) picture.caption.insert(picture.caption.begin(), safety::fault_words(faults));
    painter->draw(picture, camera, display::light_theme());
    if (folder) {
      data::AtomicFile file(folder->prepare(frame_name(i)));
      file.write(painter->png());
      file.commit(false);
    }
    if (settings.animate) painter->add_to_animation(static_cast<double>(i) * settings.every);
    progress.show(static_cast<double>(i + 1) / static_cast<double>(touched.moments.size()));
  }
  const auto [median, p99] = tick_costs(scene, spec, renderer, poses);
  DrawnFrames out{.pictures = touched.moments.size(),
                  .animation = {},
                  .seconds = poses.back().t - poses.front().t,
                  .notes = scene_notes(spec, scene, builder),
                  .tick_median_ns = median,
                  .tick_p99_ns = p99};
  if (settings.animate)
    out.animation =
        painter->animation(static_cast<double>(touched.moments.size()) * settings.every);
  if (folder) folder->commit(settings.may_replace);
  return out;
}

}  // namespace palpate::runner::commands
