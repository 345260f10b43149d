#include "runner/session/session.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>
#include <utility>

#include "data/base/cell_name.h"
#include "data/base/checksum.h"
#include "data/files/utc.h"
#include "protocols/schedule.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/levels.h"
#include "rendering/fields.h"
#include "runner/participants/seen_record.h"
#include "runner/session/body_record.h"
#include "runner/session/reach_measures.h"
#include "runner/session/recorded_outcome.h"

namespace palpate::runner::session {
namespace {

using protocols::PageItem;
using protocols::PageSpec;
using protocols::TaskKind;

constexpr double kPerSecond_ns = 1e9;

/// Whether the comparison answers the question of `compare`. At the standard's own level, where
/// either answer would do, it follows the rule of the other levels.
bool comparison_is_right(const protocols::TaskBlock& block, const data::TaskRecord& task,
                         int side) {
  if (block.intervals == 2 && !task.dimensions.empty()) {
    std::optional<double> standard, other;
    for (const data::IntervalRecord& interval : task.intervals)
      (interval.standard ? standard : other) = interval.level;
    if (!standard || !other) return true;
    return block.asks_smaller ? *other <= *standard : *other >= *standard;
  }
  if (block.intervals > 2 || !task.level || !task.standard_level) return true;
  if (side != 0) return (side > 0) != block.asks_smaller;
  return block.asks_smaller ? *task.level <= *task.standard_level
                            : *task.level >= *task.standard_level;
}

/// Whether the response is the stimulus, or with several intervals the number of the one that is no
/// standard.
bool names_what_is_asked(const protocols::Trial& trial, const data::TrialRecord& record) {
  if (trial.intervals.size() == 1) return record.response == base_name(record.shape);
  const auto asked = std::ranges::find(trial.intervals, false, &protocols::Interval::standard);
  return record.response == std::to_string(asked - trial.intervals.begin() + 1);
}

const protocols::TaskAnswer& chosen(const protocols::TaskBlock& block,
                                    const participants::Answer& answer) {
  return block.answers.at(static_cast<std::size_t>(answer.stimulus));
}

/// The screens of a text, separated by form feeds, with their pictures.
std::vector<participants::ReadScreen> screens_of(
    const std::string& text, const std::vector<protocols::PagePicture>& pictures = {}) {
  std::vector<participants::ReadScreen> screens(1);
  for (const char c : text) {
    if (c == '\f') {
      screens.emplace_back();
    } else {
      screens.back().text += c;
    }
  }
  for (std::size_t i = 0; i < std::min(screens.size(), pictures.size()); ++i)
    screens[i].picture = pictures[i].bytes;
  return screens;
}

std::vector<PageItem> questions_of(const PageSpec& page) {
  if (page.kind != PageSpec::Kind::consent) return page.items;
  PageItem agree;
  agree.name = "consent";
  return {agree};
}

std::optional<std::string> answer_to(const PageSpec& page, const PageItem& item,
                                     const std::vector<data::PageAnswer>& answers) {
  for (const data::PageAnswer& one : answers) {
    if (one.page == page.name && one.item == item.name) return one.answer;
  }
  return std::nullopt;
}

/// The questions of a page without an answer, as indices.
std::vector<std::size_t> open_questions(const PageSpec& page,
                                        const std::vector<data::PageAnswer>& answers) {
  std::vector<std::size_t> open;
  const std::vector<PageItem> items = questions_of(page);
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (!answer_to(page, items[i], answers)) open.push_back(i);
  }
  return open;
}

/// None: there were no knocks.
std::optional<data::HeardRecord> heard_record(std::vector<sound::Knock> knocks) {
  if (knocks.empty()) return std::nullopt;
  const std::int64_t first_ns = knocks.front().heard_ns;
  const auto middle = knocks.begin() + static_cast<std::ptrdiff_t>(knocks.size() / 2);
  std::ranges::nth_element(knocks, middle, {}, &sound::Knock::lag);
  return data::HeardRecord{static_cast<int>(knocks.size()), middle->lag, first_ns};
}

std::array<double, 3> values(const Vec3& v) { return {v.x, v.y, v.z}; }

}  // namespace

const protocols::TaskBlock& Session::task_of(const protocols::Trial& trial) const {
  return block_of(station_.protocol, trial);
}

