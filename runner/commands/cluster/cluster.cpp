// `palpate cluster`: a sweep, a study or a plan as one array job on Slurm.

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <iostream>
#include <map>
#include <stdexcept>

#include "data/base/text.h"
#include "protocols/parse.h"
#include "protocols/tasks/task_plan.h"
#include "runner/commands/cluster/job.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/study_options.h"
#include "runner/commands/sweep/planned.h"

namespace palpate::runner::commands {
namespace {

namespace fs = std::filesystem;
namespace po = boost::program_options;

/// The place and the options of a job, for all kinds of work.
struct ClusterSettings {
  std::string folder, time, partition;
  std::int64_t shards = 0;
  bool no_submit = false;
};

/// Warns of short tasks: sites ask for ten minutes at least. \param felt  stimuli of a shard
void warn_of_small_shards(const std::string& items, double felt) {
  constexpr double kSecondsAStimulus = 10, kSpeed = 3000, kLeast = 600;  // simulated s, in 1 s, s
  const double seconds = felt * kSecondsAStimulus / kSpeed;
  std::cerr << "a shard: some " << items << ", roughly " << std::lround(std::ceil(seconds / 60))
            << " min\n";
  if (seconds < kLeast)
    std::cerr << "warning: sites ask for tasks of at least ten minutes; take fewer shards\n";
}

/// \return the new folder. \throws UsageError
fs::path make_folder(const ClusterSettings& settings) {
  if (settings.folder.empty())
    throw UsageError("missing --dir DIR, a new folder that all nodes see");
  fs::path folder = fs::absolute(settings.folder).lexically_normal();
  if (fs::exists(folder) && !(fs::is_directory(folder) && fs::is_empty(folder)))
    throw UsageError("--dir " + settings.folder +
                     ": exists and is not empty; 'palpate cluster submit' goes on with a folder");
  fs::create_directories(folder);
  struct stat found {};
  if (::stat(folder.c_str(), &found) != 0 || found.st_uid != ::geteuid())
    throw UsageError("--dir " + settings.folder + ": belongs to another user; name a new folder");
  fs::permissions(folder, fs::perms::owner_all);  // of an empty existing one
  fs::create_directories(folder / "parts");
  fs::create_directories(folder / "logs");
  return folder;
}

int submit_or_say(const ClusterSettings& settings, const fs::path& folder, ClusterJob job) {
  if (!settings.time.empty()) job.options.push_back("--time=" + settings.time);
  if (!settings.partition.empty()) job.options.push_back("--partition=" + settings.partition);
  write_job(folder, job);
  if (settings.no_submit) {
    std::cout << printable(folder.string()) << ": ready; submit with: palpate cluster submit "
              << printable(settings.folder) << "\n";
    return 0;
  }
  submit_shards(folder, job);
  return 0;
}

/// \param others  files that the tasks read beside the protocol. \param command  of a shard,
/// relative to the copies of protocol and others
int begin(const ClusterSettings& settings, ClusterJob job, const protocols::Protocol& protocol,
          const std::vector<std::string>& others,
          const std::function<std::string(const std::vector<std::string>&)>& command,
          double felt_an_item) {
  if (settings.shards < 1 || settings.shards > std::min<std::int64_t>(job.items, 999'999)) {
    throw UsageError("--shards: must be 1 to the number of " +
                     std::string(job.work == "sweep" ? "points" : "participants") +
                     ", at most 999999");
  }
  const fs::path folder = make_folder(settings);
  job.shards = settings.shards;
  write_scripts(folder, job, command(copy_inputs(folder, protocol, others)));
  const double items = static_cast<double>(job.items) / static_cast<double>(job.shards);
  warn_of_small_shards(
      std::to_string(std::lround(items)) + (job.work == "sweep" ? " points" : " participants"),
      items * felt_an_item);
  return submit_or_say(settings, folder, std::move(job));
}

/// Stimuli that a participant feels: each interval of a task, adaptive blocks at their longest.
/// \param repetitions  of version 1
double stimuli_felt(const protocols::Protocol& protocol, int repetitions) {
  if (protocol.version == 1)
    return static_cast<double>(protocol.stimuli.size() * protocol.renderers.size()) * repetitions;
  double felt = 0;
  for (const protocols::TaskBlock& block : protocol.blocks) {
    const bool with_standard =
        block.task == protocols::TaskKind::adjust ||
        (block.task == protocols::TaskKind::rate && block.standard.has_value());
    const int intervals = block.task == protocols::TaskKind::compare ? block.intervals
                          : with_standard                            ? 2
                                                                     : 1;
    felt += static_cast<double>(protocols::most_trials_of(block)) * intervals;
  }
  return felt;
}

int begin_sweep(const ClusterSettings& settings, const SweepSettings& sweep) {
  const PlannedSweep planned(sweep);
  const auto command = [&](const std::vector<std::string>& inputs) {
    std::string out = "sweep " + shell_quoted(inputs[0]) + " --space " + shell_quoted(inputs[1]) +
                      " --points " + std::to_string(sweep.points) + " --design " + sweep.design +
                      " --seed " + std::to_string(sweep.seed) + " --participants " +
                      std::to_string(sweep.participants) + " --participant-version " +
                      std::to_string(sweep.version);
    if (sweep.repetitions > 0) out += " --repetitions " + std::to_string(sweep.repetitions);
    return inputs[2].empty() ? out : out + " --settings " + shell_quoted(inputs[2]);
  };
  ClusterJob job;
  job.work = "sweep";
  job.unit = "points";
  job.items = planned.plan.points;
  const int repetitions = sweep.repetitions > 0 ? sweep.repetitions : planned.protocol.repetitions;
  return begin(settings, job, planned.protocol, {sweep.space, sweep.patch}, command,
               sweep.participants * stimuli_felt(planned.protocol, repetitions));
}

int begin_study(const ClusterSettings& settings, const StudyOptions& study) {
  protocols::Protocol protocol = protocols::parse_protocol(study.protocol);
  fit_to_simulation(protocol, participants::load_simulated_settings(study.patch, study.version));
  const auto command = [&](const std::vector<std::string>& inputs) {
    const std::string out = "simulate " + shell_quoted(inputs[0]) + " --participants " +
                            std::to_string(study.participants) + " --seed " +
                            std::to_string(study.seed) + " --participant-version " +
                            std::to_string(study.version);
    return inputs[1].empty() ? out : out + " --settings " + shell_quoted(inputs[1]);
  };
  ClusterJob job;
  job.work = "simulate";
  job.unit = "sessions";
  job.items = study.participants;
  job.per_item = protocol.sessions.count;
  return begin(settings, job, protocol, {study.patch}, command,
               stimuli_felt(protocol, protocol.repetitions));
}

int cluster_submit(const std::string& given) {
  const fs::path folder = fs::absolute(given).lexically_normal();
  ClusterJob job = read_job(folder);
  if (!job.array_job.empty() && !queue_states(job.array_job).empty()) {
    throw UsageError("job " + job.array_job +
                     " is still in the queue; wait for its end, or: scancel " + job.array_job);
  }
  submit_shards(folder, job);
  return 0;
}

int cluster_status(const std::string& given) {
  const fs::path folder = fs::absolute(given).lexically_normal();
  const ClusterJob job = read_job(folder);
  const std::vector<ShardState> states = shard_states(folder, job);
  std::map<std::int64_t, std::string> queue;
  if (!job.array_job.empty()) {
    try {
      queue = queue_states(job.array_job);
    } catch (const std::runtime_error& error) {
      std::cerr << error.what() << "; what follows is from the files alone\n";
    }
  }
  std::int64_t done = 0, running = 0, waiting = 0;
  std::vector<std::int64_t> stopped;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const auto shard = static_cast<std::int64_t>(i) + 1;
    const auto queued = queue.find(shard);
    if (states[i].done()) {
      ++done;
    } else if (queued == queue.end()) {
      stopped.push_back(shard);
    } else if (queued->second == "RUNNING" || queued->second == "COMPLETING") {
      ++running;
    } else {
      ++waiting;
    }
  }
  const std::int64_t units = recorded_units(states);
  std::int64_t all = 0;
  for (const ShardState& state : states) all += state.wanted;
  std::cout << "shards: " << done << " done, " << running << " running, " << waiting << " waiting, "
            << stopped.size() << " not done and not in the queue\n"
            << job.unit << ": " << units << " of " << all << "\n";
  const auto gone = static_cast<double>(seconds_since_1970() - job.submitted_s);
  if (running > 0 && units > job.done_then && units < all) {
    const double left =
        gone / static_cast<double>(units - job.done_then) * static_cast<double>(all - units);
    std::cout << "time left: about " << std::lround(std::ceil(left / 60))
              << " min, at the pace since it was submitted\n";
  }
  if (!stopped.empty() && !job.array_job.empty()) {
    std::cout << "not done: shards " << array_text(stopped)
              << "; logs/shard-K.log says why; they go on with: palpate cluster submit "
              << printable(given) << "\n";
  }
  if (done == job.shards) {
    const bool plan = job.work == "plan";
    const std::string merged = plan ? "" : std::string("all") + job.extension() + ", ";
    const std::string last = plan ? "power.svg" : "report.html";
    std::cout << "result: "
              << (fs::exists(folder / last) && merged_units(folder, job) >= all
                      ? merged + "analysis.txt, analysis.json, " + last
                      : "not merged yet; logs/finish.log, or by hand: finish.sh")
              << "\n";
  }
  return 0;
}

/// One shard for each number of trials: a curve takes long only with --test model.
int begin_plan(const ClusterSettings& settings, const PlanOptions& options,
               const po::variables_map& values) {
  analysis::Pilot pilot = starting_point(options, values);
  model_of(pilot, options, values);  // refuses bad options here
  const analysis::PlanSettings plan = settings_of(options, values);
  ClusterJob job;
  job.work = "plan";
  job.unit = "curves";
  job.items = job.shards = static_cast<std::int64_t>(plan.trials.size());
  const fs::path folder = make_folder(settings);
  write_plan_scripts(folder, plan.trials, options, values);
  return submit_or_say(settings, folder, std::move(job));
}

void describe(CommandLine& line) {
  line.usage =
      "palpate cluster sweep PROTOCOL.json --space SPACE.json --points N --shards K --dir DIR\n"
      "       [--time T] [--partition NAME] [OPTIONS OF SWEEP]\n"
      "       palpate cluster simulate PROTOCOL.json --participants N --shards K --dir DIR\n"
      "       [--time T] [--partition NAME] [OPTIONS OF SIMULATE]\n"
      "       palpate cluster plan --dir DIR [--time T] [--partition NAME] [OPTIONS OF PLAN]\n"
      "       palpate cluster status DIR\n"
      "       palpate cluster submit DIR";
  line.summary =
      "Runs a sweep, a simulated study or the power curves of a plan as one array job on Slurm,\n"
      "and a job after it that merges its shards and analyses them. DIR, which all nodes must\n"
      "see, gets shards, logs, scripts and results.\n"
      "status: which shards are done, running, waiting or stopped, and the time left. submit:\n"
      "resumes shards that are not done (a task was killed, its time ran out).";
  line.example =
      R"(  palpate cluster sweep protocols/ho2000.json --space protocols/spaces/participants.json \
      --points 20000 --repetitions 20 --shards 64 --time 02:00:00 --dir people
  palpate cluster simulate protocols/ho2000.json --participants 5000 --shards 50 --dir many
  palpate cluster plan --db pilot.db --test model --trials 10,20,40,76 --dir power
  palpate cluster status people
  parallel --sshloginfile hosts "$PWD"/people/shard.sh ::: $(seq 64) && people/finish.sh
      (GNU parallel, without Slurm; DIR begun with --no-submit))";
}

void add_shards(CommandLine& line, ClusterSettings& settings) {
  line.options.add_options()("shards", po::value(&settings.shards)->required()->value_name("K"),
                             "tasks of the array; ten minutes each at least");
}

void add_options(CommandLine& line, ClusterSettings& settings) {
  line.options.add_options()  //
      ("dir", po::value(&settings.folder)->value_name("DIR"),
       "a new folder, on a disk that all nodes share")  //
      ("time", po::value(&settings.time)->value_name("T"),
       "limit for a task, as sbatch takes it")                                                 //
      ("partition", po::value(&settings.partition)->value_name("NAME"), "as sbatch takes it")  //
      ("no-submit", po::bool_switch(&settings.no_submit), "write the folder, submit nothing");
}

}  // namespace

