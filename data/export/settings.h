#pragma once
// What all exports have in common.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "data/record.h"

namespace palpate::data {

struct StimulusFacts {
  std::string name;
  std::string object;  ///< JSON: what the protocol says of it but for its name
};

/// What an export needs to know of a protocol beyond its text.
struct ProtocolFacts {
  std::string title = {};    ///< "" for none
  double servo_rate = 1000;  ///< Hz
  std::vector<StimulusFacts> stimuli = {};
};

/// What a bit of the columns `faults` means.
struct FaultMeaning {
  std::uint32_t bit = 0;
  std::string text;
};

enum class Times {
  absolute,  ///< on the calendar
  /// Seconds from the participant's first trial; where a date has to stand, it is shifted so that
  /// this trial is at the beginning of 1900 (BIDS: before 1925, so that nobody takes it for real).
  relative,
};

struct ExportSettings {
  bool force = false;                ///< replace what is there, if it is an export of ours
  std::string program_version = {};  ///< "0.1.0"
  Times times = Times::absolute;
  std::string codebook = {};  ///< csv: a file that describes the columns; "" for none
  std::vector<FaultMeaning> fault_bits = {};  ///< lowest first
  /// Reads a protocol's text; asked only by exports that describe themselves. May throw.
  std::function<ProtocolFacts(const ProtocolInfo&)> facts = {};
  /// Called after every so many trials with their number; may throw to stop the export, which then
  /// leaves nothing.
  std::function<void(std::int64_t)> progress = {};
};

struct ExportResult {
  std::int64_t trials = 0;    ///< rows written
  std::int64_t attempts = 0;  ///< that were cut off; 0: their file was not written
  std::int64_t samples = 0;   ///< servo ticks
  bool simulated = false;     ///< there are simulated participants among them
  std::string attempts_path;  ///< csv only
  /// Why the export could not be recorded in the database; forget will not list it. "" when it is.
  std::string not_recorded;
};

/// Called once a trial; asks `progress` now and then.
class ProgressCounter {
 public:
  explicit ProgressCounter(const ExportSettings& settings) : settings_(settings) {}
  void next() {
    constexpr std::int64_t kOften = 256;
    if (++trials_ % kOften == 0 && settings_.progress) settings_.progress(trials_);
  }

 private:
  const ExportSettings& settings_;
  std::int64_t trials_ = 0;
};

}  // namespace palpate::data