void Session::plan_task(const protocols::Trial& trial, data::TrialRecord& record) const {
  const protocols::TaskBlock& block = task_of(trial);
  data::TaskRecord& task = record.task;
  task.task = to_string(block.task);
  task.block_name = block.name;
  task.track = trial.track;
  task.level = trial.level;
  for (std::size_t d = 0; d < trial.point.size(); ++d)
    task.dimensions.emplace_back(block.dimensions[d].name, trial.point[d]);
  task.catch_trial = trial.catch_trial;
  if (block.standard)
    task.standard_level = protocols::own_level(station_.protocol, block, *block.standard);
  if (block.task != TaskKind::external) return;
  const auto standard = std::ranges::find(trial.intervals, true, &protocols::Interval::standard);
  if (standard != trial.intervals.end()) task.standard_level = standard->level;
}

void Session::prepare_interval(const protocols::Trial& trial, const protocols::Interval& interval,
                               const servo::HomeZone& home) {
  contact_.begin(scenes_.edges(trial, interval), trial.orientation);
  record_.first_contact_time.reset();
  data::IntervalRecord& record = record_.task.intervals.emplace_back();
  if (interval.stimulus >= 0)
    record.stimulus = station_.protocol.stimuli[static_cast<std::size_t>(interval.stimulus)].name;
  record.renderer = protocols::to_string(interval.renderer);
  record.level = trial.point.empty()
                     ? interval.level
                     : protocols::judged_value(station_.protocol, task_of(trial), interval);
  record.standard = interval.standard;
  const rendering::Scene scene = scenes_.scene(trial, interval);
  const rendering::Renderer& renderer = renderer_for(interval.renderer);
  power_.begin(scene, renderer.side_contact());
  if (station_.sound != nullptr) {
    const auto sound = contact_sound(station_.protocol, trial, interval);
    station_.sound->contacts(sound ? &*sound : nullptr);
  }
  station_.servo.prepare(scene, renderer, home);
}

servo::HomeZone Session::home_of(const protocols::Interval& interval, double rest) const {
  const double reach = interval.stimulus < 0
                           ? least_reach_
                           : std::max(station_.library.reach(interval.stimulus), least_reach_);
  return {reach + station_.protocol.home.margin, std::max(rest, station_.protocol.home.rest)};
}

void Session::report_interval(const protocols::Trial& trial,
                              const participants::IntervalView& view) {
  if (!task_of(trial).announced) return;
  if (events_ != nullptr) events_->interval(trial, view);
  participant_.begin_interval(trial, view);
}

std::optional<participants::Answer> Session::wait_in_interval(
    const participants::IntervalView& view, std::optional<double> limit, ServoState& servo,
    const std::function<bool(const servo::Sample&)>& ends) {
  const std::int64_t limit_ns = limit ? std::llround(*limit * kPerSecond_ns) : 0;
  while (true) {
    const servo::Sample& sample = station_.servo.next();
    servo = {sample.faults, sample.trouble};
    if (servo.tripped()) return std::nullopt;
    const bool feeling = sample.phase == servo::Phase::feeling;
    if (feeling && view.felt) {
      record_onset_and_contact(sample);
      contact_.add(sample);
      power_.add(sample);
      if (station_.protocol.samples) record_sample(sample);
    }
    if (feeling) record_.response_ns = sample.time_ns;
    const std::optional<participants::Answer> answer = participant_.step(sample);
    const bool over = feeling && limit && sample.time_ns - record_.onset_ns >= limit_ns;
    if (feeling && ends && ends(sample)) {
      participants::Answer arrived;
      arrived.time_ns = sample.time_ns;
      return arrived;
    }
    const bool meant = answer && answer->continues != view.answers && !ends;
    if (meant && (!limit || answer->time_ns - record_.onset_ns < limit_ns)) return answer;
    if (over) return std::nullopt;
  }
}

void Session::end_interval() {
  add_quality(station_.servo.stop());
  data::IntervalRecord& interval = record_.task.intervals.back();
  interval.onset_ns = record_.onset_ns;
  interval.end_ns = record_.response_ns;
}

