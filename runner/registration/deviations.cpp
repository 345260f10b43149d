#include "runner/registration/deviations.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>
#include <variant>

#include "analysis/input/trials.h"
#include "analysis/report/study_report.h"
#include "analysis/statistics/analysis.h"
#include "analysis/text.h"
#include "data/base/json_text.h"
#include "data/base/text.h"
#include "data/files/utc.h"
#include "data/store/task_text.h"
#include "protocols/difference.h"
#include "protocols/groups.h"
#include "protocols/json_document.h"
#include "protocols/tasks/block_order.h"
#include "runner/build_info.h"
#include "runner/participants/simulated_settings.h"
#include "runner/registration/registration_text.h"
#include "runner/registration/sealed_folder.h"
#include "runner/session/recorded_outcome.h"
#include "runner/study/study_order.h"
#include "runner/study/study_trials.h"
#include "runner/usage_error.h"

namespace palpate::runner::registration {
namespace {

using analysis::counted;

/// Most lines of evidence; the rest is counted: "; and 12 more".
constexpr std::size_t kMostEvidence = 50;
/// Of a reported analysis of tasks.
constexpr std::size_t kMostCells = 100'000;

void cut(std::vector<std::string>& evidence) {
  if (evidence.size() <= kMostEvidence) return;
  const std::size_t more = evidence.size() - kMostEvidence;
  evidence.resize(kMostEvidence);
  evidence.push_back("and " + std::to_string(more) + " more");
}

study::ShownTrial shown_trial(const data::TrialRecord& record) {
  study::ShownTrial out;
  out.row = {record.session, record.renderer, record.shape, record.orientation_wxyz};
  out.practice = record.practice;
  out.outcome = session::outcome_of(record);
  const data::TaskRecord& task = record.task;
  int comparison = 0;
  for (std::size_t i = 0; task.task == "compare" && i < task.intervals.size(); ++i) {
    if (!task.intervals[i].standard) comparison = static_cast<int>(i) + 1;
  }
  out.row.task = {record.block,
                  task.block_name,
                  task.track,
                  task.level,
                  task.catch_trial,
                  comparison,
                  task.reach ? task.reach->kind : "",
                  out.outcome.point};
  return out;
}

StudyData read_study(data::Store& store) {
  StudyData out;
  out.protocols = store.protocols();
  out.runs = store.runs();
  out.notes = store.notes();
  out.removed = static_cast<std::size_t>(store.counts().withdrawn);
  for (const data::ProtocolInfo& info : out.protocols)
    out.files[info.sha256] = store.files(info.sha256);
  store.for_each_trial([&](const data::StoredTrial& trial) {
    if (out.participants.empty() || out.participants.back().person.id != trial.participant.id)
      out.participants.push_back({trial.participant, trial.protocol_sha256, {}});
    out.participants.back().shown.push_back(shown_trial(trial.record));
  });
  return out;
}

/// Participants who ended a session by withdrawing and did not begin again.
std::vector<std::string> withdrawn(const std::vector<data::StoredRun>& runs) {
  std::map<std::pair<std::int64_t, int>, const data::StoredRun*> latest;
  for (const data::StoredRun& run : runs) latest[{run.participant.id, run.info.session}] = &run;
  std::vector<std::string> codes;
  for (const auto& [session, run] : latest) {
    if (run->end == data::RunEnd::withdrawn &&
        std::ranges::find(codes, run->participant.code) == codes.end())
      codes.push_back(run->participant.code);
  }
  return codes;
}

std::string short_sum(const std::string& sha256) { return sha256.substr(0, 12) + "..."; }

/// "S001, S002 and S003".
std::string names(const std::set<std::string>& codes) {
  return analysis::joined(std::vector<std::string>(codes.begin(), codes.end()));
}

CheckPoint of_registration(const Registration& registered, const std::string& folder) {
  CheckPoint out{"registration", "The registration", Finding::as_registered,
                 "No file of the registration has changed since it was made."};
  out.evidence = checksum_faults(folder, files_to_fill_in());
  out.evidence.insert(out.evidence.end(), registered.contradictions.begin(),
                      registered.contradictions.end());
  const FilledIn filled = filled_in(folder, registered);
  for (const std::string& change : filled.changes)
    out.evidence.push_back(change + ", outside of the fields to fill in");
  // Another build may word its texts otherwise.
  if (registered.form && registered.contradictions.empty() &&
      registered.build == build_description() && registered.program_version == PALPATE_VERSION &&
      registration_form(registered) != *registered.form)
    out.evidence.push_back(
        "form.json does not say what the protocol, the plan, the hypotheses and registration.json "
        "say");
  if (!out.evidence.empty()) {
    out.finding = Finding::deviation;
    out.sentence = "The registration has changed since it was made.";
    cut(out.evidence);
  }
  if (filled.files.empty() || !filled.changes.empty()) return out;
  const std::string files = analysis::joined(filled.files);
  if (filled.comparable) {
    out.sentence += " Fields filled in as requested: " + files + ".";
  } else {
    if (out.finding == Finding::as_registered) out.finding = Finding::note;
    out.sentence += " Filled in: " + files +
                    ". This registration was made before form.json held the other words of these "
                    "texts: compare them with what the registry holds.";
  }
  return out;
}

/// The registry's date covers the digest alone: whoever changes a file can make its checksum again.
CheckPoint of_digest(const Registration& registered, const std::string& expected) {
  CheckPoint out{"digest", "Digest of the registration", Finding::as_registered,
                 "It is the given one: " + registered.digest + "."};
  if (expected.empty()) {
    out.finding = Finding::note;
    out.sentence =
        registered.digest + "; compare it with the one that the registry holds (--digest).";
  } else if (expected != registered.digest) {
    out.finding = Finding::deviation;
    out.sentence = "This is not the registration that the given digest belongs to.";
    out.evidence = {"given " + expected, "found " + registered.digest};
  }
  return out;
}

std::size_t first_difference(const std::string& a, const std::string& b) {
  std::size_t at = 0;
  while (at < std::min(a.size(), b.size()) && a[at] == b[at]) ++at;
  return at;
}

CheckPoint of_protocol(const Registration& registered, const StudyData& study) {
  CheckPoint out{"protocol", "Protocol", Finding::as_registered,
                 "Protocol " + registered.protocol.name +
                     " is the registered one, byte for byte (SHA-256 " +
                     short_sum(registered.protocol.sha256) + ")."};
  for (const data::ProtocolInfo& info : study.protocols) {
    if (info.sha256 == registered.protocol.sha256) continue;
    std::set<std::string> began, shown;
    for (const StudyParticipant& one : study.participants) {
      if (one.protocol_sha256 == info.sha256) began.insert(one.person.code);
    }
    for (const data::StoredRun& run : study.runs) {
      if (run.info.protocol_sha256 == info.sha256 && !began.contains(run.participant.code))
        shown.insert(run.participant.code);
    }
    if (began.empty() && shown.empty()) continue;
    began.merge(shown);
    std::string line = names(began) + ": shown with protocol " + printable(info.name) +
                       ", SHA-256 " + short_sum(info.sha256);
    if (info.name == registered.protocol.name) {
      line += "; the texts differ from byte " +
              std::to_string(first_difference(registered.protocol.source_text, info.text) + 1);
      const protocols::ProtocolDifference differs =
          protocols::difference(registered.protocol.source_text, info.text);
      line +=
          differs.nothing() ? ", in layout only" : ", " + printable(protocols::in_words(differs));
    }
    out.evidence.push_back(std::move(line));
  }
  if (const auto stored = study.files.find(registered.protocol.sha256);
      stored != study.files.end()) {
    for (const data::ProtocolFile& file : registered.files) {
      const auto found = std::ranges::find(stored->second, file.name, &data::ProtocolFile::name);
      if (found == stored->second.end() || found->bytes != file.bytes)
        out.evidence.push_back(printable(file.name) + (found == stored->second.end()
                                                           ? ": is not in the database"
                                                           : ": other bytes were shown"));
    }
  }
  if (out.evidence.empty()) return out;
  out.finding = Finding::deviation;
  out.sentence = "Trials were shown with another protocol than the registered one (SHA-256 " +
                 short_sum(registered.protocol.sha256) + ").";
  return out;
}

std::map<int, std::vector<study::OrderRow>> by_session(const std::vector<study::OrderRow>& rows) {
  std::map<int, std::vector<study::OrderRow>> out;
  for (const study::OrderRow& row : rows) out[row.session].push_back(row);
  return out;
}

std::vector<study::OrderRow> rows_that_count(const std::vector<study::ShownTrial>& shown) {
  std::vector<study::OrderRow> out;
  for (const study::ShownTrial& one : shown) {
    if (!one.practice) out.push_back(one.row);
  }
  return out;
}

/// The place where the shown trials first differ from the order; "": nowhere.
std::string order_difference(const std::vector<study::OrderRow>& expected,
                             const std::vector<study::OrderRow>& shown) {
  const auto planned = by_session(expected);
  for (const auto& [session, rows] : by_session(shown)) {
    const auto found = planned.find(session);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const std::string where = "session " + std::to_string(session) + ", trial " +
                                std::to_string(i + 1) + " of those that count: ";
      if (found == planned.end() || i >= found->second.size())
        return where + "shown " + printable(study::to_line(rows[i])) + ", none registered";
      if (!(rows[i] == found->second[i]))
        return where + "shown " + printable(study::to_line(rows[i])) + ", registered " +
               study::to_line(found->second[i]);
    }
  }
  return "";
}

CheckPoint of_order(const Registration& registered, const StudyData& study) {
  CheckPoint out{"order", "Order of trials", Finding::as_registered, ""};
  std::size_t beyond = 0;
  for (const StudyParticipant& one : study.participants) {
    const int number = one.person.enrolled_number;
    const std::string who = one.person.code + " (number " + std::to_string(number) + ")";
    if (number < 1) {
      out.evidence.push_back(who + ": there is no such number");
      continue;
    }
    const auto own = registered.order_sha256.find(number);
    if (own == registered.order_sha256.end()) {
      ++beyond;
    } else if (const std::string sha256 = study::order_checksum(registered.protocol, number);
               sha256 != own->second) {
      out.evidence.push_back(who + ": the registered order has SHA-256 " + short_sum(own->second) +
                             "; this program makes another one of the registered protocol, " +
                             short_sum(sha256));
      continue;
    }
    const std::string differs =
        order_difference(study::expected_trials(registered.protocol, number, one.shown).rows,
                         rows_that_count(one.shown));
    if (!differs.empty()) out.evidence.push_back(who + ": " + differs);
  }
  out.sentence = "Every participant's trials came in the order that was registered for the number.";
  if (beyond > 0)
    out.sentence += " " + counted(beyond, "number is", "numbers are") +
                    " beyond those registered; the protocol determines the order of these, too.";
  if (out.evidence.empty()) return out;
  out.finding = Finding::deviation;
  out.sentence = counted(out.evidence.size(), "participant", "participants") +
                 " had trials in another order than the registered one.";
  cut(out.evidence);
  return out;
}

/// The numbers that participants should have when a study has n: at a planned look, those of the
/// look.
std::vector<int> planned_so_far(const Registration& registered, std::size_t n) {
  const bool is_look = std::ranges::find(registered.looks, n, &analysis::Look::participants) !=
                       registered.looks.end();
  std::vector<int> numbers;
  for (const auto& [number, sha256] : registered.order_sha256) {
    if (is_look && numbers.size() == n) break;
    numbers.push_back(number);
  }
  return numbers;
}

/// "1 to 12", or of groups of other sizes "1 to 20, 22, 24".
std::string numbers_in_words(const std::vector<int>& numbers) {
  std::string out;
  for (std::size_t i = 0, end = 0; i < numbers.size(); i = end) {
    for (end = i + 1; end < numbers.size() && numbers[end] == numbers[end - 1] + 1;) ++end;
    out += (out.empty() ? "" : ", ") + std::to_string(numbers[i]) +
           (end > i + 1 ? " to " + std::to_string(numbers[end - 1]) : "");
  }
  return out;
}

/// "point, then ray" -> number of participants.
using OrderCounts = std::map<std::string, std::size_t>;

/// Of participants of these numbers. Empty where the order is not counterbalanced.
OrderCounts registered_orders(const Registration& registered, const std::vector<int>& numbers) {
  OrderCounts out;
  const protocols::Protocol& protocol = registered.protocol;
  const int orders = protocols::block_orders(protocol);
  if (orders < 2) return out;
  std::map<int, std::string> known;  // with groups in permuted blocks nothing repeats
  for (const int number : numbers) {
    std::string& order = known[protocol.groups.any() ? number : (number - 1) % orders];
    if (order.empty()) order = study::condition_order(protocol, number);
    ++out[order];
  }
  return out;
}

/// "Order of the renderers: point, then ray: 3 (3 registered); ray, then point: 0 (3 registered)."
std::string orders_text(const Registration& statement, const StudyData& study) {
  OrderCounts registered =
      registered_orders(statement, planned_so_far(statement, study.participants.size()));
  if (registered.empty()) return "";
  OrderCounts shown;
  for (const StudyParticipant& one : study.participants) {
    const std::string order = study::condition_order(statement.protocol, one.shown);
    if (!order.empty()) ++shown[order];
  }
  for (const auto& [order, n] : shown) registered.try_emplace(order, 0);
  std::string out;
  for (const auto& [order, n] : registered)
    out += (out.empty() ? "" : "; ") + printable(order) + ": " + std::to_string(shown[order]) +
           " (" + std::to_string(n) + " registered)";
  return std::string("Order of the ") + statement.protocol.order_rule->conditions_in_words() +
         ": " + out + ".";
}

/// Who began a session and completed no trial, each once.
std::vector<data::Participant> people_without_trials(const StudyData& study) {
  std::set<std::int64_t> known;
  for (const StudyParticipant& one : study.participants) known.insert(one.person.id);
  std::vector<data::Participant> out;
  for (const data::StoredRun& run : study.runs) {
    if (known.insert(run.participant.id).second) out.push_back(run.participant);
  }
  return out;
}

/// Which of the planned looks the study is at, and its alpha.
CheckPoint of_looks(const Registration& registered, const StudyData& study) {
  const auto& looks = registered.looks;
  const std::size_t n = study.participants.size();
  const auto at = std::ranges::find(looks, n, &analysis::Look::participants);
  CheckPoint out{"looks", "Looks", Finding::as_registered, ""};
  if (at == looks.end()) {
    out.finding = Finding::deviation;
    out.sentence = counted(n, "participant", "participants") +
                   ": no look was registered at this number. Hypotheses that compare with alpha "
                   "stay undecided.";
  } else {
    out.sentence = "Look " + std::to_string(at - looks.begin() + 1) + " of " +
                   std::to_string(looks.size()) + ", as registered: alpha is " +
                   analysis::short_number(at->alpha) + " at this look.";
    if (at + 1 != looks.end())
      out.sentence += " The registration says whether the study ends here.";
  }
  for (const analysis::Look& look : looks)
    out.evidence.push_back(std::to_string(look.participants) + " participants: alpha " +
                           analysis::short_number(look.alpha));
  return out;
}

/// Whose data are there, by number. A sample that is selected afterwards shows in the numbers,
/// which are given in the order of arrival, or in the removals.
CheckPoint of_participants(const Registration& registered, const StudyData& study) {
  const std::size_t n = study.participants.size();
  const std::vector<int> planned = planned_so_far(registered, n);
  CheckPoint out{"participants", "Participants", Finding::as_registered,
                 counted(n, "participant", "participants") + " with the numbers " +
                     numbers_in_words(planned) + ", as registered; nobody was removed."};
  std::map<int, std::set<std::string>> by_number, without_trials;
  for (const StudyParticipant& one : study.participants)
    by_number[one.person.enrolled_number].insert(one.person.code);
  for (const data::Participant& one : people_without_trials(study))
    without_trials[one.enrolled_number].insert(one.code);
  for (const int number : planned) {
    if (by_number.contains(number)) continue;
    const auto began = without_trials.find(number);
    out.evidence.push_back("no participant has number " + std::to_string(number) +
                           (began == without_trials.end()
                                ? ""
                                : ": " + names(began->second) + " began and completed no trial"));
  }
  for (const auto& [number, codes] : by_number) {
    if (!std::ranges::binary_search(planned, number))
      out.evidence.push_back(names(codes) + (codes.size() == 1 ? " has" : " have") + " number " +
                             std::to_string(number) + ", " + std::to_string(planned.size()) +
                             " registered");
    if (codes.size() > 1)
      out.evidence.push_back(names(codes) + " have the same number " + std::to_string(number));
  }
  if (study.removed > 0)
    out.evidence.push_back(counted(study.removed, "code was", "codes were") +
                           " removed from the database with 'palpate forget'; it does not keep "
                           "their numbers, trials or protocol");
  const std::string orders = orders_text(registered, study);
  if (!out.evidence.empty() || n != planned.size()) {
    out.finding = Finding::deviation;
    out.sentence =
        counted(n, "participant", "participants") + ", " + std::to_string(planned.size()) +
        " registered" +
        (study.removed > 0 ? "; " + std::to_string(study.removed) + " more removed" : "") +
        ". Who is in the study is not as registered.";
    cut(out.evidence);
  }
  if (!orders.empty()) out.sentence += " " + orders;
  return out;
}

CheckPoint of_trials(const Registration& registered, const StudyData& study) {
  const bool adaptive = study::has_adaptive_blocks(registered.protocol);
  const auto planned_of = [&registered](int number) {
    return study::planned_trials(protocols::protocol_of(registered.protocol, number));
  };
  const std::string registered_words =
      adaptive ? "trials up to the end of every procedure"
      : registered.protocol.groups.any()
          ? std::string("the trials that were registered for the group")
          : "the registered " + counted(planned_of(1), "trial", "trials");
  CheckPoint out{"trials", "Number of trials", Finding::as_registered,
                 "Every participant has " + registered_words + "."};
  int ended = 0;
  for (const StudyParticipant& one : study.participants) {
    const int number = std::max(1, one.person.enrolled_number);
    const std::size_t found = rows_that_count(one.shown).size();
    if (adaptive) {
      const auto expected = study::expected_trials(registered.protocol, number, one.shown);
      ended += expected.ended_by_program;
      if (expected.complete) continue;
    } else if (found == planned_of(number)) {
      continue;
    }
    out.evidence.push_back(one.person.code + ": " + std::to_string(found) +
                           (adaptive ? " trials, and not at the end of every session"
                                     : " of " + std::to_string(planned_of(number)) + " trials"));
  }
  if (ended > 0)
    out.sentence += " In " + counted(static_cast<std::size_t>(ended), "session", "sessions") +
                    " the last block has fewer trials than its procedure: the program that chooses "
                    "its levels may end it, and the session's notes say whether it did.";
  if (out.evidence.empty()) return out;
  out.finding = Finding::deviation;
  out.sentence = counted(out.evidence.size(), "participant has", "participants have") +
                 (adaptive ? " not all trials."
                  : registered.protocol.groups.any()
                      ? std::string(" another number of trials than was registered for the group.")
                      : " another number of trials than the registered " +
                            std::to_string(planned_of(1)) + ".");
  cut(out.evidence);
  return out;
}

/// "86 field, 4 catch, 10 clamp"
using Movements = std::map<std::string, std::size_t>;

std::string movements_text(const Movements& counts) {
  std::string out;
  for (const auto kind :
       {protocols::ReachTrial::field, protocols::ReachTrial::none, protocols::ReachTrial::clamp}) {
    const auto found = counts.find(protocols::to_string(kind));
    if (found != counts.end())
      out += (out.empty() ? "" : ", ") + std::to_string(found->second) + " " + found->first;
  }
  return out.empty() ? "none" : out;
}

/// By block. \param rows  of trials that count
std::map<std::string, Movements> movements_of(const std::vector<study::OrderRow>& rows) {
  std::map<std::string, Movements> out;
  for (const study::OrderRow& row : rows) {
    if (!row.task.reach.empty()) ++out[row.task.name][row.task.reach];
  }
  return out;
}

/// Movements with the field, without it and along a channel: their shares are what the participants
/// learn from, and what is measured.
CheckPoint of_movements(const Registration& registered, const StudyData& study) {
  CheckPoint out{"movements", "Movements to targets", Finding::as_registered, ""};
  std::map<std::string, Movements> all;
  for (const StudyParticipant& one : study.participants) {
    const int number = std::max(1, one.person.enrolled_number);
    const protocols::Protocol& protocol = protocols::protocol_of(registered.protocol, number);
    auto shown = movements_of(rows_that_count(one.shown));
    for (const auto& [block, counts] : shown) {
      for (const auto& [kind, n] : counts) all[block][kind] += n;
    }
    for (const protocols::TaskBlock& block : protocol.blocks) {
      if (!block.reaching || block.practice) continue;
      Movements wanted;
      for (const auto kind : {protocols::ReachTrial::field, protocols::ReachTrial::none,
                              protocols::ReachTrial::clamp}) {
        const long long n = protocols::reaches_of_track(block, kind) *
                            static_cast<long long>(block.stimuli.size() * block.renderers.size());
        if (n > 0) wanted[protocols::to_string(kind)] = static_cast<std::size_t>(n);
      }
      if (!block.cell && shown[block.name] != wanted)
        out.evidence.push_back(one.person.code + ", block " + block.name + ": " +
                               movements_text(shown[block.name]) + "; registered " +
                               movements_text(wanted));
    }
  }
  std::string words;
  for (const auto& [block, counts] : all)
    words += (words.empty() ? "" : "; ") + block + ": " + movements_text(counts);
  out.sentence = out.evidence.empty()
                     ? "Every participant made the registered movements with the field, without it "
                       "and along a channel."
                     : "Other movements with the field, without it and along a channel were made "
                       "than registered.";
  if (!words.empty()) out.sentence += " Of all: " + words + ".";
  if (out.evidence.empty()) return out;
  out.finding = Finding::deviation;
  cut(out.evidence);
  return out;
}

bool has_movements(const protocols::Protocol& protocol) {
  return std::ranges::any_of(protocol.blocks, [](const protocols::TaskBlock& block) {
    return block.reaching && !block.practice;
  });
}

/// The version of a simulated participant; "" for changed settings.
std::string version_of(const std::string& observer_sha256) {
  for (const int version : participants::participant_versions()) {
    if (participants::load_simulated_settings("", version).sha256 == observer_sha256)
      return "version " + std::to_string(version);
  }
  return "changed settings";
}

CheckPoint of_people(const StudyData& study) {
  CheckPoint out{"people", "Who took part", Finding::as_registered, "All participants are people."};
  std::set<std::string> simulated, people, observers;
  for (const StudyParticipant& one : study.participants)
    (one.person.simulated ? simulated : people).insert(one.person.code);
  if (simulated.empty()) return out;
  for (const data::StoredRun& run : study.runs) {
    if (run.participant.simulated && !run.info.observer_sha256.empty())
      observers.insert(run.info.observer_sha256);
  }
  std::string which;
  for (const std::string& sha256 : observers)
    which +=
        (which.empty() ? "" : ", ") + version_of(sha256) + " (settings " + short_sum(sha256) + ")";
  out.finding = people.empty() ? Finding::note : Finding::deviation;
  out.sentence = people.empty() ? "SIMULATED PARTICIPANTS: no person took part"
                                : "People and SIMULATED participants are mixed";
  out.sentence += which.empty() ? "." : "; simulated participants: " + which + ".";
  if (!people.empty())
    out.evidence = {"simulated: " + names(simulated), "people: " + names(people)};
  return out;
}

CheckPoint of_dates(const Registration& registered, const StudyData& study) {
  CheckPoint out{"dates", "Dates", Finding::as_registered,
                 "Every session began after the registration was made."};
  bool real = false;
  for (const data::StoredRun& run : study.runs) {
    if (run.participant.simulated) continue;
    real = true;
    const std::int64_t began = run.info.clock.utc_ns;
    if (began < registered.made_utc_ns)
      out.evidence.push_back(
          run.participant.code + ", session " + std::to_string(run.info.session) + ": began on " +
          data::format_utc(began).substr(0, 19) + "Z, the registration was made on " +
          data::format_utc(registered.made_utc_ns).substr(0, 19) + "Z");
  }
  if (!real) {
    out.finding = Finding::note;
    out.sentence = "Simulated sessions have no true dates.";
  } else if (!out.evidence.empty()) {
    out.finding = Finding::deviation;
    out.sentence = counted(out.evidence.size(), "session", "sessions") +
                   " began before the registration was made.";
    cut(out.evidence);
  }
  return out;
}

std::string seconds(double value) { return nlohmann::json(value).dump() + " s"; }

CheckPoint of_exclusion(const Registration& registered, const ReportedAnalysis& reported) {
  CheckPoint out{"exclusion", "Exclusion of times", Finding::as_registered,
                 "Correct answers faster than " + seconds(registered.too_fast) +
                     " are left out of the times, as registered."};
  if (registered.typical_time == 0)
    out.sentence = "Nothing is identified: there are no times to leave out.";
  const double used = reported.too_fast.value_or(registered.too_fast);
  if (used == registered.too_fast) return out;
  out.finding = Finding::deviation;
  out.sentence = "Another limit for times that are too fast was used than the registered one.";
  out.evidence = {"used " + seconds(used) + ", registered " + seconds(registered.too_fast)};
  return out;
}

CheckPoint of_alpha(const Registration& registered, const ReportedAnalysis& reported) {
  const auto text = [](double value) { return nlohmann::json(value).dump(); };
  CheckPoint out{"alpha", "Alpha", Finding::as_registered,
                 "Alpha is " + text(registered.alpha) + ", as registered."};
  const double used = reported.alpha.value_or(registered.alpha);
  if (used == registered.alpha) return out;
  out.finding = Finding::deviation;
  out.sentence = "Another alpha was used than the registered one.";
  out.evidence = {"used " + text(used) + ", registered " + text(registered.alpha)};
  return out;
}

CheckPoint of_versions(const Registration& registered, const StudyData& study) {
  CheckPoint out{
      "versions", "Versions of the program", Finding::as_registered,
      "Recorded and analysed with palpate " + registered.program_version + ", as registered."};
  std::map<std::string, std::set<std::string>> codes;
  std::set<std::string> builds;
  for (const data::StoredRun& run : study.runs) {
    if (run.info.program_version != registered.program_version)
      codes[run.info.program_version].insert(run.participant.code);
    if (run.info.build != registered.build) builds.insert(run.info.build);
  }
  for (const auto& [version, who] : codes)
    out.evidence.push_back(names(who) + ": recorded with palpate " + printable(version) +
                           ", registered " + printable(registered.program_version));
  if (registered.program_version != PALPATE_VERSION)
    out.evidence.push_back("this check analyses with palpate " PALPATE_VERSION ", registered " +
                           printable(registered.program_version));
  if (!out.evidence.empty()) {
    out.finding = Finding::deviation;
    out.sentence = "Other versions of palpate were used than the registered one.";
  }
  if (!builds.empty()) out.sentence += " Other builds of it: " + printable(names(builds)) + ".";
  return out;
}

/// Sessions with a note that `says` accepts.
std::vector<std::string> noted(const StudyData& study, bool (*says)(const std::string&)) {
  std::vector<std::string> out;
  for (const data::StoredNote& note : study.notes) {
    if (says(note.text))
      out.push_back(note.participant.code + ", session " + std::to_string(note.session) + ": " +
                    printable(note.text, 300));
  }
  return out;
}

CheckPoint left_out(const char* id, const char* title, const std::string& good,
                    const std::string& bad, std::vector<std::string> evidence) {
  CheckPoint out{id, title, Finding::as_registered, good, std::move(evidence)};
  if (!out.evidence.empty()) {
    out.finding = Finding::deviation;
    out.sentence = bad;
    cut(out.evidence);
  }
  return out;
}

/// Whether masked groups were unmasked before the last planned participant.
CheckPoint of_masks(const Registration& registered,
                    const std::vector<data::Unmasking>& unmaskings) {
  CheckPoint out{"masks", "Masked groups", Finding::as_registered, "The groups are masked."};
  const std::size_t planned = registered.order_sha256.size();
  for (const data::Unmasking& one : unmaskings) {
    out.sentence = "The groups were unmasked when all planned participants had trials.";
    out.evidence.push_back(
        data::format_utc(one.utc_ns) + ", by " + printable(one.person) + ": " +
        counted(static_cast<std::size_t>(one.participants), "participant", "participants") +
        " had trials, registered " + std::to_string(planned));
    if (static_cast<std::size_t>(one.participants) < planned) out.finding = Finding::deviation;
  }
  if (out.finding == Finding::deviation)
    out.sentence = "The groups were unmasked before all planned participants had trials.";
  return out;
}

/// Compliant if the protocol allows it and all sessions or none have torque: sessions with and
/// without torque cannot be compared.
CheckPoint of_torque(const Registration& registered, const StudyData& study) {
  const auto sessions =
      noted(study, [](const std::string& note) { return note == data::kTorqueLeftOutNote; });
  const bool allowed = registered.protocol.torque == protocols::TorqueRule::left_out;
  if (!allowed)
    return left_out("torque", "Torque", "No session records that torque was left out.",
                    "Sessions were run without the torque of the ray.", sessions);
  const bool all = sessions.size() == study.runs.size();
  return left_out("torque", "Torque",
                  all ? "The protocol allows to leave torque out; every session did."
                      : "The protocol allows to leave torque out; no session did.",
                  "Torque was left out in some sessions and driven in others.",
                  all ? std::vector<std::string>() : sessions);
}

/// In the order of the reported analysis, on which bootstrap, reference level and rounding depend.
std::vector<std::string> shapes_of(const std::string& analysis_json) {
  std::vector<std::string> shapes;
  const nlohmann::ordered_json json = read_ordered_json(analysis_json);
  const auto accuracy = json.find("accuracy");
  if (accuracy == json.end() || !accuracy->is_object() || accuracy->empty()) return shapes;
  if (!accuracy->begin()->is_object()) return shapes;
  for (const auto& [shape, figures] : accuracy->begin()->items()) shapes.push_back(shape);
  return shapes;
}

/// Compares the numbers of an analysis as reported with those of the registered analysis.
CheckPoint of_reported(analysis::StudyTable table, const ReportedAnalysis& reported,
                       double too_fast) {
  CheckPoint out{"analysis", "Reported numbers", Finding::as_registered,
                 "Every number of the reported analysis is that of these data."};
  if (table.times) analysis::order_shapes(*table.times, shapes_of(reported.json));
  const analysis::NamedResults ours = analysis::named_results(
      analysis::study_json(study::analyze_study(std::move(table), too_fast)), 0);
  const analysis::NamedResults theirs = analysis::named_results(reported.json, 0);
  const auto text = [](const analysis::NamedResults& of, const std::string& name) {
    const auto found = of.find(name);
    return found == of.end()           ? std::string("nothing")
           : std::isnan(found->second) ? "undefined"
                                       : nlohmann::json(found->second).dump();
  };
  analysis::NamedResults both = ours;
  both.insert(theirs.begin(), theirs.end());
  const auto has_number = [](const analysis::NamedResults& of, const std::string& name) {
    const auto found = of.find(name);
    return found != of.end() && !std::isnan(found->second);
  };
  for (const auto& [name, value] : both) {
    // A table of trials has no name of its protocol: null where a database has a text.
    if (!has_number(ours, name) && !has_number(theirs, name)) continue;
    if (text(ours, name) != text(theirs, name))
      out.evidence.push_back(printable(name, 120) + ": reported " + text(theirs, name) +
                             ", of these data " + text(ours, name));
  }
  if (out.evidence.empty()) return out;
  out.finding = Finding::deviation;
  out.sentence = counted(out.evidence.size(), "number", "numbers") +
                 " of the reported analysis are not those of these data.";
  cut(out.evidence);
  return out;
}

}  // namespace

