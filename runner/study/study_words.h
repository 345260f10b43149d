#pragma once
// Internal to runner/study: how a kind of study is told.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "protocols/protocol.h"
#include "protocols/schedule.h"

namespace palpate::runner::study {

/// A protocol in a few lines, and the trials of a participant, listed.
struct StudyWords {
  std::string (*summary)(const protocols::Protocol&);
  std::vector<protocols::Trial> (*trials)(const protocols::Protocol&, int participant);
  std::string (*table)(const protocols::Protocol&, const std::vector<protocols::Trial>&);
  std::string (*csv)(const protocols::Protocol&, int participant,
                     const std::vector<protocols::Trial>&);
  nlohmann::ordered_json (*rows)(const protocols::Protocol&, const std::vector<protocols::Trial>&);
};

extern const StudyWords kWordsOfShapes, kWordsOfBlocks;

/// "45 s", "20 min", "1.6 h"
std::string time_in_words(double seconds);
/// The summary's lines about what is heard, if there is anything.
std::string heard_lines(const protocols::Protocol& protocol);

}  // namespace palpate::runner::study
