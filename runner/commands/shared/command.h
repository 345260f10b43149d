#pragma once
// The commands of the program, a file or folder each. main.cpp has the table of them.
//
// A command gets the arguments after its name and returns the exit status. It writes results to
// stdout, messages and progress (only on a terminal) to stderr. It throws UsageError for wrong
// usage (status 2), InputError or MeshError for bad input (status 2), anything else for a failure
// while running (status 1); main.cpp prints them.

#include <boost/program_options.hpp>
#include <optional>
#include <string>
#include <vector>

#include "data/store/store.h"
#include "runner/terminal.h"
#include "runner/usage_error.h"
#include "stimuli/polygon_soup.h"

namespace palpate::runner::commands {

/// The trial named by an option, "P03/1/12". \throws UsageError
data::TrialName parse_trial_name(const std::string& text);

/// A command's options: parses them, checks numbers and prints --help.
struct CommandLine {
  std::string usage;    ///< "palpate validate PROTOCOL.json"
  std::string summary;  ///< its purpose, in a sentence
  std::string example;  ///< one or more command lines with explanations
  boost::program_options::options_description options{"Options"};
  boost::program_options::positional_options_description positional;
  std::vector<std::string> positional_names;  ///< not in the options' list; all std::string

  /// nullopt if --help was given: then it has been printed. \throws UsageError.
  std::optional<boost::program_options::variables_map> parse(const std::vector<std::string>& args);
};

/// The value of an option; empty if it was not given.
std::string text_of(const boost::program_options::variables_map& values, const char* option);

/// Warns on stderr if other users can read the database or create files beside it.
void warn_of_exposure(const std::string& database);

int accuracy_command(const std::vector<std::string>& args);
int analyze_command(const std::vector<std::string>& args);
int bench_command(const std::vector<std::string>& args);
int bundle_command(const std::vector<std::string>& args);
int check_command(const std::vector<std::string>& args);
int cluster_command(const std::vector<std::string>& args);
int design_command(const std::vector<std::string>& args);
int devices_command(const std::vector<std::string>& args);
int explore_command(const std::vector<std::string>& args);
int export_command(const std::vector<std::string>& args);
int forget_command(const std::vector<std::string>& args);
int merge_command(const std::vector<std::string>& args);
int plan_command(const std::vector<std::string>& args);
int register_command(const std::vector<std::string>& args);
int render_command(const std::vector<std::string>& args);
int replay_command(const std::vector<std::string>& args);
int run_command(const std::vector<std::string>& args);
int schedule_command(const std::vector<std::string>& args);
int serve_command(const std::vector<std::string>& args);
int simulate_command(const std::vector<std::string>& args);
int stability_command(const std::vector<std::string>& args);
int sweep_command(const std::vector<std::string>& args);
int unmask_command(const std::vector<std::string>& args);
int validate_command(const std::vector<std::string>& args);
int watch_command(const std::vector<std::string>& args);

}  // namespace palpate::runner::commands
