#include <charconv>
#include <cmath>
#include <iostream>
#include <optional>
#include <string_view>
#include <vector>

#include "data/base/text.h"
#include "protocols/parse.h"
#include "runner/commands/explore/frames.h"
#include "runner/commands/explore/live_touch.h"
#include "runner/commands/render/forces.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/outputs.h"
#include "runner/display/scene/painter.h"

namespace palpate::runner::commands {
namespace {

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

}  // namespace

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

ViewAngles parse_view(const std::string& text) {
  const auto parts = split(text, ',');
  const char* const expected =
      "degrees to the right and up (-85 to 85), and if need be how many times as large (0.01 to "
      "100), such as 30,20 or 30,20,1.5";
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

namespace {

namespace po = boost::program_options;

void add_explore_options(CommandLine& line) {
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
      ("calibration", po::value<std::string>()->value_name("FILE"),
       "of the device, as for palpate run")                                                       //
      ("without-calibration", po::bool_switch(), "a device that was not calibrated may be used")  //
      ("force", "replace existing files and frames");
}

std::string text_of(const po::variables_map& values, const char* option) {
  return values.count(option) > 0 ? values[option].as<std::string>() : std::string();
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
                       " goes with the window: leave out --frames and --animation");
  Outputs outputs(values, {"animation"}, {"SCENE.json", "trajectory"});
  const std::string animation =
      values.count("animation") > 0 ? text_of(values, "animation") : std::string();
  if (!animation.empty() && !animation.ends_with(".webp"))
    throw UsageError("--animation " + animation + ": expected a name that ends in .webp");
  if (values.count("frames") > 0) check_frames_folder(settings.folder, settings.may_replace);
  const std::string scene_path = text_of(values, "SCENE.json");
  const protocols::SceneSpec spec = protocols::parse_scene(scene_path);
  for (const stimuli::ObjectSpec& object : spec.objects) outputs.protect(object);
  const std::vector<TimedPose> poses = read_trajectory(text_of(values, "trajectory"));
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

int open_window(const po::variables_map& values, const rendering::Renderer& renderer) {
  HandsOnSettings settings{.scene_path = text_of(values, "SCENE.json"),
                           .trajectory = text_of(values, "trajectory"),
                           .device = text_of(values, "device"),
                           .pictures = text_of(values, "pictures"),
                           .calibration = text_of(values, "calibration"),
                           .without_calibration = values["without-calibration"].as<bool>(),
                           .labels = values["labels"].as<bool>()};
  if (!settings.trajectory.empty() && !settings.device.empty())
    throw UsageError("--device and --trajectory: expected one of them");
  if (settings.trajectory.empty() && settings.device.empty()) settings.device = "mouse";
  return explore_hands_on(protocols::parse_scene(settings.scene_path), renderer, settings);
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
  add_explore_options(line);
  const auto values = line.parse(args);
  if (!values) return 0;
  const rendering::Renderer& renderer = renderer_named(text_of(*values, "renderer"));
  const bool draws = values->count("frames") > 0 || values->count("animation") > 0;
  if (draws) return draw_pictures(*values, renderer);
  for (const char* option : {"size", "every", "view"})
    if (!(*values)[option].defaulted())
      throw UsageError("--" + std::string(option) +
                       " goes with pictures: expected --frames or --animation");
  return open_window(*values, renderer);
}

}  // namespace palpate::runner::commands
