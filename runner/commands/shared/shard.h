#pragma once
// Which part of the work this process does: points of a sweep, participants of a study.

#include <cstdint>
#include <functional>
#include <string>

namespace palpate::runner {

/// Shard `number` of `count`, from 1.
struct Shard {
  std::int64_t number = 1, count = 1;
  /// Its items follow one another: after `first` (from 0) up to `last`.
  std::int64_t first(std::int64_t items) const { return part(items, number - 1); }
  std::int64_t last(std::int64_t items) const { return part(items, number); }

 private:
  std::int64_t part(std::int64_t items, std::int64_t parts) const;
};

/// "2/8"; "auto": from the variables of a Slurm array task, SLURM_ARRAY_TASK_ID, _COUNT and _MIN.
/// \param variable  the value of an environment variable, or null. \throws UsageError
Shard parse_shard(const std::string& text, const std::function<const char*(const char*)>& variable);

}  // namespace palpate::runner
