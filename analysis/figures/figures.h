#pragma once
// A figure (plot) as data: panels, axes and marks in the units of the axes, with its texts.
// figure_svg() draws it.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/study_record.h"
#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

struct MovementPictures;
struct MovementTable;
struct SweepAnalysis;
struct StudyAnalysis;

/// What a colour encodes; each palette gives it a value. point, ray, third to eighth: a renderer or
/// a separate line; paper: results of Ho, Basdogan & Srinivasan (2000); heat: cells of a matrix;
/// ink, soft, grid, page: text, secondary text, grid lines, background; amber: warnings, limits,
/// censored estimates.
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

/// The symbol of a data point, distinguishable without colour. diamond: outline only; up, down,
/// left, right: triangles; cross: +; saltire: x.
enum class MarkerShape { circle, square, diamond, up, down, dash, right, cross, left, saltire };

/// A graphical element of a panel; coordinates in the units of the panel's axes.
struct Mark {
  /// label: a text beside its point, placed with the least overlap.
  enum class Kind { rect, area, line, interval, symbol, text, label };
  Kind kind = Kind::symbol;
  Role role = Role::ink;
  /// rect: two opposite corners; area (closed) and line: their corners; interval: one x and two y;
  /// symbol, text, label: one of each.
  std::vector<double> x, y;
  double opacity = 1;
  double size = 6;  ///< px: half the width of a symbol, width of a line, font size of a text
  MarkerShape shape = MarkerShape::circle;
  std::string text;         ///< of a text or label: the text; of others: the tooltip
  std::string participant;  ///< code; marks with the same code are highlighted together
  int anchor = 0;           ///< of a text: -1 begins, 0 is centred, 1 ends at x
  bool bold = false;        ///< of a text
  bool dashed = false;      ///< of a line
  double dx = 0, dy = 0;    ///< px, y down: offset of a symbol or text from (x, y)
  /// Of a text: largest width in units of x (0: unlimited). A wider text is replaced by `shorter`,
  /// or left out if that is too wide as well.
  double max_width = 0;
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
  bool names = false;  ///< categorical: tick i is the name of the slot i to i + 1
};

struct Panel {
  std::string title;
  FigureAxis x, y;
  double width = 400, height = 300;  ///< px; drawn narrower on a narrow page
  bool starts_row = false;           ///< begins a new row of panels
  std::vector<Mark> marks;
};

struct LegendEntry {
  std::string label;
  Role role = Role::ink;
  MarkerShape shape = MarkerShape::circle;
};

struct Figure {
  std::string id;  ///< file name without .svg and anchor in a page, such as "figure15"
  std::string title;
  std::string subtitle;     ///< numbers of participants and trials
  std::string label;        ///< "SIMULATED PARTICIPANTS" or empty
  std::string description;  ///< text alternative for screen readers: the numbers drawn
  std::vector<std::string> notes;
  std::vector<LegendEntry> legend;
  std::vector<Panel> panels;
  double max_row_width = 1000;  ///< px: panels are placed side by side up to this width
};

/// The figures for which there are data, in the order of display: figure15, speedup, times,
/// confusion, speed-accuracy, learning, order, servo (unless all trials have their longest period
/// in the same bin), exclusions.
std::vector<Figure> figures_of(const Analysis& analysis, const StudyRecord& record);

/// Mean response time (s) of each shape and renderer over participants' mean times, with its 95 % t
/// interval, and each participant's means; as fig. 15 of Ho, Basdogan & Srinivasan (2000).
Figure figure15_of(const Analysis& analysis);
/// Geometric percent reduction of response time for each shape with its 95 % t interval, the
/// estimate with time-outs as censored times and the paper's percentage; a panel for each
/// comparison.
Figure speedup_of(const Analysis& analysis);

/// The reason, in a sentence, why there is no figure of the servo periods.
std::string servo_sentence(const Analysis& analysis, const StudyRecord& record);

/// Largest number of shapes in a figure; tables and JSON have all.
constexpr std::size_t kShownShapes = 24;
/// Largest number of renderers in a figure: the number of styles (colour and symbol).
constexpr std::size_t kShownRenderers = 6;
/// Largest number of participants drawn one by one.
constexpr std::size_t kShownParticipants = 200;

/// Figures of tasks.
/// For each stimulus in a block with means over participants: "group1", ...: a panel for each
/// measure with every participant, the mean and its 95 % interval, by renderer. For each block of
/// ratings on steps or without levels: "rating1", ...: means of the stimuli and shares of the
/// steps. For each stimulus of magnitude estimation: "magnitude1", ...: numbers over levels, both
/// logarithmic, with every participant. For each cell with
/// psychometric functions: "function1", ...: a panel for each participant with the share of
/// successes at each level (area of the symbol: trials), the fitted function and the threshold's
/// interval; and "track1", ...: levels over the trials of up to four tracks with the answers, and
/// reversals of a staircase. Participants beyond the first 12 are left out, with a note.
std::vector<Figure> task_figures(const StudyAnalysis& analysis);

/// For each stimulus in a block whose level has several dimensions: "field1", ...: a panel for each
/// renderer with what the form says of every participant (JND over the standard, threshold over x2,
/// shift over a conflict), the same from the trials at each place alone, and the mean.
std::vector<Figure> field_figures(const StudyAnalysis& analysis);

/// For each stimulus in a block of a study with groups, and for identification, "between1", ...: a
/// panel for each measure with the means of the groups under each renderer
/// with their intervals, and every participant.
std::vector<Figure> between_figures(const StudyAnalysis& analysis);

/// The figures for which there are data: movement-paths (a typical trial on three views of its
/// object), movement-contact (where surfaces were touched), movement-speed (speed over time with
/// movements and contact), movement-coverage (share of the surface over time), movement-procedures
/// (share of exploratory procedures). Shapes beyond the first eight and renderers beyond the first
/// four are left out, with a note.
std::vector<Figure> movement_figures(const MovementTable& table, const MovementPictures& pictures);

/// Mean over participants' means of an untransformed share; none: no trial has it.
std::optional<double> mean_share(const MovementTable& table, std::size_t measure,
                                 std::size_t renderer, std::size_t shape);

/// gains: each shape's gain over the space, with the paper's; drivers: their strongest drivers;
/// scatter: each shape's gain over its strongest driver. Only figures with data.
std::vector<Figure> sweep_figures(const SweepAnalysis& analysis);

/// "Sobol index" or "rank correlation".
std::string driver_measure(const SweepAnalysis& analysis);

/// Number of parameters shown for each shape in figures and tables.
constexpr std::size_t kShownDrivers = 8;

}  // namespace palpate::analysis