int cluster_command(const std::vector<std::string>& args) {
  ClusterSettings settings;
  const std::string what = args.empty() ? "" : args[0];
  const bool help = std::find_if(args.begin(), args.end(), [](const std::string& a) {
                      return a == "--help" || a == "-h";
                    }) != args.end();
  CommandLine line;
  describe(line);
  if (!help && (what == "status" || what == "submit")) {
    if (args.size() != 2)
      throw UsageError("expected one folder\nUsage: palpate cluster " + what + " DIR");
    return what == "status" ? cluster_status(args[1]) : cluster_submit(args[1]);
  }
  if (!help && what != "sweep" && what != "simulate" && what != "plan") {
    throw UsageError("expected sweep, simulate, plan, status or submit" +
                     (what.empty() ? "" : ", found '" + what + "'") + "\nUsage: " + line.usage +
                     "\nMore: add --help");
  }
  const bool named = !what.empty() && what.front() != '-';
  const std::vector<std::string> words(args.begin() + (named ? 1 : 0), args.end());
  SweepSettings sweep;
  StudyOptions study;
  PlanOptions plan;
  add_options(line, settings);
  if (what == "plan") {
    add_plan_options(line, plan);
    const auto values = line.parse(words);
    return values ? begin_plan(settings, plan, *values) : 0;
  }
  add_shards(line, settings);
  if (what == "simulate") {
    add_study_options(line, study);
    const auto values = line.parse(words);
    if (!values) return 0;
    check_study_options(*values, study);
    if (study.version == 0) study.version = participants::kDefaultParticipantVersion;
    return begin_study(settings, study);
  }
  add_sweep_options(line, sweep);
  line.positional_names = {"PROTOCOL.json"};
  const auto values = line.parse(words);
  if (!values) return 0;
  check_sweep_options(*values, sweep);
  if (sweep.version == 0) sweep.version = participants::kDefaultParticipantVersion;
  return begin_sweep(settings, sweep);
}

}  // namespace palpate::runner::commands
