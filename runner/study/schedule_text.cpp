#include "runner/study/schedule_text.h"

#include <cstddef>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

#include "data/base/cell_name.h"
#include "data/base/words.h"
#include "protocols/session_plan.h"
#include "runner/study/study_words.h"

namespace palpate::runner::study {
namespace {

const StudyWords& words_of(const protocols::Protocol& protocol) {
  return protocols::is_study_of_shapes(protocol) ? kWordsOfShapes : kWordsOfBlocks;
}

}  // namespace

std::string time_in_words(double seconds) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(0);
  if (seconds < 60) {
    out << seconds << " s";
  } else if (seconds < 5400) {
    out << seconds / 60 << " min";
  } else {
    out << std::setprecision(1) << seconds / 3600 << " h";
  }
  return out.str();
}

std::string heard_lines(const protocols::Protocol& protocol) {
  std::vector<std::string> sounding;
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli) {
    if (stimulus.sound && stimulus.name == base_name(stimulus.name))
      sounding.push_back(stimulus.name);
  }
  std::ostringstream out;
  if (!sounding.empty()) out << "  sounds      contacts of " << listed(sounding) << "\n";
  if (!protocol.masking_noise) return out.str();
  out << "  noise       " << protocols::to_string(protocol.masking_noise->kind) << ", "
      << protocol.masking_noise->level_db << " dB re full scale, through headphones\n";
  return out.str();
}

int comparison_interval(const protocols::TaskBlock& block, const protocols::Trial& trial) {
  if (block.task != protocols::TaskKind::compare) return 0;
  for (std::size_t i = 0; i < trial.intervals.size(); ++i) {
    if (!trial.intervals[i].standard) return static_cast<int>(i) + 1;
  }
  return 0;
}

std::string summary_text(const protocols::Protocol& protocol) {
  return words_of(protocol).summary(protocol);
}

std::string schedule_text(const protocols::Protocol& protocol, int participant,
                          const std::string& format) {
  const StudyWords& words = words_of(protocol);
  const std::vector<protocols::Trial> trials = words.trials(protocol, participant);
  if (format == "table") return words.table(protocol, trials);
  if (format == "csv") return words.csv(protocol, participant, trials);
  const nlohmann::ordered_json document = {{"protocol", protocol.name},
                                           {"protocol_sha256", protocol.sha256},
                                           {"program_version", PALPATE_VERSION},
                                           {"participant_number", participant},
                                           {"trials", words.rows(protocol, trials)}};
  return document.dump(1) + "\n";
}

}  // namespace palpate::runner::study
