#include "analysis/figure.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <optional>
#include <vector>

#include "analysis/axes.h"
#include "analysis/svg.h"
#include "analysis/text.h"

namespace palpate {

namespace {

// Okabe & Ito (2008): told apart with every common colour vision; shapes differ as well.
constexpr std::string_view kPoint = "#0072b2", kRay = "#d55e00", kPaper = "#009e73";
constexpr double kMargin = 28, kPlotHeight = 310, kGap = 44;
constexpr std::size_t kLongestLabel = 18;  // characters of a shape's name

void draw_names(Svg& svg, const Axes& axes, const std::vector<std::string>& names, bool turned) {
  for (std::size_t s = 0; s < names.size(); ++s) {
    const std::string name = shortened(names[s], kLongestLabel);
    if (turned) {
      svg.text(axes.centre(s) + 5, axes.bottom + 20, name,
               {13, kInk, Svg::Anchor::end, false, -30});
    } else {
      svg.text(axes.centre(s), axes.bottom + 22, name, {13, kInk, Svg::Anchor::middle});
    }
  }
}

void draw_mean(Svg& svg, bool ray, double x, double y, double half, double opacity = 1) {
  if (ray)
    svg.square(x, y, half * 0.9, kRay, opacity);
  else
    svg.circle(x, y, half, kPoint, opacity);
}

/// Where a renderer stands in the table; none when it is not in the data.
std::optional<std::size_t> place_of(const Analysis& analysis, std::string_view renderer) {
  for (std::size_t r = 0; r < analysis.table.renderers.size(); ++r) {
    if (analysis.table.renderers[r] == renderer) return r;
  }
  return std::nullopt;
}

/// t interval of the mean of participant means; none below two participants.
std::optional<Interval> interval_of(const TimesCell& cell) {
  if (!cell.sd_of_participant_means) return std::nullopt;
  const double n = static_cast<double>(cell.n_participants);
  const double half = quantile(boost::math::students_t(n - 1), 0.975) *
                      *cell.sd_of_participant_means / std::sqrt(n);
  return Interval{*cell.mean_of_participant_means - half, *cell.mean_of_participant_means + half};
}

void draw_people(Svg& svg, const Axes& axes, const Analysis& analysis, std::size_t shape,
                 std::optional<std::size_t> point, std::optional<std::size_t> ray) {
  const std::size_t n = analysis.table.participants.size();
  const double opacity = n <= 10 ? 0.55 : n <= 40 ? 0.35 : 0.2;
  const double x = axes.centre(shape), inner = 0.15 * axes.slot;
  for (std::size_t p = 0; p < n; ++p) {
    const auto time = [&](std::optional<std::size_t> renderer) -> std::optional<double> {
      if (!renderer) return std::nullopt;
      const ParticipantCell& cell = analysis.description.people[*renderer][shape][p];
      if (cell.n_used == 0) return std::nullopt;
      return cell.mean;
    };
    const auto a = time(point), b = time(ray);
    if (!a && !b) continue;
    svg.begin_group(analysis.table.participants[p]);
    if (a && b) svg.line(x - inner, axes.y(*a), x + inner, axes.y(*b), kSoft, 1, opacity);
    if (a) draw_mean(svg, false, x - inner, axes.y(*a), 2.4, opacity);
    if (b) draw_mean(svg, true, x + inner, axes.y(*b), 2.4, opacity);
    svg.end_group();
  }
}

void draw_times(Svg& svg, Axes& axes, const Analysis& analysis) {
  const auto point = place_of(analysis, "point"), ray = place_of(analysis, "ray");
  double largest = 0, largest_end = 0;
  for (std::size_t r = 0; r < analysis.table.renderers.size(); ++r) {
    for (std::size_t s = 0; s < analysis.table.shapes.size(); ++s) {
      for (const ParticipantCell& person : analysis.description.people[r][s]) {
        largest = std::max(largest, person.mean);
      }
      if (const auto ends = interval_of(analysis.description.times[r][s])) {
        largest_end = std::max(largest_end, ends->high);
      }
    }
  }
  axes.low = 0;
  // Two people's interval may be ten times their times: it is cut rather than the rest flattened.
  axes.high = std::max(largest, std::min(largest_end, 1.5 * largest));
  if (axes.high <= 0) axes.high = 1;
  axes.round_ends();
  draw_grid(svg, axes);
  for (std::size_t s = 0; s < analysis.table.shapes.size(); ++s) {
    draw_people(svg, axes, analysis, s, point, ray);
    for (const auto& renderer : {point, ray}) {
      if (!renderer) continue;
      const TimesCell& cell = analysis.description.times[*renderer][s];
      if (!cell.mean_of_participant_means) continue;
      const bool is_ray = renderer == ray;
      const double x = axes.centre(s) + (is_ray ? 0.27 : -0.27) * axes.slot;
      if (const auto ends = interval_of(cell)) {
        draw_interval(svg, axes, x, ends->low, ends->high, is_ray ? kRay : kPoint);
      }
      draw_mean(svg, is_ray, x, axes.y(*cell.mean_of_participant_means), 6);
    }
  }
}

std::optional<double> paper_value(const std::string& shape) {
  const std::string text = paper_reduction(shape);
  if (text.empty() || text == "n.s.") return std::nullopt;
  return std::stod(text);
}

void draw_reductions(Svg& svg, Axes& axes, const Analysis& analysis) {
  axes.low = 0;
  axes.high = 25;  // the paper's largest stays inside
  for (const PairedShape& shape : analysis.shapes) {
    if (!shape.percent_reduction_geometric) continue;
    axes.low = std::min(axes.low, *shape.percent_reduction_geometric);
    axes.high = std::max(axes.high, *shape.percent_reduction_geometric);
    if (!shape.t_test.log_ratio_ci95) continue;
    const Interval ends = percent_reduction(*shape.t_test.log_ratio_ci95);
    axes.low = std::min(axes.low, ends.low);
    axes.high = std::max(axes.high, ends.high);
  }
  axes.low = std::max(axes.low, -150.0);  // a slowing-down has no end: cut it
  axes.round_ends();
  draw_grid(svg, axes);
  for (std::size_t s = 0; s < analysis.shapes.size(); ++s) {
    const PairedShape& shape = analysis.shapes[s];
    const double x = axes.centre(s), x_ours = x - 9, x_paper = x + 13;
    if (const auto value = paper_value(analysis.table.shapes[s])) {
      svg.diamond(x_paper, axes.y(*value), 7, kPaper);
    } else if (!paper_reduction(analysis.table.shapes[s]).empty()) {
      svg.text(x_paper, axes.y(0) - 6, "n.s.", {12, kPaper, Svg::Anchor::middle, true});
    }
    if (shape.t_test.log_ratio_ci95) {
      const Interval ends = percent_reduction(*shape.t_test.log_ratio_ci95);
      draw_interval(svg, axes, x_ours, ends.low, ends.high, kInk);
    }
    if (shape.percent_reduction_geometric) {
      svg.circle(x_ours, axes.y(*shape.percent_reduction_geometric), 6, kInk);
    }
    const auto& p = shape.t_test.p_holm;
    std::string text = p ? (*p < 0.001 ? "p " : "p = ") : "–";
    if (p) text += p_text(*p);
    svg.text(x, axes.top - 10, text, {12, kSoft, Svg::Anchor::middle, p.has_value() && *p < 0.05});
  }
}

void draw_legends(Svg& svg, const Axes& left, const Axes& right, double y, bool with_paper) {
  double x = left.left;
  svg.circle(x + 6, y - 4, 6, kPoint);
  svg.text(x + 18, y, "point", {13});
  svg.square(x + 70, y - 4, 5.4, kRay);
  svg.text(x + 82, y, "ray", {13});
  svg.line(x + 118, y - 4, x + 142, y - 4, kSoft, 1, 0.7);
  svg.text(x + 149, y, "one participant", {13});
  x = right.left;
  svg.circle(x + 6, y - 4, 6, kInk);
  svg.text(x + 18, y, "this data", {13});
  if (!with_paper) return;
  svg.diamond(x + 92, y - 4, 6.5, kPaper);
  svg.text(x + 105, y, "Ho et al. 2000", {13});
}

std::string description_of(const Analysis& analysis) {
  std::string text =
      "Left: mean response times with the point and the ray renderer. Right: percent reduction of "
      "the response time with the ray.";
  for (std::size_t s = 0; s < analysis.shapes.size(); ++s) {
    const auto& reduction = analysis.shapes[s].percent_reduction_geometric;
    text += " " + analysis.table.shapes[s] + ": " +
            (reduction ? fixed(*reduction, 1) + " %" : std::string("undefined"));
    if (const auto& ends = analysis.shapes[s].t_test.log_ratio_ci95) {
      const Interval percent = percent_reduction(*ends);
      text += " (95 % interval " + fixed(percent.low, 1) + " to " + fixed(percent.high, 1) + ")";
    }
    text += ".";
  }
  return text;
}

}  // namespace

std::string figure15(const Analysis& analysis) {
  const auto& names = analysis.table.shapes;
  const double n = static_cast<double>(names.size());
  Axes times, reductions;
  times.slot = std::clamp(470 / n, 84.0, 180.0);
  reductions.slot = std::clamp(330 / n, 72.0, 130.0);
  bool turned = false;
  for (const std::string& name : names) {
    turned = turned || text_width(shortened(name, kLongestLabel), 13) > reductions.slot - 8;
  }
  times.left = kMargin + (turned ? 72 : 34);
  times.width = std::max(300.0, n * times.slot);
  times.slot = times.width / n;
  reductions.left = times.left + times.width + kGap + 34;
  reductions.width = std::max(280.0, n * reductions.slot);
  reductions.slot = reductions.width / n;
  const double total = reductions.left + reductions.width + kMargin;

  const std::string label = simulated_label(analysis.table.simulated);
  const std::string title = answer(analysis);
  const auto lines = lines_of(title, total - 2 * kMargin, 20, true);
  const Counts& counts = analysis.description.counts;
  Svg svg;
  double y = kMargin + 18;
  svg.begin_group(title);
  for (const std::string& line : lines) {
    svg.text(kMargin, y, line, {20, kInk, Svg::Anchor::start, true});
    y += 26;
  }
  svg.end_group();
  y += 2;
  double x = kMargin;
  if (!label.empty()) {
    const double pill = text_width(label, 12, true) + 44;
    svg.rect(x, y - 16, pill, 23, "#fff4d6", "#b7791f", 11);
    svg.text(x + pill / 2, y, label, {12, "#7a4d05", Svg::Anchor::middle, true});
    x += pill + 12;
  }
  svg.text(x, y,
           counted(counts.n_participants, "participant", "participants") + ", " +
               counted(counts.n_trials, "trial", "trials"),
           {13, kSoft});
  y += 44;
  svg.text(times.left, y, "Mean time to identify a shape (s)",
           {15, kInk, Svg::Anchor::start, true});
  svg.text(reductions.left, y, "Reduction of the time with the ray (%)",
           {15, kInk, Svg::Anchor::start, true});
  y += 24;
  draw_legends(svg, times, reductions, y, std::ranges::any_of(names, [](const std::string& name) {
                 return !paper_reduction(name).empty();
               }));

  times.top = reductions.top = y + 38;
  times.bottom = reductions.bottom = times.top + kPlotHeight;
  draw_times(svg, times, analysis);
  draw_reductions(svg, reductions, analysis);
  draw_names(svg, times, names, turned);
  draw_names(svg, reductions, names, turned);
  y = times.bottom + (turned ? 100 : 56);

  const std::string note =
      (label.empty() ? "" : label + ". ") +
      "Bars: 95 % intervals over participants (left: of the mean; right: of the geometric "
      "reduction, "
      "paired t-test on log times, p adjusted after Holm). Above 0 the ray is faster. Paper: Ho, "
      "Basdogan & Srinivasan 2000, fig. 15; n.s.: no significant difference.";
  for (const std::string& line : lines_of(note, total - 2 * kMargin, 12)) {
    svg.text(kMargin, y, line, {12, kSoft});
    y += 17;
  }
  Svg page;
  page.rect(0, 0, total, y + kMargin - 12, "#ffffff");
  page.append(svg);
  return page.document(total, y + kMargin - 12, (label.empty() ? "" : label + ": ") + title,
                       description_of(analysis));
}

}  // namespace palpate
