// `palpate watch`: stored trials on a page.

#include <algorithm>
#include <iostream>

#include "data/base/text.h"
#include "data/store/store.h"
#include "runner/commands/shared/command.h"
#include "runner/output/outputs.h"
#include "runner/touch/trial_page.h"

namespace palpate::runner::commands {
namespace {

constexpr std::size_t kMostShown = 4;  // pictures that stay legible side by side

std::vector<data::TrialName> names_of(const std::vector<std::string>& texts, bool compare) {
  std::vector<data::TrialName> names;
  for (const std::string& text : texts) {
    names.push_back(parse_trial_name(text));
    if (std::ranges::count(texts, text) > 1)
      throw UsageError("--trial " + printable(text, 60) + ": given twice");
  }
  if (names.size() * (compare ? 2 : 1) > kMostShown)
    throw UsageError(std::string("--trial: expected at most ") +
                     (compare ? "2 trials with --compare" : "4 trials") + ", found " +
                     std::to_string(names.size()));
  return names;
}

}  // namespace

int watch_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate watch --db FILE --trial CODE/SESSION/TRIAL [--trial ...] [--compare] --out "
      "PAGE.html";
  line.summary =
      "Writes a page that shows stored trials as presented: object, tool, contact and force\n"
      "in time, at speeds from 1/20 to 4. Contacts are found by rendering the trial again. The\n"
      "page needs no network and opens in any browser; of the participant it has only\n"
      "the code. Needs servo samples (\"samples\": true in the protocol).";
  line.example =
      "  palpate watch --db study.db --trial P03/1/12 --out trial.html\n"
      "  palpate watch --db study.db --trial P03/1/12 --trial P03/1/40 --out two.html   (side by\n"
      "      side, on one axis of time)\n"
      "  palpate watch --db study.db --trial P03/1/12 --compare --out both.html   (and the\n"
      "      other renderer on the same path)";
  std::string db, protocol, out, folder;
  std::vector<std::string> trials;
  auto add = line.options.add_options();
  namespace po = boost::program_options;
  add("db", po::value(&db)->value_name("FILE")->required(), "the study's database; only read");
  add("trial", po::value(&trials)->value_name("CODE/SESSION/TRIAL")->required(),
      "the trial; up to four, each with --trial");
  add("out", po::value(&out)->value_name("PAGE.html")->required(), "the page");
  add("compare", "also show the same path with the other renderer");
  add("protocol", po::value(&protocol)->value_name("NAME"),
      "the protocol, if the code is in several");
  add("meshes", po::value(&folder)->value_name("DIR"),
      "folder of the protocol's mesh files, for an old database that does not have them;\n"
      "default: the working directory");
  add("force", "replace an existing page");
  const auto values = line.parse(args);
  if (!values) return 0;
  output::Outputs outputs(*values, {"out"}, {"db"});
  const bool compare = values->count("compare") > 0;
  const std::vector<data::TrialName> names = names_of(trials, compare);
  data::Store store = data::Store::open(db, data::Store::Mode::read_only);
  std::vector<touch::WatchedTrial> watched;
  for (const data::TrialName& name : names) {
    watched.push_back(
        {session::to_string(name), session::load_recorded_trial(store, name, protocol, folder)});
    for (const protocols::StimulusSpec& stimulus : watched.back().trial.protocol.stimuli)
      outputs.protect(stimulus.object);
  }
  touch::TrialPage page = touch::trial_page(watched, compare);
  for (const std::string& note : page.notes) std::cerr << "note: " << printable(note) << "\n";
  const std::size_t size = page.html.size();
  outputs.put("out", std::move(page.html));
  outputs.write();
  std::cout << printable(out) << ": " << page.ticks << " ticks, " << (size + 999) / 1000 << " kB\n";
  return 0;
}

}  // namespace palpate::runner::commands
