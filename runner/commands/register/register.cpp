// `palpate register`: a registration of a study, before its first session.

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "analysis/report/plan_record.h"
#include "analysis/statistics/sensitivity.h"
#include "analysis/text.h"
#include "data/base/json_text.h"
#include "data/base/text.h"
#include "data/files/atomic_folder.h"
#include "data/store/store.h"
#include "protocols/json_document.h"
#include "protocols/parse.h"
#include "protocols/protocol.h"
#include "protocols/session_plan.h"
#include "protocols/tasks/block_order.h"
#include "runner/build_info.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/study_options.h"
#include "runner/output/progress_line.h"
#include "runner/participants/simulated_settings.h"
#include "runner/registration/answers.h"
#include "runner/registration/planned_conditions.h"
#include "runner/registration/planned_studies.h"
#include "runner/registration/registration.h"
#include "runner/registration/registration_text.h"
#include "runner/registration/sealed_folder.h"
#include "runner/session/run_record.h"
#include "runner/session/simulated_study.h"
#include "runner/study/study_order.h"

namespace palpate::runner::commands {
namespace {

namespace po = boost::program_options;
namespace fs = std::filesystem;

constexpr const char* kMark = "registration.json";

struct RegisterOptions {
  std::string protocol, plan, hypotheses, out, database;
  std::string groups;  ///< "young=12,old=10"; empty: equal ones
  std::size_t participants = 0, jobs = 1;
  std::optional<std::size_t> studies;
  std::vector<std::size_t> looks;
  analysis::Spending spending = analysis::Spending::obrien_fleming;
  double too_fast = 0.2;
  std::uint64_t seed = 1;
  bool force = false;
};

/// "12,18,24".
std::vector<std::size_t> read_looks(const std::string& option) {
  const auto fail = [&] {
    throw UsageError(
        "--looks: expected numbers of participants that rise, such as 12,18,24, at "
        "most " +
        std::to_string(registration::kMostLooks) + " of them and each from " +
        std::to_string(registration::kFewestParticipants) + " to " +
        std::to_string(registration::kMostParticipants) + ", found '" + printable(option, 80) +
        "'");
  };
  std::vector<std::size_t> out;
  std::istringstream stream(option);
  for (std::string word; std::getline(stream, word, ',');) {
    std::size_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() ||
        value < registration::kFewestParticipants || value > registration::kMostParticipants ||
        (!out.empty() && value <= out.back()))
      fail();
    out.push_back(value);
  }
  if (out.empty() || out.size() > registration::kMostLooks || option.ends_with(',')) fail();
  return out;
}

std::optional<RegisterOptions> parse_options(const std::vector<std::string>& args) {
  RegisterOptions options;
  options.jobs = std::max(1U, std::thread::hardware_concurrency());
  CommandLine line;
  line.usage =
      "palpate register PROTOCOL.json --plan plan.json --hypotheses hypotheses.json --out FOLDER\n"
      "       [--participants N] [--looks N,N,N] [--too-fast-s SECONDS] [--db FILE] [--force]";
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
  add("groups", po::value(&options.groups)->value_name("NAME=N,..."),
      "planned number of each group, where the protocol leaves the group to the experimenter; "
      "instead of --participants");
  std::string looks, spending = registration::to_string(options.spending);
  add("looks", po::value(&looks)->value_name("N,N,N"),
      "participants after which the hypotheses are judged, the last of all; alpha is spent over "
      "these looks, and 'alpha' in a hypothesis is that of the look; default: at the end alone");
  add("spending", po::value(&spending)->default_value(spending)->value_name("FUNCTION"),
      "of alpha over the looks: obrien-fleming (little at first) or pocock (much at first)");
  add("too-fast-s", po::value(&options.too_fast)->default_value(0.2, "0.2")->value_name("SECONDS"),
      "correct answers faster than this will be excluded from the times");
  add("db", po::value(&options.database)->value_name("FILE"),
      "the study's database, if it exists; the registration states its number of sessions");
  std::size_t studies = 0;
  add("studies", po::value(&studies)->value_name("N"),
      "simulated with the planned effect, and as many with none; default: 200, with blocks of "
      "tasks "
      "20");
  add("seed", po::value(&options.seed)->default_value(1)->value_name("S"),
      "of the simulated studies");
  add("jobs", po::value(&options.jobs)->default_value(options.jobs)->value_name("J"),
      "studies simulated at a time");
  add("force", po::bool_switch(&options.force), "replace an earlier registration");
  const auto values = line.parse(args);
  if (!values) return std::nullopt;
  options.protocol = (*values)["PROTOCOL.json"].as<std::string>();
  if (values->count("participants") && (options.participants < registration::kFewestParticipants ||
                                        options.participants > registration::kMostParticipants))
    throw UsageError("--participants: must be 2 to " +
                     std::to_string(registration::kMostParticipants));
  if (!options.groups.empty() && values->count("participants"))
    throw UsageError("--groups: says how many participants; leave out --participants");
  if (!options.groups.empty() && !looks.empty())
    throw UsageError("--looks: require groups of one size; leave out --groups");
  if (!(options.too_fast > 0 && options.too_fast <= registration::kMostTooFast))
    throw UsageError("--too-fast-s: must be above 0, at most 60 s");
  if (values->count("studies")) options.studies = studies;
  if (options.studies && (*options.studies < 20 || *options.studies > 100'000))
    throw UsageError("--studies: must be 20 to 100000");
  if (!looks.empty()) options.looks = read_looks(looks);
  const auto known = registration::spending_of(spending);
  if (!known)
    throw UsageError("--spending: expected obrien-fleming or pocock, found '" +
                     printable(spending, 60) + "'");
  if (!values->operator[]("spending").defaulted() && looks.empty())
    throw UsageError("--spending: alpha is spent over looks; give --looks, too");
  options.spending = *known;
  if (options.jobs < 1 || options.jobs > 256) throw UsageError("--jobs: must be 1 to 256");
  return options;
}

/// Refuses to replace a registration that the lab has filled in.
void require_replaceable(const RegisterOptions& options) {
  registration::require_replaceable_folder(options.out, options.force, kMark,
                                           registration::files_to_fill_in());
  if (!options.force || !fs::exists(fs::path(options.out) / kMark)) return;
  for (const std::string& file :
       registration::filled_in(options.out, registration::read_registration(options.out)).files)
    throw UsageError(printable(options.out) + ": " + file +
                     " has been filled in and would be lost; name another folder");
}

protocols::Protocol read_protocol(const std::string& path) {
  protocols::Protocol protocol = protocols::parse_protocol(path);
  registration::require_registrable(protocol, path);
  return protocol;
}

analysis::PlanRecord read_fitting_plan(const std::string& path, const std::string& text,
                                       const protocols::Protocol& protocol) {
  analysis::PlanRecord plan = analysis::read_plan(text, path);
  registration::require_fitting(plan, path, protocol);
  return plan;
}

std::size_t sample_size(const RegisterOptions& options, const registration::Registration& made) {
  if (options.participants > 0) return options.participants;
  if (const auto& needed = registration::fitting_curve(made.protocol, made.plan).participants) {
    if (*needed >= 2 && *needed <= registration::kMostParticipants) return *needed;
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

void warn_of_hypothesis(const analysis::Hypothesis& one, const registration::Rehearsal& rehearsal,
                        double wanted_power, std::vector<std::string>& out) {
  const registration::VerdictCounts &with = rehearsal.with_effect,
                                    &without = rehearsal.without_effect;
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

bool names_alpha(const analysis::Hypothesis& one) {
  const auto numbers = analysis::judge(one, {}).numbers;
  return std::ranges::any_of(numbers, [](const auto& number) { return number.first == "alpha"; });
}

std::vector<std::string> warnings_of(const registration::Registration& made) {
  std::vector<std::string> out;
  const auto& curve = registration::fitting_curve(made.protocol, made.plan);
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
  const auto orders = static_cast<std::size_t>(protocols::block_orders(made.protocol));
  if (made.participants % orders != 0)
    out.push_back(std::string("The orders of the ") +
                  made.protocol.order_rule->conditions_in_words() + " repeat after " +
                  std::to_string(orders) + " participants: with " +
                  std::to_string(made.participants) + " they are not balanced.");
  if (!made.plan.pilot_label.empty())
    out.push_back("The plan rests on " + made.plan.pilot_label +
                  ": their standard deviations are a model's.");
  if (!registration::conditions_of(made.protocol, made.plan).differ)
    out.emplace_back(
        "The plan is of a difference between two conditions; the protocol has one. The simulated "
        "studies with the planned effect and with none are alike.");
  for (const analysis::Hypothesis& one : made.hypotheses)
    if (!made.looks.empty() && !names_alpha(one))
      out.push_back(one.id +
                    " does not name alpha: its conditions are the same at each look, and all looks "
                    "together err more often than alpha.");
  for (std::size_t h = 0; h < made.hypotheses.size(); ++h)
    warn_of_hypothesis(made.hypotheses[h], made.rehearsals[h], made.plan.power, out);
  return out;
}

/// Writes simulated studies, their analyses and their verdicts on the hypotheses.
void put_simulated(const RegisterOptions& options, const data::AtomicFolder& draft,
                   registration::Registration& made) {
  constexpr const char* kEffect = "simulated/planned-effect.csv";
  constexpr const char* kNone = "simulated/no-effect.csv";
  const std::unique_ptr<registration::StudyAnswers> answers = registration::study_answers(made);
  const std::unique_ptr<registration::PlannedStudies> studies = answers->planned();
  const std::string scratch = draft / "scratch";
  studies->write(scratch, draft.prepare(kEffect), draft / "codebook.csv", true);
  fs::remove_all(scratch);
  studies->write(scratch, draft.prepare(kNone), "", false);
  fs::remove_all(scratch);
  registration::write_member(draft, "simulated/README.md",
                             "# SIMULATED data\n\n" + answers->simulated() + "\n");
  const std::string with = studies->analyzed(draft / kEffect, kEffect);
  const std::string none = studies->analyzed(draft / kNone, kNone);
  registration::write_member(draft, "analysis-simulated.json",
                             nlohmann::ordered_json{{"planned_effect", read_ordered_json(with)},
                                                    {"no_effect", read_ordered_json(none)}}
                                     .dump(2) +
                                 "\n");
  made.hypotheses = analysis::read_hypotheses(made.hypotheses_text, options.hypotheses,
                                              analysis::named_results(with, made.alpha));
  output::ProgressLine line("simulated studies");
  made.rehearsals =
      registration::rehearse(*studies, made, options.studies.value_or(studies->usual_studies()),
                             options.jobs, [&](double share) { line.show(share); });
  line.clear();
}

/// Sets the digest.
void write_registration(const data::AtomicFolder& draft, registration::Registration& made) {
  registration::write_member(draft, "protocol.json", made.protocol.source_text);
  for (const data::ProtocolFile& file : made.files)
    registration::write_member(draft, file.name, file.bytes);
  registration::write_member(draft, "plan.json", made.plan_text);
  registration::write_member(draft, "hypotheses.json", made.hypotheses_text);
  const registration::Form form = registration::registration_form(made);
  registration::write_member(draft, "form.json", registration::form_json(form));
  registration::write_member(draft, "registration.json", registration::registration_json(made));
  registration::write_checksums(draft, registration::files_to_fill_in());
  made.digest = registration::registration_digest(draft / "");
  registration::write_member(draft, registration::files_to_fill_in()[0],
                             registration::markdown_as_made(form, made.digest));
  registration::write_member(draft, registration::files_to_fill_in()[1],
                             registration::osf_as_made(form, made.digest));
}

}  // namespace

int register_command(const std::vector<std::string>& args) {
  const std::optional<RegisterOptions> given = parse_options(args);
  if (!given) return 0;
  const RegisterOptions& options = *given;
  registration::Registration made;
  made.protocol = read_protocol(options.protocol);
  made.files = session::info_of(made.protocol).files;
  registration::require_files_below(made.files);
  made.plan_text = protocols::read_text_file(options.plan);
  made.plan = read_fitting_plan(options.plan, made.plan_text, made.protocol);
  made.hypotheses_text = protocols::read_text_file(options.hypotheses);
  const std::vector<int> planned =
      options.groups.empty() ? session::first_numbers(static_cast<int>(sample_size(options, made)))
                             : numbers_of_groups(options.groups, made.protocol.groups);
  made.participants = planned.size();
  if (made.participants < registration::kFewestParticipants ||
      made.participants > registration::kMostParticipants)
    throw UsageError("--groups: must be 2 to " + std::to_string(registration::kMostParticipants) +
                     " participants together");
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
  if (!options.looks.empty()) {
    if (options.looks.back() != made.participants)
      throw UsageError("--looks: expected the last look at all " +
                       std::to_string(made.participants) + " participants, found " +
                       std::to_string(options.looks.back()));
    made.spending = options.spending;
    made.looks = analysis::planned_looks(made.spending, made.alpha, options.looks);
  }
  made.seed = options.seed;
  made.typical_time = registration::typical_time(made.protocol, made.too_fast);
  made.participant_version = participants::kDefaultParticipantVersion;
  made.participant_sha256 = participants::load_simulated_settings("").sha256;
  for (const int number : planned)
    made.order_sha256[number] = study::order_checksum(made.protocol, number);

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
