#include "runner/session/simulated_study.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "protocols/difference.h"
#include "protocols/groups.h"
#include "protocols/schedule.h"
#include "protocols/session_plan.h"
#include "protocols/tasks/block_order.h"
#include "runner/build_info.h"
#include "runner/participants/simulated.h"
#include "runner/session/device_check.h"
#include "runner/session/recorded_outcome.h"
#include "runner/session/run_record.h"
#include "runner/session/session.h"
#include "runner/session/socket_advisor.h"
#include "runner/session/trial_log.h"

namespace palpate::runner::session {
namespace {

/// \throws std::invalid_argument
const protocols::Protocol& checked(const protocols::Protocol& protocol,
                                   const StimulusLibrary& library,
                                   const participants::SimulatedSettings& settings) {
  std::string reasons;
  for (const std::string& fault : simulation_faults(protocol, library, settings)) {
    reasons += (reasons.empty() ? "" : "\n") + fault;
  }
  if (!reasons.empty()) throw std::invalid_argument(reasons);
  return protocol;
}

class VisitingLog final : public TrialLog {
 public:
  explicit VisitingLog(std::function<void(const data::TrialRecord&)> visit)
      : visit_(std::move(visit)) {}
  int begin(const data::TrialRecord&, std::int64_t) override { return 1; }
  void finish(const data::TrialRecord& record) override { visit_(record); }
  void cut_off(const std::string& reason) override {
    throw std::runtime_error("a simulated trial was cut off: " + reason);
  }

 private:
  std::function<void(const data::TrialRecord&)> visit_;
};

/// One session of one participant, with its records in the store.
struct Work {
  data::Participant participant;
  int session = 1;
  std::vector<protocols::TrialOutcome> answers;  ///< of the trials on record
  std::vector<std::string> notes;                ///< of earlier runs, in order
  std::int64_t clock_ns = 0;                     ///< the session's clock at its last record
  data::RunInfo info;
  std::vector<data::PageAnswer> page_answers;
  std::vector<data::TrialRecord>
      completed;  ///< for an advisor that proposes levels, and a hand that learns
};

/// Carries records from the workers to the thread that owns the store.
class Queue {
 public:
  explicit Queue(std::size_t room) : room_(room) {}

  void push(std::size_t work, const data::TrialRecord& record) {
    std::unique_lock lock(mutex_);
    drained_.wait(lock, [&] { return records_.size() < room_; });
    records_.emplace_back(work, record);
    if (records_.size() >= room_) done_.notify_all();
  }
  void worker_done(const std::exception_ptr& error) {
    const std::lock_guard lock(mutex_);
    ++workers_done_;
    if (error && !error_) error_ = error;
    done_.notify_all();
  }
  /// The thread that owns the store keeps answers to a page before the session's next trial.
  void push(std::size_t work, const data::PageAnswer& answer) {
    const std::lock_guard lock(mutex_);
    if (pages_.empty() || pages_.back().first != work) pages_.emplace_back().first = work;
    pages_.back().second.push_back(answer);
  }
  void push(std::size_t work, std::int64_t at_ns, const std::string& note) {
    const std::lock_guard lock(mutex_);
    notes_.push_back({work, at_ns, note});
  }
  struct Note {
    std::size_t work = 0;
    std::int64_t at_ns = 0;
    std::string text;
  };
  std::deque<Note> take_notes() {
    const std::lock_guard lock(mutex_);
    return std::exchange(notes_, {});
  }
  std::deque<std::pair<std::size_t, std::vector<data::PageAnswer>>> take_pages() {
    const std::lock_guard lock(mutex_);
    return std::exchange(pages_, {});
  }
  /// Waits for up to 0.2 s, or until the workers are done or held up; takes the new records.
  std::deque<std::pair<std::size_t, data::TrialRecord>> take(int workers, bool& all_done) {
    std::unique_lock lock(mutex_);
    done_.wait_for(lock, std::chrono::milliseconds(200),
                   [&] { return workers_done_ == workers || records_.size() >= room_; });
    all_done = workers_done_ == workers;
    drained_.notify_all();
    return std::exchange(records_, {});
  }
  void rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  const std::size_t room_;
  std::mutex mutex_;
  std::condition_variable drained_, done_;
  std::deque<std::pair<std::size_t, data::TrialRecord>> records_;
  std::deque<std::pair<std::size_t, std::vector<data::PageAnswer>>> pages_;
  std::deque<Note> notes_;
  int workers_done_ = 0;
  std::exception_ptr error_;
};

class QueueLog final : public TrialLog {
 public:
  /// \param given  answers to pages in earlier runs of the session
  QueueLog(Queue& queue, std::size_t work, std::vector<data::PageAnswer> given)
      : queue_(queue), work_(work), given_(std::move(given)) {}
  int begin(const data::TrialRecord&, std::int64_t) override { return 1; }
  void finish(const data::TrialRecord& record) override { queue_.push(work_, record); }
  void cut_off(const std::string& reason) override {
    throw std::runtime_error("a simulated trial was cut off: " + reason);
  }
  void answered(const data::PageAnswer& answer) override {
    queue_.push(work_, answer);
    given_.push_back(answer);
  }
  void note(std::int64_t at_ns, const std::string& text) override {
    queue_.push(work_, at_ns, text);
  }
  std::vector<data::PageAnswer> answers() override { return given_; }

