#pragma once
// A recorded session that another program runs with the participant. The program starts trials,
// chooses their contents in external blocks, and reports answers. Plan, forces, samples and record
// are as in every session.

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "runner/serve/outlets.h"
#include "runner/serve/why_off.h"
#include "runner/session/live_forces.h"
#include "runner/session/session.h"
#include "runner/session/signals.h"
#include "runner/session/station.h"

namespace palpate::runner::serve {

/// The reason why a program cannot run this protocol, in words; empty: it can. Questions on pages,
/// confidence and adjustment need the displays of `palpate run`.
std::string unserved(const protocols::Protocol& protocol);

/// Call all functions in one thread, the session's, unless stated otherwise.
class ServedSession final : public participants::Respondent, public session::SessionEvents {
 public:
  /// The parts that it uses. All must outlive it.
  struct Parts {
    const session::Station& station;
    session::RunRecord& record;
    servo::ServoThread& servo;
    safety::GuardedDevice* guard;  ///< null without force feedback
    session::Markers& markers;
    std::function<int()> end_requested;
    const std::vector<data::TrialRecord>& stored;  ///< completed trials of the session
    PictureOf picture;
  };
  explicit ServedSession(const Parts& parts);

  /// The way it ended.
  struct Outcome {
    data::RunEnd end = data::RunEnd::done;
    std::string reason;  ///< empty when done
    bool failed = false;
  };
  /// Runs until the last trial is on record and the controller has left, or until a signal. Sends
  /// answers to `output` and takes commands from `commands`.
  Outcome run(ServeOutput& output, std::function<std::vector<ServeCommand>()> commands);

  /// Commands zero force at once, until `clear`. From any thread.
  void emergency_zero() noexcept { forces_.off(); }
  /// The same, until this client takes it back. From any thread. \return false: it had asked before
  bool emergency(std::uint64_t client);
  const Emergencies& emergencies() const noexcept { return emergencies_; }
  /// The same by the ramp, because the controller is silent. From any thread.
  void controller_is_silent() noexcept {
    silent_.store(true);
    forces_.fade();
  }
  /// Whether they are on, or a trial has been asked for in which they may come. From any thread.
  bool forces_may_come() const noexcept {
    return under_way_.load() || !parts_.servo.forces_are_off();
  }
  /// From any thread.
  std::uint32_t times_off() const noexcept { return forces_.times_off(); }
  /// Ticks, for the network's thread.
  TickStream& ticks() noexcept { return ticks_; }
  /// Members of the answer to hello. From any thread.
  nlohmann::json state() const;
  /// Members of the answer to `picture`. From any thread.
  std::string picture() const;

  // As Respondent:
  void read(const std::string& text) override;
  void rest(const std::string& text, std::int64_t until_ns) override;
  void feedback(bool correct) override;  ///< the sound; the reply to `answer` has it as well
  std::optional<protocols::TrialChoice> choose(const protocols::Trial& next) override;
  void begin_trial(const protocols::Trial& trial) override;
  void begin_interval(const protocols::Trial& trial,
                      const participants::IntervalView& view) override;
  std::optional<participants::Answer> step(const servo::Sample& sample) override;
  // As SessionEvents:
  void began(const protocols::Trial& trial) override { signals_.began(trial); }
  void onset(const data::TrialRecord& so_far) override;
  void first_contact(const data::TrialRecord& so_far, std::int64_t time_ns) override;
  void answered(const data::TrialRecord& record) override { signals_.answered(record); }
  void cut_off(const std::string& reason) override;
  void recorded(const data::TrialRecord& record) override;

 private:
  /// A message that awaits its reply.
  struct Asked {
    std::uint64_t client = 0;
    Message message;
  };
  Outcome run_trials();
  void wait_for_the_end();
  void attend();
  void obey(const Asked& asked);
  void start(const Asked& asked);
  void show_next(const Asked& asked);
  void answer(const Asked& asked);
  void clear(const Asked& asked);
  void left();
  std::optional<protocols::TrialChoice> choice_of(const Message& message,
                                                  const protocols::Trial& next) const;
  protocols::Interval interval_of(const Wanted& wanted, const std::string& place,
                                  const protocols::TaskBlock& block) const;
  participants::Answer answer_of(const Message& message) const;
  void begin_feeling(const servo::Sample& sample);
  nlohmann::ordered_json next_trial() const;
  void keep_state();
  void keep_under_way() noexcept { under_way_.store(start_.has_value() || in_trial_); }
  void draw(const protocols::Trial& trial);
  void held(const WhyOff& why);
  MessageRefused forces_off() const;
  void refuse(const std::optional<Asked>& asked, const std::string& code, const std::string& why);
  void tell(const std::string& name, std::int64_t t_ns,
            const nlohmann::ordered_json& more = nlohmann::ordered_json::object());

  const Parts parts_;
  servo::Clock& clock_;
  session::LiveForces forces_;
  std::string sound_trouble_;
  session::SessionSound sound_;
  session::TrialSignals signals_;
  session::Session session_;
  TickStream ticks_;
  ServeOutput* output_ = nullptr;
  std::function<std::vector<ServeCommand>()> source_;
  std::deque<ServeCommand> commands_;  ///< not obeyed yet
  // Of the current trial:
  bool in_trial_ = false;
  protocols::Trial trial_;
  std::optional<Asked> start_;   ///< waits for forces
  std::optional<Asked> answer_;  ///< waits until the trial is on record
  std::optional<Asked> stop_;    ///< waits for forces off
  std::optional<Asked> next_;    ///< waits for the next interval
  std::optional<participants::Answer> given_;
  participants::IntervalView view_;  ///< the current interval
  bool begun_ = false;               ///< its forces are on, or its question is asked
  bool goes_on_ = false;             ///< to the next interval
  std::int64_t onset_ns_ = 0;        ///< of the last interval with forces; 0: not yet
  servo::Waiting waits_for_ = servo::Waiting::nothing;
  std::int64_t waits_since_ns_ = 0;

  std::optional<nlohmann::ordered_json> timed_out_;  ///< what was told of it; until the next start
  std::optional<data::TrialRecord> stored_;          ///< the trial stored last, without samples
  std::uint64_t controller_ = 0;   ///< the client that sent a command last; 0: none, or it has left
  std::optional<WhyOff> held_by_;  ///< reason why forces are off, until `clear`
  Emergencies emergencies_;
  std::atomic<bool> silent_{false};
  std::atomic<bool> under_way_{false};  ///< start_, or in_trial_
  mutable std::mutex mutex_;            ///< guards the next two: this thread writes, others read
  nlohmann::ordered_json state_;
  std::string picture_ = R"("objects":[])";
  nlohmann::ordered_json trials_ = nlohmann::ordered_json::array();  ///< on record
};

}  // namespace palpate::runner::serve