std::string keep_study_named(const std::string& name, StudyData& study) {
  std::set<std::string> own;  // checksums
  for (const data::ProtocolInfo& info : study.protocols) {
    if (info.name == name) own.insert(info.sha256);
  }
  if (own.empty()) return "";
  const auto is_other = [&](const auto& one) { return !own.contains(one.protocol_sha256); };
  std::erase_if(study.participants, is_other);
  std::erase_if(study.runs, is_other);
  std::set<std::int64_t> people;
  for (const data::StoredRun& run : study.runs) people.insert(run.participant.id);
  std::erase_if(study.notes,
                [&](const data::StoredNote& one) { return !people.contains(one.participant.id); });
  return name;
}

std::vector<CheckPoint> points_of_trials(const Registration& registered, const std::string& folder,
                                         const StudyData& study, const ReportedAnalysis& reported) {
  std::vector<CheckPoint> out = {
      of_registration(registered, folder), of_digest(registered, reported.digest),
      of_order(registered, study),         of_participants(registered, study),
      of_trials(registered, study),        of_people(study),
      of_exclusion(registered, reported),  of_alpha(registered, reported)};
  if (!registered.looks.empty()) {
    const auto participants = std::ranges::find(out, "participants", &CheckPoint::id);
    out.insert(participants + 1, of_looks(registered, study));
  }
  if (has_movements(registered.protocol)) {
    const auto trials = std::ranges::find(out, "trials", &CheckPoint::id);
    out.insert(trials + 1, of_movements(registered, study));
  }
  return out;
}

