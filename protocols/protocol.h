#pragma once
// The design of an experiment as plain values. Meaning and default of each key:
// protocol.schema.json. SI units.

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "data/base/group_assignment.h"
#include "protocols/procedures/procedure_spec.h"
#include "protocols/scene_spec.h"
#include "protocols/sight.h"
#include "protocols/sound.h"
#include "stimuli/shapes.h"
#include "stimuli/vec.h"

namespace palpate::protocols {

enum class RendererKind;

enum class TaskKind {
  identify,  ///< which stimulus it was
  compare,   ///< which of two or three intervals held the comparison, or: were they the same?
  detect,    ///< was there anything?
  rate,      ///< a number, or a step of a labelled scale
  adjust,    ///< turns a parameter until the stimulus equals the standard
  external,  ///< another program chooses the stimulus and reports the answer (palpate serve)
  reach,     ///< moves from home to a target, through the fields of the stimulus
};
/// "identify", ...
inline const char* to_string(TaskKind kind) {
  constexpr std::array kNames = {"identify", "compare",  "detect", "rate",
                                 "adjust",   "external", "reach"};
  return kNames[static_cast<std::size_t>(kind)];
}

/// A number of a stimulus that is varied from trial to trial.
struct LevelTarget {
  std::string pointer;       ///< JSON pointer into the stimulus; "/orientation": degrees about axis
  Vec3 axis{0, 0, 1};        ///< of "/orientation", unit, in the stimulus's frame
  bool orientation = false;  ///< pointer is "/orientation"

  bool operator==(const LevelTarget&) const = default;
};

/// One of the numbers that are varied together, from trial to trial.
struct LevelDimension {
  /// The stimuli of a trial whose number it is.
  enum class Of { comparison, standard, both };
  std::string name;  ///< of its column
  LevelTarget target;
  Of of = Of::comparison;
  LevelScale scale = LevelScale::linear;  ///< linear or log10

  bool applies_to(bool standard) const {
    return of == Of::both || (of == Of::standard) == standard;
  }
  bool operator==(const LevelDimension&) const = default;
};

/// "comparison", ...
inline const char* to_string(LevelDimension::Of of) {
  constexpr std::array kNames = {"comparison", "standard", "both"};
  return kNames[static_cast<std::size_t>(of)];
}

/// The answer that a key gives.
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

/// Practice ends once so many of the last answers were correct, at the latest after most_trials.
struct PracticeCriterion {
  int correct = 1, of = 1;
  int most_trials = 1;
  bool by_round = false;  ///< judged at the end of a round only
};

/// A level of a factor: what it sets.
struct FactorLevel {
  std::string name;
  /// JSON pointer ("/stimuli/*/friction_static", "/block/time_out_s") and the value's JSON text.
  std::vector<std::pair<std::string, std::string>> sets;
};
/// A factor within participants besides renderer, stimulus and level.
struct Factor {
  std::string name;
  std::vector<FactorLevel> levels;
};
/// The levels of a factor that a block crosses with its other factors: indices.
struct CrossedFactor {
  std::size_t factor = 0;  ///< into Protocol::factors
  std::vector<std::size_t> levels;
};

/// The field that is felt on the way to a target.
enum class ReachTrial {
  field,  ///< the fields of the stimulus
  none,   ///< catch trial: no field, unannounced
  clamp,  ///< a channel from home to the target, which shows what the hand has learnt to push
};
/// "field", "catch", "clamp"
inline const char* to_string(ReachTrial kind) {
  constexpr std::array kNames = {"field", "catch", "clamp"};
  return kNames[static_cast<std::size_t>(kind)];
}

/// Movements from home to targets. World frame, m.
struct ReachingSpec {
  static constexpr double kStopSpeed = 0.02;  ///< m/s; slower is at rest
  Vec3 home{0, 0, 0};
  double home_radius = 0.005, target_radius = 0.005;
  std::vector<Vec3> targets;
  std::optional<double> least_time, most_time;  ///< s, of a movement in time
  double clamp_share = 0, catch_share = 0;      ///< of all trials
  double clamp_stiffness = 1000;                ///< N/m, of the channel
  std::vector<int> channels;  ///< of each target: index into Protocol::stimuli; empty: no clamps
};

/// A block of trials of one task in version 2 of a protocol.
struct TaskBlock {
  /// Unique within the protocol, except among the cells of a block; "": of the study of shapes.
  std::string name;
  std::size_t place = 0;  ///< in the protocol's list, where the cells of a block are one
  std::vector<CrossedFactor> factors{};
  bool cells_apart = false;         ///< one after the other; else every trial may be of any cell
  std::optional<std::size_t> cell;  ///< of the factors, apart from the other cells
  bool cells_share_tracks = false;  ///< a track goes on over all cells; else each has its own
  /// Intervals are announced, and the question is shown; false: the keys alone, and texts.go.
  bool announced = true;
  TaskKind task = TaskKind::identify;
  int session = 1;
  bool practice = false;  ///< not analysed
  std::string instructions, question;
  std::vector<RendererKind> renderers;
  /// Indices into Protocol::stimuli: the stimuli to identify, to compare with the standard, to
  /// detect, rate or adjust. With `level`, each at every level.
  std::vector<int> stimuli;
  /// compare, adjust: the reference; rate: the modulus, felt first. nullopt: rate without.
  std::optional<int> standard;
  std::optional<RendererKind> standard_renderer;  ///< of the standard; none: the trial's
  std::optional<int> absent;  ///< detect: shown in catch trials; none: nothing at all
  /// Of a stimulus in a cell: `standard` and `absent` in the same cell.
  std::map<int, int> standard_of{}, absent_of{};
  std::optional<LevelTarget> level;
  std::vector<LevelDimension> dimensions{};  ///< 2 to 4, in place of `level`; empty: none
  std::vector<ProcedureSpec> procedures;  ///< tracks for each stimulus and renderer; none: no level
  /// Of each stimulus and renderer, without procedure; external: trials of the block.
  int repetitions = 1;
  std::optional<int> max_run, min_distance;  ///< of equal stimulus, renderer and level
  double catch_trials = 0;  ///< share of all trials: detect: absent; same_different: both standard

