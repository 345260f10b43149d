#include "runner/design/rehearsal.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <exception>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "analysis/report/study_report.h"
#include "analysis/statistics/task_analysis.h"
#include "data/store/store.h"
#include "protocols/parse.h"
#include "runner/participants/simulated_settings.h"
#include "runner/serve/loopback.h"
#include "runner/session/simulated_study.h"
#include "runner/study/simulation_limits.h"
#include "runner/study/study_trials.h"
#include "runner/usage_error.h"

namespace palpate::runner::design {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t kReportsKept = 8;
constexpr int kNice = 10;

/// Waits until the other end of a pipe is closed, then removes a folder.
[[noreturn]] void remove_at_the_end(int life, const std::string& folder) {
  ::setsid();  // a terminal's Ctrl+C is for the parent
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::close(descriptor);
  char none = 0;
  while (::read(life, &none, 1) < 0 && errno == EINTR) {
  }
  std::error_code ignored;
  fs::remove_all(folder, ignored);
  ::_exit(0);
}

void lower_priority_of_thread() {
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(::syscall(SYS_gettid)), kNice);
}

/// The words of a process's command line; empty: it has none, or has ended.
std::vector<std::string> command_line_of(const fs::path& process) {
  std::ifstream file(process / "cmdline", std::ios::binary);
  std::vector<std::string> words;
  for (std::string word; words.size() < 2 && std::getline(file, word, '\0');) words.push_back(word);
  return words;
}

/// The report of what a database holds.
std::string report_of(data::Store& store) {
  study::Study study = study::read_study(store, "", true);
  const analysis::StudyAnalysis found =
      analysis::analyze_study(std::move(study.table), {}, {}, PALPATE_VERSION);
  return analysis::study_html(found, study.record);
}

/// The present activity of a palpate of this computer with a person and a device: "run", "serve",
/// "explore";
/// "": nothing.
std::string session_on_this_computer() {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator("/proc", error)) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    const std::vector<std::string> words = command_line_of(entry.path());
    if (words.size() < 2 || fs::path(words[0]).filename() != "palpate") continue;
    for (const char* const with_a_person : {"run", "serve", "explore"}) {
      if (words[1] == with_a_person) return words[1];
    }
  }
  return "";
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
  std::string name = (fs::temp_directory_path() / "palpate-rehearsal-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr)
    throw std::runtime_error(name + ": " + std::generic_category().message(errno));
  path_ = name;
  std::array<int, 2> ends{};
  const bool piped = ::pipe2(ends.data(), O_CLOEXEC) == 0;
  child_ = piped ? ::fork() : -1;
  if (child_ == 0) {
    ::close(ends[1]);
    remove_at_the_end(ends[0], path_);
  }
  if (piped) ::close(ends[0]);
  life_ = piped ? ends[1] : -1;
  if (child_ > 0) return;
  fs::remove_all(path_);
  throw std::runtime_error("no process to remove " + path_ + ": " +
                           std::generic_category().message(errno));
}

TemporaryFolder::~TemporaryFolder() {
  ::close(life_);
  ::waitpid(child_, nullptr, 0);
}

Rehearsal::~Rehearsal() {
  stop();
  if (thread_.joinable()) thread_.join();
}

void Rehearsal::start(const std::string& text, const std::string& path, const Request& request) {
  if (progress()["state"] == "running") throw UsageError("A rehearsal is running already.");
  if (thread_.joinable()) thread_.join();
  if (const std::string other = session_on_this_computer(); !other.empty())
    throw UsageError("palpate " + other +
                     " runs on this computer: a rehearsal would take time from its servo. Rehearse "
                     "when it has ended.");
  protocols::Protocol protocol = protocols::parse_protocol_text(text, path);
  stop_ = false;
  {
    const std::lock_guard lock(mutex_);
    progress_ = {{"state", "running"}, {"recorded", 0}, {"expected", 0}};
  }
  thread_ = std::thread([this, protocol = std::move(protocol), request]() mutable {
    lower_priority_of_thread();
    try {
      run(std::move(protocol), request);
    } catch (const std::exception& error) {
      const std::lock_guard lock(mutex_);
      progress_["state"] = "failed";
      progress_["why"] = error.what();
    }
  });
}

void Rehearsal::run(protocols::Protocol protocol, Request request) {
  const participants::SimulatedSettings people =
      participants::load_simulated_settings("", participants::kDefaultParticipantVersion);
  const session::LimitedForSimulation limited = study::fit_to_simulation(protocol, people);
  session::StudyPlan plan;
  plan.numbers = session::first_numbers(request.participants);
  plan.seed = request.seed;
  plan.event = limited.event;
  const std::string key = serve::make_token(), database = folder_.path() + "/" + key + ".db";
  std::string why, report;
  {
    data::Store store = data::Store::open(database, data::Store::Mode::write_or_create);
    const session::StudyProgress last = session::simulate_study(
        protocol, store, people, plan, stop_, [&](const session::StudyProgress& now) {
          if (const std::string other = session_on_this_computer(); !other.empty()) {
            why = "palpate " + other + " has begun on this computer.";
            stop_ = true;
          }
          const std::lock_guard lock(mutex_);
          progress_["recorded"] = now.recorded;
          progress_["expected"] = now.expected;
        });
    if (last.recorded == last.expected) report = report_of(store);
  }
  std::error_code ignored;
  for (const std::string& end : {std::string(), std::string("-wal"), std::string("-shm")})
    fs::remove(database + end, ignored);
  const std::lock_guard lock(mutex_);
  progress_["state"] = report.empty() ? "stopped" : "done";
  if (report.empty()) {
    progress_["why"] = why;
    return;
  }
  progress_["recorded"] = progress_["expected"];
  progress_["report"] = key;
  reports_.emplace_back(key, std::move(report));
  if (reports_.size() > kReportsKept) reports_.pop_front();
}

Json Rehearsal::progress() {
  const std::lock_guard lock(mutex_);
  return progress_;
}

std::optional<std::string> Rehearsal::report(const std::string& key) {
  const std::lock_guard lock(mutex_);
  for (const auto& [known, html] : reports_) {
    if (known == key) return html;
  }
  return std::nullopt;
}

}  // namespace palpate::runner::design
