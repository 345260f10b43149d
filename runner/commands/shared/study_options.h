#pragma once
// What a simulated study is asked for with.

#include <cstdint>
#include <string>

#include "runner/commands/shared/command.h"
#include "runner/participants/simulated_settings.h"

namespace palpate::runner {

/// The options that the data of a simulated study depends on.
struct StudyOptions {
  std::string protocol;
  std::string patch;  ///< file of a JSON merge patch on the simulated participant; empty: none
  int participants = 7;
  std::uint64_t seed = 1;
  int version = 0;  ///< of the simulated participant; 0: none was asked for
};

void add_study_options(CommandLine& line, StudyOptions& options);
/// To be called with what CommandLine::parse gave. \throws UsageError
void check_study_options(const boost::program_options::variables_map& values,
                         StudyOptions& options);

/// \throws UsageError: the path is no socket, or the time is out of range
void check_advisor(const std::string& path, double time_out);

}  // namespace palpate::runner
