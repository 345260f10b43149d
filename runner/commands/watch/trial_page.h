#pragma once
// A page that shows trials: objects, tool, contact and force in time.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "runner/session/recorded_trial.h"

namespace palpate::runner {

struct WatchedTrial {
  std::string name;  ///< "P03/1/12"
  RecordedTrial trial;
};

struct TrialPage {
  std::string html;
  std::size_t ticks = 0;           ///< that it shows; a comparison has them twice
  std::vector<std::string> notes;  ///< what differs from the record or the object, in sentences
};

/// Self-contained: nothing is loaded, and no script runs but its own.
/// \param compare  after each trial, what the other renderer makes of its path
/// \throws std::invalid_argument where protocol and record do not agree
TrialPage trial_page(const std::vector<WatchedTrial>& trials, bool compare);

std::string_view watch_css();  ///< watch.css, embedded by the build
std::string_view watch_js();

}  // namespace palpate::runner
