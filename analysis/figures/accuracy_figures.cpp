// Histogram of the longest servo period of each trial, by renderer.

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "analysis/figures/panel_drawing.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

constexpr const char* kVirtualClock =
    " Simulated sessions run on a virtual clock: their periods say nothing about a machine.";

constexpr double kManyExcluded = 10;   // percent of the trials; the amber line
constexpr double kWidestChange = 150;  // percent of the time; intervals are cut beyond

std::string percent_text(std::size_t part, std::size_t of) {
  const double percent = of ? 100 * static_cast<double>(part) / static_cast<double>(of) : 0;
  return fixed(percent, percent > 0 && percent < 9.95 ? 1 : 0) + " %";
}

Panel confusion_panel(const Analysis& analysis, std::size_t renderer, std::size_t shapes) {
  const auto& table = analysis.table;
  std::vector<std::string> answers(
      table.answers.begin(), table.answers.begin() + static_cast<std::ptrdiff_t>(std::min(
                                                         table.answers.size(), kShownShapes)));
  answers.emplace_back("none");
  Panel panel;
  const std::string name = short_name(table.renderers[renderer]);
  panel.title = name;
  panel.x = names_axis(answers, answers.size(), "answered");
  panel.y = names_axis(table.shapes, shapes, "shown");
  for (Tick& tick : panel.y.ticks) tick.at = panel.y.high - tick.at;  // first shape at the top
  panel.width = std::max(340.0, 62.0 * static_cast<double>(answers.size()));
  panel.height = 56.0 * static_cast<double>(shapes);
  for (std::size_t s = 0; s < shapes; ++s) {
    const auto& row = analysis.description.confusion[renderer][s];
    const std::size_t total = std::accumulate(row.begin(), row.end(), std::size_t{0});
    for (std::size_t a = 0; a < answers.size(); ++a) {
      const std::size_t n = a + 1 == answers.size() ? row.back() : row[a];
      const double proportion = total ? static_cast<double>(n) / static_cast<double>(total) : 0;
      const double x = static_cast<double>(a), y = panel.y.high - static_cast<double>(s) - 1;
      const std::string text = name + ": " + printable(table.shapes[s], 40) + " answered as " +
                               printable(answers[a], 40) + " " + counted(n, "time", "times") +
                               " of " + std::to_string(total) + " (" + percent_text(n, total) + ")";
      panel.marks.push_back(rect_mark(Role::heat, x + 0.02, y + 0.03, x + 0.98, y + 0.97,
                                      n ? 0.08 + 0.9 * proportion : 0.03, text));
      if (n == 0) continue;
      // For contrast, text on a strongly coloured cell has the colour of the page.
      Mark mark = text_mark(proportion > 0.5 ? Role::page : Role::ink, x + 0.5, y + 0.5,
                            percent_text(n, total), 12);
      mark.bold = analysis.table.answers.size() > a && answers[a] == table.shapes[s];
      mark.dy = 4;
      panel.marks.push_back(std::move(mark));
    }
  }
  return panel;
}

/// Interval of the change of time in percent; negative: less time.
std::optional<Interval> percent_change(const std::optional<Interval>& log_ratio) {
  if (!log_ratio) return std::nullopt;
  const Interval reduction = percent_reduction(*log_ratio);
  return Interval{-reduction.high, -reduction.low};
}

