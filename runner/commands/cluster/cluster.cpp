// `palpate cluster`: a sweep, a study or a plan as one array job on Slurm.

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "data/base/text.h"
#include "data/files/file_permissions.h"
#include "data/store/store.h"
#include "data/store/sweep_file.h"
#include "protocols/parse.h"
#include "protocols/protocol.h"
#include "protocols/tasks/block_order.h"
#include "runner/commands/plan/plan.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/study_options.h"
#include "runner/commands/sweep/sweep_options.h"
#include "runner/output/outputs.h"
#include "runner/session/run_record.h"
#include "runner/study/simulation_limits.h"
#include "runner/sweep/cluster_folder.h"
#include "runner/sweep/cluster_job.h"
#include "runner/sweep/slurm.h"

namespace palpate::runner::commands {
namespace {

namespace fs = std::filesystem;
namespace po = boost::program_options;
using nlohmann::json;

/// The progress of a shard, in units.
struct ShardState {
  std::int64_t wanted = 0, recorded = 0;
  bool done() const { return recorded >= wanted; }
};

/// \param text  after the first line, which names the shell
void write_script(const fs::path& path, const std::string& text) {
  output::write_whole(path.string(), "#!/bin/bash\numask 077\n" + text);
  ::chmod(path.c_str(), 0700);
}

std::int64_t seconds_since_1970() {
  return std::chrono::duration_cast<std::chrono::seconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// By shard, from 1, read from its file. \throws data::StoreRefused
std::vector<ShardState> shard_states(const fs::path& folder, const sweep::ClusterJob& job) {
  std::vector<ShardState> out;
  for (std::int64_t number = 1; number <= job.shards; ++number) {
    const Shard shard{number, job.shards};
    out.push_back({(shard.last(job.items) - shard.first(job.items)) * job.per_item,
                   sweep::recorded_in(job, sweep::part_of(folder, job, number).string())});
  }
  return out;
}

std::int64_t recorded_units(const std::vector<ShardState>& states) {
  std::int64_t sum = 0;
  for (const ShardState& state : states) sum += state.recorded;
  return sum;
}

/// Submits the unfinished shards as an array job, followed by the merging job; reports on stdout.
/// \throws std::runtime_error with sbatch's message
void submit_shards(const fs::path& folder, sweep::ClusterJob& job) {
  sweep::require_own_scripts(folder);
  const std::vector<ShardState> states = shard_states(folder, job);
  std::vector<std::int64_t> todo;
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (!states[i].done()) todo.push_back(static_cast<std::int64_t>(i) + 1);
  }
  std::vector<std::string> arguments = job.options;
  arguments.push_back("--chdir=" + folder.string());
  std::vector<std::string> finish = arguments;
  if (!todo.empty()) {
    std::vector<std::string> array = arguments;
    array.insert(array.end(), {"--job-name=palpate", "--requeue", "--open-mode=append",
                               "--output=logs/shard-%a.log", "--array=" + sweep::array_text(todo),
                               (folder / "shard.sh").string()});
    job.array_job = sweep::submit(array);
    job.submitted_s = seconds_since_1970();
    job.done_then = recorded_units(states);
    sweep::write_job(folder, job);
    // If a shard fails, this job is cancelled; the next 'submit' makes it again.
    finish.push_back("--dependency=afterok:" + job.array_job);
    finish.push_back("--kill-on-invalid-dep=yes");
  }
  finish.insert(finish.end(), {"--job-name=palpate-finish", "--requeue", "--output=logs/finish.log",
                               (folder / "finish.sh").string()});
  const std::string last = sweep::submit(finish);
  if (!todo.empty())
    std::cout << "job " << job.array_job << ": shards " << sweep::array_text(todo) << "\n";
  std::cout << "job " << last << ": merges and analyses when they are done\n";
}

/// Writes shard.sh K, which runs or resumes a shard, and finish.sh, which merges the parts and
/// analyses them. \param command  of a shard, without --jobs, --shard and --db
// "#SBATCH" is not used: cluster.json has the arguments of sbatch, for both jobs.
void write_scripts(const fs::path& folder, const sweep::ClusterJob& job,
                   const std::string& command) {
  const std::string program = shell_quoted(fs::read_symlink("/proc/self/exe").string());
  const std::string enter = "cd " + shell_quoted(folder.string());
  const std::string extension = job.extension();
  write_script(folder / "shard.sh",
               "# One shard. Run again to resume.\n" + enter + " || exit 1\nexec " + program + " " +
                   command + " --jobs 1 --shard \"${1:-$SLURM_ARRAY_TASK_ID}/" +
                   std::to_string(job.shards) +
                   "\" \\\n  --db \"parts/part$(printf %06d \"${1:-$SLURM_ARRAY_TASK_ID}\")" +
                   extension + "\"\n");
  const std::string given = job.work == "sweep" ? "--sweep" : "--db";
  const std::string all = "all" + extension, fresh = "new-" + all;
  write_script(folder / "finish.sh",
               "# When all shards are done: one file, and its analysis. Again, after more of "
               "them.\nset -e\n" +
                   enter + "\nrm -f " + fresh + "\n" + program + " merge --out " + fresh +
                   " parts/*" + extension + "\nmv " + fresh + " " + all + "\n" + program +
                   " analyze " + given + " " + all +
                   " --json analysis.json --report report.html --force > analysis.txt\n");
}

/// The given options as words of a shell's command line, with absolute file paths and without
/// --trials.
std::string plan_words(const PlanOptions& options, const po::variables_map& values) {
  std::string out;
  for (const auto& [name, value] : values) {
    constexpr std::array kNumbers{"power",        "alpha",       "gain-sd",     "shape-gain-sd",
                                  "intercept-sd", "correlation", "residual-sd", "share-used"};
    constexpr std::array kTexts{"effect", "goal", "participants", "test", "studies"};
    if (value.defaulted()) continue;
    if (name == "db" || name == "csv") {
      const std::string& file = name == "db" ? options.database : options.csv;
      out += " --" + name + " " + shell_quoted(fs::absolute(file).string());
    } else if (std::ranges::find(kNumbers, name) != kNumbers.end()) {
      std::array<char, 32> digits{};
      const auto end =
          std::to_chars(digits.data(), digits.data() + digits.size(), value.as<double>()).ptr;
      out += " --" + name + "=" + std::string(digits.data(), end);
    } else if (std::ranges::find(kTexts, name) != kTexts.end()) {
      out += " --" + name + " " + shell_quoted(value.as<std::string>());
    } else if (name == "seed") {
      out += " --seed " + std::to_string(options.seed);
    }
  }
  return out;
}

/// Like write_scripts, with a shard for each number of trials. \param values  as parsed
void write_plan_scripts(const fs::path& folder, const std::vector<std::size_t>& trials,
                        const PlanOptions& options, const po::variables_map& values) {
  const std::string enter = "cd " + shell_quoted(folder.string());
  const std::string plan = shell_quoted(fs::read_symlink("/proc/self/exe").string()) + " plan" +
                           plan_words(options, values);
  std::string each, all;
  for (const std::size_t number : trials) {
    each += " " + std::to_string(number);
    all += (all.empty() ? "" : ",") + std::to_string(number);
  }
  write_script(
      folder / "shard.sh",
      "# The power curve of one number of trials.\n" + enter + " || exit 1\ntrials=(none" + each +
          ")\nk=${1:-$SLURM_ARRAY_TASK_ID}\nexec " + plan +
          " --jobs 1 --trials \"${trials[$k]}\" --json \"parts/part$(printf %06d \"$k\").json\"\n");
  write_script(
      folder / "finish.sh",
      "# When all curves are there: one plan.\nset -e\n" + enter +
          "\nknown=()\nfor part in parts/*.json; do known+=(--reuse \"$part\"); done\n" + plan +
          " --trials " + all +
          " \"${known[@]}\" --json analysis.json --figure power.svg --force > analysis.txt\n");
}

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
  const data::ResolvedPath place = data::resolve_trusted_links(settings.folder);
  if (!place.fault.empty()) throw UsageError("--dir " + settings.folder + ": " + place.fault);
  if (settings.folder == "-") throw UsageError("--dir: expected a new folder");
  fs::path folder = fs::absolute(settings.folder).lexically_normal();
  if (fs::exists(folder) && !(fs::is_directory(folder) && fs::is_empty(folder)))
    throw UsageError("--dir " + settings.folder +
                     ": exists and is not empty; resume it with 'palpate cluster submit'");
  fs::create_directories(folder);
  struct stat found {};
  if (::stat(folder.c_str(), &found) != 0 || found.st_uid != ::geteuid())
    throw UsageError("--dir " + settings.folder + ": belongs to another user; name a new folder");
  fs::permissions(folder, fs::perms::owner_all);  // of an empty existing one
  fs::create_directories(folder / "parts");
  fs::create_directories(folder / "logs");
  return folder;
}

int submit_or_say(const ClusterSettings& settings, const fs::path& folder, sweep::ClusterJob job) {
  if (!settings.time.empty()) job.options.push_back("--time=" + settings.time);
  if (!settings.partition.empty()) job.options.push_back("--partition=" + settings.partition);
  sweep::write_job(folder, job);
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
int begin(const ClusterSettings& settings, sweep::ClusterJob job,
          const protocols::Protocol& protocol, const std::vector<std::string>& others,
          const std::function<std::string(const std::vector<std::string>&)>& command,
          double felt_an_item) {
  if (settings.shards < 1 || settings.shards > std::min<std::int64_t>(job.items, 999'999)) {
    throw UsageError("--shards: must be 1 to the number of " +
                     std::string(job.work == "sweep" ? "points" : "participants") +
                     ", at most 999999");
  }
  const fs::path folder = make_folder(settings);
  job.shards = settings.shards;
  write_scripts(folder, job, command(sweep::copy_inputs(folder, protocol, others)));
  const double items = static_cast<double>(job.items) / static_cast<double>(job.shards);
  warn_of_small_shards(
      std::to_string(std::lround(items)) + (job.work == "sweep" ? " points" : " participants"),
      items * felt_an_item);
  return submit_or_say(settings, folder, std::move(job));
}

/// Stimuli that a participant feels: each interval of a task, adaptive blocks at their longest.
double stimuli_felt(const protocols::Protocol& protocol) {
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

int begin_sweep(const ClusterSettings& settings, const sweep::SweepSettings& sweep) {
  const sweep::PlannedSweep planned(sweep, std::cerr);
  const auto command = [&](const std::vector<std::string>& inputs) {
    std::string out = "sweep " + shell_quoted(inputs[0]) + " --space " + shell_quoted(inputs[1]) +
                      " --points " + std::to_string(sweep.points) + " --design " + sweep.design +
                      " --seed " + std::to_string(sweep.seed) + " --participants " +
                      std::to_string(sweep.participants) + " --participant-version " +
                      std::to_string(sweep.version);
    if (sweep.repetitions > 0) out += " --repetitions " + std::to_string(sweep.repetitions);
    return inputs[2].empty() ? out : out + " --settings " + shell_quoted(inputs[2]);
  };
  sweep::ClusterJob job;
  job.work = "sweep";
  job.unit = "points";
  job.items = planned.plan.points;
  const double times =
      sweep.repetitions > 0 ? 1.0 * sweep.repetitions / planned.protocol.repetitions : 1;
  return begin(settings, job, planned.protocol, {sweep.space, sweep.patch}, command,
               sweep.participants * times * stimuli_felt(planned.protocol));
}

int begin_study(const ClusterSettings& settings, const StudyOptions& study) {
  protocols::Protocol protocol = protocols::parse_protocol(study.protocol);
  study::fit_to_simulation(protocol,
                           participants::load_simulated_settings(study.patch, study.version));
  const auto command = [&](const std::vector<std::string>& inputs) {
    const std::string out = "simulate " + shell_quoted(inputs[0]) + " --participants " +
                            std::to_string(study.participants) + " --seed " +
                            std::to_string(study.seed) + " --participant-version " +
                            std::to_string(study.version);
    return inputs[1].empty() ? out : out + " --settings " + shell_quoted(inputs[1]);
  };
  sweep::ClusterJob job;
  job.work = "simulate";
  job.unit = "sessions";
  job.items = study.participants;
  job.per_item = protocol.sessions.count;
  return begin(settings, job, protocol, {study.patch}, command, stimuli_felt(protocol));
}

int cluster_submit(const std::string& given) {
  const fs::path folder = fs::absolute(given).lexically_normal();
  sweep::ClusterJob job = sweep::read_job(folder);
  if (!job.array_job.empty() && !sweep::queue_states(job.array_job).empty()) {
    throw UsageError("job " + job.array_job +
                     " is still in the queue; wait for its end, or: scancel " + job.array_job);
  }
  submit_shards(folder, job);
  return 0;
}

int cluster_status(const std::string& given) {
  const fs::path folder = fs::absolute(given).lexically_normal();
  const sweep::ClusterJob job = sweep::read_job(folder);
  const std::vector<ShardState> states = shard_states(folder, job);
  std::map<std::int64_t, std::string> queue;
  if (!job.array_job.empty()) {
    try {
      queue = sweep::queue_states(job.array_job);
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
    std::cout << "not done: shards " << sweep::array_text(stopped)
              << "; logs/shard-K.log says why; resume them with: palpate cluster submit "
              << printable(given) << "\n";
  }
  if (done == job.shards) {
    const bool plan = job.work == "plan";
    const std::string merged = plan ? "" : std::string("all") + job.extension() + ", ";
    const std::string last = plan ? "power.svg" : "report.html";
    std::cout << "result: "
              << (fs::exists(folder / last) && sweep::merged_units(folder, job) >= all
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
  sweep::ClusterJob job;
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
       "limit for a task, in the format of sbatch")                                            //
      ("partition", po::value(&settings.partition)->value_name("NAME"), "partition of Slurm")  //
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
  sweep::SweepSettings sweep;
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