 private:
  Queue& queue_;
  std::size_t work_;
  std::vector<data::PageAnswer> given_;
};

protocols::SessionPlan plan_of(const protocols::Protocol& protocol, const Work& work) {
  protocols::SessionPlan plan(protocol, work.participant.enrolled_number, work.session);
  for (const protocols::TrialOutcome& outcome : work.answers) plan.answered(outcome);
  for (const std::string& note : work.notes) end_as_noted(plan, note);
  return plan;
}

void run_session(const SimulatedStudy& study, const Work& work, std::size_t index, Queue& queue,
                 const StudyPlan& plan, const std::function<bool()>& halting) {
  std::unique_ptr<SocketAdvisor> advisor;
  if (!plan.advisor.empty())
    advisor = std::make_unique<SocketAdvisor>(
        study.protocol,
        SocketAdvisor::Settings{plan.advisor, plan.advisor_time_out,
                                work.participant.enrolled_number, work.session},
        work.completed);
  QueueLog log(queue, index, work.page_answers);
  run_simulated_session(study,
                        {work.participant.enrolled_number, plan_of(study.protocol, work),
                         work.clock_ns, work.info.clock, advisor.get(), work.completed},
                        log, halting);
}

/// Refuses a participant who is enrolled under two texts of one protocol: it would count twice.
void refuse_changed(data::Store& store, const data::ProtocolInfo& now) {
  for (const data::ProtocolInfo& before : store.protocols()) {
    if (before.name != now.name || before.sha256 == now.sha256 ||
        store.participants(before.sha256).empty())
      continue;
    throw data::StoreRefused(
        store.path() + ": holds participants of another text of protocol '" + now.name + "' (" +
        protocols::in_words(protocols::difference(before.text, now.text)) +
        "); use that text, give the changed protocol another name, or use another database");
  }
}

std::vector<Work> unfinished_work(const protocols::Protocol& protocol, data::Store& store,
                                  const participants::SimulatedSettings& settings,
                                  const StudyPlan& plan, StudyProgress& progress) {
  std::vector<Work> todo;
  const data::ProtocolInfo info = info_of(protocol);
  refuse_changed(store, info);
  for (const int number : plan.numbers) {
    const protocols::Protocol& shown = protocols::protocol_of(protocol, number);
    const data::Participant participant =
        store.enrol(info, simulated_code(number), number, true, plan.seed);
    for (int session = 1; session <= shown.sessions.count; ++session) {
      Work work;
      work.participant = participant;
      work.session = session;
      const data::SessionProgress before = store.progress(participant, session);
      if (before.last_end && before.observer_sha256 != settings.sha256) {
        throw data::StoreRefused(
            store.path() + ": session " + std::to_string(session) + " of participant " +
            participant.code + " was simulated with other settings; use those or another database");
      }
      for (const data::TrialRecord& record : before.completed)
        work.answers.push_back(outcome_of(record));
      for (const data::StoredNote& note : store.notes())
        if (note.participant.id == participant.id && note.session == session)
          work.notes.push_back(note.text);
      const bool learns = std::ranges::any_of(shown.blocks, [](const protocols::TaskBlock& block) {
        return block.reaching.has_value();
      });
      if (!plan.advisor.empty() || learns) work.completed = before.completed;
      work.clock_ns = before.latest_ns;
      work.info = simulated_run(shown, settings, number, session);
      if (!shown.pages.empty()) work.page_answers = store.answers_in_force(participant, session);
      const protocols::SessionPlan trials = plan_of(protocol, work);
      progress.recorded += static_cast<std::int64_t>(trials.done());
      progress.expected += static_cast<std::int64_t>(trials.size());
      if (!trials.finished()) todo.push_back(std::move(work));
    }
  }
  return todo;
}

/// The store's side: begins a run with its first record, ends it when its session is complete.
class Recorder {
 public:
  Recorder(const protocols::Protocol& protocol, data::Store& store, std::vector<Work>& work,
           std::string event)
      : store_(store), work_(work), event_(std::move(event)) {
    for (const Work& w : work_) plans_.push_back(plan_of(protocol, w));
  }

