#include <iostream>

#include "data/base/text.h"
#include "protocols/parse.h"
#include "runner/commands/explore/frames.h"
#include "runner/commands/explore/hands_on.h"
#include "runner/commands/explore/option_values.h"
#include "runner/commands/render/forces.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/outputs.h"

namespace palpate::runner {
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
      "(violet). In the window Esc and F12 command zero force.";
  line.example =
      "  palpate explore protocols/scenes/fig17a-engine.json\n"
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

}  // namespace palpate::runner
