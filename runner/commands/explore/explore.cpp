#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <glm/geometric.hpp>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "data/base/text.h"
#include "data/files/atomic_file.h"
#include "data/files/atomic_folder.h"
#include "data/files/file_permissions.h"
#include "protocols/parse.h"
#include "rendering/renderer.h"
#include "runner/commands/run/settings.h"
#include "runner/commands/shared/command.h"
#include "runner/display/scene/painter.h"
#include "runner/display/scene/scene_drawing.h"
#include "runner/output/outputs.h"
#include "runner/output/progress_line.h"
#include "runner/safety/fault_signals.h"
#include "runner/scene_builder.h"
#include "runner/touch/forces.h"
#include "runner/touch/live_touch.h"
#include "runner/touch/scene_notes.h"
#include "stimuli/polygon_soup.h"

namespace palpate::runner::commands {
namespace {

// Pictures of a scene along a recorded path.

struct PictureSize {
  int width = 1280, height = 720;  ///< px
};

struct ViewAngles {
  float yaw = 0.5F, pitch = 0.4F;  ///< rad
  float closer = 1;                ///< above 1: larger
};

struct FrameSettings {
  PictureSize size;
  double every = 0.016;  ///< s, between pictures
  ViewAngles view;
  bool labels = false;
  std::string folder;        ///< of PNG files; empty: none
  bool animate = false;      ///< as a WebP as well
  bool may_replace = false;  ///< pictures in the folder
};

inline constexpr std::size_t kMostFrames = 100'000;

struct DrawnFrames {
  std::size_t pictures = 0;
  std::string animation;                       ///< WebP; empty: none
  double seconds = 0;                          ///< of the path
  std::vector<std::string> notes;              ///< features of the scene that are left out
  double tick_median_ns = 0, tick_p99_ns = 0;  ///< cost of a row's tick here, by the clock
};

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
std::vector<std::size_t> shown_rows(const std::vector<touch::TimedPose>& poses, double every) {
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

TouchedScene touch_along(const rendering::Scene& scene, const protocols::SceneSpec& spec,
                         const rendering::Renderer& renderer,
                         const std::vector<touch::TimedPose>& poses,
                         const std::vector<std::size_t>& rows) {
  TouchedScene out;
  std::size_t row = 0, next = 0;
  touch::render_along(
      scene, spec, renderer, poses,
      [&](const touch::TimedPose& pose, const rendering::Rendering& rendering,
          const rendering::RenderState& state) {
        const bool shown = next < rows.size() && rows[next] == row++;
        // Scale arrows by the whole path, not only by the drawn rows.
        for (const servo::ContactPlace& contact : display::contact_places(scene, state, rendering))
          out.strongest = std::max(out.strongest, glm::length(contact.force));
        if (!shown) return;
        const display::SceneMoment moment = touch::moment_of(pose, spec, scene, rendering, state);
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
                                     const std::vector<touch::TimedPose>& poses) {
  std::vector<double> costs;
  costs.reserve(poses.size());
  double before = output::now_ns();
  touch::render_along(
      scene, spec, renderer, poses,
      [&](const touch::TimedPose&, const rendering::Rendering&, const rendering::RenderState&) {
        const double now = output::now_ns();
        costs.push_back(now - before);
        before = output::now_ns();
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

/// Refuses a folder of frames before any work: what exists is empty, or with `may_replace` holds
/// nothing but frames. \throws UsageError
void check_frames_folder(const std::string& folder, bool may_replace) {
  const std::string named = "--frames " + folder + ": ";
  if (folder.empty() || folder == "-") throw UsageError("--frames: expected a folder");
  const std::string fault = data::resolve_trusted_links(folder).fault;
  if (!fault.empty()) throw UsageError(named + fault);
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

/// \param scene_path  that faults name. \throws UsageError, DisplayError, MeshError, StoreError
DrawnFrames draw_frames(const std::string& scene_path, const protocols::SceneSpec& spec,
                        const rendering::Renderer& renderer,
                        const std::vector<touch::TimedPose>& poses, const FrameSettings& settings) {
  const std::vector<std::size_t> rows = shown_rows(poses, settings.every);
  SceneBuilder builder;
  const rendering::Scene scene = touch::build_scene(builder, scene_path, spec, renderer);
  const TouchedScene touched = touch_along(scene, spec, renderer, poses, rows);
  display::SceneDrawing drawing(spec.objects, tool_of(spec.tool));
  drawing.add_compiled(scene);
  const display::SceneDrawingSettings looks =
      drawing_settings(drawing, touched, renderer, settings.labels);
  const display::Camera camera = camera_for(drawing, touched, looks, settings);
  const std::unique_ptr<display::ScenePainter> painter =
      display::make_painter(settings.size.width, settings.size.height);
  std::optional<data::AtomicFolder> folder;
  if (!settings.folder.empty()) folder.emplace(settings.folder);
  output::ProgressLine progress("pictures");
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
                  .notes = touch::scene_notes(spec, scene, builder),
                  .tick_median_ns = median,
                  .tick_p99_ns = p99};
  if (settings.animate)
    out.animation =
        painter->animation(static_cast<double>(touched.moments.size()) * settings.every);
  if (folder) folder->commit(settings.may_replace);
  return out;
}

constexpr double kShortest = 0.001, kLongest = 3600;  // s, between pictures
constexpr double kSteepest = 85;                      // degrees
constexpr double kLeastZoom = 0.01, kMostZoom = 100;

/// The whole text as a number.
template <class Number>
std::optional<Number> number_of(std::string_view text) {
  Number out{};
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, out);
  if (error != std::errc{} || stop != end) return std::nullopt;
  if (!std::isfinite(static_cast<double>(out))) return std::nullopt;
  return out;
}

std::vector<std::string_view> split(std::string_view text, char at) {
  std::vector<std::string_view> out;
  for (;;) {
    const std::size_t end = text.find(at);
    out.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return out;
    text.remove_prefix(end + 1);
  }
}

[[noreturn]] void refuse_value(const char* option, const std::string& expected,
                               const std::string& text) {
  throw UsageError("--" + std::string(option) + ": expected " + expected + ", found '" +
                   printable(text, 60) + "'");
}

/// "1280x720". \throws UsageError naming --size
PictureSize parse_size(const std::string& text) {
  const auto parts = split(text, 'x');
  const auto side = [&](std::size_t i) {
    const auto value = number_of<int>(parts[i]);
    const bool good = value && *value >= display::ScenePainter::kLeastSide &&
                      *value <= display::ScenePainter::kMostSide;
    return good ? *value : 0;
  };
  if (parts.size() == 2 && side(0) > 0 && side(1) > 0) return {side(0), side(1)};
  refuse_value("size",
               "width and height of " + std::to_string(display::ScenePainter::kLeastSide) + " to " +
                   std::to_string(display::ScenePainter::kMostSide) + " px, such as 1280x720",
               text);
}

/// "16ms" or "0.5s", in s. \throws UsageError naming --every
double parse_every(const std::string& text) {
  std::string_view number = text;
  double unit = 0;
  if (number.ends_with("ms")) {
    unit = 0.001;
    number.remove_suffix(2);
  } else if (number.ends_with('s')) {
    unit = 1;
    number.remove_suffix(1);
  }
  const auto value = number_of<double>(number);
  const double seconds = value ? unit * *value : 0;
  if (seconds >= kShortest && seconds <= kLongest) return seconds;
  refuse_value("every", "a time from 1ms to 3600s with its unit, such as 16ms or 0.5s", text);
}

/// "30,20" or "30,20,1.5": degrees to the right and up, and the magnification. \throws UsageError
/// naming --view
ViewAngles parse_view(const std::string& text) {
  const auto parts = split(text, ',');
  const char* const expected =
      "degrees to the right and up (-85 to 85), and optionally the zoom (0.01 to 100), such as "
      "30,20 or 30,20,1.5";
  std::vector<double> values;
  for (const std::string_view part : parts) {
    const auto value = number_of<double>(part);
    if (!value) refuse_value("view", expected, text);
    values.push_back(*value);
  }
  const bool two_or_three = values.size() == 2 || values.size() == 3;
  if (!two_or_three || std::abs(values[0]) > 360 || std::abs(values[1]) > kSteepest)
    refuse_value("view", expected, text);
  const double closer = values.size() == 3 ? values[2] : 1;
  if (closer < kLeastZoom || closer > kMostZoom) refuse_value("view", expected, text);
  constexpr double kRadPerDegree = M_PI / 180;
  return {static_cast<float>(kRadPerDegree * values[0]),
          static_cast<float>(kRadPerDegree * values[1]), static_cast<float>(closer)};
}

namespace po = boost::program_options;

void add_explore_options(CommandLine& line, station::RunSettings& device) {
  line.positional_names = {"SCENE.json"};
  line.options.add_options()  //
      ("device", po::value<std::string>()->value_name("NAME"),
       "what touches it in the window: mouse (default) or as for palpate run")  //
      ("trajectory", po::value<std::string>()->value_name("FILE"),
       "path of the stylus instead, CSV as for palpate render")  //
      ("frames", po::value<std::string>()->value_name("DIR"),
       "no window: new folder for pictures of the path, frame-00000.png and so on")  //
      ("animation", po::value<std::string>()->value_name("FILE"),
       "no window: the same as one animated picture, WebP")  //
      ("renderer", po::value<std::string>()->value_name("NAME")->default_value("ray"),
       "point or ray")  //
      ("size", po::value<std::string>()->value_name("WxH")->default_value("1280x720"),
       "of the pictures, px")  //
      ("every", po::value<std::string>()->value_name("TIME")->default_value("16ms"),
       "between pictures")  //
      ("view", po::value<std::string>()->value_name("YAW,PITCH[,ZOOM]")->default_value("30,22"),
       "where the camera of the pictures stands, degrees: 0,0 looks along +y with x to the right "
       "and z up, 90,0 stands on +x; what is touched is in the picture")  //
      ("labels", po::bool_switch(), "number and shape at each object")    //
      ("pictures", po::value<std::string>()->value_name("DIR"),
       "where the window keeps pictures: scene-1.png and so on")  //
      ("force", "replace existing files and frames");
  add_device_options(line.options, device);
  add_recorder_options(line.options, device);
}

int draw_pictures(const po::variables_map& values, const rendering::Renderer& renderer) {
  FrameSettings settings{.size = parse_size(text_of(values, "size")),
                         .every = parse_every(text_of(values, "every")),
                         .view = parse_view(text_of(values, "view")),
                         .labels = values["labels"].as<bool>(),
                         .folder = text_of(values, "frames"),
                         .animate = values.count("animation") > 0,
                         .may_replace = values.count("force") > 0};
  if (values.count("trajectory") == 0)
    throw UsageError("the option '--trajectory' is required to draw pictures");
  for (const char* option : {"device", "pictures"})
    if (values.count(option) > 0)
      throw UsageError("--" + std::string(option) +
                       " requires the window: leave out --frames and --animation");
  output::Outputs outputs(values, {"animation"}, {"SCENE.json", "trajectory"});
  const std::string animation =
      values.count("animation") > 0 ? text_of(values, "animation") : std::string();
  if (!animation.empty() && !animation.ends_with(".webp"))
    throw UsageError("--animation " + animation + ": expected a name that ends in .webp");
  if (values.count("frames") > 0) check_frames_folder(settings.folder, settings.may_replace);
  const std::string scene_path = text_of(values, "SCENE.json");
  const protocols::SceneSpec spec = protocols::parse_scene(scene_path);
  for (const stimuli::ObjectSpec& object : spec.objects) outputs.protect(object);
  const std::vector<touch::TimedPose> poses = touch::read_trajectory(text_of(values, "trajectory"));
  DrawnFrames drawn = draw_frames(scene_path, spec, renderer, poses, settings);
  for (const std::string& note : drawn.notes)
    std::cerr << printable(scene_path) << ": " << note << '\n';
  outputs.put("animation", std::move(drawn.animation));
  outputs.write();
  std::cout << drawn.pictures << " pictures of " << settings.size.width << " x "
            << settings.size.height << " px, " << drawn.seconds << " s of the path\n"
            << "a tick took " << drawn.tick_median_ns / 1000
            << " us in the median, 99 of 100 at most " << drawn.tick_p99_ns / 1000 << " us\n";
  return 0;
}

int open_window(const po::variables_map& values, const rendering::Renderer& renderer,
                const station::RunSettings& device) {
  touch::HandsOnSettings settings{.scene_path = text_of(values, "SCENE.json"),
                                  .trajectory = text_of(values, "trajectory"),
                                  .pictures = text_of(values, "pictures"),
                                  .labels = values["labels"].as<bool>(),
                                  .run = device};
  settings.run.device = text_of(values, "device");
  check_recorders(settings.run);
  if (!settings.trajectory.empty() && !settings.run.device.empty())
    throw UsageError("--device and --trajectory: expected one of them");
  if (settings.trajectory.empty() && settings.run.device.empty()) settings.run.device = "mouse";
  return touch::explore_hands_on(protocols::parse_scene(settings.scene_path), renderer, settings);
}

}  // namespace

int explore_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate explore SCENE.json [--device NAME | --trajectory T.csv] [--renderer point|ray]\n"
      "               [--labels] [--pictures DIR]\n"
      "       palpate explore SCENE.json --trajectory T.csv (--frames DIR | --animation "
      "FILE.webp)\n"
      "               [--renderer point|ray] [--size 1280x720] [--every 16ms]\n"
      "               [--view YAW,PITCH[,ZOOM]] [--labels] [--force]";
  line.summary =
      "Touches a scene in a window, with the mouse, a device or a recorded path; or draws it\n"
      "along a path without a display (--frames, --animation). Shown are the objects, the ideal\n"
      "tool (where it would be if objects were solid), the virtual one (orange, as the hand\n"
      "holds it), each contact place with the force on the tool, and the torque on the hand\n"
      "(violet). In the window Esc and F12 command zero force. A mesh file in place of a scene is\n"
      "touched alone, in its own coordinates, m.";
  line.example =
      "  palpate explore protocols/scenes/fig17a-engine.json\n"
      "  palpate explore bunny.stl\n"
      "  palpate explore protocols/scenes/fig17a-engine.json \\\n"
      "      --trajectory protocols/scenes/fig17a-engine.csv --frames engine --every 100ms\n"
      "  palpate explore scene.json --trajectory path.csv --animation scene.webp --size 640x360\n";
  station::RunSettings device;
  add_explore_options(line, device);
  const auto values = line.parse(args);
  if (!values) return 0;
  const rendering::Renderer& renderer = touch::renderer_named(text_of(*values, "renderer"));
  const bool draws = values->count("frames") > 0 || values->count("animation") > 0;
  if (draws) return draw_pictures(*values, renderer);
  for (const char* option : {"size", "every", "view"})
    if (!(*values)[option].defaulted())
      throw UsageError("--" + std::string(option) +
                       " requires pictures: expected --frames or --animation");
  return open_window(*values, renderer, device);
}

}  // namespace palpate::runner::commands
