#include "runner/commands/cluster/job.h"

#include <sys/stat.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "data/base/json_text.h"
#include "data/files/file_permissions.h"
#include "data/store/store.h"
#include "data/store/sweep_file.h"
#include "protocols/json_document.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/outputs.h"
#include "runner/commands/shared/study_options.h"
#include "runner/session/run_record.h"

namespace palpate::runner::commands {
namespace {

namespace fs = std::filesystem;
namespace po = boost::program_options;

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

}  // namespace

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

namespace {

struct Output {
  int status = 0;
  std::string text;  ///< stdout and stderr
};

Output run(const std::string& command) {
  std::FILE* const pipe = ::popen((command + " 2>&1").c_str(), "re");
  if (pipe == nullptr) throw std::runtime_error("a shell cannot be started");
  Output out;
  std::array<char, 4096> part{};
  while (const std::size_t read = std::fread(part.data(), 1, part.size(), pipe))
    out.text.append(part.data(), read);
  const int status = ::pclose(pipe);
  out.status = WIFEXITED(status) ? WEXITSTATUS(status) : 1;
  while (!out.text.empty() && out.text.back() == '\n') out.text.pop_back();
  return out;
}

}  // namespace

std::string shell_quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

std::string array_text(const std::vector<std::int64_t>& tasks) {
  std::string out;
  for (std::size_t i = 0; i < tasks.size();) {
    std::size_t last = i;
    while (last + 1 < tasks.size() && tasks[last + 1] == tasks[last] + 1) ++last;
    out += (out.empty() ? "" : ",") + std::to_string(tasks[i]);
    if (last > i) out += "-" + std::to_string(tasks[last]);
    i = last + 1;
  }
  return out;
}

std::string submit(const std::vector<std::string>& arguments) {
  std::string command = "sbatch --parsable";
  for (const std::string& argument : arguments) command += " " + shell_quoted(argument);
  const Output said = run(command);
  const std::string job = said.text.substr(0, said.text.find(';'));  // "123;cluster"
  const bool number = !job.empty() && std::all_of(job.begin(), job.end(),
                                                  [](char c) { return c >= '0' && c <= '9'; });
  if (said.status == 127)
    throw std::runtime_error("there is no Slurm here (no command sbatch): " + said.text);
  if (said.status != 0 || !number) throw std::runtime_error("sbatch refused the job: " + said.text);
  return job;
}

std::map<std::int64_t, std::string> queue_states(const std::string& job) {
  const Output said = run("squeue --noheader --array --format='%K %T' --jobs=" + shell_quoted(job));
  if (said.status == 127) throw std::runtime_error("there is no Slurm here (no command squeue)");
  // squeue does not know a job that ended some minutes ago.
  if (said.status != 0 && said.text.find("Invalid job id") != std::string::npos) return {};
  if (said.status != 0) throw std::runtime_error("squeue failed: " + said.text);
  std::map<std::int64_t, std::string> out;
  std::istringstream lines(said.text);
  std::string task, state;
  while (lines >> task >> state) {
    char* end = nullptr;
    const long long number = std::strtoll(task.c_str(), &end, 10);
    if (end != task.c_str() && *end == '\0') out[number] = state;
  }
  return out;
}

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kVersion = 2;

fs::path part_of(const fs::path& folder, const ClusterJob& job, std::int64_t shard) {
  const std::string digits = std::to_string(shard);
  return folder / "parts" /
         ("part" + std::string(6 - std::min<std::size_t>(6, digits.size()), '0') + digits +
          job.extension());
}

/// Units in a shard's file.
std::int64_t recorded_in(const ClusterJob& job, const std::string& path) {
  if (!fs::exists(path)) return 0;
  if (job.work == "plan") return 1;  // written at once
  if (job.work == "sweep") return data::SweepFile::open(path).count();
  data::Store store = data::Store::open(path, data::Store::Mode::read_only);
  const std::vector<data::StoredRun> runs = store.runs();
  return std::count_if(runs.begin(), runs.end(),
                       [](const data::StoredRun& run) { return run.end == data::RunEnd::done; });
}

}  // namespace

void write_script(const fs::path& path, const std::string& text) {
  write_whole(path.string(), "#!/bin/bash\numask 077\n" + text);
  ::chmod(path.c_str(), 0700);
}