std::optional<participants::Answer> Session::show_intervals(const protocols::Trial& trial,
                                                            ServoState& servo) {
  const protocols::TaskBlock& block = task_of(trial);
  std::optional<participants::Answer> answer;
  if (block.task == TaskKind::adjust) {
    answer = adjust(trial, servo);
  } else if (block.reaching) {
    answer = reach(trial, servo);
  } else {
    const auto count = static_cast<int>(trial.intervals.size());
    for (int i = 0; i < count; ++i) {
      const protocols::Interval& interval = trial.intervals[static_cast<std::size_t>(i)];
      const participants::IntervalView view{i + 1, count, i + 1 == count, true, &interval};
      report_interval(trial, view);
      prepare_interval(trial, interval, home_of(interval, i > 0 ? block.inter_interval : 0));
      const std::optional<double> limit =
          view.answers && !block.interval_limit ? block.time_out : block.interval_limit;
      answer = wait_in_interval(view, limit, servo);
      if (servo.tripped()) return std::nullopt;
      end_interval();
    }
    if (!answer && block.interval_limit) answer = ask_without_forces(trial, servo);
  }
  if (servo.tripped()) return std::nullopt;
  record_.timed_out = !answer;
  if (answer && block.confidence) {
    take_answer(trial, answer);
    if (events_ != nullptr) events_->unrated(record_);
    ask_confidence(*block.confidence);
  }
  return answer;
}

/// The movement gives the answer: it ends when the tip rests in the target.
std::optional<participants::Answer> Session::reach(const protocols::Trial& trial,
                                                   ServoState& servo) {
  const protocols::TaskBlock& block = task_of(trial);
  const protocols::ReachingSpec& reaching = *block.reaching;
  const Vec3 target = reaching.targets.at(static_cast<std::size_t>(*trial.level) - 1);
  const double period = 1 / station_.protocol.servo_rate;
  const participants::IntervalView view{1, 1, true, true, &trial.intervals.front()};
  report_interval(trial, view);
  servo::HomeZone home{reaching.home_radius, station_.protocol.home.rest};
  home.start = reaching.home;
  prepare_interval(trial, trial.intervals.front(), home);
  RestInTarget target_reached(target, reaching.target_radius, period);
  std::optional<participants::Answer> answer = wait_in_interval(
      view, block.time_out, servo,
      [&](const servo::Sample& sample) { return target_reached.rests(sample.probe.tip); });
  if (servo.tripped()) return std::nullopt;
  end_interval();
  record_.task.reach =
      reach_measures(record_.samples, trial.reach, target, period, field_of(trial));
  if (answer) answer->stimulus = timing_of(block, *record_.task.reach);
  return answer;
}

/// The fields of the trial's stimulus, also where a channel or nothing takes their place.
FieldOfReach Session::field_of(const protocols::Trial& trial) const {
  const auto& object = station_.protocol.stimuli[static_cast<std::size_t>(trial.stimulus)].object;
  const Quat to_world = object.pose.orientation;
  return [this, &object, to_world](const data::SampleRecord& sample, const Vec3& velocity) {
    const Vec3 tip(sample.tip[0], sample.tip[1], sample.tip[2]);
    const Vec3 place = glm::conjugate(to_world) * (tip - object.pose.position);
    const double time = sample.tick / station_.protocol.servo_rate;
    Vec3 force(0);
    for (const stimuli::FieldSpec& field : object.fields)
      force +=
          rendering::field_force(field, place, glm::conjugate(to_world) * velocity, time, false);
    return to_world * force;
  };
}

/// Asks for the answer after the last interval, with forces off.
std::optional<participants::Answer> Session::ask_without_forces(const protocols::Trial& trial,
                                                                ServoState& servo) {
  const auto count = static_cast<int>(trial.intervals.size());
  const participants::IntervalView view{count, count, true, false, nullptr};
  report_interval(trial, view);
  const protocols::Interval nothing{-1, trial.renderer};
  station_.servo.prepare(scenes_.scene(trial, nothing), renderer_for(trial.renderer), {0, 0});
  const auto answer = wait_in_interval(view, task_of(trial).time_out, servo);
  station_.servo.stop();
  return answer;
}

