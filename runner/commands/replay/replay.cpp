// `palpate replay`: a stored trial through the servo and its renderer again.

#include <iostream>
#include <string>

#include "data/store/store.h"
#include "runner/commands/replay/report.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/outputs.h"
#include "runner/commands/shared/trial_option.h"
#include "runner/session/recorded_trial.h"
#include "runner/session/replay_comparison.h"

namespace palpate::runner {
int replay_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage = "palpate replay --db FILE --trial CODE/SESSION/TRIAL [--compare] [--out FILE.csv]";
  line.summary =
      "Puts a stored trial through the servo and its renderer again: the forces must be the\n"
      "recorded ones, bit by bit; of a trial of several intervals, in each of them. Needs servo\n"
      "samples (\"samples\": true in the protocol). Status 1 when a tick differs.";
  line.example =
      "  palpate replay --db study.db --trial P03/1/12\n"
      "  palpate replay --db study.db --trial P03/1/12 --compare --out both.csv   (and what the\n"
      "      other renderer would have shown on the same way, tick by tick)\n"
      "  palpate watch --db study.db --trial P03/1/12 --out trial.html   (a page that shows it)";
  std::string db, trial, protocol, out, json, folder;
  auto add = line.options.add_options();
  namespace po = boost::program_options;
  add("db", po::value(&db)->value_name("FILE")->required(), "the study's database; only read");
  add("trial", po::value(&trial)->value_name("CODE/SESSION/TRIAL")->required(), "which trial");
  add("protocol", po::value(&protocol)->value_name("NAME"),
      "of which protocol, where the code is in several");
  add("meshes", po::value(&folder)->value_name("DIR"),
      "where the protocol's mesh files are, for a database of before they were kept in it;\n"
      "default: the working directory");
  add("compare", "also show what the other renderer would have shown");
  add("out", po::value(&out)->value_name("FILE.csv"), "write every tick");
  add("json", po::value(&json)->value_name("FILE"), "write the figures as JSON");
  add("force", "replace files that are there");
  const auto values = line.parse(args);
  if (!values) return 0;
  Outputs outputs(*values, {"out", "json"}, {"db"});
  const data::TrialName name = parse_trial_name(trial);
  data::Store store = data::Store::open(db, data::Store::Mode::read_only);
  const RecordedTrial recorded = load_recorded_trial(store, name, protocol, folder);
  for (const protocols::StimulusSpec& stimulus : recorded.protocol.stimuli)
    outputs.protect(stimulus.object);
  const ReplayComparison found =
      compare_with_record(recorded.protocol, recorded.stored.record, values->count("compare") > 0);
  if (outputs.wanted("out")) outputs.put("out", to_csv(recorded, found));
  if (outputs.wanted("json")) outputs.put("json", to_json_text(trial, recorded, found));
  outputs.write();
  std::cout << to_text(trial, recorded, found);
  return found.equal_ticks == found.ticks.size() ? 0 : 1;
}

}  // namespace palpate::runner
