#pragma once
// A judge of the levels of one block, for tests.

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "protocols/parse.h"
#include "runner/participants/task_participant.h"

namespace palpate::runner::participants::judged {

using protocols::Interval;
using protocols::Trial;

/// A protocol of one block about a sphere of 400 N/m. \param keys  of the block, beside its name
inline protocols::Protocol study(const std::string& keys) {
  return protocols::parse_protocol_text(
      R"({"version": 2, "name": "j", "renderers": ["ray"], "stimuli": [
        {"name": "ball", "shape": "sphere", "radius_m": 0.03, "stiffness_n_per_m": 400},
        {"name": "soft", "shape": "sphere", "radius_m": 0.03, "stiffness_n_per_m": 100},
        {"name": "mid", "shape": "sphere", "radius_m": 0.03, "stiffness_n_per_m": 200}],
        "blocks": [{"name": "b", )" +
          keys + "}]}",
      "j.json");
}

inline std::string constant(const std::string& levels) {
  return R"("stimuli": ["ball"], "level": {"path": "/stiffness_n_per_m"},
            "procedure": {"kind": "constant", "levels": [)" +
         levels + R"(], "repetitions": 1})";
}

inline std::string compare(const std::string& more = "") {
  return R"("task": "compare", "standard": "ball", )" + constant("300, 500") + more;
}

/// Of the draws of a trial that a test begins itself.
inline constexpr std::uint64_t kSeedOfTrial = 1;

inline Trial trial_of(int stimulus = 0) {
  Trial trial;
  trial.task_block = 0;
  trial.stimulus = stimulus;
  return trial;
}

inline const Interval kStandard{0, {}, {}, true};
inline Interval at(double level) { return {0, {}, level, false}; }

/// Settings without lapses and noise.
inline JudgementSettings exact() {
  JudgementSettings settings;
  settings.weber = settings.turn_sd = settings.lapse = settings.number_sd = 0;
  settings.false_alarm = 0;
  return settings;
}

/// The name of the answer to some intervals.
class Judge {
 public:
  explicit Judge(const std::string& keys, const JudgementSettings& settings = {})
      : protocol_(study(keys)), judgement_(protocol_, settings) {}

  std::string answer(const std::vector<Interval>& intervals, const TaskJudgement::Felt& felt = {},
                     Trial trial = trial_of()) {
    constexpr std::uint64_t kSeed = 7;
    judgement_.begin(trial, Random(kSeed, {++draw_}));
    for (const Interval& interval : intervals) judgement_.feel(interval, felt);
    return named(judgement_.answer());
  }
  std::string named(int answer) const {
    return protocol_.blocks[0].answers.at(static_cast<std::size_t>(answer)).name;
  }
  TaskJudgement& judgement() { return judgement_; }
  const protocols::Protocol& protocol() const { return protocol_; }

 private:
  protocols::Protocol protocol_;
  TaskJudgement judgement_;
  std::uint64_t draw_ = 0;
};

}  // namespace palpate::runner::participants::judged