/// The participant adjusts the level of one stimulus and feels it and the standard in turn, until
/// they are equal. After a turn the stylus need not go home: an object that appears around it
/// exerts no force until the stylus has left it.
std::optional<participants::Answer> Session::adjust(const protocols::Trial& trial,
                                                    ServoState& servo) {
  const protocols::TaskBlock& block = task_of(trial);
  protocols::Interval own = trial.intervals[0];
  bool standard = false, turned = false;
  servo::HomeZone home = home_of(own, 0);
  std::int64_t first_onset_ns = 0;
  while (true) {
    const protocols::Interval& shown = standard ? trial.intervals[1] : own;
    const participants::IntervalView view{standard ? 2 : 1, 2, true, true, &shown, turned};
    report_interval(trial, view);
    prepare_interval(trial, shown, home);
    const double spent =
        first_onset_ns == 0
            ? 0
            : static_cast<double>(station_.clock.now_ns() - first_onset_ns) / kPerSecond_ns;
    std::optional<participants::Answer> answer;
    if (spent < block.time_out) answer = wait_in_interval(view, block.time_out - spent, servo);
    if (servo.tripped()) return std::nullopt;
    if (first_onset_ns == 0) first_onset_ns = record_.onset_ns;
    end_interval();
    const std::string act = answer ? chosen(block, *answer).name : "done";
    if (act == "done") {
      record_.onset_ns = first_onset_ns;
      if (answer) answer->number = *own.level;
      return answer;
    }
    turned = act != "switch";
    home = turned ? servo::HomeZone{0, 0} : home_of(own, 0);
    if (!turned) {
      standard = !standard;
    } else if (!standard) {
      const double by = block.turn * answer->times;
      own.level = std::clamp(*own.level + (act == "up" ? by : -by), *block.least, *block.most);
    }
  }
}

void Session::ask_confidence(const protocols::ConfidenceSpec& asked) {
  if (events_ != nullptr) events_->asking(true);
  const std::optional<participants::Answer> step = participant_.confidence(asked);
  if (events_ != nullptr) events_->asking(false);
  if (!step) return;
  record_.task.confidence = asked.scale.at(static_cast<std::size_t>(step->stimulus)).number;
  record_.task.confidence_ns = step->time_ns;
}

void Session::judge(const protocols::Trial& trial, const participants::Answer& answer) {
  const protocols::TaskBlock& block = task_of(trial);
  data::TaskRecord& task = record_.task;
  switch (block.task) {
    case TaskKind::identify:
      record_.response = chosen(block, answer).name;
      record_.correct = task.success = record_.response == base_name(record_.shape);
      break;
    case TaskKind::compare:
      record_.response = chosen(block, answer).name;
      if (block.same_different) {
        task.success = record_.response == "different";
        record_.correct = task.success != trial.catch_trial;
      } else {
        const auto at = static_cast<std::size_t>(record_.response.front() - '1');
        task.success = !trial.intervals[at].standard;
        const int side = protocols::side_of_levels(station_.protocol, block);
        record_.correct = task.success == comparison_is_right(block, task, side);
        // On one side of the standard this is a forced choice: count right answers.
        if (side != 0) task.success = record_.correct;
      }
      break;
    case TaskKind::detect:
      record_.response = chosen(block, answer).name;
      task.success = record_.response == "yes";
      record_.correct = task.success != trial.catch_trial;
      break;
    case TaskKind::external:
      record_.response = chosen(block, answer).name;
      record_.correct = task.success = answer.correct.value_or(names_what_is_asked(trial, record_));
      break;
    case TaskKind::reach:
      record_.response = chosen(block, answer).name;
      record_.correct = task.success = record_.response == "in_time";
      break;
    case TaskKind::rate:
      task.number = block.answers.empty() ? answer.number : chosen(block, answer).number;
      record_.response = protocols::level_text(*task.number);
      break;
    case TaskKind::adjust:
      task.number = answer.number;
      record_.response = protocols::level_text(*task.number);
      break;
  }
}

