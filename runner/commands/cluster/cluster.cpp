// `palpate cluster`: a sweep as one array job on Slurm.

#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "data/store/sweep_file.h"
#include "protocols/json_document.h"
#include "runner/commands/cluster/slurm.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/outputs.h"
#include "runner/commands/sweep/planned.h"
#include "runner/commands/sweep/shard.h"
#include "stimuli/printable.h"

namespace palpate::runner {
namespace {

namespace fs = std::filesystem;
namespace po = boost::program_options;
using nlohmann::json;

struct ClusterSettings {
  SweepSettings sweep;
  std::string folder, time, partition;
  std::int64_t shards = 0;
  bool no_submit = false;
};

/// What DIR/cluster.json holds.
struct ClusterJob {
  std::int64_t shards = 0, points = 0;
  std::vector<std::string> options;  ///< of sbatch
  std::string array_job;             ///< latest one; "": none was submitted
  std::int64_t submitted_s = 0;      ///< since 1970
  std::int64_t points_then = 0;      ///< on record when it was submitted
};

fs::path part_of(const fs::path& folder, std::int64_t shard) {
  std::string digits = std::to_string(shard);
  return folder / "parts" /
         ("part" + std::string(6 - std::min<std::size_t>(6, digits.size()), '0') + digits +
          ".sweep");
}

std::int64_t seconds_now() {
  return std::chrono::duration_cast<std::chrono::seconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

void write_job(const fs::path& folder, const ClusterJob& job) {
  const json out{{"version", 1},
                 {"shards", job.shards},
                 {"points", job.points},
                 {"sbatch", job.options},
                 {"array_job", job.array_job},
                 {"submitted_s", job.submitted_s},
                 {"points_then", job.points_then}};
  write_whole((folder / "cluster.json").string(), out.dump(1) + "\n");
}

ClusterJob read_job(const fs::path& folder) {
  const std::string path = (folder / "cluster.json").string();
  try {
    const json in = json::parse(protocols::read_text_file(path));
    ClusterJob job;
    job.shards = in.at("shards");
    job.points = in.at("points");
    job.options = in.at("sbatch").get<std::vector<std::string>>();
    job.array_job = in.at("array_job");
    job.submitted_s = in.at("submitted_s");
    job.points_then = in.at("points_then");
    return job;
  } catch (const json::exception& error) {
    throw UsageError(path + ": is not what 'palpate cluster sweep' wrote: " + error.what());
  }
}

void write_script(const fs::path& path, const std::string& text) {
  write_whole(path.string(), "#!/bin/bash\n" + text);
  ::chmod(path.c_str(), 0700);
}

/// "#SBATCH" is not used: what sbatch is called with stands in cluster.json and goes for both jobs.
void write_scripts(const ClusterSettings& settings, const fs::path& folder) {
  const SweepSettings& sweep = settings.sweep;
  const auto file = [](const std::string& path) {
    return shell_quoted(fs::absolute(path).string());
  };
  const std::string program = shell_quoted(fs::read_symlink("/proc/self/exe").string());
  std::string command = program + " sweep " + file(sweep.protocol) + " --space " +
                        file(sweep.space) + " --points " + std::to_string(sweep.points) +
                        " --design " + sweep.design + " --seed " + std::to_string(sweep.seed) +
                        " --participants " + std::to_string(sweep.participants) +
                        " --participant-version " + std::to_string(sweep.version);
  if (sweep.repetitions > 0) command += " --repetitions " + std::to_string(sweep.repetitions);
  if (!sweep.patch.empty()) command += " --settings " + file(sweep.patch);
  const std::string shards = std::to_string(settings.shards);
  write_script(folder / "shard.sh",
               "# One shard of the sweep; started again, it goes on where it was.\n"
               "cd " +
                   shell_quoted(folder.string()) +
                   " || exit 1\n"
                   "exec " +
                   command + " --jobs 1 --shard \"${1:-$SLURM_ARRAY_TASK_ID}/" + shards +
                   "\" \\\n"
                   "  --db \"parts/part$(printf %06d \"${1:-$SLURM_ARRAY_TASK_ID}\").sweep\"\n");
  write_script(folder / "finish.sh",
               "# When all shards are done: one file, and its analysis.\n"
               "set -e\ncd " +
                   shell_quoted(folder.string()) +
                   "\n"
                   "[ -e all.sweep ] || " +
                   program + " merge --out all.sweep parts/*.sweep\n" + program +
                   " analyze --sweep all.sweep --json analysis.json --report report.html --force > "
                   "analysis.txt\n");
}

struct ShardState {
  std::int64_t wanted = 0, recorded = 0;
  bool done() const { return recorded >= wanted; }
};

std::vector<ShardState> shard_states(const fs::path& folder, const ClusterJob& job) {
  std::vector<ShardState> out;
  for (std::int64_t shard = 1; shard <= job.shards; ++shard) {
    const Shard part{shard, job.shards};
    ShardState state{part.last(job.points) - part.first(job.points), 0};
    const std::string path = part_of(folder, shard).string();
    if (fs::exists(path)) state.recorded = data::SweepFile::open(path).count();
    out.push_back(state);
  }
  return out;
}

std::int64_t recorded_points(const std::vector<ShardState>& states) {
  std::int64_t sum = 0;
  for (const ShardState& state : states) sum += state.recorded;
  return sum;
}

/// The shards that are not done, and after them what puts all together.
void submit_shards(const fs::path& folder, ClusterJob& job) {
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
                               "--output=logs/shard-%a.log", "--array=" + array_text(todo),
                               (folder / "shard.sh").string()});
    job.array_job = submit(array);
    job.submitted_s = seconds_now();
    job.points_then = recorded_points(states);
    write_job(folder, job);
    finish.push_back("--dependency=afterok:" + job.array_job);
  }
  finish.insert(finish.end(), {"--job-name=palpate-finish", "--requeue", "--output=logs/finish.log",
                               (folder / "finish.sh").string()});
  const std::string last = submit(finish);
  if (!todo.empty())
    std::cout << "job " << job.array_job << ": shards " << array_text(todo) << "\n";
  std::cout << "job " << last << ": merges and analyses when they are done\n";
}

