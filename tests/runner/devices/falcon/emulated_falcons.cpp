// Runs a command with emulated Falcons on its USB bus:
//
//   emulated_falcons [--falcons N] [--bare | --unhomed] [--control FIFO] [--last PATH]
//                    [--record PATH] COMMAND...
//
// Their serial numbers are EMU1, EMU2, ... Firmware is loaded unless --bare; they are homed unless
// --bare or --unhomed. Exits with COMMAND's status. Writes the final states to PATH, as by state,
// and the packets of the first Falcon as by record. Lines written to FIFO act on Falcon K (from 1),
// vectors in its own frame:
//
//   unplug K | plug K | lose_homing K | buttons K BITS | firmware_file PATH
//   hand K X Y Z STIFFNESS DAMPING     the hand pulls the grip there (m, N/m, N s/m)
//   shake K METRES                     ... and moves it in and out, as for homing
//   load K X Y Z MASS                  a force (N) and mass (kg) at the grip
//   scale K COUNTS                     true counts per newton metre
//   state PATH                         writes their states as JSON
//   record K PATH                      writes its newest packets: time (ns, CLOCK_MONOTONIC),
//                                      commands of the motors (counts), as CSV

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <deque>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>

#include "runner/devices/falcon/parameters.h"
#include "tests/runner/devices/falcon/emulated_bus.h"
#include "tests/runner/devices/falcon/preload.h"

