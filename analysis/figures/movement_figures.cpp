#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "analysis/figures/figures.h"
#include "analysis/figures/panel_drawing.h"
#include "analysis/movement/comparison.h"
#include "analysis/movement/pictures.h"
#include "analysis/statistics/analysis.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

constexpr std::size_t kMostDrawnShapes = 8, kMostRenderers = 4;
constexpr double kMm = 1000;  // of a metre

Role role_of(const std::string& renderer, std::size_t index) {
  if (renderer == "point") return Role::point;
  if (renderer == "ray") return Role::ray;
  return index % 2 == 0 ? Role::third : Role::fourth;
}

class Drawer {
 public:
  Drawer(const MovementTable& table, const MovementPictures& pictures)
      : table_(table),
        pictures_(pictures),
        shapes_(std::min(table.trials.shapes.size(), kMostDrawnShapes)),
        renderers_(std::min(table.trials.renderers.size(), kMostRenderers)) {}

  Figure paths() const;
  Figure contact() const;
  Figure speed() const;
  Figure coverage() const;
  Figure procedures() const;

 private:
  Figure new_figure(const char* id, const char* title) const;
  const TypicalTrial* typical(std::size_t renderer, std::size_t shape) const;
  Panel panel_of(std::size_t renderer, std::size_t shape, const TypicalTrial& one) const;
  Panel views_of(std::size_t renderer, std::size_t shape, const TypicalTrial& one) const;
  Panel map_of(std::size_t renderer, std::size_t shape, const ContactMap& map) const;
  Panel profile_of(std::size_t renderer, std::size_t shape, const TypicalTrial& one, double seconds,
                   double fastest) const;
  Role role(std::size_t renderer) const {
    return role_of(table_.trials.renderers[renderer], renderer);
  }
  /// Tells a renderer's curve from others without colour.
  static MarkerShape symbol_of(std::size_t renderer) {
    constexpr std::array kShapes = {MarkerShape::circle, MarkerShape::square, MarkerShape::diamond,
                                    MarkerShape::up};
    return kShapes[renderer % kShapes.size()];
  }
  void add_symbols(Panel& panel, std::size_t renderer, const CoverageCurve& curve) const;
  std::string name(std::size_t renderer) const {
    return printable(table_.trials.renderers[renderer], 40);
  }
  std::string shape(std::size_t s) const { return printable(table_.trials.shapes[s], 40); }

  const MovementTable& table_;
  const MovementPictures& pictures_;
  const std::size_t shapes_, renderers_;
};

Figure Drawer::new_figure(const char* id, const char* title) const {
  Figure figure;
  figure.id = id;
  figure.title = title;
  figure.label = simulated_label(table_.trials.simulated);
  figure.subtitle = counted(table_.trials.participants.size(), "participant", "participants") +
                    ", " + counted(table_.trials.rows.size(), "trial", "trials");
  if (table_.trials.shapes.size() > shapes_)
    figure.notes.push_back("The first " + std::to_string(shapes_) + " of " +
                           std::to_string(table_.trials.shapes.size()) + " shapes.");
  if (table_.trials.renderers.size() > renderers_)
    figure.notes.push_back("The first " + std::to_string(renderers_) + " of " +
                           std::to_string(table_.trials.renderers.size()) + " renderers.");
  return figure;
}

const TypicalTrial* Drawer::typical(std::size_t renderer, std::size_t shape) const {
  for (const TypicalTrial& one : pictures_.typical) {
    const TrialRow& row = table_.trials.rows[one.row];
    if (row.renderer == renderer && row.shape == shape) return &one;
  }
  return nullptr;
}

Panel Drawer::panel_of(std::size_t renderer, std::size_t s, const TypicalTrial& one) const {
  Panel panel;
  const double seconds = static_cast<double>(one.trial.tip.size()) / one.trial.rate;
  panel.title =
      shape(s) + ", " + name(renderer) + ": " + one.name + ", " + fixed(seconds, 1) + " s";
  panel.starts_row = renderer == 0;
  return panel;
}

// --- three views
// ----------------------------------------------------------------------------------

using Flat = std::array<double, 2>;  // mm

