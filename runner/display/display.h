#pragma once
// What a live session shows and hears: the participant's screen, which gives no cue to the shape,
// and the experimenter's console. Each exists as a window and as plain text. All functions are
// called from the session's thread and never wait for the display; keys are stamped on arrival.

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "runner/servo/servo.h"
#include "stimuli/object_spec.h"

namespace palpate::runner {

struct ConsoleCommand {
  enum class Kind {
    pause,             ///< before the next trial
    go_on,             ///< after a pause or a fault that was cleared
    repeat_trial,      ///< cuts the trial under way off and shows it again
    stop_after_trial,  ///< the session ends; it can be resumed
    stop_after_block,
    emergency_zero,  ///< zero force at once and until clear_fault
    clear_fault,
    note,  ///< free text with a time stamp
    quit,  ///< ends at once: the trial under way is cut off
  };
  Kind kind = Kind::note;
  std::string text;          ///< of emergency_zero: what asked for it, "the key F12"
  std::int64_t time_ns = 0;  ///< session clock, on arrival
};

/// What is gone through before the first trial, shown to both.
struct Checklist {
  struct Step {
    enum class State { to_do, now, done, left_out };
    std::string words;
    State state = State::to_do;
  };
  std::vector<Step> steps;
  std::string instruction;  ///< of the step that is due
  /// What the experimenter may command, and what it means here.
  std::vector<std::pair<ConsoleCommand::Kind, std::string>> choices;
};

/// What the participant sees.
struct Page {
  enum class Kind {
    text,       ///< read, then go on with the space bar; as many screens as it takes
    neutral,    ///< a trial: a word and the key map, the same whatever the shape
    feedback,   ///< whether the answer was right
    message,    ///< paused, over, or a fault: nothing to press
    checklist,  ///< before the first trial
  };
  Kind kind = Kind::message;
  std::string text;                                       ///< UTF-8
  std::vector<std::pair<std::string, std::string>> keys;  ///< key and what it answers, in order
  bool go = false;                                        ///< forces are on
  std::string reply;                                      ///< to a key that did nothing
  int done = 0, trials = 0;                               ///< a bar; no trials: none
  int seconds_left = 0;                                   ///< counted down; 0: nothing is
  Checklist checklist;
};

struct KeyPress {
  std::string key;           ///< as in the protocol: "1", "a", "space", "escape"; keypad as digits
  std::int64_t time_ns = 0;  ///< session clock, on arrival
};

class ParticipantScreen {
 public:
  virtual ~ParticipantScreen() = default;
  virtual void show(const Page& page) = 0;
  /// Pressed since the last call, in order of arrival.
  virtual std::vector<KeyPress> keys() = 0;
  /// False once it was closed by hand or its display died.
  virtual bool open() const = 0;
};

/// How often a shape was told right.
struct ShapeScore {
  std::string shape;
  int right = 0, shown = 0;
};

/// What the experimenter sees; a new one about 30 times a second.
struct ConsoleState {
  std::string study, participant, state;   ///< state: a word or two, "trial", "rest", "paused"
  std::string shape, renderer, stop_plan;  ///< of the trial under way; what a stop was asked for
  std::string held_by;    ///< while nothing goes on: why, and what to press or type; else empty
  std::string fault;      ///< why forces are off; empty: the sample tells
  std::string answer;     ///< the last one, and whether it was right
  bool practice = false;  ///< the trial under way does not count
  std::vector<ShapeScore> scores;  ///< of what counts, in the protocol's order
  int seconds_left = 0;            ///< of a break
  Checklist checklist;             ///< before the first trial; else without steps
  int session = 0, block = 0, blocks = 0, trial = 0, trials = 0;
  double elapsed = 0;                 ///< s, of this session
  double remaining = 0;               ///< s, estimated, without breaks; 0 while unknown
  std::vector<double> times;          ///< s, identification times so far, in order
  std::vector<std::string> messages;  ///< newest last: faults, notes, what was done
  std::size_t older_messages = 0;     ///< that were left out before the first
  Sample sample;                      ///< the servo's newest
  std::shared_ptr<const std::vector<stimuli::ObjectSpec>>
      objects;                                ///< of the trial under way, virtual frame
  std::uint64_t ticks = 0, missed_ticks = 0;  ///< of this session
  std::int64_t longest_period_ns = 0;
};

class ExperimenterConsole {
 public:
  virtual ~ExperimenterConsole() = default;
  virtual void show(const ConsoleState& state) = 0;
  virtual std::vector<ConsoleCommand> commands() = 0;
  /// What to press or type for it, in quotes: "':go'", "'Go on'".
  virtual std::string name_of(ConsoleCommand::Kind kind) const = 0;
};

}  // namespace palpate::runner
