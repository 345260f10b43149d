#pragma once
// The commands of the program, one file each. main.cpp holds the table of them.
//
// A command gets the arguments after its name and returns the exit status. It writes results to
// stdout, messages and progress (only on a terminal) to stderr. It throws UsageError for wrong
// usage (status 2), InputError or MeshError for bad input (status 2), anything else for a failure
// while running (status 1); main.cpp prints them.

#include <boost/program_options.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace palpate::runner {

class UsageError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A command's options: prints --help with the example, checks, and stores the values.
struct CommandLine {
  std::string usage;    ///< "palpate validate PROTOCOL.json"
  std::string summary;  ///< what it does, in a sentence
  std::string example;  ///< one or more command lines with what they are for
  boost::program_options::options_description options{"Options"};
  boost::program_options::positional_options_description positional;
  std::vector<std::string> positional_names;  ///< hidden from the list of options; all std::string

  /// Parses; nullopt when --help was asked for and printed. \throws UsageError.
  std::optional<boost::program_options::variables_map> parse(const std::vector<std::string>& args);
};

/// Says on stderr, once, where others could get at the database or put files beside it.
void warn_of_exposure(const std::string& database);

int accuracy_command(const std::vector<std::string>& args);
int analyze_command(const std::vector<std::string>& args);
int bench_command(const std::vector<std::string>& args);
int devices_command(const std::vector<std::string>& args);
int export_command(const std::vector<std::string>& args);
int forget_command(const std::vector<std::string>& args);
int merge_command(const std::vector<std::string>& args);
int plan_command(const std::vector<std::string>& args);
int render_command(const std::vector<std::string>& args);
int replay_command(const std::vector<std::string>& args);
int run_command(const std::vector<std::string>& args);
int schedule_command(const std::vector<std::string>& args);
int simulate_command(const std::vector<std::string>& args);
int stability_command(const std::vector<std::string>& args);
int validate_command(const std::vector<std::string>& args);

}  // namespace palpate::runner