  void record(std::deque<std::pair<std::size_t, data::TrialRecord>>&& came,
              StudyProgress& progress) {
    std::map<std::size_t, std::vector<data::TrialRecord>> by_work;
    for (auto& [index, record] : came) by_work[index].push_back(std::move(record));
    for (auto& [index, records] : by_work) {
      const data::Run& run = run_of(index);
      store_.record_simulated(run, records);
      protocols::SessionPlan& plan = plans_[index];
      for (const data::TrialRecord& record : records) {
        StudyProgress::Answers& answers = progress.by_block[record.task.block_name];
        ++answers.trials;
        if (record.timed_out) ++answers.unanswered;
        const std::size_t size = plan.size();
        plan.answered(outcome_of(record));
        // Fewer trials if a procedure has ended early.
        progress.expected +=
            static_cast<std::int64_t>(plan.size()) - static_cast<std::int64_t>(size);
      }
      progress.recorded += static_cast<std::int64_t>(records.size());
      progress.this_run += static_cast<std::int64_t>(records.size());
      std::int64_t& clock = work_[index].clock_ns;
      progress.simulated_seconds += static_cast<double>(records.back().response_ns - clock) * 1e-9;
      clock = records.back().response_ns;
      if (plan.finished()) {
        finished_.push_back(index);
      }
    }
  }
  /// Call after the trials of the same time: pages and notes after the last trial belong to its
  /// run, too.
  void record(const std::deque<std::pair<std::size_t, std::vector<data::PageAnswer>>>& pages) {
    for (const auto& [index, answers] : pages) store_.add_page_answers(run_of(index), answers);
  }
  void record(const std::deque<Queue::Note>& notes, StudyProgress& progress) {
    for (const Queue::Note& note : notes) {
      store_.add_note(run_of(note.work), note.at_ns, note.text);
      if (note.text.find(kBlockEnded) != std::string::npos) ends_.push_back(note);
    }
    // A note may come before the last trial of its block does.
    std::erase_if(ends_, [&](const Queue::Note& note) {
      protocols::SessionPlan& plan = plans_[note.work];
      const std::size_t size = plan.size();
      if (!end_as_noted(plan, note.text)) return false;
      progress.expected += static_cast<std::int64_t>(plan.size()) - static_cast<std::int64_t>(size);
      if (plan.finished()) finished_.push_back(note.work);
      return true;
    });
  }
  void end_finished() {
    for (const std::size_t index : std::exchange(finished_, {})) {
      store_.end_run(run_of(index), data::RunEnd::done, work_[index].clock_ns);
      runs_.erase(index);
    }
  }
  void pause() {
    for (const auto& [index, run] : runs_)
      store_.end_run(run, data::RunEnd::paused, work_[index].clock_ns);
    runs_.clear();
  }

 private:
  const data::Run& run_of(std::size_t index) {
    auto run = runs_.find(index);
    if (run == runs_.end()) {
      const data::RunInfo& info = work_[index].info;
      run = runs_.emplace(index, store_.begin_run(work_[index].participant, info)).first;
      if (!event_.empty()) store_.add_note(run->second, info.clock.monotonic_ns, event_);
    }
    return run->second;
  }

