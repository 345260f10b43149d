#include "protocols/schedule.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iomanip>
#include <iostream>
#include <nlohmann/json.hpp>

#include "protocols/groups.h"
#include "protocols/parse.h"
#include "runner/commands/shared/command.h"
#include "runner/output/outputs.h"
#include "runner/study/study_order.h"
#include "runner/study/task_words.h"

namespace palpate::runner::commands {
namespace {

namespace po = boost::program_options;

const std::string& shape_of(const protocols::Protocol& protocol, const protocols::Trial& trial) {
  return protocol.stimuli[static_cast<std::size_t>(trial.stimulus)].name;
}

void print_csv(const protocols::Protocol& protocol, const std::vector<protocols::Trial>& trials,
               int participant) {
  output::CsvText table(study::schedule_columns(), "\r\n");
  for (const protocols::Trial& trial : trials)
    study::put_scheduled(table, protocol, trial, participant);
  std::cout << table.text();
}

void print_json(const protocols::Protocol& protocol, const std::vector<protocols::Trial>& trials,
                int participant) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const protocols::Trial& trial : trials) {
    const Quat& q = trial.orientation;
    rows.push_back({{"session", trial.session},
                    {"block", trial.block},
                    {"trial", trial.trial},
                    {"renderer", protocols::to_string(trial.renderer)},
                    {"shape", shape_of(protocol, trial)},
                    {"orientation_wxyz", {q.w, q.x, q.y, q.z}},
                    {"practice", trial.practice}});
  }
  const nlohmann::ordered_json document = {{"protocol", protocol.name},
                                           {"protocol_sha256", protocol.sha256},
                                           {"program_version", PALPATE_VERSION},
                                           {"participant_number", participant},
                                           {"trials", rows}};
  std::cout << document.dump(1) << "\n";
}

void print_table(const protocols::Protocol& protocol, const std::vector<protocols::Trial>& trials) {
  std::size_t width = 5;
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli) {
    width = std::max(width, stimulus.name.size());
  }
  const auto shape_width = static_cast<int>(width);
  std::cout << "session  block  trial  renderer  " << std::left << std::setw(shape_width) << "shape"
            << "  orientation (w x y z)\n";
  std::cout << std::fixed << std::setprecision(3);
  for (const protocols::Trial& trial : trials) {
    const Quat& q = trial.orientation;
    std::cout << std::right << std::setw(7) << trial.session << std::setw(7) << trial.block
              << std::setw(7) << trial.trial << "  " << std::left << std::setw(8)
              << protocols::to_string(trial.renderer) << "  " << std::setw(shape_width)
              << shape_of(protocol, trial) << std::right;
    for (const double part : {q.w, q.x, q.y, q.z}) std::cout << std::setw(8) << part;
    std::cout << (trial.practice ? "  practice\n" : "\n");
  }
}

/// The number of participant `row` of a group. \throws UsageError
int number_in(const std::string& name, const GroupAssignment& groups, int row) {
  if (!groups.any()) throw UsageError("--group: the protocol has no groups");
  const std::size_t group = groups.find(name);
  if (group == groups.names.size())
    throw UsageError("--group: expected " + join_names(groups.names) + ", found '" + name + "'");
  constexpr int kMost = 1'000'000;
  if (row > kMost) throw UsageError("--group: --participant must be at most 1000000");
  return groups.number(group, row);
}

}  // namespace

int schedule_command(const std::vector<std::string>& args) {
  CommandLine line;
  line.usage =
      "palpate schedule PROTOCOL.json (--participant N [--group NAME] | --recover N) [--format "
      "table|csv|json|order]";
  line.summary =
      "Prints the trials that a participant will get, in order, without running them.\n"
      "If answers choose the levels: prints the rule and an example.";
  line.example =
      "  palpate schedule protocols/ho2000.json --participant 1\n"
      "  palpate schedule protocols/ho2000.json --participant 2 --format csv > order.csv\n"
      "  palpate schedule protocols/size-questplus.json --recover 200";
  line.positional_names = {"PROTOCOL.json"};
  line.options.add_options()("participant", po::value<int>()->value_name("N"),
                             "participant number: 1, 2, ...")(
      "group", po::value<std::string>()->value_name("NAME"), "the N-th participant of this group")(
      "format", po::value<std::string>()->default_value("table")->value_name("FORMAT"),
      "table, csv, json, or order: the lines of which a registration holds the checksum")(
      "recover", po::value<int>()->value_name("N"),
      "instead: bias and spread of the thresholds that its adaptive procedures find, over N "
      "simulated participants whose threshold is known")(
      "seed", po::value<std::uint64_t>()->default_value(1)->value_name("S"), "of --recover");
  const auto values = line.parse(args);
  if (!values) return 0;
  const auto format = (*values)["format"].as<std::string>();
  if (format != "table" && format != "csv" && format != "json" && format != "order") {
    throw UsageError("--format: expected table, csv, json or order, found '" + format + "'");
  }

  const protocols::Protocol all =
      protocols::parse_protocol((*values)["PROTOCOL.json"].as<std::string>());
  if (values->count("recover")) {
    if (format == "order") throw UsageError("--recover: is no order; expected table, csv or json");
    const int count = (*values)["recover"].as<int>();
    if (count < 2 || count > 100000) throw UsageError("--recover: must be 2 to 100000");
    std::cout << study::recovery_text(all, count, (*values)["seed"].as<std::uint64_t>(), format);
    return 0;
  }
  if (values->count("participant") == 0)
    throw UsageError("expected --participant N\nUsage: " + line.usage + "\nMore: add --help");
  int participant = (*values)["participant"].as<int>();
  study::check_participant_number(participant);
  if (values->count("group"))
    participant = number_in(text_of(*values, "group"), all.groups, participant);
  const protocols::Protocol& protocol = protocols::protocol_of(all, participant);
  if (all.groups.any() && format == "table")
    std::cout << "participant " << participant << ", group " << all.groups.name(participant)
              << "\n";
  if (format == "order") {
    std::cout << study::fixed_order(protocol, participant);
    return 0;
  }
  if (protocol.version == 2) {
    std::cout << study::task_schedule_text(protocol, participant, format);
    return 0;
  }
  const std::vector<protocols::Trial> trials = protocols::schedule(protocol, participant);
  if (format == "csv") {
    print_csv(protocol, trials, participant);
  } else if (format == "json") {
    print_json(protocol, trials, participant);
  } else {
    print_table(protocol, trials);
  }
  return 0;
}

}  // namespace palpate::runner::commands
