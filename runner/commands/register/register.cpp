// `palpate register`: a registration of a study, before its first session.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iostream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/report/plan_report.h"
#include "analysis/report/report.h"
#include "analysis/statistics/analysis.h"
#include "analysis/statistics/jobs.h"
#include "analysis/statistics/power.h"
#include "analysis/statistics/sensitivity.h"
#include "analysis/text.h"
#include "data/base/checksum.h"
#include "data/base/json_text.h"
#include "data/base/random.h"
#include "data/base/text.h"
#include "data/export/csv.h"
#include "data/files/atomic_folder.h"
#include "data/store/store.h"
#include "protocols/json_document.h"
#include "protocols/parse.h"
#include "protocols/protocol.h"
#include "protocols/schedule.h"
#include "runner/build_info.h"
#include "runner/commands/register/registration.h"
#include "runner/commands/register/registration_text.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/progress_line.h"
#include "runner/commands/shared/protocol_choice.h"
#include "runner/commands/shared/sealed_folder.h"
#include "runner/participants/simulated_settings.h"
#include "runner/session/run_record.h"
#include "runner/session/simulated_study.h"

namespace palpate::runner::commands {
namespace {

// Studies simulated from a plan's model before there are data, to rehearse the analysis and the
// hypotheses.

class PlannedStudies {
 public:
  /// The shapes of the model are those of the protocol, which has two renderers.
  PlannedStudies(const protocols::Protocol& protocol, const analysis::StudyModel& model,
                 std::size_t participants, std::uint64_t seed);

  /// s; the plan has only ratios of times, so this is the geometric middle between the limit of too
  /// fast answers and the time-out, to lose the fewest trials at either end.
  static double typical_time(const protocols::Protocol& protocol, double too_fast);

  /// Writes a study with the planned effect, or none, as 'palpate export' writes data.
  /// \param folder  for a database, which is removed again \param csv  the file
  /// \param codebook  the file; "": none
  void write(const std::string& folder, const std::string& csv, const std::string& codebook,
             bool with_effect, double typical_time) const;

  /// Verdicts on hypotheses in studies with the planned effect and in as many without; the first of
  /// each are those of write(). The result does not depend on `jobs`.
  /// \param first  the trials of the first study \param progress  called with the share that is
  /// done
  std::vector<Rehearsal> rehearse(const analysis::TrialTable& first,
                                  const Registration& registration, std::size_t studies,
                                  std::size_t jobs,
                                  const std::function<void(double)>& progress) const;

 private:
  struct Outcome {
    bool correct = false, timed_out = false;
    std::size_t answer = 0;  ///< shape of the model
    double time = 0;         ///< s
  };
  /// Of all trials of a participant, practice included.
  std::vector<Outcome> outcomes(std::size_t participant, std::size_t study, bool with_effect,
                                double typical_time) const;
  analysis::TrialTable table(const analysis::TrialTable& like, std::size_t study, bool with_effect,
                             double typical_time) const;

