#include "analysis/figures/figures_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "analysis/statistics/wording.h"
#include "analysis/text.h"

namespace palpate::analysis {

const char* to_string(Role role) {
  constexpr const char* kNames[kRoles] = {"page",   "ink",   "soft", "grid",  "point",
                                          "ray",    "paper", "heat", "amber", "third",
                                          "fourth", "fifth", "sixth"};
  return kNames[static_cast<std::size_t>(role)];
}

Figure new_figure(const Analysis& analysis, std::string id, std::string title) {
  Figure figure;
  figure.id = std::move(id);
  figure.title = std::move(title);
  figure.label = simulated_label(analysis.table.simulated);
  const Counts& counts = analysis.description.counts;
  figure.subtitle = counted(counts.n_participants, "participant", "participants") + ", " +
                    counted(counts.n_trials, "trial", "trials");
  return figure;
}

std::vector<std::pair<double, double>> outline_of(Shape shape) {
  constexpr double kArm = 0.36;  // half of a cross's arm's width
  std::vector<std::pair<double, double>> corners;
  if (shape == Shape::right || shape == Shape::left) {
    corners = {{1, 0}, {-0.8, -1}, {-0.8, 1}};
    if (shape == Shape::left) {
      for (auto& corner : corners) corner.first = -corner.first;
    }
  } else if (shape == Shape::cross || shape == Shape::saltire) {
    corners = {{kArm, -1}, {kArm, -kArm}, {1, -kArm}, {1, kArm},   {kArm, kArm},   {kArm, 1},
               {-kArm, 1}, {-kArm, kArm}, {-1, kArm}, {-1, -kArm}, {-kArm, -kArm}, {-kArm, -1}};
    if (shape == Shape::saltire) {
      const double turn = std::sqrt(0.5);
      for (auto& [x, y] : corners) {
        const double turned = turn * (x - y);
        y = turn * (x + y);
        x = turned;
      }
    }
  }
  return corners;
}

std::size_t roles_in(const Figure& figure) {
  std::size_t roles = kUsualRoles;
  for (const Panel& panel : figure.panels) {
    for (const Mark& mark : panel.marks) {
      roles = std::max(roles, static_cast<std::size_t>(mark.role) + 1);
    }
  }
  for (const LegendEntry& entry : figure.legend) {
    roles = std::max(roles, static_cast<std::size_t>(entry.role) + 1);
  }
  return roles;
}

Look look_of(const Analysis& analysis, std::string_view renderer) {
  constexpr std::array<Look, kShownRenderers> kLooks{{{Role::point, Shape::circle},
                                                      {Role::ray, Shape::square},
                                                      {Role::third, Shape::right},
                                                      {Role::fourth, Shape::cross},
                                                      {Role::fifth, Shape::left},
                                                      {Role::sixth, Shape::saltire}}};
  const auto own = [](std::string_view name) {
    return name == "point" ? 0U : name == "ray" ? 1U : kShownRenderers;
  };
  if (own(renderer) < kShownRenderers) return kLooks[own(renderer)];
  std::array<bool, kShownRenderers> taken{};
  std::size_t before = 0;  // others that choose first
  for (const std::string& name : analysis.table.renderers) {
    if (name == renderer) break;
    if (own(name) < kShownRenderers) {
      taken[own(name)] = true;
    } else {
      ++before;
    }
  }
  for (std::size_t i = 0; i < kShownRenderers; ++i) {
    if (!taken[i] && before-- == 0) return kLooks[i];
  }
  return kLooks.back();
}

std::string short_name(const std::string& renderer) { return stimuli::printable(renderer, 40); }

void add_renderers(Figure& figure, const Analysis& analysis, std::size_t shown) {
  for (std::size_t r = 0; r < shown; ++r) {
    const std::string& renderer = analysis.table.renderers[r];
    const Look look = look_of(analysis, renderer);
    figure.legend.push_back({stimuli::printable(renderer, 200), look.role, look.shape});
  }
}

std::size_t shown_shapes(const Analysis& analysis, Figure& figure) {
  const std::size_t n = analysis.table.shapes.size();
  if (n <= kShownShapes) return n;
  figure.notes.push_back("The first " + std::to_string(kShownShapes) + " of " + std::to_string(n) +
                         " shapes; the tables and the JSON file have all.");
  return kShownShapes;
}

std::size_t shown_renderers(const Analysis& analysis, Figure& figure) {
  const std::size_t n = analysis.table.renderers.size();
  if (n <= kShownRenderers) return n;
  figure.notes.push_back("The first " + std::to_string(kShownRenderers) + " of " +
                         std::to_string(n) + " renderers; the tables and the JSON file have all.");
  return kShownRenderers;
}

std::size_t shown_comparisons(const Analysis& analysis, Figure& figure) {
  return std::min(analysis.comparisons.size(),
                  std::max<std::size_t>(shown_renderers(analysis, figure), 2) - 1);
}

Panel comparison_panel(const Analysis& analysis, const RendererPair& pair, std::size_t shapes,
                       double slot) {
  const bool alone = analysis.comparisons.size() == 1;
  Panel panel;
  constexpr std::size_t kLongest = 24;  // bytes: two names above a narrow panel
  if (!alone) {
    panel.title = stimuli::printable(pair.renderer, kLongest) + " − " +
                  stimuli::printable(pair.reference, kLongest);
  }
  panel.width = std::max(alone ? kWide : kHalfWide, slot * static_cast<double>(shapes));
  return panel;
}

std::string gain_title(const Analysis& analysis, const std::string& what,
                       const std::string& joint) {
  return shortened(what + " " + with_renderer(analysis, joint), 58) + " (%)";
}

FigureAxis names_axis(const std::vector<std::string>& names, std::size_t shown, std::string title) {
  FigureAxis axis;
  axis.title = std::move(title);
  axis.high = static_cast<double>(std::max<std::size_t>(shown, 1));
  axis.grid = false;
  axis.names = true;
  for (std::size_t i = 0; i < shown; ++i) {
    axis.ticks.push_back({static_cast<double>(i) + 0.5, stimuli::printable(names[i], 160)});
  }
  return axis;
}

FigureAxis linear_axis(double low, double high, std::string title) {
  if (!(high > low)) high = low + 1;
  const double power = std::pow(10.0, std::floor(std::log10((high - low) / 5)));
  const double factor = (high - low) / 5 / power;
  const double step = power * (factor < 1.5 ? 1 : factor < 3.5 ? 2 : factor < 7.5 ? 5 : 10);
  FigureAxis axis;
  axis.title = std::move(title);
  axis.low = step * std::floor(low / step + 1e-9);
  axis.high = step * std::ceil(high / step - 1e-9);
  const int decimals = step < 1 ? static_cast<int>(std::ceil(-std::log10(step) - 1e-9)) : 0;
  const auto count = std::lround((axis.high - axis.low) / step);
  for (long i = 0; i <= count; ++i) {
    const double at = axis.low + static_cast<double>(i) * step;
    axis.ticks.push_back({at, fixed(at, decimals)});
  }
  return axis;
}

FigureAxis seconds_axis(double low, double high, std::string title) {
  if (!(high > low)) {
    low -= 0.1;
    high += 0.1;
  }
  FigureAxis axis;
  axis.title = std::move(title);
  axis.low = low;
  axis.high = high;
  const bool only_powers = high - low > 3.5;
  for (int power = static_cast<int>(std::floor(low)); power <= static_cast<int>(high) + 1;
       ++power) {
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double at = power + std::log10(factor);
      if ((only_powers && factor > 1) || at < low - 1e-9 || at > high + 1e-9) continue;
      const int decimals = power < 0 ? -power : 0;
      axis.ticks.push_back({at, decimals > 6 ? "10^" + fixed(power, 0)
                                             : fixed(factor * std::pow(10.0, power), decimals)});
    }
  }
  return axis;
}

