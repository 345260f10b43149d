#pragma once
// The comparison of a study with its registration: each point with its finding and evidence.

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analysis/report/hypotheses.h"
#include "data/store/store.h"
#include "runner/commands/register/registration.h"

namespace palpate::runner::commands {

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

/// The analysis for the report of the study, as far as it is known.
struct ReportedAnalysis {
  std::optional<double> too_fast = {}, alpha = {};  ///< s; none: as registered
  std::string json = {};                            ///< text of its analysis.json; "": not given
};

struct StudyCheck {
  std::string label;  ///< "SIMULATED PARTICIPANTS"; empty: people
  std::size_t participants = 0;
  std::vector<CheckPoint> points;
  std::vector<std::pair<analysis::Hypothesis, analysis::Judgement>> hypotheses;

  std::size_t deviations() const;
};

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

}  // namespace palpate::runner::commands
