#include "runner/commands/shared/study_options.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "data/base/text.h"
#include "runner/commands/shared/command.h"
#include "runner/session/socket_advisor.h"
#include "runner/study/simulation_limits.h"
#include "runner/terminal.h"

namespace palpate::runner::commands {

namespace po = boost::program_options;

void add_study_options(CommandLine& line, StudyOptions& options) {
  line.options.add_options()  //
      ("participants",
       po::value(&options.participants)->default_value(options.participants)->value_name("N"),
       "simulated participants, numbered from 1")  //
      ("seed", po::value(&options.seed)->default_value(options.seed)->value_name("S"),
       "of the participants; the order of trials follows the protocol's own seed");
  add_participant_version(line, options.version);
  line.options.add_options()  //
      ("settings", po::value(&options.patch)->value_name("FILE"),
       "JSON merge patch on the settings of that version, for ablations");
  line.positional_names = {"PROTOCOL.json"};
}

void check_study_options(const po::variables_map& values, StudyOptions& options) {
  study::check_simulated_participants(options.participants);
  check_participant_version(values, options.version);
  options.protocol = values["PROTOCOL.json"].as<std::string>();
}

void check_advisor(const std::string& path, double time_out) {
  if (!(time_out >= 0.01 && time_out <= 60))
    throw UsageError("--ask-time-out-s: must be 0.01 to 60 seconds");
  if (path.empty()) return;
  if (const std::string fault = session::socket_fault(path); !fault.empty())
    throw UsageError("--ask: expected the Unix domain socket of a program that listens, found " +
                     printable(path) + ": " + fault);
}

namespace {

constexpr std::int64_t kMostShards = 1'000'000;

std::optional<std::int64_t> number(const std::string& text) {
  std::int64_t value = 0;
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, value);
  if (read.ec != std::errc() || read.ptr != end || value < 0) return std::nullopt;
  return value;
}

std::int64_t slurm_number(const char* name,
                          const std::function<const char*(const char*)>& variable) {
  const char* const text = variable(name);
  if (text == nullptr) {
    throw UsageError(
        std::string("--shard auto: expected a task of a Slurm array (sbatch --array), but ") +
        name + " is not set; elsewhere give --shard K/N");
  }
  const auto value = number(text);
  if (!value)
    throw UsageError(std::string("--shard auto: expected a number in ") + name + ", found '" +
                     text + "'");
  return *value;
}

}  // namespace

std::int64_t Shard::part(std::int64_t items, std::int64_t parts) const {
  // items * parts / count, without overflow.
  return items / count * parts + items % count * parts / count;
}

Shard parse_shard(const std::string& text,
                  const std::function<const char*(const char*)>& variable) {
  Shard shard;
  if (text == "auto") {
    shard.count = slurm_number("SLURM_ARRAY_TASK_COUNT", variable);
    shard.number = slurm_number("SLURM_ARRAY_TASK_ID", variable) -
                   slurm_number("SLURM_ARRAY_TASK_MIN", variable) + 1;
    if (shard.count < 1 || shard.count > kMostShards || shard.number < 1 ||
        shard.number > shard.count) {
      throw UsageError(
          "--shard auto: task " + std::to_string(shard.number) + " of " +
          std::to_string(shard.count) +
          " is not a shard; the array's task numbers must be consecutive (--array=1-N)");
    }
    return shard;
  }
  const std::size_t slash = text.find('/');
  const auto k = number(text.substr(0, slash));
  const auto n = slash == std::string::npos ? std::nullopt : number(text.substr(slash + 1));
  if (!k || !n || *n < 1 || *n > kMostShards || *k < 1 || *k > *n) {
    throw UsageError("--shard: expected K/N with 1 <= K <= N <= " + std::to_string(kMostShards) +
                     ", such as 3/8, or auto; found '" + text + "'");
  }
  return {*k, *n};
}

void add_participant_version(CommandLine& line, int& version) {
  line.options.add_options()(
      "participant-version", boost::program_options::value(&version)->value_name("1|2|3"),
      ("of the simulated participant; each is frozen. Default: the one that FILE was begun with, "
       "else " +
       std::to_string(participants::kDefaultParticipantVersion))
          .c_str());
}

void check_participant_version(const boost::program_options::variables_map& values, int version) {
  if (values.count("participant-version") == 0) return;
  const std::vector<int> versions = participants::participant_versions();
  if (std::find(versions.begin(), versions.end(), version) == versions.end())
    throw UsageError("--participant-version: must be 1 to " + std::to_string(versions.back()));
}

int version_to_resume_with(const std::set<int>& begun, const std::string& file) {
  if (begun.empty()) return participants::kDefaultParticipantVersion;
  if (begun.size() > 1) {
    std::string versions;
    for (const int version : begun)
      versions += (versions.empty() ? "" : ", ") + std::to_string(version);
    throw UsageError(printable(file) + ": holds versions " + versions +
                     " of the simulated participant; choose one with --participant-version");
  }
  if (*begun.begin() != participants::kDefaultParticipantVersion) {
    std::fprintf(stderr, "%s: continues with version %d of the simulated participant\n",
                 printable(file).c_str(), *begun.begin());
  }
  return *begun.begin();
}

std::vector<int> numbers_of_groups(const std::string& text, const GroupAssignment& groups) {
  if (groups.rule != GroupAssignment::Rule::given || !groups.any())
    throw UsageError(
        "--groups: the protocol assigns groups itself, or has none; use --participants");
  const std::string expected = "--groups: expected NAME=N,... of " + join_names(groups.names);
  std::set<int> numbers;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const std::size_t equals = part.find('=');
    const std::size_t group = groups.find(part.substr(0, equals));
    const std::string digits = equals == std::string::npos ? "" : part.substr(equals + 1);
    const bool is_count = !digits.empty() && digits.size() < 6 &&
                          digits.find_first_not_of("0123456789") == std::string::npos;
    if (group == groups.names.size() || !is_count)
      throw UsageError(expected + ", found '" + part + "'");
    if (numbers.contains(groups.number(group, 1)))
      throw UsageError(expected + " once each, found '" + part + "'");
    for (int row = 1; row <= std::stoi(digits); ++row) numbers.insert(groups.number(group, row));
  }
  if (numbers.empty()) throw UsageError(expected + " with at least one participant");
  return {numbers.begin(), numbers.end()};
}

}  // namespace palpate::runner::commands
