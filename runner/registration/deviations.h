#pragma once
// The comparison of a study with its registration: each point with its finding and evidence.

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analysis/report/hypotheses.h"
#include "data/store/store.h"
#include "runner/registration/registration.h"
#include "runner/study/study_order.h"

namespace palpate::runner::registration {

enum class Finding {
  as_registered,
  deviation,
  note  ///< no deviation
};

struct CheckPoint {
  std::string id;  ///< "protocol", "order", ...
  std::string title;
  Finding finding = Finding::as_registered;
  std::string sentence;
  std::vector<std::string> evidence = {};  ///< a line each: participant, registered value, finding
};

/// A participant with trials, and their order.
struct StudyParticipant {
  data::Participant person;
  std::string protocol_sha256;
  std::vector<study::ShownTrial> shown;  ///< practice or not, in their order
};

/// The part of a study that is compared, from a database or a bundle.
struct StudyData {
  std::vector<data::ProtocolInfo> protocols;
  std::vector<StudyParticipant> participants;  ///< with trials, practice or not
  std::vector<data::StoredRun> runs;
  std::vector<data::StoredNote> notes;
  std::map<std::string, std::vector<data::ProtocolFile>> files;  ///< by SHA-256 of the protocol
  std::size_t removed = 0;  ///< codes that 'palpate forget' removed, of all protocols
};

/// Leaves out what was recorded with protocols of other names, such as a pilot, where there is one
/// of this name. \return the name that chooses the study's trials (analysis::is_protocol)
std::string keep_study_named(const std::string& name, StudyData& study);

/// What is compared beside the data: the analysis for the report of the study, as far as it is
/// known, and the digest that a registry holds.
struct ReportedAnalysis {
  std::optional<double> too_fast = {}, alpha = {};  ///< s; none: as registered
  std::string json = {};                            ///< text of its analysis.json; "": not given
  std::string digest = {};                          ///< of the registration; "": not given
};

/// \param text  what 'palpate analyze --json' wrote \throws protocols::InputError with every fault
ReportedAnalysis read_reported(const std::string& text, const std::string& file);

struct StudyCheck {
  std::string label;  ///< "SIMULATED PARTICIPANTS"; empty: people
  std::size_t participants = 0;
  std::size_t removed = 0;                        ///< codes, with 'palpate forget'
  std::vector<data::Participant> without_trials;  ///< who began and completed none
  std::vector<CheckPoint> points;
  std::vector<std::pair<analysis::Hypothesis, analysis::Judgement>> hypotheses;

  std::size_t deviations() const;
};

/// The points that follow from the registration and the trials alone.
std::vector<CheckPoint> points_of_trials(const Registration& registered, const std::string& folder,
                                         const StudyData& study, const ReportedAnalysis& reported);

/// \param folder  of the registration \throws UsageError: a participant has withdrawn and is still
/// in the database; exceptions of analysis and store
StudyCheck check_study(const Registration& registered, const std::string& folder,
                       const std::string& database, const ReportedAnalysis& reported);

/// "Run as registered", "2 deviations from the registration".
std::string conclusion_of(const StudyCheck& check);

std::string check_text(const StudyCheck& check, const Registration& registered);
std::string check_json(const StudyCheck& check, const Registration& registered);
/// A page like the report of analyze.
std::string check_html(const StudyCheck& check, const Registration& registered);

}  // namespace palpate::runner::registration
