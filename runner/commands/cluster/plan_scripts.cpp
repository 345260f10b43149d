#include "runner/commands/cluster/plan_scripts.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "runner/commands/cluster/job.h"
#include "runner/commands/cluster/slurm.h"

namespace palpate::runner {
namespace {

namespace fs = std::filesystem;
namespace po = boost::program_options;

/// The options that were given as words of a shell's command line, files with their whole path;
/// without --trials.
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

}  // namespace palpate::runner