  const protocols::Protocol& protocol_;
  analysis::StudyModel model_, no_effect_;
  std::uint64_t seed_;
  std::vector<std::vector<protocols::Trial>> schedules_;  ///< by participant
  std::vector<std::size_t> shape_of_stimulus_;            ///< index into the model's
};

constexpr std::int64_t kSecond_ns = 1'000'000'000, kDay_ns = 86'400 * kSecond_ns;
constexpr std::int64_t kFirstMorning_ns = 946'717'200 * kSecond_ns;  // 2000-01-01T09:00:00Z
constexpr double kBetweenTrials = 5;                                 // s

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

std::vector<Rehearsal> PlannedStudies::rehearse(const analysis::TrialTable& first,
                                                const Registration& registration,
                                                std::size_t studies, std::size_t jobs,
                                                const std::function<void(double)>& progress) const {
  const std::vector<analysis::Hypothesis>& hypotheses = registration.hypotheses;
  std::vector<Rehearsal> out(hypotheses.size());
  analysis::AnalysisSettings settings;
  settings.too_fast = registration.too_fast;
  std::mutex mutex;
  const auto one_study = [&](std::size_t i) {
    const bool with_effect = i < studies;
    const analysis::Analysis analysis = analysis::analyze(
        table(first, i % studies, with_effect, registration.typical_time), settings, "");
    const analysis::NamedResults results =
        analysis::named_results(analysis::report_json(analysis), registration.alpha);
    std::vector<analysis::Verdict> verdicts;
    verdicts.reserve(hypotheses.size());
    for (const analysis::Hypothesis& one : hypotheses)
      verdicts.push_back(analysis::judge(one, results).verdict);
    const std::lock_guard lock(mutex);
    for (std::size_t h = 0; h < out.size(); ++h)
      (with_effect ? out[h].with_effect : out[h].without_effect).add(verdicts[h]);
  };
  analysis::do_jobs(2 * studies, jobs, one_study, progress);
  return out;
}

namespace po = boost::program_options;
namespace fs = std::filesystem;

constexpr const char* kMark = "registration.json";

struct RegisterOptions {
  std::string protocol, plan, hypotheses, out, database;
  std::size_t participants = 0, studies = 200, jobs = 1;
  double too_fast = 0.2;
  std::uint64_t seed = 1;
  bool force = false;
};

std::optional<RegisterOptions> parse_options(const std::vector<std::string>& args) {
  RegisterOptions options;
  options.jobs = std::max(1U, std::thread::hardware_concurrency());
  CommandLine line;
  line.usage =
      "palpate register PROTOCOL.json --plan plan.json --hypotheses hypotheses.json --out FOLDER\n"
      "       [--participants N] [--too-fast-s SECONDS] [--db FILE] [--force]";
  line.summary =
      "Makes a registration of a study before its first session: a folder with the answers to the\n"
      "questions of the OSF Preregistration form that protocol and plan give, the hypotheses as\n"
      "conditions on the numbers of the analysis, the checksum of every participant's order of\n"
      "trials, SIMULATED data with the planned effect and with none, and their analysis. What\n"
      "only the lab can say is marked FILL IN. Nothing is sent anywhere: deposit the folder.";
  line.example =
      R"(  palpate plan --db pilot.db --effect cone=22,cube=11 --trials 76 --json plan.json
  palpate register protocols/ho2000.json --plan plan.json --hypotheses hypotheses.json \
      --out registration
hypotheses.json:
  [{"id": "H1", "text": "Cones are found faster with the ray.",
    "corroborated": "paired.cone.p_holm < alpha && paired.cone.reduction > 0",
    "refuted": "paired.cone.ci95_high < 5"}])";
  line.positional_names = {"PROTOCOL.json"};
  auto add = line.options.add_options();
  add("plan", po::value(&options.plan)->required()->value_name("FILE"),
      "what 'palpate plan --json' wrote for the protocol's repetitions");
  add("hypotheses", po::value(&options.hypotheses)->required()->value_name("FILE"),
      "the hypotheses, as below");
  add("out", po::value(&options.out)->required()->value_name("FOLDER"), "a new folder");
  add("participants", po::value(&options.participants)->value_name("N"),
      "planned number; default: that of the plan");
  add("too-fast-s", po::value(&options.too_fast)->default_value(0.2, "0.2")->value_name("SECONDS"),
      "correct answers faster than this will be excluded from the times");
  add("db", po::value(&options.database)->value_name("FILE"),
      "the study's database, if it exists; the registration states its number of sessions");
  add("studies", po::value(&options.studies)->default_value(200)->value_name("N"),
      "simulated with the planned effect, and as many with none");
  add("seed", po::value(&options.seed)->default_value(1)->value_name("S"),
      "of the simulated studies");
  add("jobs", po::value(&options.jobs)->default_value(options.jobs)->value_name("J"),
      "studies simulated at a time");
  add("force", po::bool_switch(&options.force), "replace an earlier registration");
  const auto values = line.parse(args);
  if (!values) return std::nullopt;
  options.protocol = (*values)["PROTOCOL.json"].as<std::string>();
  if (values->count("participants") &&
      (options.participants < kFewestParticipants || options.participants > kMostParticipants))
    throw UsageError("--participants: must be 2 to " + std::to_string(kMostParticipants));
  if (!(options.too_fast > 0 && options.too_fast <= kMostTooFast))
    throw UsageError("--too-fast-s: must be above 0, at most 60 s");
  if (options.studies < 20 || options.studies > 100'000)
    throw UsageError("--studies: must be 20 to 100000");
  if (options.jobs < 1 || options.jobs > 256) throw UsageError("--jobs: must be 1 to 256");
  return options;
}

/// Refuses to replace a registration that the lab has filled in.
void require_replaceable(const RegisterOptions& options) {
  require_replaceable_folder(options.out, options.force, kMark, files_to_fill_in());
  if (!options.force || !fs::exists(fs::path(options.out) / kMark)) return;
  for (const std::string& file : filled_in(options.out, read_registration(options.out)).files)
    throw UsageError(printable(options.out) + ": " + file +
                     " has been filled in and would be lost; name another folder");
}

protocols::Protocol read_protocol(const std::string& path) {
  protocols::Protocol protocol = protocols::parse_protocol(path);
  require_registrable(protocol, path);
  return protocol;
}

/// The plan, with a curve for the protocol's trials and the same shapes. \throws UsageError
analysis::PlanRecord read_fitting_plan(const std::string& path, const std::string& text,
                                       const protocols::Protocol& protocol) {
  analysis::PlanRecord plan = analysis::read_plan(text, path);
  std::vector<std::string> planned = plan.model.shapes, shown;
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli) shown.push_back(stimulus.name);
  std::ranges::sort(planned);
  std::ranges::sort(shown);
  if (planned != shown)
    throw UsageError(path + ": /model/log_ratio: expected a plan for the protocol's shapes (" +
                     printable(analysis::joined(shown)) + "); this one is for " +
                     printable(analysis::joined(planned)));
  const auto trials = static_cast<std::size_t>(protocol.repetitions);
  std::string others;
  for (const auto& curve : plan.curves) {
    if (curve.trials == trials) return plan;
    others += (others.empty() ? "" : ", ") + std::to_string(curve.trials);
  }
  throw UsageError(path + ": /needed: expected a plan for the protocol's " +
                   std::to_string(trials) +
                   " trials of each shape with each renderer; this one is for " + others +
                   ": plan again with --trials " + std::to_string(trials));
}

const analysis::PlanRecord::Curve& curve_of(const Registration& made) {
  return *std::ranges::find(made.plan.curves, static_cast<std::size_t>(made.protocol.repetitions),
                            &analysis::PlanRecord::Curve::trials);
}

std::size_t sample_size(const RegisterOptions& options, const Registration& made) {
  if (options.participants > 0) return options.participants;
  if (const auto& needed = curve_of(made).participants) {
    if (*needed >= 2 && *needed <= kMostParticipants) return *needed;
  }
  throw UsageError(options.plan +
                   ": no number of participants reaches the wanted power; say with --participants "
                   "N how many there will be, or plan again");
}

/// Sessions of protocols of this name.
std::size_t sessions_in(const std::string& database, const std::string& protocol) {
  data::Store store = data::Store::open(database, data::Store::Mode::read_only);
  std::size_t sessions = 0;
  for (const data::ProtocolInfo& info : store.protocols()) {
    if (info.name != protocol) continue;
    for (const data::StoredRun& run : store.runs())
      sessions += run.protocol_sha256 == info.sha256 ? 1 : 0;
  }
  return sessions;
}

std::string share_text(std::size_t n, std::size_t of) {
  const analysis::Interval ends = analysis::wilson_interval(n, of);
  return std::to_string(n) + " of " + std::to_string(of) + " (95 % interval " +
         analysis::fixed(100 * ends.low, 0) + " to " + analysis::fixed(100 * ends.high, 0) + " %)";
}

void warn_of_hypothesis(const analysis::Hypothesis& one, const Rehearsal& rehearsal,
                        double wanted_power, std::vector<std::string>& out) {
  const VerdictCounts &with = rehearsal.with_effect, &without = rehearsal.without_effect;
  const std::size_t all = with.studies() + without.studies();
  for (const auto& [n, words] :
       {std::pair{with.corroborated + without.corroborated, "corroborated"},
        std::pair{with.refuted + without.refuted, "refuted"},
        std::pair{with.undecided + without.undecided, "undecided"}}) {
    if (n == all)
      out.push_back(one.id + " comes out " + words + " in all of " + std::to_string(all) +
                    " simulated studies, with the planned effect and with none: the data cannot "
                    "tell.");
  }
  if (with.refuted + without.refuted == 0)
    out.push_back(one.id + " cannot be refuted: it is refuted in none of " +
                  std::to_string(with.studies()) + " studies with the planned effect and " +
                  std::to_string(without.studies()) + " with no effect.");
  if (analysis::wilson_interval(with.corroborated, with.studies()).high < wanted_power)
    out.push_back(one.id + " lacks power: with the planned effect it is corroborated in " +
                  share_text(with.corroborated, with.studies()) +
                  " simulated studies; the plan "
                  "wants " +
                  analysis::fixed(100 * wanted_power, 0) + " %.");
}

std::vector<std::string> warnings_of(const Registration& made) {
  std::vector<std::string> out;
  const auto& curve = curve_of(made);
  const auto power = curve.power.find(made.participants);
  if (!curve.participants) {
    out.push_back("The plan reaches its power with no number of participants in its range.");
  } else if (made.participants < *curve.participants) {
    out.push_back("The plan wants " + std::to_string(*curve.participants) + " participants; " +
                  std::to_string(made.participants) + " are registered" +
                  (power == curve.power.end()
                       ? "."
                       : ", with a power of " + analysis::fixed(100 * power->second, 0) + " %."));
  }
  const auto orders = static_cast<std::size_t>(protocols::renderer_orders(made.protocol));
  if (made.participants % orders != 0)
    out.push_back("The orders of the renderers repeat after " + std::to_string(orders) +
                  " participants: with " + std::to_string(made.participants) +
                  " they are not balanced.");
  if (!made.plan.pilot_label.empty())
    out.push_back("The plan rests on " + made.plan.pilot_label +
                  ": their standard deviations are a model's.");
  for (std::size_t h = 0; h < made.hypotheses.size(); ++h)
    warn_of_hypothesis(made.hypotheses[h], made.rehearsals[h], made.plan.power, out);
  return out;
}

std::string analyzed(const analysis::TrialTable& table, double too_fast) {
  analysis::AnalysisSettings settings;
  settings.too_fast = too_fast;
  return analysis::report_json(analysis::analyze(table, settings, PALPATE_VERSION));
}

/// The trials of a file in the draft, under its name there.
analysis::TrialTable read_table(const data::AtomicFolder& draft, const std::string& name) {
  analysis::TrialTable table = analysis::read_trials_csv(draft / name);
  table.provenance.source = name;
  return table;
}

/// Writes simulated studies, their analyses and their verdicts on the hypotheses.
void put_simulated(const RegisterOptions& options, const data::AtomicFolder& draft,
                   Registration& made) {
  constexpr const char* kEffect = "simulated/planned-effect.csv";
  constexpr const char* kNone = "simulated/no-effect.csv";
  const PlannedStudies studies(made.protocol, made.plan.model, made.participants, made.seed);
  const std::string scratch = draft / "scratch";
  studies.write(scratch, draft.prepare(kEffect), draft / "codebook.csv", true, made.typical_time);
  fs::remove_all(scratch);
  studies.write(scratch, draft.prepare(kNone), "", false, made.typical_time);
  fs::remove_all(scratch);
  write_member(draft, "simulated/README.md",
               "# SIMULATED data\n\nDrawn from the model of plan.json, in the registered orders of "
               "trials: no person took part. `planned-effect.csv` has the effects that the study "
               "is to find, `no-effect.csv` none. `../codebook.csv` explains the columns.\n");
  const analysis::TrialTable first = read_table(draft, kEffect);
  const std::string with = analyzed(first, made.too_fast);
  const std::string none = analyzed(read_table(draft, kNone), made.too_fast);
  write_member(draft, "analysis-simulated.json",
               nlohmann::ordered_json{{"planned_effect", read_ordered_json(with)},
                                      {"no_effect", read_ordered_json(none)}}
                       .dump(2) +
                   "\n");
  made.hypotheses = analysis::read_hypotheses(made.hypotheses_text, options.hypotheses,
                                              analysis::named_results(with, made.alpha));
  ProgressLine line("simulated studies");
  made.rehearsals = studies.rehearse(first, made, options.studies, options.jobs,
                                     [&](double share) { line.show(share); });
  line.clear();
}

/// Sets the digest.
void write_registration(const data::AtomicFolder& draft, Registration& made) {
  write_member(draft, "protocol.json", made.protocol.source_text);
  for (const data::ProtocolFile& file : made.files) write_member(draft, file.name, file.bytes);
  write_member(draft, "plan.json", made.plan_text);
  write_member(draft, "hypotheses.json", made.hypotheses_text);
  const Form form = registration_form(made);
  write_member(draft, "form.json", form_json(form));
  write_member(draft, "registration.json", registration_json(made));
  write_checksums(draft, files_to_fill_in());
  made.digest = registration_digest(draft / "");
  write_member(draft, files_to_fill_in()[0], markdown_as_made(form, made.digest));
  write_member(draft, files_to_fill_in()[1], osf_as_made(form, made.digest));
}

}  // namespace

