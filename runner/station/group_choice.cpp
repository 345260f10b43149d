#include "runner/station/group_choice.h"

#include <algorithm>
#include <cstddef>

#include "runner/terminal.h"
#include "runner/usage_error.h"

namespace palpate::runner::station {
namespace {

int first_unused(const GroupAssignment& groups, std::size_t group, const std::set<int>& taken) {
  int row = 1;
  while (taken.contains(groups.number(group, row))) ++row;
  return groups.number(group, row);
}

/// \throws UsageError
std::size_t named_group(const std::string& name, const GroupAssignment& groups) {
  const std::size_t group = groups.find(name);
  if (group == groups.names.size())
    throw UsageError("--group: expected " + join_names(groups.names) + ", found '" + name + "'");
  return group;
}

/// \throws UsageError: --group does not name the group of this number
void check_number(const std::string& who, int number, std::size_t wanted,
                  const GroupAssignment& groups) {
  if (groups.group(number) == wanted) return;
  throw UsageError("--group " + groups.names[wanted] + ": " + who + " is in group " +
                   groups.name(number));
}

/// The group with the fewest participants who have completed the study. Ties go to the group of the
/// smallest unused number.
std::size_t least_filled(const GroupAssignment& groups, const GroupFacts& facts) {
  std::size_t least = 0;
  for (std::size_t group = 1; group < groups.names.size(); ++group) {
    const bool fewer = facts.completed[group] < facts.completed[least];
    const bool earlier =
        facts.completed[group] == facts.completed[least] &&
        first_unused(groups, group, facts.taken) < first_unused(groups, least, facts.taken);
    if (fewer || earlier) least = group;
  }
  return least;
}

}  // namespace

std::optional<int> number_in_group(const RunSettings& settings, const protocols::Protocol& protocol,
                                   const GroupFacts& facts) {
  const GroupAssignment& groups = protocol.groups;
  const std::string& named = settings.group;
  if (!groups.any()) {
    if (!named.empty()) throw UsageError("--group: the protocol has no groups");
    if (settings.fill) throw UsageError("--fill: the protocol has no groups");
    return std::nullopt;
  }
  const bool given = groups.rule == GroupAssignment::Rule::given;
  if (given && settings.fill)
    throw UsageError(
        "--fill: the experimenter chooses the group (\"assign\": \"given\"); use --group");
  if (!given && !named.empty())
    throw UsageError(std::string("--group: the protocol assigns groups itself (\"assign\": \"") +
                     to_string(groups.rule) + "\"); leave it out");
  if (settings.fill && settings.number)
    throw UsageError("--fill: chooses the number; leave out --number");
  if (facts.enrolled) {
    if (!named.empty())
      check_number("participant " + settings.participant, *facts.enrolled,
                   named_group(named, groups), groups);
    return std::nullopt;
  }
  if (!named.empty()) {
    const std::size_t group = named_group(named, groups);
    if (!settings.number) return first_unused(groups, group, facts.taken);
    check_number("number " + std::to_string(*settings.number), *settings.number, group, groups);
    return settings.number;
  }
  if (settings.fill) return first_unused(groups, least_filled(groups, facts), facts.taken);
  if (given && !settings.number)
    throw UsageError("expected --group with one of " + join_names(groups.names) +
                     ": the protocol leaves a new participant's group to the experimenter");
  return settings.number;
}

}  // namespace palpate::runner::station