ReportedAnalysis read_reported(const std::string& text, const std::string& file) {
  protocols::FaultList faults(file);
  const nlohmann::json json = protocols::read_json(text, faults);
  protocols::ObjectReader reader(json, "", faults);
  const bool of_tasks = json.is_object() && json.contains("cells");
  std::optional<double> too_fast;
  const auto read_object = [&](const nlohmann::json& value, const std::string& pointer) {
    protocols::ObjectReader object(value, pointer, faults);
    if (!pointer.ends_with("/settings")) return;
    double limit = 0;
    object.number("too_fast_s", limit, {0, kMostTooFast, "s", true}, protocols::Presence::required);
    too_fast = limit;
  };
  if (of_tasks) {
    reader.array("cells", 1, kMostCells, protocols::Presence::required);
  } else {
    for (const char* key : {"settings", "paired_by_shape", "accuracy"}) {
      if (const auto* value = reader.member(key, protocols::Presence::required))
        read_object(*value, reader.pointer(key));
    }
  }
  if (json.contains(nlohmann::json::json_pointer("/identification/settings")))
    read_object(json["identification"]["settings"], "/identification/settings");
  if (!faults.empty())
    faults.add("", "expected what 'palpate analyze --json' wrote for this study");
  faults.throw_if_any();
  ReportedAnalysis out;
  out.too_fast = too_fast;
  out.json = text;
  return out;
}

