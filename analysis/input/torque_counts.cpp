#include "analysis/input/torque_counts.h"

#include "analysis/text.h"
#include "stimuli/text.h"

namespace palpate::analysis {

void TorqueCounts::add(std::string_view renderer, std::optional<bool> driven) {
  if (!driven) return;
  auto found = counts_.find(renderer);
  if (found == counts_.end()) found = counts_.emplace(renderer, Count{}).first;
  ++found->second.trials;
  if (!*driven) ++found->second.left_out;
}

void TorqueCounts::warn(std::vector<std::string>& warnings) const {
  for (const auto& [renderer, count] : counts_) {
    if (count.left_out == 0) continue;
    warnings.push_back("In " + std::to_string(count.left_out) + " of " +
                       counted(count.trials, "trial", "trials") + " with " +
                       stimuli::printable(renderer, 40) +
                       " torque was left out: the device drives force alone.");
  }
}

}  // namespace palpate::analysis
