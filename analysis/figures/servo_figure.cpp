// Histogram of the longest servo period of each trial, by renderer.

#include <algorithm>
#include <cmath>
#include <utility>

#include "analysis/figures/figure_skeleton.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

constexpr const char* kVirtualClock =
    " Simulated sessions run on a virtual clock: their periods say nothing about a machine.";

}  // namespace

Figure servo_of(const Analysis& analysis, const StudyRecord& record) {
  Figure figure = new_figure(analysis, "servo", "Longest servo period of each trial");
  int first = ServoQuality::kBins, last = -1;
  double highest = 0;
  for (const ServoQuality& servo : record.servo) {
    for (int b = 0; b < ServoQuality::kBins; ++b) {
      const std::size_t n = servo.longest_periods[static_cast<std::size_t>(b)];
      if (n == 0) continue;
      first = std::min(first, b);
      last = std::max(last, b);
      highest =
          std::max(highest, 100 * static_cast<double>(n) / static_cast<double>(servo.n_trials));
    }
  }
  if (last <= first) return figure;  // a single bin: servo_sentence() says it
  // The axis spans at least 0.5 to 5 ms, so that small differences are not magnified.
  constexpr int kHalf = ServoQuality::kBinsPerDecade;
  first = std::min(first, static_cast<int>(0.7 * kHalf));
  last = std::max(last, static_cast<int>(1.7 * kHalf));
  const auto edge = [](int bin) {  // log10 of ms
    return std::log10(1000 * ServoQuality::kLowest) +
           static_cast<double>(bin) / ServoQuality::kBinsPerDecade;
  };
  const double highest_shown = std::max(highest, 1.0);
  for (const ServoQuality& servo : record.servo) {
    Panel panel;
    panel.title = stimuli::printable(servo.renderer, 40);
    panel.x = log_axis(edge(first), edge(last + 1), "longest period (ms, logarithmic)");
    panel.x.grid = false;
    panel.y = linear_axis(0, highest_shown, "trials (%)");
    panel.width = 380;
    panel.height = 200;
    for (int b = first; b <= last; ++b) {
      const std::size_t n = servo.longest_periods[static_cast<std::size_t>(b)];
      if (n == 0) continue;
      const double percent = 100 * static_cast<double>(n) / static_cast<double>(servo.n_trials);
      panel.marks.push_back(rect_mark(
          style_of(analysis, servo.renderer).role, edge(b), 0, edge(b + 1), percent, 0.85,
          fixed(std::pow(10, edge(b)), 2) + " to " + fixed(std::pow(10, edge(b + 1)), 2) +
              " ms: " + counted(n, "trial", "trials") + " (" + fixed(percent, 1) + " %)"));
    }
    figure.description += stimuli::printable(servo.renderer, 40) + ": " +
                          std::to_string(servo.missed_ticks) + " of " +
                          std::to_string(servo.ticks) + " ticks missed, longest period " +
                          fixed(1000 * servo.longest_period, 3) + " ms. ";
    figure.panels.push_back(std::move(panel));
  }
  figure.notes.push_back("One tick is due every 1 ms, unless the protocol says otherwise.");
  if (analysis.table.simulated != Simulated::no) {
    figure.notes.emplace_back(kVirtualClock + 1);  // without the space
  }
  return figure;
}

std::string servo_sentence(const Analysis& analysis, const StudyRecord& record) {
  if (record.servo.empty()) {
    return "Only a study’s database records servo periods, a table of trials does not.";
  }
  double longest = 0;
  for (const ServoQuality& servo : record.servo) longest = std::max(longest, servo.longest_period);
  std::string text = "All trials have their longest servo period in the same bin, up to " +
                     fixed(1000 * longest, 3) + " ms: there is nothing to draw.";
  if (analysis.table.simulated != Simulated::no) text += kVirtualClock;
  return text;
}

}  // namespace palpate::analysis
