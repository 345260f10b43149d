#pragma once
// What was changed in a protocol since somebody began with it.

#include <string>
#include <vector>

namespace palpate::protocols {

/// JSON pointers of what is there, or has another value, in one of two texts only.
struct ProtocolDifference {
  std::vector<std::string> texts;     ///< what participants read, and descriptions
  std::vector<std::string> design;    ///< stimuli, order, trials: what is shown, and when
  std::vector<std::string> settings;  ///< all else: of the trial, the stylus, the servo, the noise

  /// Trials, their order and their conditions are the same, whatever is read beside them.
  bool only_texts() const { return design.empty() && settings.empty(); }
  /// The same in other words: spaces, order of keys, 1 as 1.0.
  bool nothing() const { return only_texts() && texts.empty(); }
};

/// Of two texts that are protocols.
ProtocolDifference difference(const std::string& before, const std::string& after);

/// "only texts: /texts/break", "stimuli and order: /seed, /stimuli; other settings: /home/rest_s"
std::string in_words(const ProtocolDifference& difference);

}  // namespace palpate::protocols