namespace {

using namespace palpate;
using namespace palpate::runner;
using namespace palpate::runner::devices;
using namespace palpate::runner::devices::falcon;
using falcon::testing::EmulatedBus;
using falcon::testing::Emulator;

constexpr double kGripMass = 0.15;  // kg

nlohmann::json state_of(Emulator& emulator) {
  const Vec3 p = emulator.position();
  return {{"uploads", emulator.uploads()},
          {"packets", emulator.packets()},
          {"malformed", emulator.malformed()},
          {"motors", emulator.motors()},
          {"torque_is_zero", emulator.torque_is_zero()},
          {"largest_count", emulator.largest_count()},
          {"torque_before_homing", emulator.torque_before_homing()},
          {"homed", emulator.homed()},
          {"position_m", {p.x, p.y, p.z}}};
}

/// Replaces the file atomically: a reader never sees half of it.
void write_state(EmulatedBus& bus, int falcons, const std::string& path) {
  nlohmann::json all = nlohmann::json::array();
  for (int i = 0; i < falcons; ++i) {
    bus.with(i, [&all](Emulator& emulator) { all.push_back(state_of(emulator)); });
  }
  std::ofstream(path + ".part") << all << "\n";
  std::rename((path + ".part").c_str(), path.c_str());
}

void write_record(EmulatedBus& bus, int index, const std::string& path) {
  std::deque<Emulator::Heard> record;
  bus.with(index, [&record](Emulator& emulator) { record = emulator.record(); });
  std::ofstream out(path + ".part");
  out << "t_ns,motor1,motor2,motor3\n";
  for (const Emulator::Heard& heard : record) {
    out << heard.time_ns;
    for (const int motor : heard.motors) out << ',' << motor;
    out << '\n';
  }
  out.close();
  std::rename((path + ".part").c_str(), path.c_str());
}

bool obey(EmulatedBus& bus, int falcons, const std::string& line) {
  std::istringstream words(line);
  std::string verb;
  words >> verb;
  if (verb == "state" || verb == "firmware_file") {
    std::string path;
    if (!(words >> path)) return false;
    if (verb == "state") {
      write_state(bus, falcons, path);
    } else {
      const auto image = falcon::testing::synthetic_image(400);
      std::ofstream(path, std::ios::binary)
          .write(reinterpret_cast<const char*>(image.data()),
                 static_cast<std::streamsize>(image.size()));
    }
    return true;
  }
  int number = 0;
  std::array<double, 5> values{};
  if (!(words >> number) || number < 1 || number > falcons) return false;
  if (verb == "record") {
    std::string path;
    if (!(words >> path)) return false;
    write_record(bus, number - 1, path);
    return true;
  }
  std::size_t count = 0;
  while (count < values.size() && words >> values[count]) ++count;
  const int index = number - 1;
  const Vec3 vector(values[0], values[1], values[2]);
  if (verb == "unplug" || verb == "plug") {
    verb == "plug" ? bus.plug(index) : bus.unplug(index);
    return true;
  }
  bool known = true;
  bus.with(index, [&](Emulator& emulator) {
    if (verb == "lose_homing") {
      emulator.lose_homing();
    } else if (verb == "buttons" && count == 1) {
      emulator.buttons = static_cast<std::uint8_t>(values[0]);
    } else if (verb == "hand" && count == 5) {
      emulator.plant.hand = [vector](double) { return vector; };
      emulator.plant.hand_stiffness = values[3];
      emulator.plant.hand_damping = values[4];
    } else if (verb == "shake" && count == 1) {
      const double size = values[0];
      emulator.plant.hand = [size](double t) {
        return kCentre + Vec3(0, 0, size * std::sin(6 * t));
      };
      emulator.plant.hand_stiffness = 400;
      emulator.plant.hand_damping = 20;
    } else if (verb == "load" && count == 4) {
      emulator.plant.load = vector;
      emulator.plant.mass = kGripMass + values[3];
    } else if (verb == "scale" && count == 1) {
      emulator.plant.counts_per_torque = values[0];
    } else {
      known = false;
    }
  });
  return known;
}

void listen(EmulatedBus& bus, int falcons, const std::string& fifo) {
  // Open it for writing too: it then never ends, however many writers close it.
  const int file = open(fifo.c_str(), O_RDWR | O_CLOEXEC);
  std::string line;
  for (char letter = 0; read(file, &letter, 1) == 1;) {
    if (letter != '\n') {
      line += letter;
      continue;
    }
    if (!obey(bus, falcons, line)) std::cerr << "emulated_falcons: what is '" << line << "'?\n";
    line.clear();
  }
}

int run(int argc, char** argv) {
  int falcons = 1, at = 1;
  bool bare = false, homed = true;
  std::string fifo, last, record;
  for (; at < argc && std::strncmp(argv[at], "--", 2) == 0; ++at) {
    const std::string option = argv[at];
    if (option == "--bare") bare = true;
    if (option == "--unhomed") homed = false;
    if (option == "--falcons" && at + 1 < argc) falcons = std::atoi(argv[++at]);
    if (option == "--control" && at + 1 < argc) fifo = argv[++at];
    if (option == "--last" && at + 1 < argc) last = argv[++at];
    if (option == "--record" && at + 1 < argc) record = argv[++at];
  }
  if (at >= argc) {
    std::cerr << "usage: emulated_falcons [--falcons N] [--bare | --unhomed] [--control FIFO] "
                 "[--last PATH] [--record PATH] COMMAND...\n";
    return 2;
  }
  // A real Falcon does not wait for a processor. Use real-time priority if allowed.
  const int usual = getpriority(PRIO_PROCESS, 0);
  setpriority(PRIO_PROCESS, 0, -15);
  EmulatedBus bus;
  for (int i = 0; i < falcons; ++i) {
    bus.add("EMU" + std::to_string(i + 1));
    bus.with(i, [bare, homed](Emulator& emulator) {
      if (!bare) emulator.preload(homed);
    });
  }
  if (!fifo.empty()) std::thread(listen, std::ref(bus), falcons, fifo).detach();
  const pid_t child = fork();
  if (child == 0) {
    setpriority(PRIO_PROCESS, 0, usual);
    execvp(argv[at], argv + at);
    _exit(127);
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
  }
  // A guard process outlives the command that it guards.
  const auto torque = [&bus, falcons] {
    for (int i = 0; i < falcons; ++i)
      if (!bus.read(i, &Emulator::torque_is_zero)) return true;
    return false;
  };
  for (int ms = 0; ms < 1000 && torque(); ++ms)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  if (!last.empty()) write_state(bus, falcons, last);
  if (!record.empty()) write_record(bus, 0, record);
  std::cout.flush();
  // The listener does not end by itself.
  std::_Exit(WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status));
}

}  // namespace

int main(int argc, char** argv) {
  if (!falcon::testing::rerun_preloaded(argv)) return 1;
  return run(argc, argv);
}