int register_command(const std::vector<std::string>& args) {
  const std::optional<RegisterOptions> given = parse_options(args);
  if (!given) return 0;
  const RegisterOptions& options = *given;
  Registration made;
  made.protocol = read_protocol(options.protocol);
  made.files = session::info_of(made.protocol).files;
  require_files_below(made.files);
  made.plan_text = protocols::read_text_file(options.plan);
  made.plan = read_fitting_plan(options.plan, made.plan_text, made.protocol);
  made.hypotheses_text = protocols::read_text_file(options.hypotheses);
  made.participants = sample_size(options, made);
  if (!options.database.empty())
    made.sessions_so_far = sessions_in(options.database, made.protocol.name);
  require_replaceable(options);

  made.made_utc_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(
                         std::chrono::system_clock::now().time_since_epoch())
                         .count();
  made.program_version = PALPATE_VERSION;
  made.build = build_description();
  made.too_fast = options.too_fast;
  made.alpha = made.plan.alpha;
  made.seed = options.seed;
  made.typical_time = PlannedStudies::typical_time(made.protocol, made.too_fast);
  made.participant_version = participants::kDefaultParticipantVersion;
  made.participant_sha256 = participants::load_simulated_settings("").sha256;
  for (std::size_t p = 1; p <= made.participants; ++p)
    made.order_sha256.push_back(order_checksum(order_of(made.protocol, static_cast<int>(p))));

  data::AtomicFolder draft(options.out);
  put_simulated(options, draft, made);
  made.warnings = warnings_of(made);
  write_registration(draft, made);
  draft.commit(options.force);
  for (const std::string& warning : made.warnings)
    std::cerr << "warning: " << printable(warning) << "\n";
  std::cout << printable(options.out) << ": " << made.protocol.name << ", " << made.participants
            << " participants, "
            << analysis::counted(made.hypotheses.size(), "hypothesis", "hypotheses") << "\n"
            << "Digest " << made.digest << "\n"
            << "Answer what is marked FILL IN in registration.md and osf.json, then deposit the "
               "folder. The digest stands in\nboth; with the date of the registry it shows that "
               "nothing was changed later ('palpate check --digest').\n";
  return 0;
}

}  // namespace palpate::runner::commands