  int intervals = 2;  ///< compare: 2 or 3; external: 1 to 10
  bool same_different = false;
  enum class IntervalsSeen { both, standard, comparison };
  IntervalsSeen intervals_seen = IntervalsSeen::both;  ///< compare: those of which things are seen
  bool asks_smaller = false;    ///< the question asks for the interval with the smaller level
  double inter_interval = 0.5;  ///< s, forces off and the stylus at rest at home
  std::optional<double> interval_limit;  ///< s, forces on; none: until the participant goes on

  std::vector<TaskAnswer> answers;    ///< keys, in order of key; rate: empty, a number is typed
  std::optional<double> least, most;  ///< rate: of a typed number; adjust, external: of the level
  double modulus = 0;                 ///< rate: the standard's number; 0: none is given
  double turn = 0;                    ///< adjust: of the level, a key press
  std::vector<double> starts;         ///< adjust: levels, in turn
  std::optional<ReachingSpec> reaching;  ///< reach
  std::optional<ConfidenceSpec> confidence;
  bool feedback = false;
  double time_out = 60;  ///< s, for the answer, from the begin of the last interval
  /// practice: its trials come again in rounds; none: once
  std::optional<PracticeCriterion> criterion;
  bool practice_feedback = false;  ///< whatever `feedback` says
  bool by_shape = false;           ///< identify: the shape, whatever else differs
};

/// A text to read or questions to answer, before the first block, between blocks or after the last.
struct PageItem {
  enum class Kind { text, number, choice, scale };
  Kind kind = Kind::text;
  std::string name, question;
  std::vector<std::string> choices;   ///< choice, and labels of a scale's steps
  std::optional<double> least, most;  ///< number
  bool required = true;
  std::vector<std::string> shown{};  ///< on the screen instead of `choices`; `choices` are stored
  std::string column{};  ///< of the table of participants, that the answer fills; "": none
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

enum class RendererKind { point, ray };
/// "point", "ray"
inline const char* to_string(RendererKind kind) {
  return kind == RendererKind::point ? "point" : "ray";
}

enum class RendererOrder { fixed, counterbalanced, interleaved };
enum class OrderKind { random, sequential };
enum class OrientationKind { uniform, fixed, listed };
/// The reaction to a material that the device cannot render passively: refuse the session, or limit
/// the stiffness.
enum class MaterialLimit { refuse, limit };
/// The treatment of torque on a device that drives force alone.
enum class TorqueRule { required, left_out };

enum class NoiseKind { white, pink };
/// "white", "pink"
inline const char* to_string(NoiseKind kind) { return kind == NoiseKind::white ? "white" : "pink"; }

/// Masking noise in the participant's headphones during trials, against the sound of the device.
/// Loudness is set at the amplifier.
struct MaskingNoise {
  NoiseKind kind = NoiseKind::pink;
  double level_db = -24;  ///< root mean square, dB re full scale (an amplitude of 1)
};

/// Short tones in the participant's headphones.
struct Sounds {
  bool ready = false, go = false, feedback = false;
  double level_db = -24;      ///< root mean square, dB re full scale
  bool lag_accepted = false;  ///< a lag that people may notice does not refuse a session
};

struct StimulusSpec {
  std::string name;            ///< unique within the protocol; in a cell: data/base/cell_name.h
  stimuli::ObjectSpec object;  ///< material already resolved against the protocol's default
  std::size_t place = 0;       ///< in the protocol's list; in a cell: of the plain stimulus
  std::optional<SeenSpec> seen = std::nullopt;    ///< none: nothing is seen of it
  bool felt = true;                               ///< false: it is seen and gives no force
  std::optional<SoundSpec> sound = std::nullopt;  ///< of its contacts; none: they are silent
};

class OrderRule;
/// Each block by itself.
const OrderRule& order_of_blocks();

struct Protocol {
  int version = 1;
  std::string name, title, description;
  std::vector<RendererKind> renderers;
  RendererOrder renderer_order = RendererOrder::counterbalanced;
  std::vector<StimulusSpec> stimuli;
  int repetitions = 1;  ///< of each stimulus, for each renderer
  struct Order {
    OrderKind kind = OrderKind::random;
    std::optional<int> max_run;  ///< at most so many equal stimuli in a row within a block
    std::optional<int>
        min_distance;  ///< equal stimuli at least so many trials apart (1: adjacent is allowed)
  } order;
  int blocks_per_renderer = 1;
  OrientationKind orientation = OrientationKind::uniform;
  std::vector<Quat> orientations;  ///< when listed
  struct Practice {
    int repetitions = 0;
    std::optional<double> criterion;  ///< proportion correct that ends practice
    int max_rounds = 1;
  } practice;
  struct Sessions {
    int count = 1;
    std::optional<double> max_minutes;
    int warm_up_trials = 0;
  } sessions;
  struct Breaks {
    std::optional<int> every_trials;
    double min_seconds = 0;
  } breaks;
  struct Response {
    std::map<std::string, std::string> keys;    ///< key -> stimulus name
    std::map<std::string, std::string> labels;  ///< stimulus name -> what is read instead of it
  } response;
  struct Stylus {
    double length = 0.12;  ///< m
    double grip = 0.06;    ///< m, from the tip
  } stylus;
  struct Workspace {
    Vec3 centre{0, 0, 0};  ///< m, in the device's frame: where the stimuli's origin stands
    double scale = 1;      ///< virtual metres per device metre
  } workspace;
  ToolSpec tool;                   ///< on the virtual stylus
  std::optional<ReachSpec> reach;  ///< the virtual stylus is longer than the real one
  Vec3 gravity{0, 0, 0};           ///< m/s^2, on stimuli that move or give
  stimuli::Material material;
  double servo_rate = 1000;           ///< Hz
  bool passivity_controller = false;  ///< dissipates the energy that sampling would generate
  MaterialLimit material_limit = MaterialLimit::refuse;
  bool materials_vary = true;  ///< with levels on record, which a limit would change
  TorqueRule torque = TorqueRule::required;
  struct Home {
    double rest = 0.5;       ///< s
    double margin = 0.01;    ///< m outside the bounding spheres
    bool beyond_all = true;  ///< of all stimuli, in each trial; false: of the trial's own
  } home;
  struct Texts {
    std::string instructions, practice, break_text, end;
    // Shown in every trial.
    std::string move_away = "Take the stylus away from the middle.";
    std::string ready = "Ready: hold it still.";
    std::string go = "Go";
    std::string wait = "Please wait.";
    std::string other_key = "This key does nothing now.";
    // Version 2.
    std::string next_interval = "Space bar: on to the next.";
    std::string answer_now = "Your answer?";
    std::string type_number = "Type a number, then Enter.";
    std::string agree = "I agree";
    std::string disagree = "I do not agree";
    std::string other_number = "Please type another number:";  ///< the range follows
    std::string answer_first = "Please type an answer first.";
    std::string go_home = "Go back to the start.";
  } texts;
  std::optional<MaskingNoise> masking_noise;
  std::optional<Sounds> sounds;  ///< version 2
  /// Version 2: other inputs that stand for a key of the keyboard. "escape" is the emergency.
  struct Responses {
    std::map<std::string, std::string> joystick;  ///< "button 1", "axis 1 +", "hat 1 up" -> key
    std::map<std::string, std::string> box;       ///< of a serial response box: byte -> key
  } responses;
  bool samples = false;
  std::uint64_t seed = 0;

