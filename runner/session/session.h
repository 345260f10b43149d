#pragma once
// The trial loop: a session as a state machine, the same for simulated and live participants.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "data/record.h"
#include "protocols/session_plan.h"
#include "runner/participants/respondent.h"
#include "runner/session/field_power.h"
#include "runner/session/live_forces.h"
#include "runner/session/reach_measures.h"
#include "runner/session/session_end.h"
#include "runner/session/session_events.h"
#include "runner/session/session_scenes.h"
#include "runner/session/station.h"

namespace palpate::runner::session {

class Session {
 public:
  enum class State {
    instruction,  ///< introduces the session; also after an interruption
    practice,     ///< a block that is not analysed begins
    block,        ///< a block begins
    rest,         ///< a break is due
    trial,        ///< from the home zone to the answer
    response,     ///< on record, feedback
    end,
  };

  /// \param station      its parts must outlive the session
  /// \param events       may be none
  /// \param least_reach  m; least radius of the home zone, for every stimulus. The place where the
  /// screen stops asking to move away must not reveal a shape.
  Session(const Station& station, participants::Respondent& participant,
          SessionEvents* events = nullptr, double least_reach = 0);

  State state() const { return state_; }
  /// Of the interval under way.
  const FieldPower& field_power() const { return power_; }
  const protocols::SessionPlan& plan() const { return station_.plan; }
  /// The task of a trial.
  const protocols::TaskBlock& task_of(const protocols::Trial& trial) const;
  /// Whether a page after the last trial still needs answers.
  bool has_open_pages() const;
  /// Does the work of the current state and moves on. Between two calls every event is on record:
  /// after any exception in a trial, forces are zero, the attempt is cut off, and the next call
  /// shows the trial again. \throws SessionFault; StoreError when a record could not be written;
  /// exceptions of the participant, except TrialCutOff.
  void step();

 private:
  State before_trial() const;
  data::TrialRecord planned_record(const protocols::Trial& trial) const;
  bool run_trial();  ///< false: the trial was cut off
  /// The servo's last values in a trial.
  struct ServoState {
    std::uint32_t faults = 0;
    servo::DeviceTrouble trouble = servo::DeviceTrouble::none;
    bool tripped() const;
  };
  void plan_task(const protocols::Trial& trial, data::TrialRecord& record) const;
  std::optional<participants::Answer> show_intervals(const protocols::Trial& trial,
                                                     ServoState& servo);
  std::optional<participants::Answer> reach(const protocols::Trial& trial, ServoState& servo);
  FieldOfReach field_of(const protocols::Trial& trial) const;
  std::optional<participants::Answer> adjust(const protocols::Trial& trial, ServoState& servo);
  std::optional<participants::Answer> ask_without_forces(const protocols::Trial& trial,
                                                         ServoState& servo);
  void prepare_interval(const protocols::Trial& trial, const protocols::Interval& interval,
                        const servo::HomeZone& home);
  servo::HomeZone home_of(const protocols::Interval& interval, double rest) const;
  /// \param ends  whether the movement has ended at a sample; empty: the participant answers
  std::optional<participants::Answer> wait_in_interval(
      const participants::IntervalView& view, std::optional<double> limit, ServoState& servo,
      const std::function<bool(const servo::Sample&)>& ends = {});
  void end_interval();
  void report_interval(const protocols::Trial& trial, const participants::IntervalView& view);
  void judge(const protocols::Trial& trial, const participants::Answer& answer);
  void ask_confidence(const protocols::ConfidenceSpec& asked);
  void begin_task_block();
  bool ask_level();
  void proceed();
  void report_level();
  void read_instructions(const protocols::TaskBlock& block);
  void resume_task_block();
  void show_pages(protocols::PageSpec::When when, const std::string& block = "");
  void show_page(const protocols::PageSpec& page);
  void store_answer(const protocols::PageSpec& page, const protocols::PageItem& item,
                    const std::string& answer);
  void report_page(const PageView& view);
  void cut_off(const std::string& reason);
  void rest_between_blocks();
  void rest();
  void give_feedback();
  void add_quality(const servo::ServoQuality& quality);
  void take_answer(const protocols::Trial& trial,
                   const std::optional<participants::Answer>& answer);
  void record_onset_and_contact(const servo::Sample& sample);
  void record_sample(const servo::Sample& sample);

  Station station_;  ///< with the session's own plan
  participants::Respondent& participant_;
  SessionEvents* events_;
  double least_reach_;
  State state_ = State::instruction;
  data::TrialRecord record_;     ///< of the trial under way
  ContactLog contact_;           ///< likewise
  FieldPower power_;             ///< likewise
  servo::ServoQuality quality_;  ///< likewise, of its intervals so far
  SessionScenes scenes_;
  int asked_trial_ = 0;  ///< the last trial for which an advisor was asked
  /// Place of the last block in the protocol, and its instructions; none: nothing has been read.
  std::optional<std::pair<std::size_t, std::string>> instructions_read_;
};

}  // namespace palpate::runner::session