std::size_t StudyCheck::deviations() const {
  return static_cast<std::size_t>(
      std::ranges::count(points, Finding::deviation, &CheckPoint::finding));
}

std::string conclusion_of(const StudyCheck& check) {
  return check.deviations() == 0
             ? "Run as registered"
             : counted(check.deviations(), "deviation", "deviations") + " from the registration";
}

StudyCheck check_study(const Registration& registered, const std::string& folder,
                       const std::string& database, const ReportedAnalysis& reported) {
  data::Store store = data::Store::open(database, data::Store::Mode::read_only);
  StudyData study = read_study(store);
  if (const auto codes = withdrawn(study.runs); !codes.empty())
    throw UsageError(printable(database) + ": " + analysis::joined(codes) +
                     (codes.size() == 1 ? " has" : " have") +
                     " withdrawn and must not be used; remove with 'palpate forget' first");
  const CheckPoint protocol = of_protocol(registered, study);
  const std::string name = keep_study_named(registered.protocol.name, study);
  const analysis::StudyTable table = study::read_study(store, name).table;
  const analysis::NamedResults results = analysis::named_results(
      analysis::study_json(study::analyze_study(table, registered.too_fast)),
      alpha_at(registered, study.participants.size()));

  StudyCheck out;
  out.label = analysis::simulated_label(table.of_trials);
  out.participants = study.participants.size();
  out.removed = study.removed;
  out.without_trials = people_without_trials(study);
  out.points = points_of_trials(registered, folder, study, reported);
  const auto behind = [&](const char* id, CheckPoint point) {
    const auto at = std::ranges::find(out.points, id, &CheckPoint::id);
    out.points.insert(at + 1, std::move(point));
  };
  behind("digest", protocol);
  behind("people", of_dates(registered, study));
  if (registered.protocol.groups.masked())
    behind("people", of_masks(registered, store.unmaskings()));
  if (!reported.json.empty())
    out.points.push_back(
        of_reported(table, reported, reported.too_fast.value_or(registered.too_fast)));
  out.points.push_back(of_versions(registered, study));
  out.points.push_back(left_out("calibration", "Calibration of the device",
                                "No session records that calibration was left out.",
                                "Sessions were run without a stored calibration of the device.",
                                noted(study, [](const std::string& note) {
                                  return note.starts_with("pre-flight: ") &&
                                         note.ends_with("WITHOUT calibration");
                                })));
  out.points.push_back(left_out(
      "noise", "Masking noise",
      registered.protocol.masking_noise ? "No session records that the noise was left out."
                                        : "The protocol has no masking noise.",
      "Sessions were run without the protocol's masking noise.",
      noted(study,
            [](const std::string& note) { return note == R"({"masking_noise":"left out"})"; })));
  const bool sounds = registered.protocol.sounds ||
                      std::ranges::any_of(registered.protocol.stimuli, [](const auto& stimulus) {
                        return stimulus.sound.has_value();
                      });
  out.points.push_back(left_out(
      "sounds", "Sounds",
      sounds ? "No session records that they were left out." : "The protocol has no sounds.",
      "Sessions were run without the protocol's sounds.",
      noted(study, [](const std::string& note) { return note == R"({"sounds":"left out"})"; })));
  out.points.push_back(of_torque(registered, study));
  out.points.push_back(
      left_out("levels", "Levels from another program", "No other program chose what was shown.",
               "Another program was asked for levels.", noted(study, [](const std::string& note) {
                 return note.starts_with(R"({"level_from_own_procedure")");
               })));
  for (const analysis::Hypothesis& one : registered.hypotheses)
    out.hypotheses.emplace_back(one, analysis::judge(one, results));
  return out;
}

}  // namespace palpate::runner::registration