  std::vector<TaskBlock> blocks;                     ///< version 1: the study of shapes alone
  const OrderRule* order_rule = &order_of_blocks();  ///< session_plan.h
  std::vector<std::string> stimulus_texts;           ///< JSON of each stimulus, for its levels
  // Version 2; empty in version 1.
  bool blocks_counterbalanced = false;  ///< within a session; practice stays before its block
  std::vector<PageSpec> pages;
  std::vector<Factor> factors;     ///< crossed by blocks; each cell has its own stimuli
  GroupAssignment groups;          ///< of participants
  std::optional<ViewSpec> view;    ///< where the picture and the eyes are
  std::optional<CuesSpec> cues;    ///< blocks of a study of seen and felt cues
  std::vector<std::string> tests;  ///< effects of the confirmatory family; empty: all
  /// The protocol of each group, with what differs for it (groups.h). Empty: there are no groups,
  /// or this is a group's own.
  std::vector<std::shared_ptr<const Protocol>> group_protocols;

  std::string language;     ///< of a translation of its texts; "": not translated
  std::string translation;  ///< the file of the translation, byte for byte

  std::string source_text;  ///< the file as it was read, byte for byte
  std::string sha256;       ///< of source_text, lower-case hexadecimal
};

/// The text shown for a stimulus: its label, else its name. Responses are stored by name.
inline const std::string& answer_label(const Protocol& protocol, const std::string& stimulus) {
  const auto label = protocol.response.labels.find(stimulus);
  return label != protocol.response.labels.end() ? label->second : stimulus;
}

}  // namespace palpate::protocols