std::int64_t seconds_since_1970() {
  return std::chrono::duration_cast<std::chrono::seconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

void write_job(const fs::path& folder, const ClusterJob& job) {
  const json out{
      {"version", kVersion},       {"work", job.work},           {"unit", job.unit},
      {"shards", job.shards},      {"items", job.items},         {"per_item", job.per_item},
      {"sbatch", job.options},     {"array_job", job.array_job}, {"submitted_s", job.submitted_s},
      {"done_then", job.done_then}};
  write_whole((folder / "cluster.json").string(), out.dump(1) + "\n");
}

ClusterJob read_job(const fs::path& folder) {
  const std::string path = (folder / "cluster.json").string();
  try {
    const json in = read_json(protocols::read_text_file(path));
    if (in.at("version") != kVersion) {
      throw UsageError(path + ": expected version " + std::to_string(kVersion) + ", found " +
                       json_excerpt(in.at("version")) + "; go on with the program that wrote it");
    }
    ClusterJob job;
    job.work = in.at("work");
    job.unit = in.at("unit");
    job.shards = in.at("shards");
    job.items = in.at("items");
    job.per_item = in.at("per_item");
    job.options = in.at("sbatch").get<std::vector<std::string>>();
    job.array_job = in.at("array_job");
    job.submitted_s = in.at("submitted_s");
    job.done_then = in.at("done_then");
    if (job.shards < 1 || job.shards > job.items || job.per_item < 1)
      throw UsageError(path + ": expected 1 or more shards of at least one item each, found " +
                       std::to_string(job.shards) + " shards of " + std::to_string(job.items));
    return job;
  } catch (const JsonError& error) {
    throw UsageError(path + ": is not what 'palpate cluster' wrote: " + error.what());
  } catch (const json::exception& error) {
    throw UsageError(path + ": is not what 'palpate cluster' wrote: " + error.what());
  }
}

std::int64_t merged_units(const fs::path& folder, const ClusterJob& job) {
  if (job.work == "plan") return job.items;
  return recorded_in(job, (folder / ("all" + std::string(job.extension()))).string());
}

std::vector<std::string> copy_inputs(const fs::path& folder, const protocols::Protocol& protocol,
                                     const std::vector<std::string>& others) {
  const data::ProtocolInfo info = session::info_of(protocol);
  std::ptrdiff_t up = 0;  // steps out of the protocol's folder
  for (const data::ProtocolFile& file : info.files) {
    const fs::path name = fs::path(file.name).lexically_normal();
    if (name.is_absolute())
      throw UsageError("the protocol names " + file.name +
                       ", which is not copied for the tasks; name it relative to the protocol");
    up = std::max(up, std::count(name.begin(), name.end(), fs::path("..")));
  }
  const fs::path inputs = folder / "inputs";
  fs::path place = inputs;
  for (; up > 0; --up) place /= "protocol";
  fs::create_directories(place);
  const auto put = [](const fs::path& path, const std::string& bytes) {
    fs::create_directories(path.parent_path());
    write_whole(path.string(), bytes);
  };
  put(place / "protocol.json", info.text);
  for (const data::ProtocolFile& file : info.files)
    put((place / file.name).lexically_normal(), file.bytes);
  std::vector<std::string> out{(place / "protocol.json").string()};
  for (std::size_t i = 0; i < others.size(); ++i) {
    out.push_back(
        others[i].empty() ? "" : (inputs / ("other" + std::to_string(i + 1) + ".json")).string());
    if (!others[i].empty()) put(out.back(), protocols::read_text_file(others[i]));
  }
  return out;
}

std::vector<ShardState> shard_states(const fs::path& folder, const ClusterJob& job) {
  std::vector<ShardState> out;
  for (std::int64_t number = 1; number <= job.shards; ++number) {
    const Shard shard{number, job.shards};
    out.push_back({(shard.last(job.items) - shard.first(job.items)) * job.per_item,
                   recorded_in(job, part_of(folder, job, number).string())});
  }
  return out;
}

std::int64_t recorded_units(const std::vector<ShardState>& states) {
  std::int64_t sum = 0;
  for (const ShardState& state : states) sum += state.recorded;
  return sum;
}

void require_own_scripts(const fs::path& folder) {
  std::vector<fs::path> all{folder,
                            folder / "parts",
                            folder / "logs",
                            folder / "cluster.json",
                            folder / "shard.sh",
                            folder / "finish.sh"};
  if (const fs::path inputs = folder / "inputs"; fs::exists(inputs)) {
    all.push_back(inputs);
    for (const auto& entry : fs::recursive_directory_iterator(inputs)) all.push_back(entry.path());
  }
  for (const fs::path& path : all) {
    const std::string fault = data::ownership_fault(path.string());
    if (fault.empty()) continue;
    throw UsageError(
        path.string() + ": " + fault +
        "; what another user put there would run as yours. If all of it is as you left "
        "it: chmod -R go-w " +
        shell_quoted(folder.string()));
  }
}

void submit_shards(const fs::path& folder, ClusterJob& job) {
  require_own_scripts(folder);
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
    job.submitted_s = seconds_since_1970();
    job.done_then = recorded_units(states);
    write_job(folder, job);
    // If a shard fails, this job is cancelled; the next 'submit' makes it again.
    finish.push_back("--dependency=afterok:" + job.array_job);
    finish.push_back("--kill-on-invalid-dep=yes");
  }
  finish.insert(finish.end(), {"--job-name=palpate-finish", "--requeue", "--output=logs/finish.log",
                               (folder / "finish.sh").string()});
  const std::string last = submit(finish);
  if (!todo.empty())
    std::cout << "job " << job.array_job << ": shards " << array_text(todo) << "\n";
  std::cout << "job " << last << ": merges and analyses when they are done\n";
}

// "#SBATCH" is not used: cluster.json has the arguments of sbatch, for both jobs.
void write_scripts(const fs::path& folder, const ClusterJob& job, const std::string& command) {
  const std::string program = shell_quoted(fs::read_symlink("/proc/self/exe").string());
  const std::string enter = "cd " + shell_quoted(folder.string());
  const std::string extension = job.extension();
  write_script(folder / "shard.sh",
               "# One shard; started again, it goes on where it was.\n" + enter +
                   " || exit 1\nexec " + program + " " + command +
                   " --jobs 1 --shard \"${1:-$SLURM_ARRAY_TASK_ID}/" + std::to_string(job.shards) +
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

}  // namespace palpate::runner::commands