/// Ask once per trial, repeats included. Without an answer the block's own procedure continues,
/// which is recorded. \return false: the program ended the block
bool Session::ask_level() {
  const protocols::Trial& trial = station_.plan.next();
  if (station_.advisor == nullptr || (!trial.level && trial.point.empty())) return true;
  const protocols::TaskBlock& block = task_of(trial);
  if (!protocols::is_adaptive(block) || asked_trial_ == trial.trial) return true;
  asked_trial_ = trial.trial;
  const auto note = [&](const nlohmann::ordered_json& event) {
    station_.log.note(station_.clock.now_ns(),
                      event.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace));
  };
  const std::optional<Proposal> proposal = station_.advisor->ask(trial);
  if (proposal && proposal->finished) {
    note({{kBlockEnded,
           {{"session", trial.session}, {"block", block.name}, {"before_trial", trial.trial}}}});
    asked_trial_ = 0;  // the next trial has the same number
    station_.plan.end_block();
    return false;
  }
  if (proposal && !proposal->point.empty()) {
    station_.plan.propose(proposal->point);
  } else if (proposal) {
    station_.plan.propose(*proposal->level);
  } else {
    nlohmann::ordered_json own = {{"session", trial.session}, {"trial", trial.trial}};
    if (trial.level) own["level"] = *trial.level;
    for (std::size_t d = 0; d < trial.point.size(); ++d)
      own["levels"][block.dimensions[d].name] = trial.point[d];
    own["reason"] = station_.advisor->trouble();
    note({{"level_from_own_procedure", own}});
  }
  return true;
}

/// The state before the next trial; after the last one, pages and the end are shown.
void Session::proceed() {
  state_ = before_trial();
  if (state_ != State::end) return;
  show_pages(protocols::PageSpec::When::after);
  participant_.read(station_.protocol.texts.end);
}

void Session::report_level() {
  if (station_.advisor != nullptr && protocols::is_adaptive(task_of(station_.plan.next())))
    station_.advisor->tell(record_);
}

void Session::begin_task_block() {
  const protocols::TaskBlock& block = station_.plan.block();
  show_pages(PageSpec::When::between, block.name);
  // The cells of a block have them once, unless a cell has its own.
  if (block.cell && instructions_read_ == std::pair(block.place, block.instructions)) return;
  read_instructions(block);
}

void Session::read_instructions(const protocols::TaskBlock& block) {
  instructions_read_ = {block.place, block.instructions};
  if (block.instructions.empty()) return;
  participant_.read_screens(screens_of(block.instructions));
}

/// Shows the block's instructions again when a session resumes within a block.
void Session::resume_task_block() {
  if (!station_.plan.block_begins()) read_instructions(station_.plan.block());
}

bool Session::has_open_pages() const {
  const auto& pages = station_.protocol.pages;
  return std::any_of(pages.begin(), pages.end(), [this](const PageSpec& page) {
    return page.when == PageSpec::When::after && !page.items.empty() &&
           !open_questions(page, station_.log.answers()).empty();
  });
}

void Session::show_pages(PageSpec::When when, const std::string& block) {
  for (const PageSpec& page : station_.protocol.pages) {
    if (page.when != when || page.before_block != block) continue;
    const bool asks = !questions_of(page).empty();
    if (!asks || !open_questions(page, station_.log.answers()).empty()) show_page(page);
  }
  report_page({});
}

/// Each answer is durable before the next question is shown. After an interruption the page begins
/// with the first question without an answer, and without its text.
void Session::show_page(const PageSpec& page) {
  const bool consent = page.kind == PageSpec::Kind::consent;
  const std::vector<PageItem> items = questions_of(page);
  const std::vector<std::size_t> open = open_questions(page, station_.log.answers());
  PageView view{page.name, "", 0, static_cast<int>(items.size())};
  report_page(view);
  if (!consent && open.size() == items.size())
    participant_.read_screens(screens_of(page.text, page.pictures));
  for (std::size_t at = items.empty() ? 0 : open.front(); at < items.size();) {
    const PageItem& item = items[at];
    view.question = item.name;
    view.number = static_cast<int>(at) + 1;
    report_page(view);
    const bool number_follows =
        at + 1 < items.size() && items[at + 1].kind == PageItem::Kind::number;
    const std::optional<std::string> given = answer_to(page, item, station_.log.answers());
    const std::optional<std::string> answer =
        participant_.ask(page, item, {at > 0, given, number_follows});
    if (!answer) {
      --at;
      continue;
    }
    if (consent && *answer != "agree")
      throw EndOfSession(data::RunEnd::aborted, "consent was not given");
    if (answer != given) store_answer(page, item, *answer);
    ++at;
  }
}

void Session::store_answer(const PageSpec& page, const PageItem& item, const std::string& answer) {
  const std::string& shown = page.kind == PageSpec::Kind::consent ? page.text : item.question;
  station_.log.answered(
      {page.name, item.name, page.version, checksum_hex(shown), answer, station_.clock.now_ns()});
}

