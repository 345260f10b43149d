// The part of Session that version 2 has: trials of several intervals, pages.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <utility>

#include "data/base/checksum.h"
#include "protocols/tasks/levels.h"
#include "protocols/tasks/task_plan.h"
#include "runner/session/session.h"
#include "runner/session/session_end.h"

namespace palpate::runner {
namespace {

using protocols::PageItem;
using protocols::PageSpec;
using protocols::TaskKind;

constexpr double kTaskSecond_ns = 1e9;

/// Whether the comparison is what the question of `compare` asks for. At the standard's own level,
/// which either could be, as at the other levels.
bool comparison_is_right(const protocols::TaskBlock& block, const data::TaskRecord& task,
                         int side) {
  if (block.intervals > 2 || !task.level || !task.standard_level) return true;
  if (side != 0) return (side > 0) != block.asks_smaller;
  return block.asks_smaller ? *task.level <= *task.standard_level
                            : *task.level >= *task.standard_level;
}

const protocols::TaskAnswer& chosen(const protocols::TaskBlock& block, const Answer& answer) {
  return block.answers.at(static_cast<std::size_t>(answer.stimulus));
}

/// The screens of a text that it separates by form feeds, with their pictures.
std::vector<ReadScreen> screens_of(const std::string& text,
                                   const std::vector<protocols::PagePicture>& pictures = {}) {
  std::vector<ReadScreen> screens(1);
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

}  // namespace

const protocols::TaskBlock& Session::task_of(const protocols::Trial& trial) const {
  return station_.protocol.blocks[static_cast<std::size_t>(trial.task_block)];
}

void Session::plan_task(const protocols::Trial& trial, data::TrialRecord& record) const {
  const protocols::TaskBlock& block = task_of(trial);
  data::TaskRecord& task = record.task.emplace();
  task.task = to_string(block.task);
  task.block_name = block.name;
  task.track = trial.track;
  task.level = trial.level;
  task.catch_trial = trial.catch_trial;
  if (block.standard)
    task.standard_level = protocols::own_level(station_.protocol, block, *block.standard);
}

void Session::prepare_interval(const protocols::Trial& trial, const protocols::Interval& interval,
                               const HomeZone& home) {
  contact_.begin(scenes_->edges(trial, interval), trial.orientation);
  record_.first_contact_time.reset();
  data::IntervalRecord& record = record_.task->intervals.emplace_back();
  if (interval.stimulus >= 0)
    record.stimulus = station_.protocol.stimuli[static_cast<std::size_t>(interval.stimulus)].name;
  record.renderer = protocols::to_string(interval.renderer);
  record.level = interval.level;
  record.standard = interval.standard;
  station_.servo.prepare(scenes_->scene(trial, interval), renderer_for(interval.renderer), home);
}

HomeZone Session::task_home(double rest) const {
  return {least_reach_ + station_.protocol.home.margin,
          std::max(rest, station_.protocol.home.rest)};
}

void Session::tell_interval(const protocols::Trial& trial, const IntervalView& view) {
  if (events_ != nullptr) events_->interval(trial, view);
  participant_.begin_interval(trial, view);
}

std::optional<Answer> Session::wait_in_interval(const IntervalView& view,
                                                std::optional<double> limit, ServoState& servo) {
  const std::int64_t limit_ns = limit ? std::llround(*limit * kTaskSecond_ns) : 0;
  while (true) {
    const Sample& sample = station_.servo.next();
    servo = {sample.faults, sample.trouble};
    if (servo.tripped()) return std::nullopt;
    const bool feeling = sample.phase == Phase::feeling;
    if (feeling && view.felt) {
      record_onset_and_contact(sample);
      contact_.add(sample);
      if (station_.protocol.samples) record_sample(sample);
    }
    if (feeling) record_.response_ns = sample.time_ns;
    const std::optional<Answer> answer = participant_.step(sample);
    const bool over = feeling && limit && sample.time_ns - record_.onset_ns >= limit_ns;
    const bool meant = answer && answer->goes_on != view.answers;
    if (meant && (!limit || answer->time_ns - record_.onset_ns < limit_ns)) return answer;
    if (over) return std::nullopt;
  }
}

void Session::end_interval() {
  add_quality(station_.servo.stop());
  data::IntervalRecord& interval = record_.task->intervals.back();
  interval.onset_ns = record_.onset_ns;
  interval.end_ns = record_.response_ns;
}

std::optional<Answer> Session::show_intervals(const protocols::Trial& trial, ServoState& servo) {
  const protocols::TaskBlock& block = task_of(trial);
  std::optional<Answer> answer;
  if (block.task == TaskKind::adjust) {
    answer = adjust(trial, servo);
  } else {
    const auto count = static_cast<int>(trial.intervals.size());
    for (int i = 0; i < count; ++i) {
      const protocols::Interval& interval = trial.intervals[static_cast<std::size_t>(i)];
      const IntervalView view{i + 1, count, i + 1 == count, true, &interval};
      tell_interval(trial, view);
      prepare_interval(trial, interval, task_home(i > 0 ? block.inter_interval : 0));
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
  if (answer && block.confidence) ask_confidence(*block.confidence);
  return answer;
}

/// The last interval is over: the answer is waited for with forces off.
std::optional<Answer> Session::ask_without_forces(const protocols::Trial& trial,
                                                  ServoState& servo) {
  const auto count = static_cast<int>(trial.intervals.size());
  const IntervalView view{count, count, true, false, nullptr};
  tell_interval(trial, view);
  const protocols::Interval nothing{-1, trial.renderer};
  station_.servo.prepare(scenes_->scene(trial, nothing), renderer_for(trial.renderer), {0, 0});
  const auto answer = wait_in_interval(view, task_of(trial).time_out, servo);
  station_.servo.stop();
  return answer;
}

/// The participant turns the level of one stimulus, and feels it and the standard in turn, until
/// they are equal. After a turn the stylus need not go home: an object that appears around it gives
/// no force until it has been left.
std::optional<Answer> Session::adjust(const protocols::Trial& trial, ServoState& servo) {
  const protocols::TaskBlock& block = task_of(trial);
  protocols::Interval own = trial.intervals[0];
  bool standard = false, turned = false;
  HomeZone home = task_home(0);
  std::int64_t first_onset_ns = 0;
  while (true) {
    const protocols::Interval& shown = standard ? trial.intervals[1] : own;
    const IntervalView view{standard ? 2 : 1, 2, true, true, &shown, turned};
    tell_interval(trial, view);
    prepare_interval(trial, shown, home);
    const double spent =
        first_onset_ns == 0
            ? 0
            : static_cast<double>(station_.clock.now_ns() - first_onset_ns) / kTaskSecond_ns;
    std::optional<Answer> answer;
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
    home = turned ? HomeZone{0, 0} : task_home(0);
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
  const std::optional<Answer> step = participant_.confidence(asked);
  if (events_ != nullptr) events_->asking(false);
  if (!step) return;
  record_.task->confidence = asked.scale.at(static_cast<std::size_t>(step->stimulus)).number;
  record_.task->confidence_ns = step->time_ns;
}

void Session::take_task_answer(const protocols::Trial& trial, const std::optional<Answer>& answer) {
  if (!answer) return;
  const protocols::TaskBlock& block = task_of(trial);
  data::TaskRecord& task = *record_.task;
  switch (block.task) {
    case TaskKind::identify:
      record_.response = chosen(block, *answer).name;
      record_.correct = task.success = record_.response == record_.shape;
      break;
    case TaskKind::compare:
      record_.response = chosen(block, *answer).name;
      if (block.same_different) {
        task.success = record_.response == "different";
        record_.correct = task.success != trial.catch_trial;
      } else {
        const auto at = static_cast<std::size_t>(record_.response.front() - '1');
        task.success = !trial.intervals[at].standard;
        const int side = protocols::side_of_levels(station_.protocol, block);
        record_.correct = task.success == comparison_is_right(block, task, side);
        // On one side of the standard it is a forced choice: right answers count.
        if (side != 0) task.success = record_.correct;
      }
      break;
    case TaskKind::detect:
      record_.response = chosen(block, *answer).name;
      task.success = record_.response == "yes";
      record_.correct = task.success != trial.catch_trial;
      break;
    case TaskKind::external:
      record_.response = chosen(block, *answer).name;
      record_.correct = task.success = answer->correct.value_or(record_.response == record_.shape);
      break;
    case TaskKind::rate:
      task.number = block.answers.empty() ? answer->number : chosen(block, *answer).number;
      record_.response = protocols::level_text(*task.number);
      break;
    case TaskKind::adjust:
      task.number = answer->number;
      record_.response = protocols::level_text(*task.number);
      break;
  }
}

/// Once a trial, however often it is shown; without an answer the block's own procedure goes on,
/// which is on record.
void Session::ask_level() {
  const protocols::Trial& trial = station_.plan.next();
  if (station_.advisor == nullptr || !trial.level || trial.task_block < 0) return;
  if (!protocols::is_adaptive(task_of(trial)) || asked_trial_ == trial.trial) return;
  asked_trial_ = trial.trial;
  if (const std::optional<double> level = station_.advisor->ask(trial)) {
    station_.plan.propose(*level);
    return;
  }
  const nlohmann::ordered_json event = {{"level_from_own_procedure",
                                         {{"session", trial.session},
                                          {"trial", trial.trial},
                                          {"level", *trial.level},
                                          {"reason", station_.advisor->trouble()}}}};
  station_.log.note(station_.clock.now_ns(),
                    event.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace));
}

void Session::tell_level() {
  if (station_.advisor != nullptr && record_.task &&
      protocols::is_adaptive(task_of(station_.plan.next())))
    station_.advisor->tell(record_);
}

void Session::begin_task_block() {
  if (station_.protocol.version == 1) return;
  const protocols::TaskBlock& block = task_of(station_.plan.next());
  show_pages(PageSpec::When::between, block.name);
  read_instructions(block);
}

void Session::read_instructions(const protocols::TaskBlock& block) {
  participant_.read_screens(screens_of(block.instructions));
}

/// A session that goes on within a block: what it is about is read again.
void Session::resume_task_block() {
  if (station_.protocol.version == 1 || station_.plan.finished() || station_.plan.block_begins())
    return;
  read_instructions(task_of(station_.plan.next()));
}

bool Session::has_open_pages() const {
  const auto& pages = station_.protocol.pages;
  return std::any_of(pages.begin(), pages.end(), [this](const PageSpec& page) {
    return page.when == PageSpec::When::after && !page.items.empty() &&
           !station_.log.has_answers(page.name);
  });
}

void Session::show_pages(PageSpec::When when, const std::string& block) {
  for (const PageSpec& page : station_.protocol.pages) {
    if (page.when != when || page.before_block != block) continue;
    if (!station_.log.has_answers(page.name)) show_page(page);
  }
  tell_page({});
}

void Session::show_page(const PageSpec& page) {
  const bool consent = page.kind == PageSpec::Kind::consent;
  PageItem agree;
  agree.name = "consent";
  const std::vector<PageItem> items = consent ? std::vector<PageItem>{agree} : page.items;
  PageView view{page.name, "", 0, static_cast<int>(items.size())};
  tell_page(view);
  if (!consent) participant_.read_screens(screens_of(page.text, page.pictures));
  std::vector<data::PageAnswer> answers;
  for (const PageItem& item : items) {
    view.question = item.name;
    ++view.number;
    tell_page(view);
    const std::string shown = consent ? page.text : item.question;
    std::string answer = participant_.ask(page, item);
    if (consent && answer != "agree")
      throw EndOfSession(data::RunEnd::aborted, "consent was not given");
    answers.push_back({page.name, item.name, page.version, checksum_hex(shown), std::move(answer),
                       station_.clock.now_ns()});
  }
  if (!answers.empty()) station_.log.answered(answers);
}

void Session::tell_page(const PageView& view) {
  if (events_ != nullptr) events_->page(view);
}

}  // namespace palpate::runner
