#include "runner/sweep/cluster_job.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "protocols/json_document.h"
#include "protocols/object_reader.h"
#include "runner/output/outputs.h"

namespace palpate::runner::sweep {
namespace {

using protocols::NumberRange;
using protocols::ObjectReader;
using protocols::Presence;

constexpr int kVersion = 2;
constexpr double kMostItems = 1e9, kMostTime = 1e12;  // s since 1970
constexpr std::size_t kMostOptions = 1'000, kMostWord = 10'000;

void read_count(ObjectReader& reader, const char* key, std::int64_t& out,
                const NumberRange& range) {
  std::size_t value = 0;
  reader.count(key, value, range);
  out = static_cast<std::int64_t>(value);
}

}  // namespace

void write_job(const std::filesystem::path& folder, const ClusterJob& job) {
  const nlohmann::json out{
      {"version", kVersion},       {"work", job.work},           {"unit", job.unit},
      {"shards", job.shards},      {"items", job.items},         {"per_item", job.per_item},
      {"sbatch", job.options},     {"array_job", job.array_job}, {"submitted_s", job.submitted_s},
      {"done_then", job.done_then}};
  output::write_whole((folder / "cluster.json").string(), out.dump(1) + "\n");
}

ClusterJob parse_job(const std::string& text, const std::string& path) {
  protocols::FaultList faults(path);
  const nlohmann::json json = protocols::read_json(text, faults);
  ObjectReader reader(json, "", faults);
  if (const auto* version = reader.member("version", Presence::required);
      version != nullptr && *version != kVersion)
    faults.add("/version", "expected version " + std::to_string(kVersion) +
                               protocols::found_text(*version) +
                               "; resume it with the program that wrote it");
  faults.throw_if_any();
  ClusterJob job;
  reader.choice("work", job.work,
                {std::pair{"sweep", "sweep"}, {"simulate", "simulate"}, {"plan", "plan"}},
                Presence::required);
  reader.choice("unit", job.unit,
                {std::pair{"points", "points"}, {"sessions", "sessions"}, {"curves", "curves"}},
                Presence::required);
  read_count(reader, "items", job.items, {1, kMostItems});
  read_count(reader, "shards", job.shards,
             {1, static_cast<double>(std::max<std::int64_t>(1, job.items))});
  read_count(reader, "per_item", job.per_item, {1, kMostItems});
  if (const auto* options = reader.array("sbatch", 0, kMostOptions, Presence::required)) {
    for (std::size_t i = 0; i < options->size(); ++i)
      protocols::read_text((*options)[i], protocols::child_pointer("/sbatch", i),
                           job.options.emplace_back(), kMostWord, faults);
  }
  reader.text("array_job", job.array_job, kMostWord);
  if (job.array_job.find_first_not_of("0123456789") != std::string::npos)
    faults.add("/array_job", "expected the number of a job, or nothing");
  read_count(reader, "submitted_s", job.submitted_s, {0, kMostTime});
  read_count(reader, "done_then", job.done_then, {0, kMostTime});
  reader.refuse_unknown_keys();
  faults.throw_if_any();
  return job;
}

ClusterJob read_job(const std::filesystem::path& folder) {
  const std::string path = (folder / "cluster.json").string();
  return parse_job(protocols::read_text_file(path), path);
}

}  // namespace palpate::runner::sweep
