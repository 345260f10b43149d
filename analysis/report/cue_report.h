#pragma once
// The report on seen and felt cues: as text, JSON, figures and HTML. The keys of the JSON are
// described in analysis/README.md.

#include <string>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/statistics/cues.h"

namespace palpate::analysis {

/// Where the answers come from.
struct CueSource {
  std::string file, protocol, protocol_sha256, program_version;
};

/// At most 100 columns; labelled if participants are simulated.
std::string cue_text(const CueAnalysis& analysis);
std::string cue_json(const CueAnalysis& analysis, const CueSource& source);
/// "cues-pse": points of equality over the conflict of every participant, and their mean slope
/// beside the predicted one; "cues-jnd": JNDs felt, seen, with both, and predicted.
std::vector<Figure> cue_figures(const CueAnalysis& analysis);
/// A self-contained page with the figures.
std::string cue_html(const CueAnalysis& analysis, const CueSource& source);

}  // namespace palpate::analysis
