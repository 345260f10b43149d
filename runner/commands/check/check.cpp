// `palpate check`: compares a study with its registration.

#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "data/base/text.h"
#include "protocols/json_document.h"
#include "runner/commands/shared/command.h"
#include "runner/output/outputs.h"
#include "runner/registration/deviations.h"

namespace palpate::runner::commands {
namespace {

namespace po = boost::program_options;
namespace fs = std::filesystem;

/// Refuses outputs in the registration: a check must not change its subject. \throws UsageError
void require_outside(const po::variables_map& values, const char* option,
                     const std::string& folder) {
  if (values.count(option) == 0) return;
  const fs::path file = fs::weakly_canonical(values[option].as<std::string>());
  const fs::path within = file.lexically_relative(fs::weakly_canonical(folder));
  if (!within.empty() && *within.begin() != "..")
    throw UsageError(std::string("--") + option + ": name a file outside of the registration");
}

}  // namespace

int check_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate check REGISTRATION --db FILE [--analysis FILE] [--digest SHA256]\n"
      "       [--json FILE] [--report FILE.html]";
  line.summary =
      "Compares a study with its registration (a folder that 'palpate register' made): protocol,\n"
      "order of trials, numbers, dates, settings of the analysis, versions, omissions. Lists each\n"
      "deviation with its evidence, then the verdict on each hypothesis. Exit status 1 if there "
      "is\n"
      "a deviation.";
  line.example =
      "  palpate check registration --db study.db\n"
      "  palpate check registration --db study.db --analysis analysis.json --report check.html";
  line.positional_names = {"REGISTRATION"};
  std::string database, analysis_file, digest, json, report;
  double too_fast = 0, alpha = 0;
  auto add = line.options.add_options();
  add("db", po::value(&database)->required()->value_name("FILE"), "the study's database");
  add("analysis", po::value(&analysis_file)->value_name("FILE"),
      "what 'palpate analyze --json' wrote for the report of the study: its settings and numbers "
      "are checked, too");
  add("too-fast-s", po::value(&too_fast)->value_name("SECONDS"),
      "limit of too fast answers that the report of the study uses; default: the registered one");
  add("alpha", po::value(&alpha)->value_name("P"),
      "alpha that the report of the study uses; default: the registered one");
  add("digest", po::value(&digest)->value_name("SHA256"),
      "the digest that the registry holds: the registration must be that one");
  add("json", po::value(&json)->value_name("FILE"), "write every point as JSON");
  add("report", po::value(&report)->value_name("FILE.html"), "write a page");
  add("force", "replace existing files");
  const auto values = line.parse(args);
  if (!values) return 0;
  const std::string folder = (*values)["REGISTRATION"].as<std::string>();
  output::Outputs outputs(*values, {"json", "report"}, {"db", "analysis"});
  for (const char* option : {"json", "report"}) require_outside(*values, option, folder);
  registration::ReportedAnalysis reported;
  if (!analysis_file.empty())
    reported = registration::read_reported(protocols::read_text_file(analysis_file), analysis_file);
  if (values->count("too-fast-s")) {
    if (!(too_fast > 0)) throw UsageError("--too-fast-s: expected a time in s above 0");
    if (reported.too_fast)
      throw UsageError("--too-fast-s: --analysis has this limit already; give one of them");
    reported.too_fast = too_fast;
  }
  if (values->count("alpha")) {
    if (!(alpha > 0 && alpha < 1)) throw UsageError("--alpha: expected a number from 0 to 1");
    reported.alpha = alpha;
  }
  if (values->count("digest")) reported.digest = registration::read_digest(digest);
  const registration::Registration registered = registration::read_registration(folder);
  warn_of_exposure(database);
  const registration::StudyCheck check =
      registration::check_study(registered, folder, database, reported);
  if (outputs.wanted("json")) outputs.put("json", registration::check_json(check, registered));
  if (outputs.wanted("report")) outputs.put("report", registration::check_html(check, registered));
  outputs.write();
  std::cout << registration::check_text(check, registered);
  return check.deviations() > 0 ? 1 : 0;
}

}  // namespace palpate::runner::commands