/// Adds a comparison's shapes: change of accuracy over change of time. \return false if none is
/// defined
bool add_changes(Panel& panel, const Comparison& comparison, const std::vector<std::string>& names,
                 std::size_t shapes, std::string& description) {
  panel.marks.push_back(
      rect_mark(Role::amber, panel.x.low, panel.y.low, 0, 0, 0.1, "faster and less accurate"));
  panel.marks.push_back(
      rect_mark(Role::amber, 0, 0, panel.x.high, panel.y.high, 0.1, "slower and more accurate"));
  panel.marks.push_back(line_mark(Role::soft, {0, 0}, {panel.y.low, panel.y.high}, 1.2));
  panel.marks.push_back(line_mark(Role::soft, {panel.x.low, panel.x.high}, {0, 0}, 1.2));
  bool any = false;
  for (std::size_t s = 0; s < shapes; ++s) {
    const SpeedAccuracy& both = comparison.speed_accuracy[s];
    if (!both.percent_change_time || !both.accuracy_change) continue;
    const std::string name = printable(names[s], 40);
    const double x = *both.percent_change_time, y = 100 * *both.accuracy_change;
    std::string text =
        (panel.title.empty() ? "" : panel.title + ", ") + name + ": time " + fixed(x, 1) + " %";
    const auto time = percent_change(comparison.shapes[s].t_test.log_ratio_ci95);
    if (time)
      text += " (95 % interval " + fixed(time->low, 1) + " to " + fixed(time->high, 1) + ")";
    text += ", accuracy " + fixed(y, 1) + " points";
    if (const auto& ends = both.test.log_ratio_ci95) {
      text += " (" + fixed(100 * ends->low, 1) + " to " + fixed(100 * ends->high, 1) + ")";
    }
    if (!both.reading.empty())
      text += both.reading == "none shown" ? ", no trade-off shown" : ", " + both.reading;
    if (time) add_interval_across(panel, Role::ink, y, time->low, time->high, text);
    if (const auto& ends = both.test.log_ratio_ci95) {
      add_interval(panel, Role::ink, x, 100 * ends->low, 100 * ends->high, text);
    }
    panel.marks.push_back(symbol(Role::ink, MarkerShape::circle, x, y, 6, text));
    Mark label = text_mark(Role::ink, x, y, name, 13);
    label.kind = Mark::Kind::label;
    label.bold = true;
    panel.marks.push_back(std::move(label));
    any = true;
    description += text + ". ";
  }
  return any;
}

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
    panel.title = printable(servo.renderer, 40);
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
    figure.description += printable(servo.renderer, 40) + ": " +
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
                     fixed(1000 * longest, 3) + " ms: no figure is drawn.";
  if (analysis.table.simulated != Simulated::no) text += kVirtualClock;
  return text;
}

// Figures of answers: confusion matrix, speed-accuracy change, and excluded trials by reason.

Figure confusion_of(const Analysis& analysis) {
  Figure figure = new_figure(analysis, "confusion", "Confusion matrix: shape shown and answered");
  const std::size_t shapes = shown_shapes(analysis, figure);
  const std::size_t renderers = shown_renderers(analysis, figure);
  for (std::size_t r = 0; r < renderers; ++r) {
    figure.panels.push_back(confusion_panel(analysis, r, shapes));
    for (std::size_t s = 0; s < shapes; ++s) {
      const AccuracyCell& cell = analysis.description.accuracy[r][s];
      figure.description += short_name(analysis.table.renderers[r]) + ", " +
                            printable(analysis.table.shapes[s], 40) + ": " +
                            percent_text(cell.n_correct, cell.n_trials) + " correct. ";
    }
  }
  figure.notes.insert(
      figure.notes.begin(),
      "Percent of the trials of a row; bold: correct answers. None: no answer in time.");
  return figure;
}

Figure speed_accuracy_of(const Analysis& analysis) {
  Figure figure = new_figure(analysis, "speed-accuracy", "Change of time and change of accuracy");
  const std::size_t shapes = shown_shapes(analysis, figure);
  const std::size_t comparisons = shown_comparisons(analysis, figure);
  double widest = 5, highest = 3;
  for (std::size_t c = 0; c < comparisons; ++c) {
    for (std::size_t s = 0; s < shapes; ++s) {
      const SpeedAccuracy& both = analysis.comparisons[c].speed_accuracy[s];
      if (!both.percent_change_time || !both.accuracy_change) continue;
      widest = std::max(widest, std::fabs(*both.percent_change_time));
      highest = std::max(highest, 100 * std::fabs(*both.accuracy_change));
      if (const auto time =
              percent_change(analysis.comparisons[c].shapes[s].t_test.log_ratio_ci95)) {
        for (const double end : {time->low, time->high}) {
          widest = std::max(widest, std::min(kWidestChange, std::fabs(end)));
        }
      }
      if (const auto& ends = both.test.log_ratio_ci95) {
        highest = std::max(highest, std::min(100.0, 100 * std::fabs(ends->low)));
        highest = std::max(highest, std::min(100.0, 100 * std::fabs(ends->high)));
      }
    }
  }
  for (std::size_t c = 0; c < comparisons; ++c) {
    const Comparison& comparison = analysis.comparisons[c];
    Panel panel = comparison_panel(analysis, comparison.pair, 0, 0);
    panel.x = linear_axis(-1.15 * widest, 1.15 * widest,
                          gain_title(analysis, "change of time", "against"));
    panel.y = linear_axis(-1.05 * highest, 1.05 * highest, "change of accuracy (points)");
    panel.height = 340;
    if (add_changes(panel, comparison, analysis.table.shapes, shapes, figure.description)) {
      figure.panels.push_back(std::move(panel));
    }
  }
  if (figure.panels.empty()) return figure;
  const bool paper =
      analysis.comparisons.size() == 1 && analysis.comparisons.front().pair.is_ray_minus_point();
  figure.notes.insert(
      figure.notes.begin(),
      std::string(paper ? "Ray minus point" : "Renderer minus reference") +
          ", means over participants; bars: 95 % intervals of the change of time "
          "and of accuracy, not adjusted. Shaded: faster and less accurate, or slower "
          "and more accurate. A trade-off is possible where the interval of "
          "accuracy stays within the shade.");
  return figure;
}

