#include "runner/commands/shared/shard.h"

#include <charconv>
#include <optional>

#include "runner/commands/shared/command.h"

namespace palpate::runner {
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
          " is no shard; the array's task numbers must follow one another (--array=1-N)");
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

}  // namespace palpate::runner