  data::Store& store_;
  std::vector<Work>& work_;
  std::vector<std::size_t> finished_;
  std::deque<Queue::Note> ends_;  ///< of blocks, by a program, whose last trial is not recorded
  const std::string event_;
  std::vector<protocols::SessionPlan> plans_;
  std::map<std::size_t, data::Run> runs_;
};

/// The behaviour of simulated participants of each group.
class SimulatedGroups {
 public:
  /// \param protocol, settings  must outlive it. \throws as SimulatedStudy
  SimulatedGroups(const protocols::Protocol& protocol,
                  const participants::SimulatedSettings& settings, std::uint64_t seed,
                  const participants::JudgementOf& planned)
      : groups_(protocol.groups) {
    const auto add = [&](const protocols::Protocol& shown, const std::string& group) {
      studies_.push_back(std::make_unique<SimulatedStudy>(
          shown, participants::settings_of_group(settings, group), seed));
      studies_.back()->planned = planned;
    };
    if (!groups_.any()) add(protocol, "");
    for (std::size_t i = 0; i < protocol.group_protocols.size(); ++i)
      add(*protocol.group_protocols[i], groups_.true_name(i));
  }
  const SimulatedStudy& study_of(int participant_number) const {
    return *studies_[groups_.group(participant_number)];
  }

