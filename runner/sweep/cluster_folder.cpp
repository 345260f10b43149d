#include "runner/sweep/cluster_folder.h"

#include <algorithm>
#include <cstddef>

#include "data/files/file_permissions.h"
#include "data/store/store.h"
#include "data/store/sweep_file.h"
#include "protocols/json_document.h"
#include "runner/output/outputs.h"
#include "runner/session/run_record.h"
#include "runner/terminal.h"
#include "runner/usage_error.h"

namespace palpate::runner::sweep {

namespace fs = std::filesystem;

fs::path part_of(const fs::path& folder, const ClusterJob& job, std::int64_t shard) {
  const std::string digits = std::to_string(shard);
  return folder / "parts" /
         ("part" + std::string(6 - std::min<std::size_t>(6, digits.size()), '0') + digits +
          job.extension());
}

std::int64_t recorded_in(const ClusterJob& job, const std::string& path) {
  if (!fs::exists(path)) return 0;
  if (job.work == "plan") return 1;  // written at once
  if (job.work == "sweep") return data::SweepFile::open(path).count();
  data::Store store = data::Store::open(path, data::Store::Mode::read_only);
  const std::vector<data::StoredRun> runs = store.runs();
  return std::count_if(runs.begin(), runs.end(),
                       [](const data::StoredRun& run) { return run.end == data::RunEnd::done; });
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
    output::write_whole(path.string(), bytes);
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
        "; another user's files there would run under your account. If nothing was changed: "
        "chmod -R go-w " +
        shell_quoted(folder.string()));
  }
}

}  // namespace palpate::runner::sweep