Figure exclusions_of(const Analysis& analysis) {
  Figure figure = new_figure(analysis, "exclusions", "Trials excluded from the times");
  const std::size_t n = shown_renderers(analysis, figure);
  if (n == 0) return figure;
  double highest = 10;
  for (const Exclusions& lost : analysis.exclusions) {
    highest = std::max(highest, 100 * lost.proportion_excluded());
  }
  struct Reason {
    const char* name;
    std::size_t Exclusions::*count;
  };
  constexpr Reason kReasons[] = {{"wrong", &Exclusions::n_wrong},
                                 {"no response", &Exclusions::n_timeouts},
                                 {"too fast", &Exclusions::n_too_fast},
                                 {"all", nullptr}};
  constexpr std::size_t kGroups = std::size(kReasons);
  std::vector<std::string> names;
  for (const Reason& reason : kReasons) names.emplace_back(reason.name);
  Panel panel;
  panel.x = names_axis(names, kGroups, "");
  panel.y = linear_axis(0, highest, "excluded from the times (% of trials)");
  panel.width = kFullPanelWidth;
  panel.height = 260;
  panel.marks.push_back(
      line_mark(Role::amber, {0, panel.x.high}, {kManyExcluded, kManyExcluded}, 1.4));
  const double group = n < 4 ? 0.6 : 0.88, width = group / static_cast<double>(n);
  for (std::size_t r = 0; r < n; ++r) {
    const Exclusions& lost = analysis.exclusions[r];
    const std::string renderer = short_name(analysis.table.renderers[r]);
    const Role role = style_of(analysis, analysis.table.renderers[r]).role;
    figure.legend.push_back(
        {printable(analysis.table.renderers[r], 200), role, MarkerShape::square});
    for (std::size_t g = 0; g < kGroups; ++g) {
      const std::size_t count =
          kReasons[g].count ? lost.*kReasons[g].count : lost.n_trials - lost.n_used;
      const double percent =
          lost.n_trials ? 100 * static_cast<double>(count) / static_cast<double>(lost.n_trials) : 0;
      const double x = static_cast<double>(g) + (1 - group) / 2 + static_cast<double>(r) * width;
      const std::string text = renderer + ", " + kReasons[g].name + ": " +
                               counted(count, "trial", "trials") + " of " +
                               std::to_string(lost.n_trials) + " (" + fixed(percent, 1) + " %)";
      panel.marks.push_back(rect_mark(role, x + 0.01, 0, x + width - 0.01, percent, 0.85, text));
      const double px = (panel.y.high - panel.y.low) / panel.height;
      const bool crossed = percent < kManyExcluded && percent + 18 * px > kManyExcluded;
      Mark mark = text_mark(Role::soft, x + width / 2, crossed ? kManyExcluded : percent,
                            fixed(percent, 1), 12);
      mark.dy = -5;
      panel.marks.push_back(std::move(mark));
      figure.description += text + ". ";
    }
  }
  figure.panels.push_back(std::move(panel));
  figure.notes.push_back(
      "Amber line: 10 %; with more exclusions, or different ones for the renderers, interpret the "
      "times with caution.");
  return figure;
}

}  // namespace palpate::analysis