Mark symbol(Role role, Shape shape, double x, double y, double size, std::string text) {
  Mark mark;
  mark.role = role;
  mark.shape = shape;
  mark.x = {x};
  mark.y = {y};
  mark.size = size;
  mark.text = std::move(text);
  return mark;
}

Mark text_mark(Role role, double x, double y, std::string text, double size) {
  Mark mark = symbol(role, Shape::circle, x, y, size, std::move(text));
  mark.kind = Mark::Kind::text;
  return mark;
}

Mark line_mark(Role role, std::vector<double> x, std::vector<double> y, double width) {
  Mark mark;
  mark.kind = Mark::Kind::line;
  mark.role = role;
  mark.x = std::move(x);
  mark.y = std::move(y);
  mark.size = width;
  return mark;
}

Mark rect_mark(Role role, double x0, double y0, double x1, double y1, double opacity,
               std::string text) {
  Mark mark;
  mark.kind = Mark::Kind::rect;
  mark.role = role;
  mark.x = {x0, x1};
  mark.y = {y0, y1};
  mark.opacity = opacity;
  mark.text = std::move(text);
  return mark;
}

void add_interval(Panel& panel, Role role, double x, double low, double high, std::string text) {
  Mark bar;
  bar.kind = Mark::Kind::interval;
  bar.role = role;
  bar.x = {x};
  bar.y = {std::clamp(low, panel.y.low, panel.y.high), std::clamp(high, panel.y.low, panel.y.high)};
  bar.size = 2;
  bar.text = std::move(text);
  panel.marks.push_back(bar);
  const auto end = [&](double y, Shape shape, double half) {
    panel.marks.push_back(symbol(role, shape, x, y, half, bar.text));
  };
  if (high <= panel.y.high) {
    end(bar.y[1], Shape::dash, 5);
  } else {
    end(bar.y[1], Shape::up, 5);
    panel.marks.back().dy = 4;
  }
  if (low >= panel.y.low) {
    end(bar.y[0], Shape::dash, 5);
  } else {
    end(bar.y[0], Shape::down, 5);
    panel.marks.back().dy = -4;
  }
}

