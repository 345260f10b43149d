#pragma once
// A block of trials of one task, as version 2 of a protocol says it: plain values. SI units.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocols/procedures/procedure_spec.h"
#include "stimuli/vec.h"

namespace palpate::protocols {

enum class RendererKind;

enum class TaskKind {
  identify,  ///< which stimulus was it?
  compare,   ///< which of two or three intervals held the comparison, or: were they the same?
  detect,    ///< was there anything?
  rate,      ///< a number, or a step of a labelled scale
  adjust,    ///< turns a parameter until the stimulus equals the standard
  external,  ///< another program says what is shown, and what the answer was (palpate serve)
};
const char* to_string(TaskKind kind);  ///< "identify", ...

/// A number of a stimulus that is varied from trial to trial.
struct LevelTarget {
  std::string pointer;       ///< JSON pointer into the stimulus; "/orientation": degrees about axis
  Vec3 axis{0, 0, 1};        ///< of "/orientation", unit, in the stimulus's frame
  bool orientation = false;  ///< pointer is "/orientation"
};

/// An answer that a key stands for.
struct TaskAnswer {
  std::string key;    ///< as in the protocol
  std::string name;   ///< as it is stored: "1", "yes", "same", a stimulus, "turn_up", ...
  std::string label;  ///< what is read
  double number = 0;  ///< of a step of a scale
};

struct ScaleStep {
  double number = 0;
  std::string label;
};

/// How sure the participant is, asked after the answer with forces off.
struct ConfidenceSpec {
  std::string question;
  std::vector<ScaleStep> scale;  ///< from the least; the keys 1, 2, ... in order
};

/// Practice is over once so many of the last answers were right, at the latest after most_trials.
struct PracticeCriterion {
  int correct = 1, of = 1;
  int most_trials = 1;
};

struct TaskBlock {
  std::string name;  ///< unique within the protocol
  TaskKind task = TaskKind::identify;
  int session = 1;
  bool practice = false;  ///< not analysed
  std::string instructions, question;
  std::vector<RendererKind> renderers;
  /// Indices into Protocol::stimuli: what is identified, compared with the standard, detected,
  /// rated or adjusted. With `level` each at every level.
  std::vector<int> stimuli;
  /// compare, adjust: what it is compared with; rate: the modulus, felt first. None: rate without.
  std::optional<int> standard;
  std::optional<RendererKind> standard_renderer;  ///< of the standard; none: the trial's
  std::optional<int> absent;  ///< detect: shown in catch trials; none: nothing at all
  std::optional<LevelTarget> level;
  std::vector<ProcedureSpec> procedures;  ///< tracks for each stimulus and renderer; none: no level
  /// Of each stimulus and renderer, without procedure; external: trials of the block.
  int repetitions = 1;
  std::optional<int> max_run, min_distance;  ///< of equal stimulus, renderer and level
  double catch_trials = 0;  ///< share of all trials: detect: absent; same_different: both standard

  // compare
  int intervals = 2;
  bool same_different = false;
  bool asks_smaller = false;             ///< the interval with the smaller level is asked for
  double inter_interval = 0.5;           ///< s, forces off and the stylus at rest at home
  std::optional<double> interval_limit;  ///< s, forces on; none: until the participant goes on

  std::vector<TaskAnswer> answers;    ///< keys, in order of key; rate: empty, a number is typed
  std::optional<double> least, most;  ///< rate: of a typed number; adjust, external: of the level
  double modulus = 0;                 ///< rate: the standard's number; 0: none is given
  double turn = 0;                    ///< adjust: of the level, a key press
  std::vector<double> starts;         ///< adjust: levels, in turn
  std::optional<ConfidenceSpec> confidence;
  bool feedback = false;
  double time_out = 60;  ///< s, for the answer, from the begin of the last interval
  /// practice: its trials come again in rounds; none: once
  std::optional<PracticeCriterion> criterion;
};

/// A text to read or questions to answer, before the first block, between blocks or after the last.
struct PageItem {
  enum class Kind { text, number, choice, scale };
  Kind kind = Kind::text;
  std::string name, question;
  std::vector<std::string> choices;   ///< choice, and labels of a scale's steps
  std::optional<double> least, most;  ///< number
  bool required = true;
  std::vector<std::string> shown{};  ///< instead of `choices`, which are what is stored
};
/// A PNG file that a page shows.
struct PagePicture {
  std::string file;  ///< as the protocol names it; "": none
  std::shared_ptr<const std::string> bytes;
};
struct PageSpec {
  enum class Kind { instructions, consent, questionnaire };
  enum class When { before, between, after };
  Kind kind = Kind::instructions;
  When when = When::before;
  std::string name;                     ///< unique within the protocol
  std::string before_block;             ///< between: shown before this block
  std::string text;                     ///< "\f" between screens of instructions
  std::string version;                  ///< consent
  std::vector<PageItem> items;          ///< questionnaire
  std::vector<PagePicture> pictures{};  ///< of each screen of the text; at most so many
};

}  // namespace palpate::protocols
