#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "analysis/statistics/threshold_plan.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

std::string conclusion_of(const ThresholdPlan& plan, std::size_t trials) {
  const std::string with = counted(trials, "trial", "trials") + " with each condition: ";
  for (const ThresholdPower& one : plan.powers) {
    if (one.trials == trials && one.power >= plan.settings.power)
      return with + std::to_string(one.participants) + " participants reach a power of " +
             fixed(one.power, 2) + " [" + fixed(one.ci95.low, 2) + ", " + fixed(one.ci95.high, 2) +
             "]\n";
  }
  return with + "no number of participants asked about reaches a power of " +
         fixed(plan.settings.power, 2) + "\n";
}

}  // namespace

std::string threshold_plan_text(const ThresholdPlan& plan) {
  const ThresholdStudy& study = plan.study;
  std::string text = "SIMULATED STUDIES\n\nA JND that is " +
                     fixed(100 * std::abs(1 - study.ratio), 1) +
                     (study.ratio <= 1 ? " % smaller" : " % larger") +
                     " with the second condition, of the same participants; paired t-test of log "
                     "JNDs, alpha " +
                     fixed(study.alpha, 3) + "\n\n";
  for (const std::size_t trials : plan.settings.trials) text += conclusion_of(plan, trials);
  text +=
      "\n  trials  participants  power  95 % of the simulation  bias of the ratio  coverage  "
      "left out\n";
  for (const ThresholdPower& one : plan.powers) {
    const double pairs = static_cast<double>(one.participants * one.studies);
    text +=
        "  " + pad_left(std::to_string(one.trials), 6) + "  " +
        pad_left(std::to_string(one.participants), 12) + "  " + pad_left(fixed(one.power, 2), 5) +
        "  " + pad_left(fixed(one.ci95.low, 2) + " to " + fixed(one.ci95.high, 2), 22) + "  " +
        pad_left(fixed(100 * (std::exp(one.bias) - 1), 1) + " %", 17) + "  " +
        pad_left(fixed(one.coverage, 2), 8) + "  " +
        pad_left(fixed(100 * static_cast<double>(one.undetermined) / pairs, 1) + " %", 8) + "\n";
  }
  return text +
         "\nConstant stimuli, two intervals, seven levels around the standard; each JND is fitted "
         "as "
         "analyze does.\nLeft out: JNDs that the data of a participant do not tell.\n";
}

std::string threshold_plan_json(const ThresholdPlan& plan) {
  const ThresholdStudy& study = plan.study;
  nlohmann::ordered_json out{{"version", 1},
                             {"simulated", true},
                             {"weber_fraction", study.weber_fraction},
                             {"jnd_ratio", study.ratio},
                             {"participant_sd", study.participant_sd},
                             {"effect_sd", study.effect_sd},
                             {"pse_sd_jnd", study.pse_sd},
                             {"lapse", study.lapse},
                             {"reach_jnd", study.reach},
                             {"alpha", study.alpha},
                             {"wanted_power", plan.settings.power},
                             {"seed", plan.settings.seed},
                             {"powers", nlohmann::ordered_json::array()}};
  for (const ThresholdPower& one : plan.powers)
    out["powers"].push_back({{"trials", one.trials},
                             {"participants", one.participants},
                             {"found", one.found},
                             {"studies", one.studies},
                             {"power", one.power},
                             {"power_ci95", {one.ci95.low, one.ci95.high}},
                             {"log_ratio_bias", one.bias},
                             {"coverage", one.coverage},
                             {"n_undetermined", one.undetermined}});
  return out.dump(1) + "\n";
}

}  // namespace palpate::analysis