double turn_of(const Flat& a, const Flat& b, const Flat& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/// Corners of the convex hull, by Andrew's monotone chain.
std::vector<Flat> hull_of(std::vector<Flat> points) {
  std::sort(points.begin(), points.end());
  std::vector<Flat> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t first = hull.size();
    for (const Flat& point : points) {
      while (hull.size() >= first + 2 && turn_of(hull[hull.size() - 2], hull.back(), point) <= 0)
        hull.pop_back();
      hull.push_back(point);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

/// A view along an axis, at its position among the three: the front below left, the top above it,
/// the right side beside it.
struct View {
  const char* name;
  int across, up;       ///< axes of the object
  double right, above;  ///< in distances between views

  Flat operator()(const Vec3& place, double apart) const {
    return {place[across] * kMm + right * apart, place[up] * kMm + above * apart};
  }
};
constexpr std::array<View, 3> kViews{
    {{"front", 0, 2, 0, 0}, {"top", 0, 1, 0, 1}, {"right side", 1, 2, 1, 0}}};

double reach_of(const ShapeOutline& outline) {
  double reach = 0;
  for (const Vec3& place : outline.places) {
    for (int k = 0; k < 3; ++k) reach = std::max(reach, std::abs(place[k]) * kMm);
  }
  return reach;
}

Mark flat_line(Role role, const std::vector<Flat>& points, double width, double opacity = 1) {
  std::vector<double> x, y;
  for (const Flat& point : points) {
    x.push_back(point[0]);
    y.push_back(point[1]);
  }
  Mark line = line_mark(role, std::move(x), std::move(y), width);
  line.opacity = opacity;
  return line;
}

/// The trial's ticks every 20 ms, cut where contact begins or ends, where there is a gap, and
/// where the tip is farther than `limit` mm from the object's axes.
std::vector<std::pair<bool, std::vector<Vec3>>> runs_of(const MovementTrial& trial, double limit) {
  const auto step = std::max<std::size_t>(1, static_cast<std::size_t>(trial.rate / 50));
  std::vector<std::pair<bool, std::vector<Vec3>>> runs;
  bool open = false;
  std::size_t next_break = 0;
  for (std::size_t i = 0; i < trial.tip.size(); i += step) {
    const Vec3& place = trial.contact[i] ? trial.point[i] : trial.tip[i];
    while (next_break < trial.breaks.size() && trial.breaks[next_break] <= i) {
      open = false;
      ++next_break;
    }
    const double off = std::max({std::abs(place.x), std::abs(place.y), std::abs(place.z)}) * kMm;
    if (off > limit) {
      open = false;
      continue;
    }
    // Not joined: with the ray the contact may be far along the stylus from its tip.
    if (!open || runs.back().first != trial.contact[i]) runs.push_back({trial.contact[i], {}});
    runs.back().second.push_back(place);
    open = true;
  }
  return runs;
}

Panel Drawer::views_of(std::size_t renderer, std::size_t s, const TypicalTrial& one) const {
  const ShapeOutline& outline = pictures_.outlines[s];
  const double reach = reach_of(outline), limit = 1.25 * reach, apart = 2.65 * reach;
  Panel panel = panel_of(renderer, s, one);
  panel.width = panel.height = 300;  // also on a narrow page: views keep their shape
  panel.x = {"", -limit, apart + limit, {}, false, false};
  panel.y = panel.x;
  const std::vector<std::pair<bool, std::vector<Vec3>>> runs = runs_of(one.trial, limit);
  for (const View& view : kViews) {
    std::vector<Flat> flat;
    for (const Vec3& place : outline.places) flat.push_back(view(place, apart));
    std::vector<Flat> hull = hull_of(std::move(flat));
    if (!hull.empty()) hull.push_back(hull.front());
    panel.marks.push_back(flat_line(Role::soft, hull, 1.5));
    for (const auto& [from, to] : outline.edges)
      panel.marks.push_back(flat_line(Role::soft, {view(from, apart), view(to, apart)}, 0.75, 0.5));
    for (const auto& [contact, places] : runs) {
      if (places.size() < 2) continue;
      std::vector<Flat> way;
      for (const Vec3& place : places) way.push_back(view(place, apart));
      panel.marks.push_back(contact ? flat_line(role(renderer), way, 1.75)
                                    : flat_line(Role::soft, way, 1, 0.8));
      panel.marks.back().dashed = !contact;
    }
    const Flat at = view(Vec3(0), apart);
    Mark text = text_mark(Role::soft, at[0], at[1] - limit, view.name, 11);
    text.dy = 8;
    panel.marks.push_back(std::move(text));
  }
  // A scale bar of 20 mm, in the corner without a view.
  const double x = apart - 10, y = apart;
  panel.marks.push_back(line_mark(Role::ink, {x, x + 20}, {y, y}, 2));
  Mark scale = text_mark(Role::ink, x + 10, y, "20 mm", 11);
  scale.dy = -6;
  panel.marks.push_back(std::move(scale));
  return panel;
}

Figure Drawer::paths() const {
  Figure figure = new_figure("movement-paths", "Path of the hand, on three views of the object");
  figure.description = "Paths of typical trials:";
  for (std::size_t s = 0; s < shapes_; ++s) {
    if (pictures_.outlines[s].places.empty()) continue;
    for (std::size_t r = 0; r < renderers_; ++r) {
      const TypicalTrial* one = typical(r, s);
      if (one == nullptr) continue;
      figure.panels.push_back(views_of(r, s, *one));
      figure.description += " " + figure.panels.back().title + ";";
    }
  }
  for (std::size_t r = 0; r < renderers_; ++r)
    figure.legend.push_back({name(r) + ", in contact", role(r), MarkerShape::dash});
  figure.legend.push_back({"in free space", Role::soft, MarkerShape::dash});
  figure.notes.push_back(
      "One trial of each kind: the correct answer whose duration is nearest to the median, in the "
      "object's frame. The line shows the contact point, or in free space (dashed) the tip of "
      "the stylus.");
  return figure;
}

// --- where surfaces were touched --------------------------------------------------------------

constexpr double kFullDensity = 4;

double opacity_of(double density) {
  return std::round(20 * std::clamp(density / kFullDensity, 0.0, 1.0)) / 20;
}

/// An edge on the map, cut at the map's side.
void add_edge(Panel& panel, const Vec3& from, const Vec3& to) {
  constexpr int kSteps = 16;
  std::vector<double> x, y;
  const auto draw = [&] {
    if (x.size() > 1) panel.marks.push_back(line_mark(Role::ink, x, y, 1));
    x.clear();
    y.clear();
  };
  for (int k = 0; k <= kSteps; ++k) {
    const auto at = SurfaceMap::place_of(from + (to - from) * (static_cast<double>(k) / kSteps));
    if (!x.empty() && std::abs(at[0] - x.back()) > SurfaceMap::kColumns / 2.0) draw();
    x.push_back(at[0]);
    y.push_back(at[1]);
  }
  draw();
  if (!panel.marks.empty() && panel.marks.back().kind == Mark::Kind::line)
    panel.marks.back().opacity = 0.6;
}

Panel Drawer::map_of(std::size_t renderer, std::size_t s, const ContactMap& map) const {
  Panel panel;
  panel.title = shape(s) + ", " + name(renderer);
  panel.starts_row = renderer == 0;
  panel.width = 360;
  panel.height = 180;
  panel.x = {"", 0, SurfaceMap::kColumns, {}, false, false};
  for (int k = 0; k <= 4; ++k)
    panel.x.ticks.push_back(
        {k * static_cast<double>(SurfaceMap::kColumns) / 4, fixed(90 * k - 180, 0) + "°"});
  panel.y = {"height", 0, SurfaceMap::kRows, {}, false, false};
  panel.y.ticks = {{0, "low"}, {SurfaceMap::kRows / 2.0, "middle"}, {SurfaceMap::kRows, "high"}};
  // Use steps of 5 %: neighbours of a row then often form one rectangle, which takes a line of the
  // file.
  for (std::size_t c = 0, next = 0; c < map.density.size(); c = next) {
    const double opacity = opacity_of(map.density[c]);
    const std::size_t end_of_row = (c / SurfaceMap::kColumns + 1) * SurfaceMap::kColumns;
    for (next = c + 1; next < end_of_row && opacity_of(map.density[next]) == opacity; ++next) {
    }
    if (opacity == 0) continue;
    const std::size_t row = c / SurfaceMap::kColumns;
    const auto x = static_cast<double>(c % SurfaceMap::kColumns), y = static_cast<double>(row);
    panel.marks.push_back(
        rect_mark(role(renderer), x, y, x + static_cast<double>(next - c), y + 1, opacity, ""));
  }
  const Vec3 middle = pictures_.outlines[s].middle();
  for (const auto& [from, to] : pictures_.outlines[s].edges)
    add_edge(panel, from - middle, to - middle);
  panel.marks.push_back(line_mark(Role::soft, {0, SurfaceMap::kColumns, SurfaceMap::kColumns, 0, 0},
                                  {0, 0, SurfaceMap::kRows, SurfaceMap::kRows, 0}, 1));
  return panel;
}

Figure Drawer::contact() const {
  Figure figure = new_figure("movement-contact", "Where the surface was touched");
  figure.description =
      "Contact time by position on the surface. The most touched tenth of the map:";
  for (std::size_t s = 0; s < shapes_; ++s) {
    for (std::size_t r = 0; r < renderers_; ++r) {
      const ContactMap& map = pictures_.contact[r][s];
      if (map.trials == 0) continue;
      figure.panels.push_back(map_of(r, s, map));
      std::vector<double> sorted = map.density;
      std::sort(sorted.rbegin(), sorted.rend());
      figure.description += " " + figure.panels.back().title + " from " +
                            fixed(sorted[sorted.size() / 10], 1) + " times uniform contact;";
    }
  }
  for (std::size_t r = 0; r < renderers_; ++r)
    figure.legend.push_back({name(r), role(r), MarkerShape::square});
  figure.notes.push_back(
      "The surface as seen from the middle of the object, unfolded: the angle about its upright "
      "axis across, the height (sine of the elevation) upwards; edges are lines. Colour: contact "
      "time per area of the surface. Full colour is at least 4 times that of uniform contact, "
      "a quarter of the colour is uniform contact, white is none. Each trial has the same weight.");
  return figure;
}

// --- speed over time --------------------------------------------------------------------------

Panel Drawer::profile_of(std::size_t renderer, std::size_t s, const TypicalTrial& one,
                         double seconds, double fastest) const {
  constexpr std::size_t kMost = 600;
  Panel panel = panel_of(renderer, s, one);
  panel.width = 370;
  panel.height = 130;
  panel.x = linear_axis(0, seconds, "time (s)");
  panel.y = linear_axis(0, fastest * kMm, "speed (mm/s)");
  panel.y.ticks.erase(panel.y.ticks.begin() + 1, panel.y.ticks.end() - 1);
  const SmoothPath smooth = smooth_path(one.trial, table_.settings);
  const auto at = [&](std::size_t tick) { return static_cast<double>(tick) / one.trial.rate; };
  const double top = panel.y.high;
  for (const Stretch& movement : smooth.movements)
    panel.marks.push_back(rect_mark(
        Role::grid, at(movement.begin), 0, at(movement.end), top, 0.8,
        "movement, " + fixed(at(movement.begin), 2) + " to " + fixed(at(movement.end), 2) + " s"));
  for (const Stretch& contact : contact_episodes(one.trial.contact, one.trial.rate))
    panel.marks.push_back(rect_mark(
        role(renderer), at(contact.begin), 0.94 * top, at(contact.end), top, 1,
        "contact, " + fixed(at(contact.begin), 2) + " to " + fixed(at(contact.end), 2) + " s"));
  const std::size_t n = smooth.speed.size();
  const std::size_t step =
      std::max<std::size_t>({1, static_cast<std::size_t>(one.trial.rate / 50), n / kMost});
  for (const Stretch& piece : pieces_of(one.trial)) {
    std::vector<double> x, y;
    for (std::size_t i = piece.begin; i < piece.end; i += step) {
      x.push_back(at(i));
      y.push_back(smooth.speed[i] * kMm);
    }
    panel.marks.push_back(line_mark(Role::ink, std::move(x), std::move(y), 1.5));
  }
  return panel;
}

Figure Drawer::speed() const {
  Figure figure = new_figure("movement-speed", "Speed of the hand over a typical trial");
  figure.description = "Speed of the tip over time. Movements and contacts:";
  for (std::size_t s = 0; s < shapes_; ++s) {
    double seconds = 0, fastest = 0;
    for (std::size_t r = 0; r < renderers_; ++r) {
      const TypicalTrial* one = typical(r, s);
      if (one == nullptr) continue;
      seconds = std::max(seconds, static_cast<double>(one->trial.tip.size()) / one->trial.rate);
      for (const double speed : smooth_path(one->trial, table_.settings).speed)
        fastest = std::max(fastest, speed);
    }
    for (std::size_t r = 0; r < renderers_; ++r) {
      const TypicalTrial* one = typical(r, s);
      if (one == nullptr || !(fastest > 0)) continue;
      figure.panels.push_back(profile_of(r, s, *one, seconds, fastest));
      figure.description += " " + figure.panels.back().title + ": " +
                            counted(smooth_path(one->trial, table_.settings).movements.size(),
                                    "movement", "movements") +
                            ", " +
                            counted(contact_episodes(one->trial.contact, one->trial.rate).size(),
                                    "contact", "contacts") +
                            ";";
    }
  }
  figure.legend.push_back({"movement", Role::grid, MarkerShape::square});
  for (std::size_t r = 0; r < renderers_; ++r)
    figure.legend.push_back({"contact, " + name(r), role(r), MarkerShape::square});
  figure.notes.push_back(
      "The same trials as in the paths; speed of the tip after the low-pass filter at " +
      fixed(table_.settings.cutoff, 1) +
      " Hz. Shaded: movements, at least 5 % of the greatest speed for "
      "100 ms or more. Bar on top: contact.");
  return figure;
}

// --- coverage over time -----------------------------------------------------------------------

void Drawer::add_symbols(Panel& panel, std::size_t renderer, const CoverageCurve& curve) const {
  constexpr std::size_t kSymbols = 6;
  const auto steps = static_cast<std::size_t>(panel.x.high / TrialTally::kStep);
  // Curves of several renderers have theirs at different places.
  for (std::size_t i = 0; i < kSymbols; ++i) {
    const std::size_t k = steps * (renderers_ * i + renderer + 1) / (renderers_ * kSymbols + 1);
    if (k >= curve.mean.size()) break;
    panel.marks.push_back(symbol(role(renderer), symbol_of(renderer),
                                 static_cast<double>(k) * TrialTally::kStep, 100 * curve.mean[k], 4,
                                 name(renderer) + ": " + fixed(100 * curve.mean[k], 1) + " %"));
  }
}

Figure Drawer::coverage() const {
  Figure figure = new_figure("movement-coverage", "Share of the surface touched, over time");
  figure.description = "Mean share of the surface touched at the median duration:";
  for (std::size_t s = 0; s < shapes_; ++s) {
    Panel panel;
    panel.title = shape(s);
    panel.width = 370;
    panel.height = 200;
    panel.starts_row = figure.panels.size() % 2 == 0;
    double longest = 0, greatest = 0;
    for (std::size_t r = 0; r < renderers_; ++r) {
      const CoverageCurve& curve = pictures_.coverage[r][s];
      if (curve.mean.empty()) continue;
      longest = std::max(longest, 2 * curve.median_duration);
      greatest = std::max(greatest, curve.mean.back());
    }
    if (!(longest > 0)) continue;
    longest = std::min(longest, TrialTally::kStep * (TrialTally::kSteps - 1));
    panel.x = linear_axis(0, longest, "time (s)");
    panel.y = linear_axis(0, std::max(1.0, 100 * greatest), "surface touched (%)");
    for (std::size_t r = 0; r < renderers_; ++r) {
      const CoverageCurve& curve = pictures_.coverage[r][s];
      if (curve.mean.empty()) continue;
      std::array<std::vector<double>, 2> x, y;  // at least half of the trials continue; have ended
      double at_median = 0;
      for (std::size_t k = 0; k < curve.mean.size(); ++k) {
        const double at = static_cast<double>(k) * TrialTally::kStep;
        if (at > panel.x.high) break;
        const bool ended = at > curve.median_duration;
        if (ended && x[1].empty() && !x[0].empty()) {
          x[1].push_back(x[0].back());
          y[1].push_back(y[0].back());
        }
        x[ended ? 1 : 0].push_back(at);
        y[ended ? 1 : 0].push_back(100 * curve.mean[k]);
        if (!ended) at_median = 100 * curve.mean[k];
      }
      for (const std::size_t part : {0U, 1U}) {
        if (x[part].size() < 2) continue;
        panel.marks.push_back(line_mark(role(r), x[part], y[part], part == 0 ? 2.5 : 1.5));
        panel.marks.back().dashed = part == 1;
      }
      add_symbols(panel, r, curve);
      figure.description += " " + shape(s) + ", " + name(r) + ": " + fixed(at_median, 1) +
                            " % at " + fixed(curve.median_duration, 1) + " s;";
    }
    figure.panels.push_back(std::move(panel));
  }
  for (std::size_t r = 0; r < renderers_; ++r)
    figure.legend.push_back({name(r), role(r), symbol_of(r)});
  figure.notes.push_back(
      "Share of 10,000 points on the surface that were within 5 mm of a contact so far: mean over "
      "participants' means. A trial that has ended keeps its last value; dashed: more than half of "
      "the trials have ended.");
  return figure;
}

// --- exploratory procedures -------------------------------------------------------------------

Figure Drawer::procedures() const {
  struct Kind {
    const char *measure, *name, *letter;
    Role role;
    double opacity;
  };
  static constexpr std::array<Kind, kProcedures> kKinds{
      {{"share_static", "static contact", "S", Role::soft, 0.55},
       {"share_pressure", "pressure", "P", Role::third, 0.9},
       {"share_lateral", "lateral motion", "L", Role::fourth, 0.9},
       {"share_contour", "contour following", "C", Role::seventh, 0.9}}};
  Figure figure = new_figure("movement-procedures", "Exploratory procedures in contact");
  figure.description = "Share of exploratory procedures, static, pressure, lateral, contour:";
  for (std::size_t r = 0; r < renderers_; ++r) {
    Panel panel;
    panel.title = name(r);
    panel.width = 350;
    panel.height = 240;
    panel.x = names_axis(table_.trials.shapes, shapes_, "");
    panel.y = linear_axis(0, 100, "contact time (%)");
    bool any = false;
    for (std::size_t s = 0; s < shapes_; ++s) {
      double below = 0;
      std::string said;
      for (const Kind& kind : kKinds) {
        const auto share = mean_share(table_, measure_named(kind.measure), r, s);
        if (!share) continue;
        const double percent = 100 * *share;
        const auto x = static_cast<double>(s);
        panel.marks.push_back(rect_mark(
            kind.role, x + 0.18, below, x + 0.82, below + percent, kind.opacity,
            shape(s) + ", " + name(r) + ": " + kind.name + " " + fixed(percent, 1) + " %"));
        if (percent >= 8) {
          panel.marks.push_back(
              text_mark(Role::ink, x + 0.5, below + 0.5 * percent, kind.letter, 12));
          panel.marks.back().dy = 4;
        }
        below += percent;
        said += (said.empty() ? " " : ", ") + fixed(percent, 0) + " %";
        any = true;
      }
      if (!said.empty()) figure.description += " " + shape(s) + ", " + name(r) + said + ";";
    }
    if (any) figure.panels.push_back(std::move(panel));
  }
  for (const Kind& kind : kKinds)
    figure.legend.push_back(
        {std::string(kind.letter) + ": " + kind.name, kind.role, MarkerShape::square});
  figure.notes.push_back(
      "Procedures of Lederman & Klatzky (1987), classified in windows of 100 ms by speed along the "
      "surface (10 mm/s), change of force (0.3 of its mean) and nearness of an edge (3 mm); the "
      "limits are our own. Mean over participants' means.");
  return figure;
}

}  // namespace

std::optional<double> mean_share(const MovementTable& table, std::size_t measure,
                                 std::size_t renderer, std::size_t shape) {
  std::map<std::uint32_t, std::pair<std::size_t, double>> by_participant;
  for (std::size_t i = 0; i < table.values.size(); ++i) {
    const TrialRow& row = table.trials.rows[i];
    const auto& value = table.values[i][measure];
    if (row.renderer != renderer || row.shape != shape || !value) continue;
    auto& [n, sum] = by_participant[row.participant];
    ++n;
    sum += *value;
  }
  if (by_participant.empty()) return std::nullopt;
  double mean = 0;
  for (const auto& [participant, sums] : by_participant)
    mean += sums.second / static_cast<double>(sums.first * by_participant.size());
  return mean;
}

std::vector<Figure> movement_figures(const MovementTable& table, const MovementPictures& pictures) {
  const Drawer drawer(table, pictures);
  std::vector<Figure> figures{drawer.paths(), drawer.contact(), drawer.speed(), drawer.coverage(),
                              drawer.procedures()};
  std::erase_if(figures, [](const Figure& figure) { return figure.panels.empty(); });
  return figures;
}

}  // namespace palpate::analysis
