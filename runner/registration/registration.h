#pragma once
// A registration: a lab's statement about its study before the first session. A folder of files
// that 'palpate register' makes and 'palpate check' reads.

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "analysis/report/hypotheses.h"
#include "analysis/report/plan_record.h"
#include "analysis/statistics/sequential_looks.h"
#include "data/record.h"
#include "protocols/protocol.h"
#include "runner/registration/form.h"

namespace palpate::runner::registration {

/// Counts of a hypothesis' verdicts in simulated studies.
struct VerdictCounts {
  std::size_t corroborated = 0, refuted = 0, undecided = 0;
  void add(analysis::Verdict verdict);
  std::size_t studies() const { return corroborated + refuted + undecided; }
};

/// The verdicts of simulated studies on a hypothesis.
struct Rehearsal {
  VerdictCounts with_effect, without_effect;
};

struct Registration {
  std::int64_t made_utc_ns = 0;
  std::string digest;        ///< of the folder (registration_digest)
  std::optional<Form> form;  ///< of the texts to fill in; none: made before version 2
  std::vector<std::string> contradictions;  ///< between registration.json and its other files
  std::string program_version, build;
  protocols::Protocol protocol;           ///< with its text and SHA-256
  std::vector<data::ProtocolFile> files;  ///< that it names
  std::string plan_text;                  ///< plan.json, byte for byte
  analysis::PlanRecord plan;
  std::string hypotheses_text;  ///< hypotheses.json, byte for byte
  std::vector<analysis::Hypothesis> hypotheses;
  std::size_t participants = 0;
  double too_fast = 0.2, alpha = 0.05;  ///< s; of the tests, all looks together
  std::vector<analysis::Look> looks;    ///< before the end and at it; none: at the end alone
  analysis::Spending spending = analysis::Spending::obrien_fleming;  ///< of alpha over the looks
  /// By the number of the participant. 1, 2, ...; of groups that the experimenter names, as many of
  /// each as are planned.
  std::map<int, std::string> order_sha256;
  int participant_version = 0;        ///< default of the simulated participant
  std::string participant_sha256;     ///< its settings
  std::vector<Rehearsal> rehearsals;  ///< one for each hypothesis
  std::uint64_t seed = 1;             ///< of the simulated studies
  /// s, of the simulated studies; 0: nothing is identified.
  double typical_time = 0;
  std::optional<std::size_t> sessions_so_far;  ///< in the named database; none: no database
  std::vector<std::string> warnings;
  std::vector<std::string> sha256_when_made;  ///< of version 1: of files_to_fill_in()
};

/// The files that the lab fills in: their checksums are not listed.
const std::vector<std::string>& files_to_fill_in();

/// "obrien-fleming"
const char* to_string(analysis::Spending spending);
/// nullopt: none of the names
std::optional<analysis::Spending> spending_of(const std::string& name);

/// Of the participants, ascending.
std::vector<int> planned_numbers(const Registration& registration);

/// The value of "alpha" in a hypothesis when a study has so many participants: that of the look, if
/// looks are planned; NaN: none is planned then.
double alpha_at(const Registration& registration, std::size_t participants);

/// The fewest and most participants of a registration.
inline constexpr std::size_t kFewestParticipants = 2, kMostParticipants = 10'000;
/// Of a participant: of one group alone, of as many as there may be.
inline constexpr int kHighestNumber = 10'000 * static_cast<int>(GroupAssignment::kMost);
/// The most looks at a study, its end among them.
inline constexpr std::size_t kMostLooks = 20;
/// s, largest limit of too fast answers.
inline constexpr double kMostTooFast = 60;

/// registration.json, which read_registration reads.
std::string registration_json(const Registration& registration);

/// Digest of everything that the date of a registry must cover: SHA-256 of the list of checksums of
/// all files but those to fill in. 'sha256sum SHA256SUMS' prints it while nothing has changed.
std::string registration_digest(const std::string& folder);
/// Reads an option --digest. \throws UsageError: not 64 digits
std::string read_digest(const std::string& option);

/// The contents of the files to fill in.
struct FilledIn {
  std::vector<std::string> files;    ///< that have changed since they were made
  std::vector<std::string> changes;  ///< outside of the fields, a line each
  bool comparable = true;            ///< false: files of version 1 do not tell
};
/// \throws UsageError
FilledIn filled_in(const std::string& folder, const Registration& registration);

/// Reads the registration in the folder, changed or not. \throws UsageError, InputError: the folder
/// has no registration
Registration read_registration(const std::string& folder);

/// The contents of registration.json itself, without the other files. \throws InputError with every
/// fault
Registration parse_statement(const std::string& text, const std::string& file);

/// Requires that all names of a protocol's files lead below its folder. \throws UsageError
void require_files_below(const std::vector<data::ProtocolFile>& files);

}  // namespace palpate::runner::registration
