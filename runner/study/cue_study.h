#pragma once
// The analysis of seen and felt cues of a study, as `palpate analyze --cues` prints it.

#include "analysis/report/cue_report.h"
#include "analysis/statistics/cues.h"
#include "runner/study/study_trials.h"

namespace palpate::runner::study {

struct CueStudy {
  analysis::CueAnalysis analysis;
  analysis::CueSource source;
};

/// \param study  with its record \throws UsageError: its protocol declares no cues, or is unknown;
/// several renderers were compared
CueStudy analyze_cues(const Study& study, const analysis::CueSettings& settings);

}  // namespace palpate::runner::study
