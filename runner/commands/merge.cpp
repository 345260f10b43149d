#include "data/merge/merge.h"

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "data/base/text.h"
#include "runner/commands/shared/command.h"
#include "runner/output/progress_line.h"

namespace palpate::runner::commands {
namespace {

namespace po = boost::program_options;

void refuse_folders(const std::vector<std::string>& inputs) {
  for (const std::string& input : inputs) {
    std::error_code error;
    if (std::filesystem::is_directory(input, error))
      throw UsageError(input + ": this is a folder; name the databases in it, such as " +
                       (std::filesystem::path(input) / "*.db").lexically_normal().string());
  }
}

void print(const std::string& out, const data::MergeResult& done) {
  std::cout << printable(out) << ": " << done.counts.participants << " participants, "
            << done.counts.sessions << " sessions, " << done.counts.completed << " trials, "
            << done.counts.cut_off << " attempts that were cut off\n";
  for (const data::RenumberedParticipant& one : done.renumbered) {
    std::cout << one.code << " (" << printable(one.path) << ") has number " << one.to
              << " from now on: " << one.from << " is also " << one.other << "'s. The trials of "
              << one.code << " keep the order of number " << one.from << "\n";
  }
  for (const data::ExcludedParticipant& one : done.excluded) {
    std::cerr << printable(one.code) << " has withdrawn and is left out, but is still in "
              << printable(one.path) << "; remove with: palpate forget --db '"
              << printable(one.path) << "' --participant " << printable(one.code) << "\n";
  }
}

/// Whether the inputs are sweeps. \throws UsageError: some are, some are not
bool are_sweeps(const std::vector<std::string>& inputs) {
  for (const std::string& input : inputs) {
    std::error_code error;
    if (!std::filesystem::exists(input, error))
      throw UsageError(input + ": there is no such file (or its folder may not be read)");
  }
  const auto sweep = std::find_if(inputs.begin(), inputs.end(), data::is_sweep_file);
  const auto other = std::find_if_not(inputs.begin(), inputs.end(), data::is_sweep_file);
  if (sweep != inputs.end() && other != inputs.end()) {
    throw UsageError(*sweep + " is the file of a sweep and " + *other +
                     " is not: a study and a sweep cannot be put together");
  }
  return sweep != inputs.end();
}

void merge_shards(const std::string& out, const std::vector<std::string>& inputs,
                  const std::atomic<bool>& stop_asked) {
  output::ProgressLine progress("files");
  const data::SweepMergeResult done = data::merge_sweeps(out, inputs, [&](std::int64_t file) {
    if (stop_asked) throw std::runtime_error("stopped; nothing was written");
    progress.show(static_cast<double>(file) / static_cast<double>(inputs.size()));
  });
  progress.clear();
  warn_of_exposure(out);
  std::cout << printable(out) << ": " << done.points << " of " << done.plan.points
            << " points of a sweep, SIMULATED participants";
  if (done.failed > 0) std::cout << ", " << done.failed << " of them failed";
  std::cout << "\n";
  if (done.points < done.plan.points)
    std::cerr << "the other points are in none of the files; compute them with: palpate sweep "
              << "... --db " << printable(out) << "\n";
}

}  // namespace

int merge_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage = "palpate merge --out ALL.db A.db B.db ... [--renumber]";
  line.summary =
      "Merges the databases of several stations, which are only read, into a new one.\n"
      "Refuses, with every reason, what cannot be one study: a participant with different\n"
      "content, one number for two codes (unless --renumber), different protocols under one\n"
      "name. Participants who have withdrawn at one station are left out altogether. Merging\n"
      "a merged database again with its parts changes nothing. The files of a sweep's shards are\n"
      "merged, too, if they have one plan; the result has the bytes of an uninterrupted sweep.";
  line.example =
      "  palpate merge --out all.db station1.db station2.db\n"
      "  palpate merge --out all2.db all.db station3.db\n"
      "  palpate merge --out people.sweep shard*.sweep";
  std::string out;
  std::vector<std::string> inputs;
  auto add = line.options.add_options();
  add("out", po::value(&out)->required()->value_name("FILE"), "the new database");
  add("input", po::value(&inputs)->value_name("FILE"),
      "a station's database; the word --input may be left out");
  add("renumber", po::bool_switch(),
      "if two stations gave one number to two codes, the one that began later gets the next free "
      "number; its trials, also future ones, keep the order of the old number, which stays stored");
  line.positional.add("input", -1);
  const auto values = line.parse(args);
  if (!values) return 0;
  if (inputs.empty()) {
    throw UsageError("missing the databases to merge\nUsage: " + line.usage + "\nMore: add --help");
  }
  refuse_folders(inputs);
  const std::atomic<bool>& stop_asked = output::catch_stop_signals();
  try {
    if (are_sweeps(inputs)) {
      if ((*values)["renumber"].as<bool>())
        throw UsageError("--renumber: a sweep has no participants with numbers of their own");
      merge_shards(out, inputs, stop_asked);
      return 0;
    }
    output::ProgressLine progress("sessions");
    const data::MergeResult done = data::merge(
        out, inputs,
        [&](std::int64_t session, std::int64_t all) {
          if (stop_asked) throw std::runtime_error("stopped; nothing was written");
          progress.show(all > 0 ? static_cast<double>(session) / static_cast<double>(all) : 1);
        },
        (*values)["renumber"].as<bool>() ? data::NumberConflict::renumber
                                         : data::NumberConflict::refuse);
    progress.clear();
    warn_of_exposure(out);
    print(out, done);
  } catch (const data::StoreRefused& error) {
    throw UsageError(error.what());  // a bad file is bad input: status 2
  }
  return 0;
}

}  // namespace palpate::runner::commands
