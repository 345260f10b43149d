// `palpate simulate`: the whole study with simulated participants.

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "protocols/parse.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/progress_line.h"
#include "runner/commands/shared/stop_signal.h"
#include "runner/session/simulated_study.h"
#include "stimuli/printable.h"

namespace palpate::runner {
namespace {

namespace po = boost::program_options;

struct SimulateSettings {
  std::string protocol, database;
  int version = kDefaultParticipantVersion;
  std::string patch;  ///< file of a JSON merge patch on the simulated participant; empty: none
  StudyPlan plan;
};

/// None where --help was asked for and printed. \throws UsageError
std::optional<SimulateSettings> parse_simulate_settings(const std::vector<std::string>& args) {
  SimulateSettings settings;
  StudyPlan& plan = settings.plan;
  plan.jobs = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  CommandLine line;
  line.usage = "palpate simulate PROTOCOL.json --db FILE [--participants N] [--seed S] [--jobs J]";
  line.summary =
      "Runs the whole study with simulated participants through the renderers, device layer, "
      "session and\n"
      "store that live participants use. Their data is labelled simulated. Run again, it resumes "
      "where it\n"
      "stopped; the same seed gives the same data, whatever the jobs and interruptions.";
  line.example =
      "  palpate simulate protocols/quick.json --db quick.db --participants 2    a minute's try\n"
      "  palpate simulate protocols/ho2000.json --db study.db                    the paper's "
      "study\n"
      "  palpate simulate protocols/ho2000.json --db study.db --participants 20  more of the "
      "same\n";
  line.options.add_options()  //
      ("db", po::value(&settings.database)->required()->value_name("FILE"),
       "database; created or resumed")  //
      ("participants",
       po::value(&plan.participants)->default_value(plan.participants)->value_name("N"),
       "simulated participants, numbered from 1")  //
      ("seed", po::value(&plan.seed)->default_value(plan.seed)->value_name("S"),
       "of the participants; the order of trials follows the protocol's own seed")  //
      ("jobs", po::value(&plan.jobs)->default_value(plan.jobs)->value_name("J"),
       "sessions simulated at a time")  //
      ("participant-version",
       po::value(&settings.version)->default_value(settings.version)->value_name("1|2|3"),
       "of the simulated participant; each is frozen")  //
      ("settings", po::value(&settings.patch)->value_name("FILE"),
       "JSON merge patch on the settings of that version, for ablations");
  line.positional_names = {"PROTOCOL.json"};
  const auto values = line.parse(args);
  if (!values) return std::nullopt;
  if (plan.participants < 1 || plan.participants > 100000)
    throw UsageError("--participants: must be 1 to 100000");
  if (plan.jobs < 1 || plan.jobs > 1024) throw UsageError("--jobs: must be 1 to 1024");
  const std::vector<int> versions = participant_versions();
  if (std::find(versions.begin(), versions.end(), settings.version) == versions.end()) {
    throw UsageError("--participant-version: must be 1 to " + std::to_string(versions.back()));
  }
  settings.protocol = (*values)["PROTOCOL.json"].as<std::string>();
  return settings;
}

/// Limits the materials where the protocol says so, which is said; an event for the record goes
/// into the plan. \throws UsageError: the simulated device or participant cannot do the protocol
void fit_to_simulation(protocols::Protocol& protocol, const SimulatedSettings& simulated,
                       StudyPlan& plan) {
  const LimitedForSimulation limited = limit_for_simulation(protocol, simulated);
  for (const std::string& text : limited.texts)
    std::fprintf(stderr, "%s\n", stimuli::printable(text).c_str());
  plan.event = limited.event;
  std::string reasons;
  for (const std::string& fault : simulation_faults(protocol, StimulusLibrary(protocol), simulated))
    reasons += "\n" + fault;
  if (!reasons.empty()) throw UsageError("this protocol cannot be simulated:" + reasons);
}

/// \param seconds  that it took
void print_summary(const protocols::Protocol& protocol, const std::string& database,
                   const SimulatedSettings& simulated, std::uint64_t seed,
                   const StudyProgress& progress, double seconds) {
  std::printf("%s, SIMULATED participants: %lld of %lld trials in %s\n", protocol.name.c_str(),
              static_cast<long long>(progress.recorded), static_cast<long long>(progress.expected),
              stimuli::printable(database).c_str());
  std::printf("settings version %d, sha256 %.12s...; seed %llu\n", simulated.version,
              simulated.sha256.c_str(), static_cast<unsigned long long>(seed));
  if (progress.this_run == 0) return;
  std::printf("%lld trials now: %.0f simulated s in %.1f s, %.0f simulated seconds per second\n",
              static_cast<long long>(progress.this_run), progress.simulated_seconds, seconds,
              progress.simulated_seconds / seconds);
}

}  // namespace

int simulate_command(const std::vector<std::string>& args) {
  std::optional<SimulateSettings> given = parse_simulate_settings(args);
  if (!given) return 0;
  StudyPlan& plan = given->plan;
  protocols::Protocol protocol = protocols::parse_protocol(given->protocol);
  const SimulatedSettings simulated = load_simulated_settings(given->patch, given->version);
  fit_to_simulation(protocol, simulated, plan);  // first: what is refused leaves no database behind
  data::Store store = data::Store::open(given->database, data::Store::Mode::write_or_create);
  warn_of_exposure(store.path());

  const auto start = std::chrono::steady_clock::now();
  ProgressLine line("trials");
  const StudyProgress progress = simulate_study(
      protocol, store, simulated, plan, catch_stop_signals(), [&line](const StudyProgress& p) {
        line.show(static_cast<double>(p.recorded) / static_cast<double>(p.expected));
      });
  line.clear();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  print_summary(protocol, store.path(), simulated, plan.seed, progress, took.count());
  if (progress.recorded < progress.expected) {
    std::fprintf(stderr, "stopped; the same command resumes from here\n");
    return 1;
  }
  return 0;
}

}  // namespace palpate::runner