void Session::report_page(const PageView& view) {
  if (events_ != nullptr) events_->page(view);
}

Session::Session(const Station& station, participants::Respondent& participant,
                 SessionEvents* events, double least_reach)
    : station_(station),
      participant_(participant),
      events_(events),
      least_reach_(least_reach),
      scenes_(station.protocol, &station.library) {
  if (station.protocol.home.beyond_all)
    least_reach_ = std::max(least_reach, largest_reach(station));  // the same for every level
}

bool Session::ServoState::tripped() const { return (faults & servo::servo_fault::kTripped) != 0; }

Session::State Session::before_trial() const {
  if (station_.plan.finished()) return State::end;
  if (station_.plan.block_begins())
    return station_.plan.next().practice ? State::practice : State::block;
  const auto& every = station_.protocol.breaks.every_trials;
  if (every && station_.plan.done_in_block() % static_cast<std::size_t>(*every) == 0)
    return State::rest;
  return State::trial;
}

void Session::step() {
  const auto& texts = station_.protocol.texts;
  switch (state_) {
    case State::instruction:
      state_ = before_trial();
      if (state_ == State::end) {  // interrupted after the last trial
        show_pages(protocols::PageSpec::When::after);
        participant_.read(texts.end);
        break;
      }
      state_ = State::instruction;
      show_pages(protocols::PageSpec::When::before);
      participant_.read(texts.instructions);
      resume_task_block();
      state_ = before_trial();
      break;
    case State::practice:
      rest_between_blocks();
      participant_.read(texts.practice);
      begin_task_block();
      state_ = State::trial;
      break;
    case State::block:
      rest_between_blocks();
      begin_task_block();
      state_ = State::trial;
      break;
    case State::rest:
      rest();
      state_ = State::trial;
      break;
    case State::trial:
      if (!ask_level())
        proceed();
      else if (run_trial())
        state_ = State::response;
      break;
    case State::response:
      station_.log.finish(record_);
      if (events_ != nullptr) events_->recorded(record_);
      participant_.learn_from(record_);
      report_level();
      give_feedback();
      proceed();
      break;
    case State::end:
      break;
  }
}

void Session::give_feedback() {
  const protocols::TaskBlock& block = station_.plan.block();
  const bool feedback = block.feedback || (record_.practice && block.practice_feedback);
  station_.plan.answered(
      outcome_of(record_));  // first: a participant who leaves during the feedback has answered
  if (feedback && data::has_right_answer(record_)) participant_.feedback(record_.correct);
}

data::TrialRecord Session::planned_record(const protocols::Trial& trial) const {
  data::TrialRecord record;
  record.session = trial.session;
  record.block = trial.block;
  record.trial = trial.trial;
  record.renderer = protocols::to_string(trial.renderer);
  record.shape = station_.protocol.stimuli[static_cast<std::size_t>(trial.stimulus)].name;
  record.practice = trial.practice;
  const Quat& q = trial.orientation;
  record.orientation_wxyz = {q.w, q.x, q.y, q.z};
  plan_task(trial, record);
  return record;
}

/// Practice belongs to the block that follows: no break separates them.
void Session::rest_between_blocks() {
  if (station_.plan.done() > 0 && !station_.plan.after_practice()) rest();
}

void Session::rest() {
  const std::int64_t until =
      station_.clock.now_ns() + std::llround(station_.protocol.breaks.min_seconds * kPerSecond_ns);
  participant_.rest(station_.protocol.texts.break_text, until);
  station_.clock.wait_until(until);
}

void Session::cut_off(const std::string& reason) {
  station_.log.cut_off(reason);  // first: what is told is on record
  if (events_ != nullptr) events_->cut_off(reason);
}

