#include "runner/commands/register/rehearsal.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <filesystem>
#include <mutex>
#include <thread>
#include <utility>

#include "analysis/report/report.h"
#include "analysis/statistics/analysis.h"
#include "analysis/statistics/power.h"
#include "data/base/checksum.h"
#include "data/base/random.h"
#include "data/export/csv.h"
#include "data/store/store.h"
#include "runner/build_info.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/protocol_choice.h"
#include "runner/session/run_record.h"
#include "runner/session/simulated_study.h"

namespace palpate::runner::commands {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000, kDay_ns = 86'400 * kSecond_ns;
constexpr std::int64_t kFirstMorning_ns = 946'717'200 * kSecond_ns;  // 2000-01-01T09:00:00Z
constexpr double kBetweenTrials = 5;                                 // s

}  // namespace

PlannedStudies::PlannedStudies(const protocols::Protocol& protocol,
                               const analysis::StudyModel& model, std::size_t participants,
                               std::uint64_t seed)
    : protocol_(protocol), model_(model), no_effect_(analysis::without_effect(model)), seed_(seed) {
  for (std::size_t p = 0; p < participants; ++p)
    schedules_.push_back(protocols::schedule(protocol, static_cast<int>(p) + 1));
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli)
    shape_of_stimulus_.push_back(static_cast<std::size_t>(
        std::ranges::find(model.shapes, stimulus.name) - model.shapes.begin()));
}

double PlannedStudies::typical_time(const protocols::Protocol& protocol, double too_fast) {
  return std::sqrt(too_fast * protocol.response.time_out);
}

std::vector<PlannedStudies::Outcome> PlannedStudies::outcomes(std::size_t participant,
                                                              std::size_t study, bool with_effect,
                                                              double typical_time) const {
  std::vector<analysis::ModelTrial> trials;
  for (const protocols::Trial& trial : schedules_[participant])
    trials.push_back({shape_of_stimulus_[static_cast<std::size_t>(trial.stimulus)],
                      trial.renderer == protocols::RendererKind::ray});
  Random random(seed_, {with_effect ? 1U : 0U, study, participant});
  const auto answers =
      analysis::draw_answers(with_effect ? model_ : no_effect_, typical_time, trials, random);
  std::vector<Outcome> out;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    Outcome& one = out.emplace_back();
    one.time = answers[i].time;
    one.answer = (trials[i].shape + answers[i].other) % model_.shapes.size();
    one.timed_out = one.time >= protocol_.response.time_out ||
                    (!answers[i].usable && one.answer == trials[i].shape);
    one.correct = !one.timed_out && one.answer == trials[i].shape;
    if (one.timed_out) one.time = protocol_.response.time_out;
  }
  return out;
}

void PlannedStudies::write(const std::string& folder, const std::string& csv,
                           const std::string& codebook, bool with_effect,
                           double typical_time) const {
  namespace fs = std::filesystem;
  fs::create_directory(folder);
  data::Store store = data::Store::open((fs::path(folder) / "study.db").string(),
                                        data::Store::Mode::write_or_create);
  const data::ProtocolInfo info = session::info_of(protocol_);
  for (std::size_t p = 0; p < schedules_.size(); ++p) {
    const int number = static_cast<int>(p) + 1;
    const data::Participant participant =
        store.enrol(info, session::simulated_code(number), number, true, seed_);
    const std::vector<Outcome> all = outcomes(p, 0, with_effect, typical_time);
    for (int session = 1; session <= protocol_.sessions.count; ++session) {
      data::RunInfo run_info;
      run_info.session = session;
      run_info.clock = {
          kFirstMorning_ns +
              (static_cast<std::int64_t>(p) * protocol_.sessions.count + session - 1) * kDay_ns,
          0};
      run_info.program_version = PALPATE_VERSION;
      run_info.build = build_description();
      run_info.device = run_info.response_device = "none: drawn from the model of a plan";
      std::vector<data::TrialRecord> records;
      double now = 0;
      for (std::size_t i = 0; i < all.size(); ++i) {
        const protocols::Trial& trial = schedules_[p][i];
        if (trial.session != session) continue;
        data::TrialRecord& record = records.emplace_back();
        record.session = session;
        record.block = trial.block;
        record.trial = trial.trial;
        record.renderer = protocols::to_string(trial.renderer);
        record.shape = protocol_.stimuli[static_cast<std::size_t>(trial.stimulus)].name;
        if (!all[i].timed_out) record.response = model_.shapes[all[i].answer];
        record.correct = all[i].correct;
        record.timed_out = all[i].timed_out;
        record.practice = trial.practice;
        record.orientation_wxyz = {trial.orientation.w, trial.orientation.x, trial.orientation.y,
                                   trial.orientation.z};
        record.response_time = all[i].time;
        record.onset_ns = std::llround(1e9 * now);
        record.response_ns = std::llround(1e9 * (now + all[i].time));
        now += all[i].time + kBetweenTrials;
      }
      if (records.empty()) continue;
      const data::Run run = store.begin_run(participant, run_info);
      store.record_simulated(run, records);
      store.end_run(run, data::RunEnd::done, records.back().response_ns);
    }
  }
  data::ExportSettings settings = export_settings();
  settings.codebook = codebook;
  data::export_csv(store, csv, settings);
}

