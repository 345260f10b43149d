#include <unistd.h>

#include <chrono>
#include <fstream>
#include <iostream>
#include <sstream>
#include <thread>

#include "data/files/atomic_file.h"
#include "runner/commands/render/forces.h"
#include "runner/commands/run/opening.h"
#include "runner/commands/shared/command.h"
#include "runner/safety/fault_signals.h"
#include "runner/serve/network.h"
#include "runner/serve/served_scene.h"
#include "runner/servo/realtime.h"
#include "stimuli/printable.h"

namespace palpate::runner {
namespace {

namespace po = boost::program_options;

std::string text_of(const po::variables_map& values, const char* option) {
  return values.count(option) > 0 ? values[option].as<std::string>() : std::string();
}

std::string contents(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream out;
  out << file.rdbuf();
  return out.str();
}

/// The file with the token while the server runs; only its owner can read it.
class TokenFile {
 public:
  TokenFile(std::string path, const std::string& text) : path_(std::move(path)) {
    if (path_.empty()) return;
    data::AtomicFile file(path_);
    file.write(text + "\n");
    file.sync();
    file.commit(true);
  }
  ~TokenFile() {
    if (!path_.empty()) ::unlink(path_.c_str());
  }
  TokenFile(const TokenFile&) = delete;
  TokenFile& operator=(const TokenFile&) = delete;

 private:
  const std::string path_;
};

int serve(const po::variables_map& values) {
  RunSettings run;
  run.device = text_of(values, "device");
  run.calibration = text_of(values, "calibration");
  run.without_calibration = values["without-calibration"].as<bool>();
  const DeviceKind& kind = find_device_kind(run.device);
  const std::string path = text_of(values, "scene");
  protocols::SceneSpec spec;
  if (!path.empty()) spec = protocols::parse_scene(path);
  const int port = values["port"].as<int>();
  if (port < 0 || port > 65535) throw UsageError("--port: expected a number from 0 to 65535");
  const double rate = values["rate"].as<double>();
  if (!(rate >= 100 && rate <= 4000))
    throw UsageError("--rate: expected a number from 100 to 4000");
  NetworkSettings net{.port = static_cast<std::uint16_t>(port),
                      .socket = text_of(values, "socket"),
                      .token = make_token(),
                      .origins = {}};
  if (values.count("allow-origin") > 0)
    net.origins = values["allow-origin"].as<std::vector<std::string>>();

  FaultSignals signals;
  protocols::Protocol protocol = protocol_of(spec, renderer_named("point"));
  protocol.servo_rate = rate;
  const OpenDevice open = open_device(kind, run, protocol);  // forks: before there are threads
  signals.watch(open.guard);
  if (open.guard != nullptr) check_fitness(open, run, protocol, StimulusLibrary(protocol));
  Network network(net);
  RealClock clock;
  ServoSettings servo;
  servo.rate = protocol.servo_rate;
  servo.workspace = workspace_of(protocol);
  ServedScene scene(*open.device, open.guard, clock,
                    {.scene_path = path.empty() ? "scene" : path,
                     .scene = path.empty() ? "" : contents(path),
                     .servo = servo});
  signals.watch(&scene.servo());
  struct AtTheEnd {
    Network& network;
    FaultSignals& signals;
    ~AtTheEnd() {
      network.end();  // it asks the scene
      signals.watch(static_cast<ServoThread*>(nullptr));
      signals.watch(static_cast<GuardedDevice*>(nullptr));
    }
  } const at_the_end{network, signals};
  scene.answer_through(network);
  scene.give_up_when([&signals] { return signals.end_requested() != 0; });

  nlohmann::ordered_json serving = {{"type", "serving"},
                                    {"url", "ws://127.0.0.1:" + std::to_string(network.port())}};
  if (!net.socket.empty()) serving["socket"] = net.socket;
  serving["token"] = net.token;
  const TokenFile token_file(text_of(values, "token-file"), serving.dump());
  network.begin({.emergency = [&scene] { scene.emergency_zero(); },
                 .silence = [&scene] { scene.controller_is_silent(); },
                 .forces_are_on = [&scene] { return scene.forces_are_on(); },
                 .scene = [&scene] { return scene.scene(); },
                 .next_sample = [&scene](StreamSample& out) { return scene.next_of_stream(out); },
                 .lost = [&scene] { return scene.lost(); }});
  // The token is in the file, where one is asked for: not in a log as well.
  if (values.count("token-file") > 0) serving.erase("token");
  std::cout << serving.dump() << std::endl;
  if (!std::cout) throw std::runtime_error("standard output could not be written");
  while (signals.end_requested() == 0) {
    for (const ServeCommand& command : network.commands()) {
      if (command.left)
        scene.controller_left();
      else
        scene.obey(command.client, command.message);
    }
    scene.attend();
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  scene.emergency_zero();
  const ServoHealth& health = scene.servo().health();
  std::cerr << "palpate serve ends: " << health.ticks() << " ticks, " << health.missed_ticks()
            << " missed\n";
  return 0;
}

}  // namespace

int serve_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate serve --device NAME [--scene SCENE.json] [--port N] [--socket PATH]\n"
      "              [--token-file FILE] [--allow-origin URL ...]";
  line.summary =
      "Lets another program put scenes before the hand: messages in JSON over a WebSocket of\n"
      "127.0.0.1, or a line each over a Unix socket (protocols/serve.schema.json). It says\n"
      "which scene and when; the forces are palpate's, limited and guarded. A program that is\n"
      "silent for half a second, or goes, ends them. Nothing is recorded. Ctrl-C ends it.";
  line.example =
      "  palpate serve --device simulated --scene scene.json\n"
      "  palpate serve --device inverse3 --socket /run/user/1000/palpate --token-file token.json\n"
      "  palpate serve --device simulated --port 7000 --allow-origin http://localhost:8000\n";
  line.options.add_options()  //
      ("device", po::value<std::string>()->value_name("NAME")->required(),
       "as for palpate run")  //
      ("scene", po::value<std::string>()->value_name("FILE"),
       "the first scene; without it the client loads one")  //
      ("port", po::value<int>()->value_name("N")->default_value(0),
       "of 127.0.0.1; 0: one that is free")  //
      ("socket", po::value<std::string>()->value_name("PATH"),
       "also serve the same messages, a line each, on this Unix socket")  //
      ("token-file", po::value<std::string>()->value_name("FILE"),
       "write address and token there, for its owner alone, instead of the token to standard "
       "output; removed at the end")  //
      ("allow-origin", po::value<std::vector<std::string>>()->value_name("URL"),
       "pages from there may connect; repeatable")  //
      ("rate", po::value<double>()->value_name("HZ")->default_value(1000, "1000"),
       "of the servo")  //
      ("calibration", po::value<std::string>()->value_name("FILE"),
       "of the device, as for palpate run")  //
      ("without-calibration", po::bool_switch(), "a device that was not calibrated may be used");
  const auto values = line.parse(args);
  if (!values) return 0;
  try {
    return serve(*values);
  } catch (const MessageRefused& error) {  // of the first scene
    std::string reasons;
    for (const Refusal& why : error.why())
      reasons += "\n" + why.place + (why.place.empty() ? "" : ": ") + why.message;
    throw UsageError("--scene: it cannot be shown on this device:" + reasons);
  }
}

}  // namespace palpate::runner
