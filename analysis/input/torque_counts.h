#pragma once
// In how many trials a device that drives force alone left the renderer's torque out.

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::analysis {

class TorqueCounts {
 public:
  /// \param driven  missing: unknown, or the renderer gives none
  void add(std::string_view renderer, std::optional<bool> driven);
  /// Adds a sentence for each renderer whose torque was left out in a trial.
  void warn(std::vector<std::string>& warnings) const;

 private:
  struct Count {
    std::size_t trials = 0, left_out = 0;
  };
  std::map<std::string, Count, std::less<>> counts_;
};

}  // namespace palpate::analysis