analysis::TrialTable PlannedStudies::table(const analysis::TrialTable& like, std::size_t study,
                                           bool with_effect, double typical_time) const {
  analysis::TrialTable out = like;
  out.rows.clear();
  out.rows.reserve(like.rows.size());
  const auto at = [](const std::vector<std::string>& names, const std::string& name) {
    return static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
  };
  const std::array<std::size_t, 2> renderer = {at(like.renderers, "point"),
                                               at(like.renderers, "ray")};
  std::vector<std::size_t> shapes, answers;
  for (const std::string& shape : model_.shapes) {
    shapes.push_back(at(like.shapes, shape));
    answers.push_back(at(like.answers, shape));
  }
  for (std::size_t p = 0; p < schedules_.size(); ++p) {
    const std::vector<Outcome> all = outcomes(p, study, with_effect, typical_time);
    std::uint32_t position = 0;
    std::array<std::uint32_t, 2> exposure{};
    for (std::size_t i = 0; i < all.size(); ++i) {
      const protocols::Trial& trial = schedules_[p][i];
      if (trial.practice) continue;
      const std::size_t r = trial.renderer == protocols::RendererKind::ray ? 1 : 0;
      analysis::TrialRow row;
      row.participant = static_cast<std::uint32_t>(p);
      row.renderer = static_cast<std::uint16_t>(renderer[r]);
      row.shape = static_cast<std::uint16_t>(
          shapes[shape_of_stimulus_[static_cast<std::size_t>(trial.stimulus)]]);
      row.answer = all[i].timed_out ? -1 : static_cast<std::int32_t>(answers[all[i].answer]);
      row.correct = all[i].correct;
      row.timed_out = all[i].timed_out;
      row.response_time = all[i].time;
      row.position = ++position;
      row.exposure = ++exposure[r];
      out.rows.push_back(row);
    }
  }
  return out;
}

std::vector<Rehearsal> PlannedStudies::rehearse(
    const analysis::TrialTable& first, const Registration& registration, std::size_t studies,
    std::size_t jobs, const std::function<void(std::size_t)>& progress) const {
  const std::vector<analysis::Hypothesis>& hypotheses = registration.hypotheses;
  std::vector<Rehearsal> out(hypotheses.size());
  analysis::AnalysisSettings settings;
  settings.too_fast = registration.too_fast;
  std::atomic<std::size_t> next{0}, done{0};
  std::mutex mutex;
  std::exception_ptr failed;
  const auto work = [&](bool reports) {
    for (std::size_t i = next++; i < 2 * studies; i = next++) {
      try {
        const bool with_effect = i < studies;
        const analysis::Analysis analysis = analysis::analyze(
            table(first, i % studies, with_effect, registration.typical_time), settings, "");
        const analysis::NamedResults results =
            analysis::named_results(analysis::report_json(analysis), registration.alpha);
        std::vector<analysis::Verdict> verdicts;
        for (const analysis::Hypothesis& one : hypotheses)
          verdicts.push_back(analysis::judge(one, results).verdict);
        const std::lock_guard lock(mutex);
        for (std::size_t h = 0; h < out.size(); ++h)
          (with_effect ? out[h].with_effect : out[h].without_effect).add(verdicts[h]);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!failed) failed = std::current_exception();
        next = 2 * studies;
      }
      ++done;
      if (reports && progress) progress(done);
    }
  };
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 1; i < jobs; ++i) threads.emplace_back([&work] { work(false); });
    work(true);
  }
  if (failed) std::rethrow_exception(failed);
  return out;
}

}  // namespace palpate::runner::commands
