#pragma once
// The design of an experiment as plain values. Meaning and default of each key:
// protocol.schema.json. SI units.

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "protocols/tasks/task_block.h"
#include "stimuli/shapes.h"

namespace palpate::protocols {

// What a scene or protocol says besides its objects: the tool on the stylus and the extended probe
// (the keys: scene.schema.json). SI units.

/// One straight piece of a tool, in the frame of the stylus: origin at its tip, +z from tip to
/// tail. m, of a length above 0.
struct ToolSegmentSpec {
  Vec3 from, to;
};

/// What the stylus carries; without segments the plain stylus from tip to tail.
struct ToolSpec {
  static constexpr std::size_t kMostSegments = 16;
  std::vector<ToolSegmentSpec> segments;
  double radius = 0;  ///< m, on soft objects; 0: kSoftRadius. Rigid ones are touched by lines
};

/// m, of a tool or stylus on soft objects that gives none: a line without thickness would sink into
/// an elastic solid without end.
inline constexpr double kSoftRadius = 0.002;

/// The extended probe: the virtual stylus is the real one stretched by `factor` about a pivot.
struct ReachSpec {
  enum class Pivot {
    grip,   ///< the point of the stylus that the hand holds
    tail,   ///< the stylus's end
    point,  ///< a point that stands still in the world
  };
  double factor = 1;
  Pivot pivot = Pivot::grip;
  Vec3 point{0, 0, 0};  ///< m, world frame, of Pivot::point
};

/// A scene file as plain values.
struct SceneSpec {
  std::vector<stimuli::ObjectSpec> objects;
  ToolSpec tool;
  std::optional<ReachSpec> reach;
  Vec3 gravity{0, 0, 0};  ///< m/s^2, on what moves
};

enum class RendererKind { point, ray };
const char* to_string(RendererKind kind);  ///< "point", "ray"

enum class RendererOrder { fixed, counterbalanced, interleaved };
enum class OrderKind { random, sequential };
enum class OrientationKind { uniform, fixed, listed };
/// What is done about a material that the device cannot render passively: refuse the session, or
/// limit the stiffness.
enum class MaterialLimit { refuse, limit };
/// What becomes of torque on a device that drives force alone.
enum class TorqueRule { required, left_out };

enum class NoiseKind { white, pink };
const char* to_string(NoiseKind kind);  ///< "white", "pink"

/// Masking noise in the participant's headphones during trials, against the sound of the device.
/// Loudness is set at the amplifier.
struct MaskingNoise {
  NoiseKind kind = NoiseKind::pink;
  double level_db = -24;  ///< root mean square, dB re full scale (an amplitude of 1)
};

/// Short tones in the participant's headphones.
struct Sounds {
  bool ready = false, go = false, feedback = false;
  double level_db = -24;  ///< root mean square, dB re full scale
};

struct StimulusSpec {
  std::string name;            ///< unique within the protocol
  stimuli::ObjectSpec object;  ///< material already resolved against the protocol's default
};

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
    double time_out = 60;                       ///< s
    bool feedback = false;
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
  TorqueRule torque = TorqueRule::required;
  struct Home {
    double rest = 0.5;     ///< s
    double margin = 0.01;  ///< m outside the bounding spheres
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
  } texts;
  std::optional<MaskingNoise> masking_noise;
  std::optional<Sounds> sounds;  ///< version 2
  /// Version 2: what stands for a key of the keyboard. "escape" is the emergency.
  struct Responses {
    std::map<std::string, std::string> joystick;  ///< "button 1", "axis 1 +", "hat 1 up" -> key
    std::map<std::string, std::string> box;       ///< of a serial response box: byte -> key
  } responses;
  bool samples = false;
  std::uint64_t seed = 0;

  // Version 2; empty in version 1.
  std::vector<TaskBlock> blocks;
  bool blocks_counterbalanced = false;  ///< within a session; practice stays before its block
  std::vector<PageSpec> pages;
  std::vector<std::string> stimulus_texts;  ///< JSON of each stimulus, for its levels

  std::string language;     ///< of a translation of its texts; "": as it is written
  std::string translation;  ///< the file of that, byte for byte

  std::string source_text;  ///< the file as it was read, byte for byte
  std::string sha256;       ///< of source_text, lower-case hexadecimal
};

/// What the participant reads for a stimulus: its label, else its name. Responses are stored by
/// name.
const std::string& answer_label(const Protocol& protocol, const std::string& stimulus);

}  // namespace palpate::protocols
