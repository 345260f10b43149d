#pragma once
// The displays of a live session: the participant's screen, which gives no cue to the shape, and
// the experimenter's console. Each exists as a window and as plain text. All functions are called
// from the session's thread and never wait for the display; keys are time-stamped on arrival.

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "rendering/tool.h"
#include "runner/display/scene/scene_drawing.h"
#include "runner/servo/servo.h"
#include "stimuli/shapes.h"

namespace palpate::runner {

// Where the moments come from that a window shows.

/// All functions are called by the display's thread, return at once and never make a servo wait.
class TouchSource {
 public:
  virtual ~TouchSource() = default;
  /// Whether a hand touches the scene now; else a path is shown that was recorded.
  virtual bool live() const = 0;
  /// Appends what has happened since the last call, in order; of a long time the last minute.
  virtual void take(std::vector<SceneMoment>& out) = 0;
  /// While it is held nothing is felt and nothing happens; then it goes on from where it stood.
  virtual void hold(bool held) = 0;
  /// So many ticks more while it is held, without force on the hand. Of a recorded path none.
  virtual void step(int /*ticks*/) {}
  /// m, that the stylus is away from where it was when it was held: it goes on once that is small.
  virtual double away() const { return 0; }
  /// Touches these from now on, from the beginning: the same shapes, of other materials.
  virtual void show(const std::vector<stimuli::ObjectSpec>& objects) = 0;
  /// Draws an object that moves, until the next call; where nothing is live, nothing happens.
  virtual void pull(const rendering::BodyPull& /*by*/) noexcept {}
  /// Zero force at once and until clear_fault().
  virtual void emergency_zero() noexcept = 0;
  virtual void clear_fault() noexcept = 0;
  /// Why the scene could not be touched, empty: it can.
  virtual std::string trouble() const = 0;
};

struct ConsoleCommand {
  enum class Kind {
    pause,             ///< before the next trial
    go_on,             ///< after a pause or a fault that was cleared
    repeat_trial,      ///< cuts off the current trial and shows it again
    stop_after_trial,  ///< the session ends; it can be resumed
    stop_after_block,
    emergency_zero,  ///< zero force at once and until clear_fault
    clear_fault,
    note,    ///< free text with a time stamp
    quit,    ///< ends at once: the current trial is cut off
    answer,  ///< the participant's, typed for them; text "": on to the next
  };
  Kind kind = Kind::note;
  std::string text;  ///< of note, quit and answer; of emergency_zero: the source, "the key F12"
  std::int64_t time_ns = 0;  ///< session clock, on arrival
};

/// The steps before the first trial, shown on both displays.
struct Checklist {
  struct Step {
    enum class State { to_do, now, done, left_out };
    std::string words;
    State state = State::to_do;
  };
  std::vector<Step> steps;
  std::string instruction;  ///< of the current step
  /// Commands that the experimenter may give now, and what they mean in this step.
  std::vector<std::pair<ConsoleCommand::Kind, std::string>> choices;
};

/// What the participant sees.
struct Page {
  enum class Kind {
    text,       ///< to read, goes on with the space bar; on several screens if long
    neutral,    ///< a trial: a word and the answer keys, the same for every shape
    feedback,   ///< whether the answer was correct
    message,    ///< paused, over, or a fault: no key to press
    checklist,  ///< before the first trial
  };
  Kind kind = Kind::message;
  std::string text;                                       ///< UTF-8
  std::vector<std::pair<std::string, std::string>> keys;  ///< key and its answer, in order
  bool go = false;                                        ///< forces are on
  std::string reply;                                      ///< to a key without a meaning
  int done = 0, trials = 0;                               ///< progress bar; trials 0: none
  int seconds_left = 0;                                   ///< count-down; 0: none
  Checklist checklist;
  /// An answer that is being typed: keys come as the characters that they write.
  enum class Typing { none, number, text } typing = Typing::none;
  std::string typed;                             ///< so far
  bool wheel = false;                            ///< turns of the wheel come as keys
  int part = 0, parts = 0;                       ///< of a text on several pages, from 1; 0: alone
  std::shared_ptr<const std::string> picture{};  ///< bytes of a PNG file, above the text; or none
};

struct KeyPress {
  /// As in the protocol: "1", "a", "space", "escape", "wheel up"; keypad as digits. Where an answer
  /// is typed, the character in UTF-8.
  std::string key;
  std::int64_t time_ns = 0;  ///< session clock, on arrival
};

class ParticipantScreen {
 public:
  virtual ~ParticipantScreen() = default;
  virtual void show(const Page& page) = 0;
  /// Pressed since the last call, in order of arrival.
  virtual std::vector<KeyPress> keys() = 0;
  /// False once it was closed by the user or its display was lost.
  virtual bool open() const = 0;
  /// What is wrong with an input beside it, in words; empty: nothing.
  virtual std::string trouble() const { return {}; }
};

/// How often a shape was identified correctly.
struct ShapeScore {
  std::string shape;
  int right = 0, shown = 0;
};

/// What the experimenter sees; a new one about 30 times a second.
struct ConsoleState {
  std::string study, participant, state;  ///< state: a word or two, "trial", "rest", "paused"
  std::string shape, renderer;            ///< of the current trial
  std::string stop_plan;                  ///< "after this trial" when a stop was requested
  std::string held_by;             ///< why the session waits, and what to press or type; else empty
  std::string fault;               ///< why forces are off; empty: see sample.faults
  std::string answer;              ///< the last one, and whether it was correct
  bool practice = false;           ///< the current trial does not count
  std::vector<ShapeScore> scores;  ///< without practice, in the protocol's order
  int seconds_left = 0;            ///< of a break
  Checklist checklist;             ///< before the first trial; else without steps
  int session = 0, block = 0, blocks = 0, trial = 0, trials = 0;
  double elapsed = 0;                       ///< s, of this session
  double remaining = 0;                     ///< s, estimated, without breaks; 0 while unknown
  std::vector<double> times;                ///< s, identification times so far, in order
  std::vector<std::string> messages;        ///< newest last: faults, notes, actions
  std::size_t older_messages = 0;           ///< dropped before the first
  Sample sample;                            ///< the servo's newest
  std::vector<rendering::BodyPose> bodies;  ///< of what moves, where the session has seen it last
  std::shared_ptr<const std::vector<stimuli::ObjectSpec>>
      objects;                                ///< of the current trial, virtual frame
  rendering::Tool tool;                       ///< that the stylus carries; empty: none
  std::uint64_t ticks = 0, missed_ticks = 0;  ///< of this session
  std::int64_t longest_period_ns = 0;
  // Version 2 of protocols:
  std::string task;                 ///< "compare", ...; empty: version 1
  int interval = 0, intervals = 0;  ///< of the trial
  std::string level;                ///< that is felt now, as text; empty: none
  bool takes_answers = false;       ///< the experimenter types the participant's answers
};

class ExperimenterConsole {
 public:
  virtual ~ExperimenterConsole() = default;
  virtual void show(const ConsoleState& state) = 0;
  virtual std::vector<ConsoleCommand> commands() = 0;
  /// What to press or type for a command, in quotes: "':go'", "'Go on'".
  virtual std::string name_of(ConsoleCommand::Kind kind) const = 0;
  /// Where the experimenter has put the windows in this session, as a note that the next one's are
  /// placed by; empty: they stand where they were shown, or there are none.
  virtual std::string places() const { return {}; }
};

}  // namespace palpate::runner
