// `palpate simulate`: the whole study with simulated participants.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "data/base/text.h"
#include "protocols/parse.h"
#include "protocols/session_plan.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/levels.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/study_options.h"
#include "runner/output/progress_line.h"
#include "runner/session/simulated_study.h"
#include "runner/study/simulation_limits.h"

namespace palpate::runner::commands {
namespace {

namespace po = boost::program_options;

struct SimulateSettings {
  StudyOptions study;
  std::string database, shard, advisor;
  std::string groups;  ///< "young=12,old=10"; empty: --participants counts
  double advisor_time_out = 1;
  int jobs = 1;
};

/// None: --help was given and printed. \throws UsageError
std::optional<SimulateSettings> parse_simulate_settings(const std::vector<std::string>& args) {
  SimulateSettings settings;
  settings.jobs = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  CommandLine line;
  line.usage =
      "palpate simulate PROTOCOL.json --db FILE [--participants N] [--seed S] [--jobs J]\n"
      "       [--shard K/N|auto] [--ask SOCKET]";
  line.summary =
      "Runs the whole study with simulated participants through the renderers, device layer,\n"
      "session and store that live participants use. Their data is labelled simulated. Run\n"
      "again, it resumes where it stopped; the same seed gives the same data, whatever the jobs\n"
      "and interruptions. With --shard each of several machines simulates some participants;\n"
      "palpate merge joins the parts to the same data.";
  line.example =
      R"(  palpate simulate protocols/quick.json --db quick.db --participants 2    a minute's try
  palpate simulate protocols/ho2000.json --db study.db                    the paper's study
  palpate simulate protocols/ho2000.json --db study.db --participants 20  more of the same
)";
  line.options.add_options()  //
      ("db", po::value(&settings.database)->required()->value_name("FILE"),
       "database; created or resumed");
  add_study_options(line, settings.study);
  line.options.add_options()  //
      ("groups", po::value(&settings.groups)->value_name("NAME=N,..."),
       "participants of each group, where the protocol leaves the group to the experimenter; "
       "instead of --participants")  //
      ("jobs", po::value(&settings.jobs)->default_value(settings.jobs)->value_name("J"),
       "sessions simulated at a time")  //
      ("shard", po::value(&settings.shard)->default_value("1/1")->value_name("K/N|auto"),
       "only the K-th of N parts of the participants; auto: the task of a Slurm array");
  line.options.add_options()  //
      ("ask", po::value(&settings.advisor)->value_name("SOCKET"),
       "Unix domain socket of a program that proposes the levels of adaptive blocks; one session "
       "at a time")  //
      ("ask-time-out-s",
       po::value(&settings.advisor_time_out)->default_value(1, "1")->value_name("S"),
       "without an answer in that time the block's own procedure chooses, and this is recorded");
  const auto values = line.parse(args);
  if (!values) return std::nullopt;
  check_advisor(settings.advisor, settings.advisor_time_out);
  if (!settings.advisor.empty()) settings.jobs = 1;
  check_study_options(*values, settings.study);
  if (!settings.groups.empty() && !(*values)["participants"].defaulted())
    throw UsageError("--groups: says how many participants; leave out --participants");
  if (settings.jobs < 1 || settings.jobs > 1024) throw UsageError("--jobs: must be 1 to 1024");
  return settings;
}

/// \throws UsageError: no such shard
session::StudyPlan plan_of(const SimulateSettings& settings, const GroupAssignment& groups) {
  const Shard shard =
      parse_shard(settings.shard, [](const char* name) { return std::getenv(name); });
  session::StudyPlan plan;
  plan.seed = settings.study.seed;
  plan.jobs = settings.jobs;
  plan.advisor = settings.advisor;
  plan.advisor_time_out = settings.advisor_time_out;
  const std::vector<int> all = settings.groups.empty()
                                   ? session::first_numbers(settings.study.participants)
                                   : numbers_of_groups(settings.groups, groups);
  const auto count = static_cast<std::int64_t>(all.size());
  plan.numbers.assign(all.begin() + shard.first(count), all.begin() + shard.last(count));
  return plan;
}

/// The version of this protocol's participants in the database; if there are none, of those of any
/// protocol. \throws UsageError: it has several
int version_begun_with(data::Store& store, const std::string& protocol_sha256,
                       const std::string& patch) {
  std::map<std::string, std::optional<int>> version_of;  // by checksum
  std::set<int> own, all;
  for (const data::StoredRun& run : store.runs()) {
    const std::string& sha256 = run.info.observer_sha256;
    if (sha256.empty()) continue;  // a human participant
    auto known = version_of.find(sha256);
    if (known == version_of.end())
      known = version_of.emplace(sha256, participants::participant_version_of(sha256, patch)).first;
    if (!known->second) continue;
    all.insert(*known->second);
    if (run.protocol_sha256 == protocol_sha256) own.insert(*known->second);
  }
  return version_to_resume_with(own.empty() ? all : own, store.path());
}

/// \param seconds  run time
void print_summary(const protocols::Protocol& protocol, const std::string& database,
                   const participants::SimulatedSettings& simulated, std::uint64_t seed,
                   const session::StudyProgress& progress, double seconds) {
  std::printf("%s, SIMULATED participants: %lld of %lld trials in %s\n", protocol.name.c_str(),
              static_cast<long long>(progress.recorded), static_cast<long long>(progress.expected),
              printable(database).c_str());
  std::printf("settings version %d, sha256 %.12s...; seed %llu\n", simulated.version,
              simulated.sha256.c_str(), static_cast<unsigned long long>(seed));
  if (progress.this_run == 0) return;
  std::printf("%lld trials now: %.0f simulated s in %.1f s, %.0f simulated seconds per second\n",
              static_cast<long long>(progress.this_run), progress.simulated_seconds, seconds,
              progress.simulated_seconds / seconds);
}

/// Prints blocks of tasks with no answer in a tenth or more of the trials, and remedies. In a study
/// of shapes time-outs are the participant's own.
void print_unanswered(const protocols::Protocol& protocol, const session::StudyProgress& progress) {
  for (const protocols::TaskBlock* const listed : protocols::listed_blocks(protocol)) {
    const protocols::TaskBlock& block = *listed;
    const auto found = progress.by_block.find(block.name);
    if (found == progress.by_block.end()) continue;
    const auto& [trials, unanswered] = found->second;
    if (unanswered * 10 < trials || unanswered == 0) continue;
    std::fprintf(stderr, "block '%s': %lld of %lld trials had no answer within time_out_s = %g s",
                 printable(block.name).c_str(), static_cast<long long>(unanswered),
                 static_cast<long long>(trials), block.time_out);
    const auto standard =
        block.standard ? protocols::own_level(protocol, block, *block.standard) : std::nullopt;
    if (block.task == protocols::TaskKind::adjust && standard && !block.starts.empty()) {
      double farthest = 0;
      for (const double start : block.starts)
        farthest = std::max(farthest, std::abs(start - *standard));
      std::fprintf(stderr,
                   "; from its starts it is up to %.0f turns to the standard: a longer "
                   "time_out_s, a larger turn or nearer starts may help",
                   std::ceil(farthest / block.turn));
    } else {
      std::fprintf(stderr, ": a longer time_out_s may help");
    }
    std::fprintf(stderr, "\n");
  }
}

}  // namespace

