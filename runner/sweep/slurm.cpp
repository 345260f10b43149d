#include "runner/sweep/slurm.h"

#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <stdexcept>

#include "runner/terminal.h"

namespace palpate::runner::sweep {
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
  std::string job = said.text.substr(0, said.text.find(';'));  // "123;cluster"
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

}  // namespace palpate::runner::sweep
