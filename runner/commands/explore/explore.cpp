#include <iostream>

#include "protocols/parse.h"
#include "runner/commands/explore/frames.h"
#include "runner/commands/explore/option_values.h"
#include "runner/commands/render/forces.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/outputs.h"

namespace palpate::runner {
namespace {

namespace po = boost::program_options;

void add_options(CommandLine& line) {
  line.positional_names = {"SCENE.json"};
  line.options.add_options()  //
      ("trajectory", po::value<std::string>()->value_name("FILE"),
       "path of the stylus, CSV as for palpate render")  //
      ("frames", po::value<std::string>()->value_name("DIR"),
       "new folder for the pictures: frame-00000.png and so on")  //
      ("animation", po::value<std::string>()->value_name("FILE"),
       "the same as one animated picture, WebP")  //
      ("renderer", po::value<std::string>()->value_name("NAME")->default_value("ray"),
       "point or ray")  //
      ("size", po::value<std::string>()->value_name("WxH")->default_value("1280x720"),
       "of the pictures, px")  //
      ("every", po::value<std::string>()->value_name("TIME")->default_value("16ms"),
       "between pictures")  //
      ("view", po::value<std::string>()->value_name("YAW,PITCH[,ZOOM]")->default_value("30,22"),
       "where the camera stands, degrees: 0,0 looks along -z with y up; what is touched is in the "
       "picture")                                                       //
      ("labels", po::bool_switch(), "number and shape at each object")  //
      ("force", "replace existing files and frames");
}

}  // namespace

int explore_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate explore SCENE.json --trajectory T.csv (--frames DIR | --animation FILE.webp)\n"
      "               [--renderer point|ray] [--size 1280x720] [--every 16ms]\n"
      "               [--view YAW,PITCH[,ZOOM]] [--labels] [--force]";
  line.summary =
      "Draws a scene as it is touched along a recorded path: objects, the ideal tool (dark, where "
      "it would be if objects were solid), the virtual one (orange, as the hand holds it), each "
      "contact place with the force on the tool (red) and the torque on the hand (violet). Needs "
      "no display.";
  line.example =
      "  palpate explore protocols/scenes/engine.json --trajectory protocols/scenes/engine.csv \\\n"
      "      --frames engine-frames --every 100ms\n"
      "  palpate explore scene.json --trajectory path.csv --animation scene.webp --size 640x360\n";
  add_options(line);
  const auto values = line.parse(args);
  if (!values) return 0;
  const auto text = [&](const char* option) {
    return values->count(option) > 0 ? (*values)[option].as<std::string>() : std::string();
  };
  const rendering::Renderer& renderer = renderer_named(text("renderer"));
  FrameSettings settings{.size = parse_size(text("size")),
                         .every = parse_every(text("every")),
                         .view = parse_view(text("view")),
                         .labels = (*values)["labels"].as<bool>(),
                         .folder = text("frames"),
                         .animate = values->count("animation") > 0,
                         .may_replace = values->count("force") > 0};
  if (values->count("trajectory") == 0)
    throw UsageError("the option '--trajectory' is required to draw pictures");
  if (values->count("frames") == 0 && !settings.animate)
    throw UsageError("nothing to write: expected --frames, --animation or both");
  Outputs outputs(*values, {"animation"}, {"SCENE.json", "trajectory"});
  if (values->count("frames") > 0) check_frames_folder(settings.folder, settings.may_replace);
  const std::string scene_path = text("SCENE.json");
  const protocols::SceneSpec spec = protocols::parse_scene(scene_path);
  for (const stimuli::ObjectSpec& object : spec.objects) outputs.protect(object);
  const std::vector<TimedPose> poses = read_trajectory(text("trajectory"));
  DrawnFrames drawn = draw_frames(scene_path, spec, renderer, poses, settings);
  outputs.put("animation", std::move(drawn.animation));
  outputs.write();
  std::cout << drawn.pictures << " pictures of " << settings.size.width << " x "
            << settings.size.height << " px, " << drawn.seconds << " s of the path\n"
            << "a tick took " << drawn.tick_median_ns / 1000
            << " us in the median, 99 of 100 at most " << drawn.tick_p99_ns / 1000 << " us\n";
  return 0;
}

}  // namespace palpate::runner
