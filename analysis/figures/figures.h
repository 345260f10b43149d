#pragma once
// Figures as numbers and words in the units of their axes; figure_svg() draws them.

#include <cstddef>
#include <string>
#include <vector>

#include "analysis/input/study_record.h"
#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

/// What a colour stands for; each theme has its own value. `third` and on: further renderers or
/// lines.
enum class Role {
  page,
  ink,
  soft,
  grid,
  point,
  ray,
  paper,
  heat,
  amber,
  third,
  fourth,
  fifth,
  sixth,
  seventh,
  eighth
};
constexpr std::size_t kRoles = 15;
const char* to_string(Role role);

/// The diamond is open. Right and left are triangles, the cross stands upright, the saltire not.
enum class Shape { circle, square, diamond, up, down, dash, right, cross, left, saltire };

/// One thing in a panel, in the panel's own units.
struct Mark {
  /// A label is a text beside its point, on the side where it hides least.
  enum class Kind { rect, area, line, interval, symbol, text, label };
  Kind kind = Kind::symbol;
  Role role = Role::ink;
  /// rect: two opposite corners; area (closed) and line: their corners; interval: one x and two y;
  /// symbol, text, label: one of each.
  std::vector<double> x, y;
  double opacity = 1;
  double size = 6;  ///< px: half of a symbol, width of a line, height of a text
  Shape shape = Shape::circle;
  std::string text;       ///< a text's own; of others what is shown when they are pointed at
  std::string person;     ///< marks of one participant are made to stand out together
  int anchor = 0;         ///< of a text: -1 starts, 0 is centred, 1 ends at x
  bool bold = false;      ///< of a text
  bool dashed = false;    ///< of a line
  double dx = 0, dy = 0;  ///< px, of symbols and texts
  /// Of a text: width that it may take, in units of x (0: any). A wider one gives way to `shorter`,
  /// then to nothing.
  double room = 0;
  std::string shorter;
};

struct Tick {
  double at = 0;
  std::string label;
};

struct FigureAxis {
  std::string title;
  double low = 0, high = 1;  ///< low < high
  std::vector<Tick> ticks;
  bool grid = true;
  bool names = false;  ///< categories: ticks have no lines
};

struct Panel {
  std::string title;
  FigureAxis x, y;
  double width = 400, height = 300;  ///< px; narrower where there is less room
  bool starts_row = false;           ///< stands below those before it, not beside them
  std::vector<Mark> marks;
};

struct LegendEntry {
  std::string label;
  Role role = Role::ink;
  Shape shape = Shape::circle;
};

struct Figure {
  std::string id;  ///< "figure15": file name and anchor
  std::string title;
  std::string subtitle;     ///< how many people and trials
  std::string label;        ///< "SIMULATED PARTICIPANTS" or empty
  std::string description;  ///< what a screen reader says
  std::vector<std::string> notes;
  std::vector<LegendEntry> legend;
  std::vector<Panel> panels;
  double room = 1000;  ///< px: panels stand side by side within it
};

/// Those that the data allow, in the order of display: figure15, speedup, times, confusion,
/// speed-accuracy, learning, order, servo (unless all trials' longest periods are alike),
/// exclusions.
std::vector<Figure> figures_of(const Analysis& analysis, const ReportRecord& record);

/// Mean time per shape and renderer with 95 % t intervals over participants, and each
/// participant's line.
Figure figure15_of(const Analysis& analysis);
/// Percent reduction per shape with its interval, beside the paper's; a panel for each comparison.
Figure speedup_of(const Analysis& analysis);

/// Why there is no figure of the servo.
std::string servo_sentence(const Analysis& analysis, const ReportRecord& record);

/// Shapes that a figure has room for; the tables have all.
constexpr std::size_t kShownShapes = 24;
/// Renderers likewise: so many are told apart by colour and symbol.
constexpr std::size_t kShownRenderers = 6;
/// Participants who get a line of their own.
constexpr std::size_t kShownPeople = 200;

}  // namespace palpate::analysis
