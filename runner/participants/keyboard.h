#pragma once
// A human participant, who answers with keys (digit row or numeric pad) or buttons of the device.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocols/protocol.h"
#include "runner/display/display.h"
#include "runner/participants/respondent.h"

namespace palpate::runner::participants {

/// Work to be done while waiting for the participant: device, console, markers.
class Attendant {
 public:
  virtual ~Attendant() = default;
  /// Called at every tick of a trial and every 5 ms between trials. An exception ends the wait.
  virtual void attend() = 0;
  /// Plays a sound to the participant, if sounds are on.
  virtual void sound(SoundCue /*cue*/) {}
};

enum class AnswerBy {
  keys,          ///< the protocol's
  buttons,       ///< of the device: button n stands for the n-th key of the protocol
  experimenter,  ///< types the participant's spoken answers; the participant's keys only continue
};

/// The answer that is stored if `typed` answers a question: a number within its range, a choice by
/// its name or as it is shown, any text. none: it does not.
std::optional<std::string> accepted_answer(const protocols::PageItem& item,
                                           const std::string& typed);

class KeyboardRespondent final : public Respondent {
 public:
  /// All arguments must outlive it. \param clock  the clock that time-stamps keys
  KeyboardRespondent(const protocols::Protocol& protocol, display::ParticipantScreen& screen,
                     Attendant& attendant, servo::Clock& clock, AnswerBy by);

  void read(const std::string& text) override;
  void read_screens(const std::vector<ReadScreen>& screens) override;
  void rest(const std::string& text, std::int64_t until_ns) override;
  void feedback(bool correct) override;
  void begin_trial(const protocols::Trial& trial) override;
  void begin_interval(const protocols::Trial& trial, const IntervalView& view) override;
  std::optional<Answer> step(const servo::Sample& sample) override;
  std::vector<data::FrameRecord> frames() override;
  std::optional<Answer> confidence(const protocols::ConfidenceSpec& asked) override;
  std::optional<std::string> ask(const protocols::PageSpec& page, const protocols::PageItem& item,
                                 const Asking& how) override;

  /// Takes the participant's spoken answer: a key, its label or a number; "": on to the next.
  /// \return  false: not expected now, a number is out of range, or forces are not on
  bool spoken(const std::string& answer, std::int64_t time_ns);
  /// Call it between trials if the device's buttons answer: button n stands for the n-th key of a
  /// page; without keys any button continues. \param newest  sample of the servo
  void look_at_buttons(const servo::Sample& newest);
  /// Shows a page without answer keys.
  void show_message(const std::string& text);
  /// Call it repeatedly while such a page is shown: replies to keys.
  void tend();
  /// Progress of this session, shown on the pages between trials.
  void set_progress(std::size_t done, std::size_t trials);
  /// s left of a break; 0: no break
  int seconds_left() const { return page_.seconds_left; }

 private:
  enum class Cue { none, move_away, go_home, ready, go };
  display::Page between_trials(display::Page::Kind kind, const std::string& text) const;
  void show(display::Page page);
  void see(const protocols::Trial& trial, const protocols::Interval* interval);
  void show_cue(const servo::Sample& sample);
  void show_way(const servo::Sample& sample);
  void reply();
  void end_reply();
  void wait_until(std::int64_t when_ns);
  void wait_for_space(std::int64_t since_ns);
  void listen(const servo::Sample& sample);
  using Keys = std::vector<std::pair<std::string, std::string>>;
  std::string interval_text() const;
  /// \return the answer, if the key ends the interval
  std::optional<Answer> meaning_in_interval(const std::string& key);
  void listen_to_buttons(unsigned pressed, std::int64_t time_ns);
  std::vector<display::KeyPress> take_keys();      ///< pressed, or typed by the experimenter
  bool listen_to(const display::KeyPress& press);  ///< false: to be handled after a turn
  std::optional<Answer> typed_answer(const std::string& key);
  bool type(const std::string& key);  ///< false: the key does not type
  void reply_with(const std::string& text);
  void refuse_number(std::optional<double> least, std::optional<double> most);
  /// \param whole_bursts  drop also the rest of a number whose first digits came too early
  display::KeyPress wait_for_key(std::int64_t since_ns, bool whole_bursts = false);
  /// Whether more digits follow a digit at once: a number typed ahead of its question. Drops them.
  bool number_begins(const display::KeyPress& digit);
  display::Page question_page(const protocols::PageItem& item, display::Page::Kind kind,
                              const Asking& how) const;
  /// \return  index into keys, which are shown with the last screen; -1: continued without an
  /// answer
  int page_through(const std::vector<ReadScreen>& screens, const Keys& keys,
                   display::Page::Kind kind, std::int64_t& time_ns);
  std::optional<std::string> ask_typed(const protocols::PageItem& item, const Asking& how);
  std::optional<std::string> ask_choice(const protocols::PageItem& item, const Asking& how);

  const protocols::Protocol& protocol_;
  display::ParticipantScreen& screen_;
  Attendant& attendant_;
  servo::Clock& clock_;
  AnswerBy by_;
  std::vector<std::pair<std::string, std::string>> keys_;  ///< as displayed
  /// Keys of the answers that the trial expects, in the order of the buttons, and what they give.
  std::vector<std::pair<std::string, int>> answers_;
  display::Page page_;  ///< displayed now
  int done_ = 0, trials_ = 0;
  std::int64_t reply_until_ns_ = 0;  ///< 0: no reply is shown
  Cue cue_ = Cue::none;
  std::int64_t cue_since_ns_ = 0;
  std::int64_t onset_ns_ = 0;      ///< of the trial; 0: not yet
  std::uint8_t buttons_ = 0xFF;    ///< down at the last tick
  std::optional<Answer> pending_;  ///< given; waits until the servo's samples reach its time
  const protocols::TaskBlock* block_ = nullptr;  ///< of the trial
  IntervalView view_;
  bool sees_ = false;              ///< something of the interval is seen
  std::int64_t way_shown_ns_ = 0;  ///< of a movement's picture
  bool early_ = false;             ///< a trial or interval is prepared but cannot be answered yet
  std::optional<double> least_, most_;     ///< range of the number being typed
  std::vector<display::KeyPress> spoken_;  ///< spoken answers as keys, and keys not handled yet
};

}  // namespace palpate::runner::participants
