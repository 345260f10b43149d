#pragma once
// The displays of a live session: the participant's screen, which gives no cue to the shape, and
// the experimenter's console. Each exists as a window and as plain text. All functions are called
// from the session's thread and never wait for the display; keys are time-stamped on arrival.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rendering/tool.h"
#include "runner/display/scene/scene_drawing.h"
#include "runner/servo/servo.h"
#include "stimuli/shapes.h"

namespace palpate::runner::display {

/// Source of the moments that a window shows. All functions are called by the display's thread,
/// return at once and never make a servo wait.
class TouchSource {
 public:
  virtual ~TouchSource() = default;
  /// True: a hand touches the scene now. False: a recorded path is replayed.
  virtual bool live() const = 0;
  /// Appends the moments since the last call, in order; at most the last minute.
  virtual void take(std::vector<SceneMoment>& out) = 0;
  /// Holds or releases the scene. While held it renders no force and does not change.
  virtual void hold(bool held) = 0;
  /// Advances a held scene by this many ticks, without force on the hand. A recorded path ignores
  /// it.
  virtual void step(int /*ticks*/) {}
  /// Distance of the stylus from its position when the scene was held, m. The scene resumes once it
  /// is small.
  virtual double away() const { return 0; }
  /// Restarts with these objects: the same shapes of other materials.
  virtual void show(const std::vector<stimuli::ObjectSpec>& objects) = 0;
  /// Pulls an object that moves, until the next call. A recorded path ignores it.
  virtual void pull(const rendering::BodyPull& /*by*/) noexcept {}
  /// Commands zero force at once and until clear_fault().
  virtual void emergency_zero() noexcept = 0;
  virtual void clear_fault() noexcept = 0;
  /// The reason why the scene cannot be touched; empty: it can.
  virtual std::string trouble() const = 0;
};

struct ConsoleCommand {
  enum class Kind {
    pause,             ///< before the next trial
    resume,            ///< continues after a pause or a cleared fault
    repeat_trial,      ///< cuts off the current trial and shows it again
    stop_after_trial,  ///< the session ends; it can be resumed
    stop_after_block,
    emergency_zero,  ///< zero force at once and until clear_fault
    clear_fault,
    note,     ///< free text with a time stamp
    quit,     ///< ends the session at once and cuts off the current trial
    answer,   ///< the participant's answer, typed by the experimenter; text "": on to the next
    correct,  ///< an answer of a page; text: page, question and new answer, spaces between them
  };
  Kind kind = Kind::note;
  /// Of note, quit and answer; for emergency_zero its source, "the key F12".
  std::string text;
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
  /// Commands that the experimenter may give now, each with its meaning in this step.
  std::vector<std::pair<ConsoleCommand::Kind, std::string>> choices;
};

/// A movement from home to a target, on the participant's screen. Virtual world, m.
struct ReachPicture {
  Vec3 home, target, tip;
  double home_radius = 0, target_radius = 0;
  double extent = 0;  ///< from home to the edge of the picture
  int up = 1;         ///< the axis that points up; x points to the right
};

/// A page on the participant's screen.
struct Page {
  enum class Kind {
    text,       ///< a text to read; the space bar continues; several screens if long
    neutral,    ///< a trial: a word and the answer keys, the same for every shape
    feedback,   ///< tells whether the answer was correct
    message,    ///< paused, over, or a fault; no key is expected
    checklist,  ///< before the first trial
  };
  Kind kind = Kind::message;
  std::string text;                                       ///< UTF-8
  std::vector<std::pair<std::string, std::string>> keys;  ///< key and its answer, in order
  bool go = false;                                        ///< forces are on
  std::string reply;                                      ///< reply to a key without a meaning
  int done = 0, trials = 0;                               ///< progress bar; trials 0: none
  int seconds_left = 0;                                   ///< count-down; 0: none
  Checklist checklist;
  /// While an answer is typed, keys arrive as the characters that they write.
  enum class Typing { none, number, text } typing = Typing::none;
  std::string typed;        ///< so far
  std::string chosen{};     ///< the key of the answer given before; empty: none
  bool back = false;        ///< a key goes back to the question before
  bool wheel = false;       ///< turns of the wheel arrive as keys
  int part = 0, parts = 0;  ///< place in a text of several pages, from 1; 0: a single page
  std::shared_ptr<const std::string> picture{};  ///< a PNG file's bytes, above the text, or null
  /// Below the text; the target is shown with `go`. None: nothing to reach.
  std::optional<ReachPicture> reach{};
};

struct SeenTrial;

/// A frame of what is seen. Session clock.
struct SeenFrame {
  std::int64_t swap_ns = 0;   ///< after the driver had drawn it
  std::int64_t pose_ns = 0;   ///< of the tick whose pose is drawn
  std::int64_t delay_ns = 0;  ///< intended, between both
};

struct KeyPress {
  /// As in the protocol: "1", "a", "space", "escape", "wheel up"; the numeric pad as digits. While
  /// an answer is typed: the character in UTF-8.
  std::string key;
  std::int64_t time_ns = 0;  ///< session clock, on arrival
};

class ParticipantScreen {
 public:
  virtual ~ParticipantScreen() = default;
  virtual void show(const Page& page) = 0;
  /// From now on draws this behind the pages; null: nothing. A screen of text draws nothing.
  virtual void see(const std::shared_ptr<const SeenTrial>& /*trial*/) {}
  /// Passes a tick of the trial that is seen.
  virtual void follow(const servo::Sample& /*sample*/) {}
  /// The frames since the last call.
  virtual std::vector<SeenFrame> frames() { return {}; }
  /// Keys pressed since the last call, in order of arrival.
  virtual std::vector<KeyPress> keys() = 0;
  /// False once the user has closed it or its display was lost.
  virtual bool open() const = 0;
  /// False until the window manager has had time to show it.
  virtual bool settled() const { return true; }
  /// The reason why the participant may not see it; empty: it is in its place.
  virtual std::string misplaced() const { return {}; }
  /// Problem of an additional input device, in words; empty: none.
  virtual std::string trouble() const { return {}; }
};

/// How often a stimulus was answered correctly.
struct ShapeScore {
  std::string shape;
  int right = 0, shown = 0;  ///< of trials with a right answer
  int answered = 0;          ///< of all trials
};

/// An answer to a question of a page that the experimenter may correct.
struct GivenAnswer {
  std::string page, question;  ///< names
  std::string answer;
};

/// State shown to the experimenter, updated about 30 times a second.
struct ConsoleState {
  std::string study, participant, state;  ///< state: a word or two, "trial", "rest", "paused"
  std::string shape, renderer;            ///< of the current trial
  std::string stop_plan;                  ///< "after this trial" when a stop was requested
  std::string held_by;                    ///< why the session waits and how to continue; else empty
  std::string fault;                      ///< reason why forces are off; empty: see sample.faults
  std::string answer;                     ///< the last answer, and whether it was correct
  bool practice = false;                  ///< the current trial does not count
  std::vector<ShapeScore> scores;         ///< practice excluded, in the protocol's order
  int seconds_left = 0;                   ///< s left of a break
  Checklist checklist;                    ///< has steps before the first trial only
  int session = 0, block = 0, blocks = 0, trial = 0, trials = 0;
  double elapsed = 0;                       ///< s, of this session
  double remaining = 0;                     ///< s, estimated, without breaks; 0 while unknown
  std::vector<double> times;                ///< s, identification times so far, in order
  std::vector<std::string> messages;        ///< newest last: faults, notes, actions
  std::size_t older_messages = 0;           ///< number of messages dropped before these
  servo::Sample sample;                     ///< the servo's newest
  std::vector<rendering::BodyPose> bodies;  ///< last known poses of the objects that move
  std::shared_ptr<const std::vector<stimuli::ObjectSpec>>
      objects;                                ///< objects of the current trial, virtual frame
  rendering::Tool tool;                       ///< carried by the stylus; empty: none
  std::uint64_t ticks = 0, missed_ticks = 0;  ///< of this session
  std::int64_t longest_period_ns = 0;
  /// W, that fields which depend on velocity put into the hand; none: there are no such fields.
  std::optional<double> field_power;
  // Version 2 of protocols:
  std::string task;                 ///< "compare", ...; empty: no interval is announced
  int interval = 0, intervals = 0;  ///< number within the trial, and their count
  std::string level;                ///< level presented now, as text; empty: none
  std::string level_name;           ///< what varies: "stiffness"; empty: nothing
  bool counts_right = true;         ///< the task has right answers
  bool about = false;               ///< `trials` is expected, as answers decide
  bool pauses = false;              ///< a pause follows this trial
  bool takes_answers = false;       ///< the experimenter types the participant's answers
  std::vector<GivenAnswer> given;   ///< in this session, of pages
};

class ExperimenterConsole {
 public:
  virtual ~ExperimenterConsole() = default;
  virtual void show(const ConsoleState& state) = 0;
  virtual std::vector<ConsoleCommand> commands() = 0;
  /// The button or text that gives a command, in quotes: "':go'", "'Go on'".
  virtual std::string name_of(ConsoleCommand::Kind kind) const = 0;
  /// A note of where the experimenter has put the windows, to place those of the next session.
  /// Empty: they were not moved, or there are none.
  virtual std::string places() const { return {}; }
};

}  // namespace palpate::runner::display
