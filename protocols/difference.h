#pragma once
// Changes of a protocol since a participant began with it.

#include <string>
#include <vector>

namespace palpate::protocols {

/// JSON pointers of the values that differ, or exist in one of the two only.
struct ProtocolDifference {
  std::vector<std::string> texts;     ///< what participants read, and descriptions
  std::vector<std::string> design;    ///< stimuli, order, trials: what is shown, and when
  std::vector<std::string> settings;  ///< all else: stylus, servo, masking noise

  /// Trials, their order and their conditions are the same; only texts differ.
  bool only_texts() const { return design.empty() && settings.empty(); }
  /// No value differs, only the layout: spaces, order of keys, 1 as 1.0.
  bool nothing() const { return only_texts() && texts.empty(); }
};

/// Compares two valid protocols.
ProtocolDifference difference(const std::string& before, const std::string& after);

/// "only texts: /texts/break", "stimuli and order: /seed, /stimuli; other settings: /home/rest_s"
std::string in_words(const ProtocolDifference& difference);

}  // namespace palpate::protocols
