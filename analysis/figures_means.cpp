// Figure 15 and the speed-up beside the paper's.

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <optional>
#include <utility>

#include "analysis/figures_parts.h"
#include "analysis/text.h"

namespace palpate {

namespace {

/// t interval of the mean of participant means; none below two participants.
std::optional<Interval> interval_of(const TimesCell& cell) {
  if (!cell.sd_of_participant_means) return std::nullopt;
  const double n = static_cast<double>(cell.n_participants);
  const double half = quantile(boost::math::students_t(n - 1), 0.975) *
                      *cell.sd_of_participant_means / std::sqrt(n);
  return Interval{*cell.mean_of_participant_means - half, *cell.mean_of_participant_means + half};
}

/// Where a renderer's figures stand within a slot of 1.
double place(std::size_t renderer, std::size_t renderers, double spread) {
  if (renderers < 2) return 0.5;
  return 0.5 +
         spread * (2 * static_cast<double>(renderer) / static_cast<double>(renderers - 1) - 1);
}

void add_people(Panel& panel, const Analysis& analysis, std::size_t shape) {
  const auto& table = analysis.table;
  const std::size_t n = std::min(table.participants.size(), kShownPeople);
  const double opacity = n <= 10 ? 0.6 : n <= 40 ? 0.4 : 0.2;
  for (std::size_t p = 0; p < n; ++p) {
    const std::string person = printable(table.participants[p], 40);
    Mark line = line_mark(Role::soft, {}, {}, 1);
    line.opacity = opacity;
    line.person = person;
    line.text = person + ", " + printable(table.shapes[shape], 40) + ":";
    std::vector<Mark> dots;
    for (std::size_t r = 0; r < table.renderers.size(); ++r) {
      const ParticipantCell& cell = analysis.description.people[r][shape][p];
      if (cell.n_used == 0) continue;
      line.x.push_back(static_cast<double>(shape) + place(r, table.renderers.size(), 0.15));
      line.y.push_back(cell.mean);
      line.text += " " + table.renderers[r] + " " + seconds_text(cell.mean);
      dots.push_back(symbol(role_of(table.renderers[r]), shape_of(table.renderers[r]),
                            line.x.back(), cell.mean, 2.4));
    }
    for (Mark& dot : dots) {
      dot.opacity = opacity;
      dot.text = line.text;
      dot.person = person;
      panel.marks.push_back(std::move(dot));
    }
    if (line.x.size() > 1) panel.marks.push_back(std::move(line));
  }
}

/// 1.5 times the largest participant's mean cuts intervals: two people's may be ten times as long.
double highest_time(const Analysis& analysis, std::size_t shapes) {
  double largest = 0, largest_end = 0;
  for (std::size_t r = 0; r < analysis.table.renderers.size(); ++r) {
    for (std::size_t s = 0; s < shapes; ++s) {
      for (const ParticipantCell& person : analysis.description.people[r][s]) {
        if (person.n_used > 0) largest = std::max(largest, person.mean);
      }
      if (const auto ends = interval_of(analysis.description.times[r][s])) {
        largest_end = std::max(largest_end, ends->high);
      }
    }
  }
  const double highest = std::max(largest, std::min(largest_end, 1.5 * largest));
  return highest > 0 ? highest : 1;
}

/// The paper's percent reduction as a number; none where it found no difference or had no shape.
std::optional<double> paper_number(const std::string& shape) {
  const std::string text = paper_reduction(shape);
  if (text.empty() || text == "n.s.") return std::nullopt;
  return std::stod(text);
}

FigureAxis reduction_axis(const Analysis& analysis, std::size_t shapes) {
  double low = 0, high = 25;  // the paper's largest stays inside
  for (std::size_t s = 0; s < shapes; ++s) {
    const PairedShape& shape = analysis.shapes[s];
    if (!shape.percent_reduction_geometric) continue;
    low = std::min(low, *shape.percent_reduction_geometric);
    high = std::max(high, *shape.percent_reduction_geometric);
    if (!shape.t_test.log_ratio_ci95) continue;
    const Interval ends = percent_reduction(*shape.t_test.log_ratio_ci95);
    low = std::min(low, ends.low);
    high = std::max(high, ends.high);
  }
  // A slowing-down has no end: it is cut.
  return linear_axis(std::max(low, -150.0), high, "less time with the ray (%)");
}

std::string interval_text(const Interval& percent) {
  return fixed(percent.low, 1) + " to " + fixed(percent.high, 1) + " %";
}

void add_paper(Panel& panel, const std::string& shape, double x) {
  if (const auto value = paper_number(shape)) {
    panel.marks.push_back(symbol(Role::paper, Shape::diamond, x, *value, 7,
                                 shape + ", Ho et al. 2000: " + fixed(*value, 0) + " %"));
  } else if (!paper_reduction(shape).empty()) {
    Mark mark = text_mark(Role::paper, x, 0, "n.s.", 12);
    mark.bold = true;
    mark.dy = -6;
    panel.marks.push_back(std::move(mark));
  }
}

}  // namespace

Figure figure15_of(const Analysis& analysis) {
  Figure figure = new_figure(analysis, "figure15", "Mean time to identify a shape");
  const auto& table = analysis.table;
  const std::size_t shapes = shown_shapes(analysis, figure);
  Panel panel;
  panel.x = names_axis(table.shapes, shapes, "");
  panel.y = linear_axis(0, highest_time(analysis, shapes), "time (s)");
  panel.width = std::max(kWide, 70.0 * static_cast<double>(shapes));
  panel.height = 380;
  for (std::size_t s = 0; s < shapes; ++s) {
    add_people(panel, analysis, s);
    for (std::size_t r = 0; r < table.renderers.size(); ++r) {
      const TimesCell& cell = analysis.description.times[r][s];
      if (!cell.mean_of_participant_means) continue;
      const std::string& renderer = table.renderers[r];
      const double x = static_cast<double>(s) + place(r, table.renderers.size(), 0.27);
      std::string text = printable(table.shapes[s], 40) + ", " + renderer + ": mean " +
                         seconds_text(*cell.mean_of_participant_means);
      if (const auto ends = interval_of(cell)) {
        text += ", 95 % interval " + fixed(ends->low, 2) + " to " + fixed(ends->high, 2) + " s";
        add_interval(panel, role_of(renderer), x, ends->low, ends->high, text);
      }
      figure.description += text + ". ";
      panel.marks.push_back(symbol(role_of(renderer), shape_of(renderer), x,
                                   *cell.mean_of_participant_means, renderer == "ray" ? 5.8 : 6.5,
                                   text));
    }
  }
  figure.panels.push_back(std::move(panel));
  for (const std::string& renderer : table.renderers) {
    figure.legend.push_back({renderer, role_of(renderer), shape_of(renderer)});
  }
  figure.legend.push_back({"one participant", Role::soft, Shape::dash});
  figure.notes.insert(
      figure.notes.begin(),
      "Correct answers only. Large marks: mean over participants of each one’s mean time; bars: 95 "
      "% interval of that mean (t). Small marks and thin lines: each participant. Compare with "
      "fig. "
      "15 of Ho, Basdogan & Srinivasan (2000).");
  if (table.participants.size() > kShownPeople) {
    figure.notes.push_back("Lines of the first " + std::to_string(kShownPeople) + " of " +
                           std::to_string(table.participants.size()) +
                           " participants; means and intervals are of all.");
  }
  return figure;
}

Figure speedup_of(const Analysis& analysis) {
  Figure figure = new_figure(analysis, "speedup", "How much less time with the ray");
  const std::size_t shapes = shown_shapes(analysis, figure);
  Panel panel;
  panel.x = names_axis(analysis.table.shapes, shapes, "");
  panel.y = reduction_axis(analysis, shapes);
  panel.width = std::max(kWide, 60.0 * static_cast<double>(shapes));
  panel.height = 340;
  panel.marks.push_back(line_mark(Role::soft, {0, panel.x.high}, {0, 0}, 1.4));
  bool with_paper = false, any = false;
  for (std::size_t s = 0; s < shapes; ++s) {
    const PairedShape& shape = analysis.shapes[s];
    const std::string& name = analysis.table.shapes[s];
    const double left = static_cast<double>(s) + 0.42, right = static_cast<double>(s) + 0.62;
    std::string text = printable(name, 40) + ": ";
    text += shape.percent_reduction_geometric ? fixed(*shape.percent_reduction_geometric, 1) + " %"
                                              : std::string("undefined");
    if (shape.t_test.log_ratio_ci95) {
      const Interval ends = percent_reduction(*shape.t_test.log_ratio_ci95);
      text += ", 95 % interval " + interval_text(ends);
      add_interval(panel, Role::ink, left, ends.low, ends.high, text);
    }
    if (shape.percent_reduction_geometric) {
      panel.marks.push_back(symbol(
          Role::ink, Shape::circle, left,
          std::clamp(*shape.percent_reduction_geometric, panel.y.low, panel.y.high), 6.5, text));
      any = true;
    }
    add_paper(panel, name, right);
    const std::string paper = paper_reduction(name);
    with_paper = with_paper || !paper.empty();
    if (!paper.empty()) text += "; paper " + paper;
    if (const auto& p = shape.t_test.p_holm) {
      Mark mark = text_mark(Role::soft, static_cast<double>(s) + 0.5, panel.y.high,
                            (*p < 0.001 ? "p " : "p = ") + p_text(*p), 12);
      mark.bold = *p < 0.05;
      mark.dy = -9;
      panel.marks.push_back(std::move(mark));
      text += "; adjusted p " + p_text(*p);
    }
    figure.description += text + ". ";
  }
  if (!any) return figure;
  figure.panels.push_back(std::move(panel));
  figure.legend = {{"this data", Role::ink, Shape::circle}};
  if (with_paper) figure.legend.push_back({"Ho et al. 2000", Role::paper, Shape::diamond});
  figure.notes.insert(
      figure.notes.begin(),
      "Above 0 the ray is faster. Geometric reduction over participants with both renderers; bars: "
      "95 % interval of the paired t-test on log times; p adjusted over the shapes after Holm, "
      "bold "
      "below 0.05. n.s.: the paper found no significant difference.");
  return figure;
}

}  // namespace palpate
