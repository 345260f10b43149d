#include "data/merge/sweep_merge.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <tuple>

#include "data/files/atomic_file.h"
#include "data/files/atomic_folder.h"
#include "data/files/file_permissions.h"
#include "data/files/output_check.h"

namespace palpate::data {
namespace {

namespace fs = std::filesystem;

void require_new(const std::string& out) {
  std::error_code error;
  if (out.empty()) throw StoreRefused("'' is not a path of a sweep's file");
  for (const char* end : {"", "-journal", "-wal"}) {
    if (!fs::exists(fs::symlink_status(out + end, error))) continue;
    throw StoreRefused(out + end + ": exists already; a merge makes a new file and replaces none");
  }
  if (belongs_to_database(out)) {
    throw StoreRefused(out +
                       ": is the name of a file that belongs to a database; give another name");
  }
}

void require_same_plan(const SweepPlan& plan, const std::string& first, const SweepFile& other) {
  const std::vector<std::string> reasons = differences(plan, other.plan());
  if (reasons.empty()) return;
  std::string text = other.path() + ": is of another sweep than " + first + ". Of " + first +
                     " and of this one differ:";
  for (const std::string& reason : reasons) text += "\n  " + reason;
  throw StoreRefused(text);
}

}  // namespace

SweepMergeResult merge_sweeps(const std::string& out, const std::vector<std::string>& inputs,
                              const std::function<void(std::int64_t)>& progress) {
  require_new(out);
  if (inputs.empty()) throw StoreRefused("no file to merge");
  const AtomicFolder folder(out);
  SweepMergeResult done;
  std::optional<SweepCopy> copy;
  std::vector<FileIdentity> seen;
  std::int64_t files = 0;
  for (const std::string& input : inputs) {
    const FileIdentity identity = identity_of(input);
    if (std::find(seen.begin(), seen.end(), identity) != seen.end()) continue;
    if (identity != FileIdentity{}) seen.push_back(identity);
    SweepFile file = SweepFile::open(input, SweepFile::Writers::none);
    if (!copy) {
      done.plan = file.plan();
      copy.emplace(folder / "merged.sweep", done.plan);
    }
    require_same_plan(done.plan, inputs.front(), file);
    copy->add(file);
    if (progress) progress(++files);
  }
  std::tie(done.points, done.failed) = copy->finish();
  if (!rename_if_absent(folder / "merged.sweep", out)) {
    throw StoreRefused(out + ": another program has created it meanwhile; nothing was written");
  }
  return done;
}

}  // namespace palpate::data