/// Sites ask for tasks of ten minutes at least.
void warn_of_small_shards(const ClusterSettings& settings, const PlannedSweep& planned) {
  constexpr double kSecondsATrial = 10, kSpeed = 3000,
                   kLeast = 600;  // simulated s, and of them in 1 s
  const double cells =
      static_cast<double>(planned.plan.shapes.size() * planned.plan.renderers.size());
  const double repetitions =
      settings.sweep.repetitions > 0 ? settings.sweep.repetitions : planned.protocol.repetitions;
  const double points =
      static_cast<double>(planned.plan.points) / static_cast<double>(settings.shards);
  const double seconds =
      points * settings.sweep.participants * cells * repetitions * kSecondsATrial / kSpeed;
  std::cerr << "a shard: some " << std::lround(points) << " points, roughly "
            << std::lround(std::ceil(seconds / 60)) << " min\n";
  if (seconds < kLeast)
    std::cerr << "warning: sites ask for tasks of at least ten minutes; take fewer shards\n";
}

int cluster_sweep(const ClusterSettings& settings) {
  const PlannedSweep planned(settings.sweep);
  if (settings.shards < 1 || settings.shards > std::min<std::int64_t>(planned.plan.points, 999'999))
    throw UsageError("--shards: must be 1 to the number of points, at most 999999");
  if (settings.folder.empty())
    throw UsageError("missing --dir DIR, a new folder that all nodes see");
  const fs::path folder = fs::absolute(settings.folder).lexically_normal();
  if (fs::exists(folder) && !(fs::is_directory(folder) && fs::is_empty(folder)))
    throw UsageError("--dir " + settings.folder +
                     ": exists and is not empty; 'palpate cluster submit' goes on with a folder");
  fs::create_directories(folder / "parts");
  fs::create_directories(folder / "logs");
  ClusterJob job;
  job.shards = settings.shards;
  job.points = planned.plan.points;
  if (!settings.time.empty()) job.options.push_back("--time=" + settings.time);
  if (!settings.partition.empty()) job.options.push_back("--partition=" + settings.partition);
  write_scripts(settings, folder);
  write_job(folder, job);
  warn_of_small_shards(settings, planned);
  if (settings.no_submit) {
    std::cout << stimuli::printable(folder.string())
              << ": ready; submit with: palpate cluster submit "
              << stimuli::printable(settings.folder) << "\n";
    return 0;
  }
  submit_shards(folder, job);
  return 0;
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
  const std::int64_t points = recorded_points(states);
  std::cout << "shards: " << done << " done, " << running << " running, " << waiting << " waiting, "
            << stopped.size() << " not done and not in the queue\n"
            << "points: " << points << " of " << job.points << "\n";
  const auto gone = static_cast<double>(seconds_now() - job.submitted_s);
  if (running > 0 && points > job.points_then && points < job.points) {
    const double left = gone / static_cast<double>(points - job.points_then) *
                        static_cast<double>(job.points - points);
    std::cout << "time left: about " << std::lround(std::ceil(left / 60))
              << " min, at the pace since it was submitted\n";
  }
  if (!stopped.empty() && !job.array_job.empty()) {
    std::cout << "not done: shards " << array_text(stopped)
              << "; logs/shard-K.log says why; they go on with: palpate cluster submit "
              << stimuli::printable(given) << "\n";
  }
  if (done == job.shards)
    std::cout << "result: "
              << (fs::exists(folder / "report.html")
                      ? "all.sweep, analysis.txt, analysis.json, report.html"
                      : "not merged yet; logs/finish.log, or by hand: finish.sh")
              << "\n";
  return 0;
}

void add_options(CommandLine& line, ClusterSettings& settings) {
  line.usage =
      "palpate cluster sweep PROTOCOL.json --space SPACE.json --points N --shards K --dir DIR\n"
      "       [--time T] [--partition NAME] [OPTIONS OF SWEEP]\n"
      "       palpate cluster status DIR\n"
      "       palpate cluster submit DIR";
  line.summary =
      "Runs a sweep as one array job on Slurm, and a job after it that merges its shards and\n"
      "analyses them. DIR, which all nodes must see, gets shards, logs, scripts and results.\n"
      "status: what is done, runs, waits or stopped, and the time left. submit: shards that are\n"
      "not done (a task was killed, its time ran out) go on where they were.";
  line.example =
      "  palpate cluster sweep protocols/ho2000.json --space protocols/spaces/participants.json "
      "\\\n"
      "      --points 20000 --repetitions 20 --shards 64 --time 02:00:00 --dir people\n"
      "  palpate cluster status people\n"
      "  parallel --sshloginfile hosts people/shard.sh ::: $(seq 64) && people/finish.sh    "
      "without Slurm";
  add_sweep_options(line, settings.sweep);
  line.options.add_options()  //
      ("shards", po::value(&settings.shards)->required()->value_name("K"),
       "tasks of the array; ten minutes each at least")  //
      ("dir", po::value(&settings.folder)->value_name("DIR"),
       "a new folder, on a disk that all nodes share")  //
      ("time", po::value(&settings.time)->value_name("T"),
       "limit for a task, as sbatch takes it")                                                 //
      ("partition", po::value(&settings.partition)->value_name("NAME"), "as sbatch takes it")  //
      ("no-submit", po::bool_switch(&settings.no_submit), "write the folder, submit nothing");
  line.positional_names = {"PROTOCOL.json"};
}

}  // namespace

int cluster_command(const std::vector<std::string>& args) {
  ClusterSettings settings;
  CommandLine line;
  add_options(line, settings);
  const std::string what = args.empty() ? "" : args[0];
  const bool help = std::find_if(args.begin(), args.end(), [](const std::string& a) {
                      return a == "--help" || a == "-h";
                    }) != args.end();
  if (!help && (what == "status" || what == "submit")) {
    if (args.size() != 2)
      throw UsageError("expected one folder\nUsage: palpate cluster " + what + " DIR");
    return what == "status" ? cluster_status(args[1]) : cluster_submit(args[1]);
  }
  if (!help && what != "sweep") {
    throw UsageError("expected sweep, status or submit" +
                     (what.empty() ? "" : ", found '" + what + "'") + "\nUsage: " + line.usage +
                     "\nMore: add --help");
  }
  const bool named = what == "sweep" || what == "status" || what == "submit";
  const auto values = line.parse({args.begin() + (named ? 1 : 0), args.end()});
  if (!values) return 0;
  check_sweep_options(*values, settings.sweep);
  return cluster_sweep(settings);
}

}  // namespace palpate::runner
