#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <thread>

#include "protocols/parse.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/progress_line.h"
#include "runner/commands/shared/stop_signal.h"
#include "runner/devices/simulated.h"
#include "runner/session/device_check.h"
#include "runner/session/simulated_study.h"
#include "stimuli/printable.h"

namespace palpate::runner {
namespace {

namespace po = boost::program_options;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

int simulate_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage = "palpate simulate PROTOCOL.json --db FILE [--participants N] [--seed S] [--jobs J]";
  line.summary =
      "Runs the whole study with simulated participants through the renderers, device layer, "
      "session and\n"
      "store that live participants use. Their data is labelled simulated. Run again, it goes on "
      "where it\n"
      "stopped; the same seed gives the same data, whatever the jobs and interruptions.";
  line.example =
      "  palpate simulate protocols/quick.json --db quick.db --participants 2    a minute's try\n"
      "  palpate simulate protocols/ho2000.json --db study.db                    the paper's "
      "study\n"
      "  palpate simulate protocols/ho2000.json --db study.db --participants 20  more of the "
      "same\n";
  int participants = 7;
  std::uint64_t seed = 1;
  int jobs = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  std::string settings_patch;
  line.options.add_options()  //
      ("db", po::value<std::string>()->required()->value_name("FILE"),
       "database; created, or gone on with")  //
      ("participants", po::value(&participants)->default_value(participants)->value_name("N"),
       "simulated participants, numbered from 1")  //
      ("seed", po::value(&seed)->default_value(seed)->value_name("S"),
       "of the participants; the order of trials follows the protocol's own seed")  //
      ("jobs", po::value(&jobs)->default_value(jobs)->value_name("J"),
       "sessions simulated at a time")  //
      ("settings", po::value(&settings_patch)->value_name("FILE"),
       "JSON merge patch on the frozen settings of the simulated participant, for ablations");
  line.positional_names = {"PROTOCOL.json"};
  const auto values = line.parse(args);
  if (!values) return 0;
  if (participants < 1 || participants > 100000)
    throw UsageError("--participants: 1 to 100000 was expected");
  if (jobs < 1 || jobs > 1024) throw UsageError("--jobs: 1 to 1024 was expected");

  protocols::Protocol protocol =
      protocols::parse_protocol((*values)["PROTOCOL.json"].as<std::string>());
  const SimulatedSettings settings = load_simulated_settings(settings_patch);
  const SimulatedStylus stylus(settings.device, settings.hand, protocol.stylus.length,
                               protocol.stylus.grip, 1 / protocol.servo_rate);
  const std::vector<LimitedMaterial> limited = limit_materials(protocol, stylus.capabilities());
  for (const LimitedMaterial& one : limited)
    std::fprintf(stderr, "%s\n", stimuli::printable(one.text).c_str());
  // Before the database is made: what is refused leaves nothing behind.
  std::string reasons;
  for (const std::string& fault : simulation_faults(protocol, StimulusLibrary(protocol), settings))
    reasons += "\n" + fault;
  if (!reasons.empty()) throw UsageError("this protocol cannot be simulated:" + reasons);
  StudyPlan plan{participants, seed, jobs, ""};
  if (!limited.empty())
    plan.event = to_json_text(limited, stylus.capabilities(), protocol.servo_rate);
  data::Store store =
      data::Store::open((*values)["db"].as<std::string>(), data::Store::Mode::write_or_create);
  warn_of_exposure(store.path());
  const auto start = std::chrono::steady_clock::now();
  ProgressLine progress_line("trials");
  StudyProgress progress;
  progress = simulate_study(
      protocol, store, settings, plan, watch_stop_signals(), [&](const StudyProgress& p) {
        progress_line.show(static_cast<double>(p.recorded) / static_cast<double>(p.expected));
      });
  progress_line.clear();
  const double elapsed = seconds_since(start);
  std::printf("%s, SIMULATED participants: %lld of %lld trials in %s\n", protocol.name.c_str(),
              static_cast<long long>(progress.recorded), static_cast<long long>(progress.expected),
              stimuli::printable(store.path()).c_str());
  std::printf("settings version %d, sha256 %.12s...; seed %llu\n", settings.version,
              settings.sha256.c_str(), static_cast<unsigned long long>(seed));
  if (progress.this_run > 0) {
    std::printf("%lld trials now: %.0f simulated s in %.1f s, %.0f simulated seconds per second\n",
                static_cast<long long>(progress.this_run), progress.simulated_seconds, elapsed,
                progress.simulated_seconds / elapsed);
  }
  if (progress.recorded < progress.expected) {
    std::fprintf(stderr, "stopped; the same command goes on from here\n");
    return 1;
  }
  return 0;
}

}  // namespace palpate::runner