void add_interval_across(Panel& panel, Role role, double y, double low, double high,
                         const std::string& text) {
  const double left = std::clamp(low, panel.x.low, panel.x.high);
  const double right = std::clamp(high, panel.x.low, panel.x.high);
  Mark bar = line_mark(role, {left, right}, {y, y}, 2);
  bar.text = text;
  panel.marks.push_back(std::move(bar));
  const double half = 5 * (panel.y.high - panel.y.low) / panel.height;
  const auto end = [&](double x, bool inside, Shape arrow, double dx) {
    if (inside) {
      Mark cap = line_mark(role, {x, x}, {y - half, y + half}, 2);
      cap.text = text;
      panel.marks.push_back(std::move(cap));
    } else {
      panel.marks.push_back(symbol(role, arrow, x, y, 5, text));
      panel.marks.back().dx = dx;
    }
  };
  end(left, low >= panel.x.low, Shape::left, 4);
  end(right, high <= panel.x.high, Shape::right, -4);
}

std::string seconds_text(double seconds) { return fixed(seconds, seconds < 10 ? 2 : 1) + " s"; }

std::vector<Figure> figures_of(const Analysis& analysis, const ReportRecord& record) {
  std::vector<Figure> figures{
      figure15_of(analysis),  speedup_of(analysis),        times_of(analysis),
      confusion_of(analysis), speed_accuracy_of(analysis), learning_of(analysis),
      order_of(analysis),     servo_of(analysis, record),  exclusions_of(analysis)};
  std::erase_if(figures, [](const Figure& figure) { return figure.panels.empty(); });
  return figures;
}

}  // namespace palpate::analysis
