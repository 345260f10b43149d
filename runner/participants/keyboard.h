#pragma once
// A person who answers by keys (row or numeric pad) or by the buttons of the device.

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "protocols/protocol.h"
#include "runner/display/display.h"
#include "runner/participants/respondent.h"

namespace palpate::runner {

/// Looks after everything else while the participant is waited for.
class Attendant {
 public:
  virtual ~Attendant() = default;
  /// Called at every tick of a trial and every few milliseconds between trials. What it throws ends
  /// the wait.
  virtual void attend() = 0;
};

enum class AnswerBy {
  keys,     ///< the protocol's
  buttons,  ///< of the device: the first stands for the first of the protocol's keys, and so on
};

class KeyboardRespondent final : public Respondent {
 public:
  /// All must outlive it. \param clock  what keys are stamped with
  KeyboardRespondent(const protocols::Protocol& protocol, ParticipantScreen& screen,
                     Attendant& attendant, Clock& clock, AnswerBy by);

  void read(const std::string& text) override;
  void rest(const std::string& text, std::int64_t until_ns) override;
  void feedback(bool correct) override;
  void begin_trial(const protocols::Trial& trial) override;
  std::optional<Answer> step(const Sample& sample) override;

  /// A page with nothing to press.
  void show_message(const std::string& text);
  /// To be called again and again while such a page is shown: keys get their reply.
  void tend();
  /// Of this session, for the pages between trials.
  void set_progress(std::size_t done, std::size_t trials);
  /// s, of the break under way; 0: none is
  int seconds_left() const { return page_.seconds_left; }

 private:
  enum class Cue { none, move_away, ready, go };
  Page between_trials(Page::Kind kind, const std::string& text) const;
  void show(Page page);
  void show_cue(const Sample& sample);
  void reply();
  void end_reply();
  void wait_until(std::int64_t when_ns);
  void wait_for_space(std::int64_t since_ns);
  void listen(const Sample& sample);
  std::optional<int> meaning(const std::string& key) const;

  const protocols::Protocol& protocol_;
  ParticipantScreen& screen_;
  Attendant& attendant_;
  Clock& clock_;
  AnswerBy by_;
  std::vector<std::pair<std::string, std::string>> keys_;  ///< as shown
  std::vector<int> stimuli_;                               ///< of keys_, in order
  Page page_;                                              ///< on show
  int done_ = 0, trials_ = 0;
  std::int64_t reply_until_ns_ = 0;  ///< 0: there is none
  Cue cue_ = Cue::none;
  std::int64_t cue_since_ns_ = 0;
  std::int64_t onset_ns_ = 0;      ///< 0: not yet
  std::uint8_t buttons_ = 0xFF;    ///< down at the last tick
  std::optional<Answer> pending_;  ///< given until the servo's samples have come as far
};

}  // namespace palpate::runner