 private:
  const GroupAssignment& groups_;
  std::vector<std::unique_ptr<SimulatedStudy>> studies_;
};

devices::SimulatedStylus simulated_stylus(const protocols::Protocol& protocol,
                                          const participants::SimulatedSettings& settings) {
  return {settings.device, settings.hand, protocol.stylus.length, protocol.stylus.grip,
          1 / protocol.servo_rate};
}

}  // namespace

SimulatedStudy::SimulatedStudy(const protocols::Protocol& p,
                               const participants::SimulatedSettings& s, std::uint64_t seed_)
    : protocol(p),
      settings(s),
      library(p),
      // Two equal shapes are never told apart, so the observer continues to perceive.
      hypotheses({stimuli::ObjectSpec{}, stimuli::ObjectSpec{}}),
      of_blocks(participants::block_hypotheses(checked(p, library, s))),
      seed(seed_) {}

void run_simulated_session(const SimulatedStudy& study, const SimulatedSession& session,
                           TrialLog& log, const std::function<bool()>& halting) {
  const protocols::Protocol& protocol = study.protocol;
  const participants::SimulatedSettings own =
      participants::individual(study.settings, study.seed, session.participant);
  devices::SimulatedStylus stylus(own.device, own.hand, protocol.stylus.length,
                                  protocol.stylus.grip, 1 / protocol.servo_rate);
  servo::VirtualClock clock(session.clock_ns);
  servo::Servo servo(stylus, clock, protocol.servo_rate, servo::ForceLimits{},
                     workspace_of(protocol));
  if (protocol.passivity_controller) servo.control_passivity();
  participants::TaskParticipant participant(own, study.hypotheses, study.of_blocks, stylus,
                                            protocol, study.seed, session.participant,
                                            study.planned);
  const Station station{protocol, study.library, session.plan, servo,
                        clock,    session.utc,   log,          session.advisor};
  for (const data::TrialRecord& record : session.completed) participant.learn_from(record);
  Session trials(station, participant);
  // A shown trial is recorded, even if the run stops after it.
  while (trials.state() != Session::State::end &&
         (trials.state() == Session::State::response || !halting())) {
    trials.step();
  }
}

std::vector<int> first_numbers(int participants) {
  std::vector<int> numbers(static_cast<std::size_t>(participants));
  std::iota(numbers.begin(), numbers.end(), 1);
  return numbers;
}

data::RunInfo simulated_run(const protocols::Protocol& protocol,
                            const participants::SimulatedSettings& settings, int participant,
                            int session) {
  constexpr std::int64_t kDay_ns = 86'400'000'000'000;
  constexpr std::int64_t kFirstMorning_ns = 946'717'200'000'000'000;  // 2000-01-01T09:00:00Z
  const std::int64_t day =
      (participant - 1) * static_cast<std::int64_t>(protocol.sessions.count) + session - 1;
  data::RunInfo info;
  info.session = session;
  info.clock = {kFirstMorning_ns + day * kDay_ns, 0};
  info.program_version = PALPATE_VERSION;
  info.build = build_description();
  info.device = "simulated";
  info.response_device = "simulated";
  info.response_latency = 0;
  info.observer_sha256 = settings.sha256;
  return info;
}

bool simulate_in_memory(
    const protocols::Protocol& protocol, const participants::SimulatedSettings& settings,
    const std::vector<int>& numbers, std::uint64_t seed, const std::atomic<bool>& stop,
    const std::function<void(int, const data::TrialRecord&, std::uint64_t)>& visit,
    const participants::JudgementOf& planned) {
  const SimulatedGroups groups(protocol, settings, seed, planned);
  for (const int number : numbers) {
    const SimulatedStudy& study = groups.study_of(number);
    for (int session = 1; session <= study.protocol.sessions.count; ++session) {
      VisitingLog log([&](const data::TrialRecord& record) {
        const double ticks = *record.contact_share * static_cast<double>(record.ticks);
        visit(number, record, static_cast<std::uint64_t>(std::llround(ticks)));
      });
      run_simulated_session(study,
                            {number, protocols::SessionPlan(protocol, number, session), 0,
                             simulated_run(study.protocol, settings, number, session).clock},
                            log, [&stop] { return stop.load(); });
      if (stop) return false;
    }
  }
  return true;
}

LimitedForSimulation limit_for_simulation(protocols::Protocol& protocol,
                                          const participants::SimulatedSettings& settings) {
  const devices::SimulatedStylus stylus = simulated_stylus(protocol, settings);
  const std::vector<LimitedMaterial> limited = limit_materials(protocol, stylus.capabilities());
  LimitedForSimulation out;
  for (const LimitedMaterial& one : limited) out.texts.push_back(one.text);
  if (!limited.empty())
    out.event = to_json_text(limited, stylus.capabilities(), protocol.servo_rate);
  return out;
}

std::vector<std::string> simulation_faults(const protocols::Protocol& protocol,
                                           const StimulusLibrary& library,
                                           const participants::SimulatedSettings& settings) {
  devices::SimulatedStylus device = simulated_stylus(protocol, settings);
  std::vector<std::string> faults = incompatibilities(protocol, library, device.capabilities());
  if (protocols::is_external(protocol)) {
    faults.emplace_back(
        "another program chooses the stimuli of the task 'external': palpate serve runs it");
  }
  const std::vector<std::string> own = participants::unknown_shapes(protocol);
  faults.insert(faults.end(), own.begin(), own.end());
  try {  // patched settings may be invalid
    const participants::ShapeHypotheses hypotheses({stimuli::ObjectSpec{}});
    participants::SimulatedParticipant(participants::individual(settings, 0, 1), hypotheses, device,
                                       protocol, 0, 1);
  } catch (const std::invalid_argument& error) {
    faults.emplace_back(error.what());
  }
  return faults;
}

std::string simulated_code(int number) {
  std::string digits = std::to_string(number);
  return "S" + std::string(digits.size() < 3 ? 3 - digits.size() : 0, '0') + digits;
}

StudyProgress simulate_study(const protocols::Protocol& protocol, data::Store& store,
                             const participants::SimulatedSettings& settings, const StudyPlan& plan,
                             const std::atomic<bool>& stop,
                             const std::function<void(const StudyProgress&)>& report) {
  const SimulatedGroups groups(protocol, settings, plan.seed, plan.planned);
  std::atomic<bool> failed{false};  // a worker or the store threw
  const auto halting = [&] { return stop || failed; };

  StudyProgress progress;
  std::vector<Work> work = unfinished_work(protocol, store, settings, plan, progress);
  Recorder recorder(protocol, store, work, plan.event);
  const std::vector<Work> sessions =
      work;  // the workers' own copy: the recorder moves its clocks on
  Queue queue(protocol.samples ? 8 : 4096);
  std::atomic<std::size_t> next{0};
  const int workers = std::max(1, std::min(plan.jobs, static_cast<int>(work.size())));
  const auto worker = [&] {
    std::exception_ptr error;
    try {
      for (std::size_t i = next++; i < sessions.size() && !halting(); i = next++) {
        run_session(groups.study_of(sessions[i].participant.enrolled_number), sessions[i], i, queue,
                    plan, halting);
      }
    } catch (...) {
      error = std::current_exception();
      failed = true;
    }
    queue.worker_done(error);
  };
  std::vector<std::jthread> threads;
  threads.reserve(static_cast<std::size_t>(workers));
  for (int i = 0; i < workers; ++i) threads.emplace_back(worker);
  std::exception_ptr failure;
  for (bool all_done = false; !all_done;) {
    auto came = queue.take(workers, all_done);
    if (failure) continue;  // the workers finish their trials; no more can be recorded
    try {
      recorder.record(std::move(came), progress);
      recorder.record(queue.take_pages());
      recorder.record(queue.take_notes(), progress);
      if (all_done) recorder.end_finished();
      if (report) report(progress);
    } catch (...) {
      failure = std::current_exception();
      failed = true;
    }
  }
  threads.clear();
  if (failure) std::rethrow_exception(failure);
  recorder.pause();
  queue.rethrow();
  return progress;
}

}  // namespace palpate::runner::session