int simulate_command(const std::vector<std::string>& args) {
  const std::optional<SimulateSettings> given = parse_simulate_settings(args);
  if (!given) return 0;
  const StudyOptions& options = given->study;
  protocols::Protocol protocol = protocols::parse_protocol(options.protocol);
  session::StudyPlan plan = plan_of(*given, protocol.groups);
  std::optional<data::Store> store;
  const auto open = [&] {
    return data::Store::open(given->database, data::Store::Mode::write_or_create);
  };
  int version = options.version;
  std::error_code none;  // an invisible file is refused when opened
  if (version == 0 && std::filesystem::exists(given->database, none)) {
    store.emplace(open());
    version = version_begun_with(*store, protocol.sha256, options.patch);
  }
  if (version == 0) version = participants::kDefaultParticipantVersion;
  const participants::SimulatedSettings simulated =
      participants::load_simulated_settings(options.patch, version);
  // Check before creating a database, so that a refusal leaves none behind.
  const session::LimitedForSimulation limited = study::fit_to_simulation(protocol, simulated);
  for (const std::string& text : limited.texts)
    std::fprintf(stderr, "%s\n", printable(text).c_str());
  plan.event = limited.event;
  if (const protocols::TaskBlock* const asks = protocols::block_that_asks(protocol);
      asks != nullptr && plan.advisor.empty())
    std::fprintf(stderr,
                 "block '%s' asks a program for its levels: without --ask they cover the range "
                 "evenly\n",
                 printable(asks->name).c_str());
  if (!store) store.emplace(open());
  warn_of_exposure(store->path());

  const auto start = std::chrono::steady_clock::now();
  output::ProgressLine line("trials");
  const session::StudyProgress progress = session::simulate_study(
      protocol, *store, simulated, plan, output::catch_stop_signals(),
      [&line](const session::StudyProgress& p) {
        line.show(static_cast<double>(p.recorded) / static_cast<double>(p.expected));
      });
  line.clear();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  print_summary(protocol, store->path(), simulated, plan.seed, progress, took.count());
  print_unanswered(protocol, progress);
  if (progress.recorded < progress.expected) {
    std::fprintf(stderr, "stopped; the same command resumes from here\n");
    return 1;
  }
  return 0;
}

}  // namespace palpate::runner::commands
