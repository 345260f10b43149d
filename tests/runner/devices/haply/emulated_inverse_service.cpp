// An emulated Inverse Service, to try palpate without a device:
//   emulated_inverse_service [PORT]      then: palpate run ... --device inverse3 --service
//   127.0.0.1:PORT Lines on standard input change it: "hand X Y Z" (m), "grip W X Y Z", "stiffness
//   N_PER_M", "version TEXT", "preset TEXT",
//   "workspace SCALE" (left behind by another program), "set NAME 0|1" (present, in_use,
//   calibrated, powered, awake, button, mute, frozen), "delay S", "second LINE" (the same for the
//   second arm, which exists once "present" is set), "service 0|1" (0 ends all connections),
//   "stroke" (the hand moves to and fro by itself), "state" (prints force and commands as JSON). It
//   ends with its input, unless the hand strokes.

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "tests/runner/devices/haply/emulated_service.h"

using palpate::runner::devices::testing::EmulatedArm;
using palpate::runner::devices::testing::EmulatedService;

namespace {

/// Rests beside the object for a second, then moves through the middle and back.
[[noreturn]] void stroke(EmulatedService& service) {
  constexpr double kAway = 0.08;  // m
  for (double t = 0;; t += 0.002) {
    const double phase = std::fmod(t, 5);
    const double x = phase < 1 ? kAway : kAway * std::cos(2 * 3.14159265358979 * (phase - 1) / 4);
    service.with([x](EmulatedArm& arm) { arm.hand = {x, 0, 0}; });
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

}  // namespace

int main(int argc, char** argv) {
  EmulatedService service(argc > 1 ? std::atoi(argv[1]) : 0);
  std::cout << "serving " << service.address() << std::endl;
  const std::map<std::string, bool EmulatedArm::*> flags = {
      {"present", &EmulatedArm::present},
      {"in_use", &EmulatedArm::in_use},
      {"calibrated", &EmulatedArm::calibrated},
      {"powered", &EmulatedArm::powered},
      {"awake", &EmulatedArm::awake},
      {"button", &EmulatedArm::button},
      {"mute", &EmulatedArm::mute},
      {"frozen", &EmulatedArm::frozen}};
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "stroke") stroke(service);
    if (word == "service") {
      bool on = true;
      words >> on;
      service.turn(on);
    }
    const std::size_t which = word == "second" ? 1 : 0;
    if (which == 1) words >> word;
    const auto change = [&](EmulatedArm& arm) {
      if (word == "hand") words >> arm.hand[0] >> arm.hand[1] >> arm.hand[2];
      if (word == "grip") words >> arm.grip[0] >> arm.grip[1] >> arm.grip[2] >> arm.grip[3];
      if (word == "stiffness") words >> arm.hand_stiffness;
      if (word == "delay") words >> arm.delay;
      if (word == "version") words >> arm.version;
      if (word == "preset") words >> arm.preset;
      if (word == "workspace") words >> arm.workspace_scale;
      std::string name;
      if (word == "set" && words >> name && flags.count(name) > 0) words >> arm.*flags.at(name);
      if (word == "state")
        std::cout << nlohmann::json{{"force_n", arm.force}, {"commands", arm.commands}}.dump()
                  << std::endl;
    };
    service.with(change, which);
  }
  return 0;
}
