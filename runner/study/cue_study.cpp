#include "runner/study/cue_study.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "analysis/statistics/cue_study.h"
#include "data/base/text.h"
#include "protocols/tasks/levels.h"
#include "runner/usage_error.h"

namespace palpate::runner::study {

namespace {

/// \throws UsageError: a file that --design names may be no protocol
std::optional<analysis::CueDesign> design_of(const analysis::ProtocolText& protocol,
                                             const std::string& source) {
  try {
    return analysis::read_cue_design(protocol.text);
  } catch (const nlohmann::json::exception&) {
    throw UsageError(source + ": --cues: the blocks that the key 'cues' of '" +
                     printable(protocol.name) +
                     "' names are missing or damaged; 'palpate validate' says where");
  }
}

}  // namespace

CueStudy analyze_cues(const Study& study, const analysis::CueSettings& settings) {
  const std::string source = printable(study.table.source);
  const auto& protocols = study.record.protocols;
  if (protocols.empty())
    throw UsageError(source + ": --cues: the blocks are in the protocol; give --design FILE");
  const std::optional<analysis::CueDesign> design = design_of(protocols.front(), source);
  if (!design)
    throw UsageError(source + ": --cues: the protocol '" + printable(protocols.front().name) +
                     "' has no key 'cues', which names the blocks");
  std::set<std::string> renderers;
  for (const analysis::StudyTrial& trial : study.table.trials) renderers.insert(trial.renderer);
  if (renderers.size() > 1)
    throw UsageError(source + ": --cues: expected trials with one renderer, found several");
  CueStudy out;
  out.analysis = analysis::analyze_all_cues(analysis::cue_answers(study.table, *design), settings);
  out.analysis.level_name = protocols::level_name(design->level_path);
  out.analysis.unit = protocols::unit_of_level(design->level_path);
  out.analysis.simulated = study.table.simulated;
  out.source = {study.table.source, protocols.front().name, protocols.front().sha256,
                PALPATE_VERSION};
  return out;
}

}  // namespace palpate::runner::study
