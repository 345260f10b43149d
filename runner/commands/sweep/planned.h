#pragma once
// The request for a sweep: the options that determine its results, checked, and its plan.

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>

#include "data/sweep_record.h"
#include "protocols/protocol.h"
#include "runner/commands/shared/command.h"
#include "runner/output/outputs.h"
#include "runner/sweep/design.h"
#include "runner/sweep/swept_study.h"

namespace palpate::runner::commands {

struct SweepSettings {
  std::string protocol, space, design;
  std::string patch;  ///< file of a JSON merge patch on the participant's settings; "": none
  std::int64_t points = 0;
  std::uint64_t seed = 1;
  int version = 0;                        ///< of the simulated participant; 0: not given
  int participants = 7, repetitions = 0;  ///< repetitions 0: the protocol's
};

void add_sweep_options(CommandLine& line, SweepSettings& settings);
/// Call it with the result of CommandLine::parse. \throws UsageError
void check_sweep_options(const boost::program_options::variables_map& values,
                         SweepSettings& settings);

struct PlannedSweep {
  /// \param settings  with a version. \throws UsageError; protocols::InputError with every fault of
  /// protocol or space
  explicit PlannedSweep(const SweepSettings& settings);

  protocols::Protocol protocol;  ///< as in its file
  sweep::SweptStudy study;
  sweep::Design design;
  data::SweepPlan plan;
};

// One point of a sweep: a study in memory, and its figures as `analyze` defines them.

/// The inputs of a point.
struct Sweep {
  const sweep::SweptStudy& study;
  const sweep::Design& design;
  const data::SweepPlan& plan;
};

/// The point's study, not yet run.
sweep::PointStudy study_of_point(const Sweep& sweep, std::int64_t point);

/// Runs a point. An exception is the reason why the point failed. \return none: it was stopped
std::optional<data::SweepRow> run_point(const Sweep& sweep, std::int64_t point,
                                        const std::atomic<bool>& stop);

/// `palpate analyze --sweep`: the analysis as text; puts the requested files into `outputs` without
/// writing them. \throws UsageError: the file is not a sweep's, or the pattern is invalid
std::string analyze_sweep_file(const std::string& file, const std::string& pattern,
                               output::Outputs& outputs);

}  // namespace palpate::runner::commands
