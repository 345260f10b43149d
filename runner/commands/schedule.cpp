#include <cstdint>
#include <iostream>

#include "protocols/groups.h"
#include "protocols/parse.h"
#include "runner/commands/shared/command.h"
#include "runner/study/schedule_text.h"
#include "runner/study/study_order.h"
#include "runner/study/task_words.h"

namespace palpate::runner::commands {
namespace {

namespace po = boost::program_options;

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
  std::cout << study::schedule_text(protocol, participant, format);
  return 0;
}

}  // namespace palpate::runner::commands
