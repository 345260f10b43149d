#include "runner/commands/shared/study_options.h"

#include "data/base/text.h"
#include "runner/commands/shared/simulation.h"
#include "runner/session/socket_advisor.h"

namespace palpate::runner {

namespace po = boost::program_options;

void add_study_options(CommandLine& line, StudyOptions& options) {
  line.options.add_options()  //
      ("participants",
       po::value(&options.participants)->default_value(options.participants)->value_name("N"),
       "simulated participants, numbered from 1")  //
      ("seed", po::value(&options.seed)->default_value(options.seed)->value_name("S"),
       "of the participants; the order of trials follows the protocol's own seed");
  add_participant_version(line, options.version);
  line.options.add_options()  //
      ("settings", po::value(&options.patch)->value_name("FILE"),
       "JSON merge patch on the settings of that version, for ablations");
  line.positional_names = {"PROTOCOL.json"};
}

void check_study_options(const po::variables_map& values, StudyOptions& options) {
  check_simulated_participants(options.participants);
  check_participant_version(values, options.version);
  options.protocol = values["PROTOCOL.json"].as<std::string>();
}

void check_advisor(const std::string& path, double time_out) {
  if (!(time_out >= 0.01 && time_out <= 60))
    throw UsageError("--ask-time-out-s: must be 0.01 to 60 seconds");
  if (path.empty()) return;
  if (const std::string fault = socket_fault(path); !fault.empty())
    throw UsageError("--ask: expected the Unix domain socket of a program that listens, found " +
                     printable(path) + ": " + fault);
}

}  // namespace palpate::runner
