#pragma once
// What `palpate replay` found, as text, JSON and CSV.

#include <string>

#include "runner/session/recorded_trial.h"
#include "runner/session/replay_comparison.h"

namespace palpate::runner {

/// \param name  "P03/1/12", as the trial was named
std::string to_text(const std::string& name, const RecordedTrial& trial,
                    const ReplayComparison& found);
std::string to_json_text(const std::string& name, const RecordedTrial& trial,
                         const ReplayComparison& found);
/// A row for each tick: s, m, N, N m; the other renderer's columns where it was asked for. Of a
/// trial of version 2 `interval` comes first, and t counts within it.
std::string to_csv(const RecordedTrial& trial, const ReplayComparison& found);

}  // namespace palpate::runner