bool Session::run_trial() {
  if (const auto choice = participant_.choose(station_.plan.next())) station_.plan.choose(*choice);
  const protocols::Trial& trial = station_.plan.next();
  record_ = planned_record(trial);
  record_.attempt = station_.log.begin(record_, station_.clock.now_ns());
  quality_ = {};
  if (events_ != nullptr) events_->began(trial);
  std::optional<participants::Answer> answer;
  ServoState servo;
  try {
    participant_.begin_trial(trial);
    answer = show_intervals(trial, servo);
  } catch (const participants::TrialCutOff& again) {
    station_.servo.stop();
    cut_off(again.what());
    return false;
  } catch (const std::exception& error) {
    station_.servo.stop();
    cut_off(error.what());
    throw;
  }
  station_.servo.stop();
  if (servo.tripped()) {
    const std::string reason = trip_reason(servo.faults, servo.trouble);
    cut_off(reason);
    throw SessionFault("forces are off: " + reason + "; trial " + std::to_string(record_.trial) +
                           " will be shown again",
                       reason, servo.faults, servo.trouble);
  }
  take_answer(trial, answer);
  record_.ticks = quality_.ticks;
  record_.missed_ticks = quality_.missed_ticks;
  record_.longest_period_ns = quality_.longest_period_ns;
  record_.faults = quality_.faults;
  record_.started_inside = (quality_.faults & rendering::render_fault::kStartedInside) != 0;
  record_.max_force = quality_.max_force;
  record_.contact_share = contact_.contact_share();
  record_.edge_dwell = contact_.edge_dwell(1 / station_.protocol.servo_rate);
  record_.frames = participant_.frames();
  record_.task.seen = participants::seen_record(record_.frames);
  if (!station_.protocol.samples) record_.frames.clear();
  if (station_.sound != nullptr) record_.task.heard = heard_record(station_.sound->take_knocks());
  if (events_ != nullptr) events_->answered(record_);
  return true;
}

void Session::add_quality(const servo::ServoQuality& quality) {
  quality_.ticks += quality.ticks;
  quality_.missed_ticks += quality.missed_ticks;
  quality_.longest_period_ns = std::max(quality_.longest_period_ns, quality.longest_period_ns);
  quality_.faults |= quality.faults;
  quality_.max_force = std::max(quality_.max_force, quality.max_force);
}

void Session::take_answer(const protocols::Trial& trial,
                          const std::optional<participants::Answer>& answer) {
  record_.response_time = task_of(trial).time_out;
  if (answer) {
    record_.response_ns = answer->time_ns;
    record_.response_time =
        static_cast<double>(record_.response_ns - record_.onset_ns) / kPerSecond_ns;
  }
  if (answer) judge(trial, *answer);
  // The answer may precede the last tick read.
  if (record_.first_contact_time && *record_.first_contact_time > record_.response_time)
    record_.first_contact_time.reset();
}

void Session::record_onset_and_contact(const servo::Sample& sample) {
  if (sample.tick == 0) {
    record_.onset_ns = sample.time_ns;
    record_.onset_utc = data::format_utc(data::to_unix_ns(station_.utc, sample.time_ns));
    record_.start_tip = values(sample.probe.tip);
    record_.start_tail = values(sample.probe.tail);
    if (events_ != nullptr) events_->onset(record_);
  }
  const rendering::Rendering& rendering = sample.rendering;
  if (rendering.contacts > 0 && !record_.first_contact_time) {
    record_.first_contact_time =
        static_cast<double>(sample.time_ns - record_.onset_ns) / kPerSecond_ns;
    if (events_ != nullptr) events_->first_contact(record_, sample.time_ns);
  }
}

void Session::record_sample(const servo::Sample& sample) {
  const rendering::Rendering& rendering = sample.rendering;
  data::SampleRecord kept;
  kept.tick = sample.tick;
  kept.period_ns = sample.period_ns;
  kept.lateness_ns = sample.lateness_ns;
  kept.compute_ns = sample.compute_ns;
  kept.tip = values(sample.probe.tip);
  kept.tail = values(sample.probe.tail);
  kept.force = values(rendering.force);
  kept.torque = values(rendering.torque);
  kept.device1 = values(sample.device1);
  kept.device2 = values(sample.device2);
  kept.depth = rendering.deepest.depth;
  kept.contacts = servo::recorded_contacts(rendering.contacts);
  kept.contact_type = static_cast<std::uint8_t>(rendering.deepest.type);
  kept.buttons = sample.buttons;
  kept.faults = sample.faults;
  const auto bodies = station_.servo.bodies();  // at most one: a stimulus is one object
  kept.bodies = bodies.empty() ? 0 : 1;
  record_.samples.push_back(kept);
  if (bodies.empty() && record_.bodies.empty()) return;
  record_.bodies.resize(record_.samples.size());  // with the samples of empty intervals
  if (!bodies.empty()) record_.bodies.back() = body_record(bodies.front());
}

}  // namespace palpate::runner::session
