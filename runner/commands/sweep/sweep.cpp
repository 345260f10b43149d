#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iostream>
#include <mutex>
#include <set>
#include <system_error>
#include <thread>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/figures/svg.h"
#include "analysis/report/report.h"
#include "analysis/statistics/pattern.h"
#include "analysis/statistics/sweep_analysis.h"
#include "data/base/json_text.h"
#include "data/base/text.h"
#include "data/store/sweep_file.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/study_options.h"
#include "runner/commands/sweep/sweep_options.h"
#include "runner/output/progress_line.h"
#include "runner/study/simulation_limits.h"

namespace palpate::runner::commands {

namespace po = boost::program_options;

void add_sweep_options(CommandLine& line, sweep::SweepSettings& settings) {
  line.options.add_options()  //
      ("space", po::value(&settings.space)->required()->value_name("FILE"),
       "what varies, and how (JSON)")  //
      ("points", po::value(&settings.points)->required()->value_name("N"),
       "number of studies; grid and saltelli round down to a possible number")  //
      ("design",
       po::value(&settings.design)->default_value("lhs")->value_name("lhs|sobol|grid|saltelli"),
       "how the points lie: Latin hypercube, Sobol's sequence, all combinations, or Saltelli's "
       "samples for Sobol indices")  //
      ("seed", po::value(&settings.seed)->default_value(settings.seed)->value_name("S"),
       "of the design and, with its number, of every point")  //
      ("participants",
       po::value(&settings.participants)->default_value(settings.participants)->value_name("N"),
       "simulated participants at each point")  //
      ("repetitions", po::value(&settings.repetitions)->value_name("R"),
       "of each shape with each renderer, instead of the protocol's");
  add_participant_version(line, settings.version);
  line.options.add_options()  //
      ("settings", po::value(&settings.patch)->value_name("FILE"),
       "JSON merge patch on those settings, before anything varies");
}

void check_sweep_options(const po::variables_map& values, sweep::SweepSettings& settings) {
  constexpr std::int64_t kMostPoints = 100'000'000;
  if (settings.points < 1 || settings.points > kMostPoints)
    throw UsageError("--points: must be 1 to " + std::to_string(kMostPoints));
  study::check_simulated_participants(settings.participants);
  if (values.count("repetitions") && (settings.repetitions < 1 || settings.repetitions > 1000000))
    throw UsageError("--repetitions: must be 1 to 1000000");
  check_participant_version(values, settings.version);
  settings.protocol = values["PROTOCOL.json"].as<std::string>();
}

std::string analyze_sweep_file(const std::string& file, const std::string& pattern,
                               output::Outputs& outputs) {
  try {
    const analysis::SweepAnalysis analysis =
        analysis::analyze_sweep(analysis::read_sweep_table(file), pattern, PALPATE_VERSION);
    if (outputs.wanted("figures")) {
      for (const analysis::Figure& figure : analysis::sweep_figures(analysis)) {
        outputs.put_into_folder(figure.id + ".svg",
                                analysis::figure_svg(figure, analysis::light_palette()));
      }
    }
    if (outputs.wanted("json")) outputs.put("json", analysis::sweep_json(analysis));
    if (outputs.wanted("report")) outputs.put("report", analysis::sweep_html(analysis));
    return analysis::sweep_text(analysis);
  } catch (const analysis::PatternError& error) {
    throw UsageError(error.what());
  } catch (const data::StoreRefused& error) {
    throw UsageError(error.what());  // the named file is bad input: status 2
  }
}

// `palpate sweep`: simulated studies over a space of settings.

namespace {

using nlohmann::json;
using sweep::PlannedSweep;
using sweep::Sweep;

struct SweepSettings {
  sweep::SweepSettings sweep;
  std::string database, shard;
  std::int64_t print_point = 0;  ///< 0: none, the sweep runs
  int jobs = 1;
};

void add_options(CommandLine& line, SweepSettings& settings) {
  line.usage =
      "palpate sweep PROTOCOL.json --space SPACE.json --points N --db FILE [--design NAME]\n"
      "       [--seed S] [--participants N] [--repetitions R] [--jobs J] [--shard K/N|auto]";
  line.summary =
      "Simulates a study at each of many points of a space of settings: of the simulated\n"
      "participant and of the protocol. FILE gets a row a point: its settings, and per shape\n"
      "and renderer times, accuracy, time-outs, contact, gains with standard errors, or why it\n"
      "failed; a failed point does not end the sweep. Run again, it resumes where it stopped\n"
      "or was killed. The same plan gives the same bytes, whatever the jobs, shards and\n"
      "interruptions. Next steps: palpate analyze --sweep FILE, palpate export\n"
      "--format csv, and palpate merge for shards.";
  line.example =
      R"(  palpate sweep protocols/quick.json --space protocols/spaces/small.json --points 8 \
      --participants 2 --repetitions 2 --db small.sweep              half a minute's try
  palpate sweep protocols/ho2000.json --space protocols/spaces/participants.json \
      --points 2000 --repetitions 20 --db people.sweep               an hour or two
  palpate sweep ... --points 2000 --shard 3/8 --db shard3.sweep      the third of eight parts
  palpate sweep ... --print-point 17                                 what point 17 is, as JSON)";
  add_sweep_options(line, settings.sweep);
  line.options.add_options()  //
      ("jobs", po::value(&settings.jobs)->default_value(settings.jobs)->value_name("J"),
       "points simulated at a time")  //
      ("shard", po::value(&settings.shard)->default_value("1/1")->value_name("K/N|auto"),
       "only the K-th of N parts of the points; auto: the task of a Slurm array")  //
      ("db", po::value(&settings.database)->value_name("FILE"),
       "the sweep's file; created or continued")  //
      ("print-point", po::value(&settings.print_point)->value_name("P"),
       "print the protocol and the participant's settings of a point instead");
  line.positional_names = {"PROTOCOL.json"};
}

/// None: --help was given and printed. \throws UsageError
std::optional<SweepSettings> parse_sweep_settings(const std::vector<std::string>& args) {
  SweepSettings settings;
  settings.jobs = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  CommandLine line;
  add_options(line, settings);
  const auto values = line.parse(args);
  if (!values) return std::nullopt;
  check_sweep_options(*values, settings.sweep);
  if (settings.jobs < 1 || settings.jobs > 1024) throw UsageError("--jobs: must be 1 to 1024");
  if (values->count("print-point") && settings.print_point < 1)
    throw UsageError("--print-point: must be the number of a point, from 1");
  if (!values->count("print-point") && settings.database.empty()) {
    throw UsageError("missing --db FILE, the sweep's file\nUsage: " + line.usage +
                     "\nMore: add --help");
  }
  return settings;
}

/// The points that workers take, and their rows for the thread that owns the file.
class PointQueue {
 public:
  explicit PointQueue(std::vector<std::int64_t> todo) : todo_(std::move(todo)) {}

  /// Takes a point; 0: none is left.
  std::int64_t take() {
    const std::size_t at = next_++;
    return at < todo_.size() ? todo_[at] : 0;
  }
  void put(data::SweepRow row) {
    const std::lock_guard lock(mutex_);
    rows_.push_back(std::move(row));
    came_.notify_all();
  }
  void worker_done(std::exception_ptr error) {
    const std::lock_guard lock(mutex_);
    ++done_;
    if (error && !error_) error_ = std::move(error);
    came_.notify_all();
  }
  /// The rows of the next 0.2 s; if there are none, waits for a row or the workers' end.
  std::vector<data::SweepRow> wait(int workers, bool& all_done) {
    std::unique_lock lock(mutex_);
    came_.wait_for(lock, std::chrono::milliseconds(200), [&] { return done_ == workers; });
    all_done = done_ == workers;
    return std::exchange(rows_, {});
  }
  void rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }
  std::size_t size() const { return todo_.size(); }

 private:
  const std::vector<std::int64_t> todo_;
  std::atomic<std::size_t> next_{0};
  std::mutex mutex_;
  std::condition_variable came_;
  std::vector<data::SweepRow> rows_;
  int done_ = 0;
  std::exception_ptr error_;
};

/// \param before  points of the shard already on record \return points on record now
std::int64_t run_points(const Sweep& sweep, data::SweepFile& file, PointQueue& queue, int jobs,
                        std::int64_t before) {
  const std::atomic<bool>& signal = output::catch_stop_signals();
  std::atomic<bool> stop{false};
  const int workers =
      static_cast<int>(std::min<std::size_t>(static_cast<std::size_t>(jobs), queue.size()));
  const auto work = [&] {
    std::exception_ptr error;
    try {
      for (std::int64_t point = queue.take(); point != 0 && !stop; point = queue.take()) {
        if (auto row = run_point(sweep, point, stop)) queue.put(std::move(*row));
      }
    } catch (...) {
      error = std::current_exception();
      stop = true;
    }
    queue.worker_done(error);
  };
  std::vector<std::jthread> threads;
  threads.reserve(static_cast<std::size_t>(workers));
  for (int i = 0; i < workers; ++i) threads.emplace_back(work);
  output::ProgressLine line("points");
  std::int64_t done = before;
  const auto all = static_cast<double>(before) + static_cast<double>(queue.size());
  if (workers > 0) line.show(static_cast<double>(before) / all);
  std::exception_ptr failure;
  for (bool all_done = workers == 0; !all_done;) {
    const std::vector<data::SweepRow> rows = queue.wait(workers, all_done);
    if (signal) stop = true;
    if (failure || rows.empty()) continue;
    try {
      file.record(rows);
      done += static_cast<std::int64_t>(rows.size());
      line.show(static_cast<double>(done) / all);
    } catch (...) {
      failure = std::current_exception();
      stop = true;
    }
  }
  threads.clear();
  line.clear();
  if (failure) std::rethrow_exception(failure);
  queue.rethrow();
  return done;
}

/// \throws data::StoreRefused: the file is not a sweep's
int version_begun_with(const std::string& database) {
  std::set<int> begun;
  std::error_code none;  // an invisible file is refused when opened
  if (std::filesystem::exists(database, none)) {
    const json settings = json_or_discarded(data::SweepFile::open(database).plan().settings);
    for (const int version : participants::participant_versions()) {
      if (settings.is_object() && settings.value("version", json()) == version)
        begun.insert(version);
    }
  }
  return version_to_resume_with(begun, database);
}

void print_summary(data::SweepFile& file, const data::SweepPlan& plan, const std::string& name) {
  const std::int64_t count = file.count(), failed = file.failed();
  std::cout << name << ", SIMULATED participants: " << count << " of " << plan.points << " points ("
            << plan.design << ", seed " << plan.seed << ") in " << printable(file.path());
  if (failed > 0) std::cout << ", " << failed << " of them failed";
  std::cout << "\n";
  if (failed == 0) return;
  std::cerr << "the column 'reason' has the reasons: palpate export --db FILE --format csv\n";
}

int run_shard(const Sweep& sweep, const SweepSettings& settings, const Shard& shard,
              const std::string& name) {
  data::SweepFile file = data::SweepFile::open(settings.database, sweep.plan);
  warn_of_exposure(settings.database);
  const std::vector<bool> recorded = file.recorded();
  std::vector<std::int64_t> todo;
  const std::int64_t first = shard.first(sweep.plan.points), last = shard.last(sweep.plan.points);
  for (std::int64_t point = first + 1; point <= last; ++point) {
    if (!recorded[static_cast<std::size_t>(point) - 1]) todo.push_back(point);
  }
  const std::int64_t before = last - first - static_cast<std::int64_t>(todo.size());
  PointQueue queue(std::move(todo));
  const std::int64_t done = run_points(sweep, file, queue, settings.jobs, before);
  if (done < last - first) {
    print_summary(file, sweep.plan, name);
    std::cerr << "stopped; the same command resumes from here\n";
    return 1;
  }
  file.finish();
  print_summary(file, sweep.plan, name);
  const bool all_failed = file.count() > 0 && file.failed() == file.count();
  if (all_failed) std::cerr << "every point failed: nothing was simulated\n";
  return all_failed ? 1 : 0;
}

void print_point(const Sweep& sweep, std::int64_t point) {
  if (point > sweep.plan.points) {
    throw UsageError("--print-point: the sweep has " + std::to_string(sweep.plan.points) +
                     " points");
  }
  const sweep::PointStudy study = study_of_point(sweep, point);
  json out{{"point", point}, {"seed", study.seed}, {"participants", sweep.plan.participants}};
  out["protocol"] = study.protocol;
  out["settings"] = study.settings;
  std::cout << out.dump(2) << "\n";
}

}  // namespace

int sweep_command(const std::vector<std::string>& args) {
  std::optional<SweepSettings> settings = parse_sweep_settings(args);
  if (!settings) return 0;
  const Shard shard =
      parse_shard(settings->shard, [](const char* name) { return std::getenv(name); });
  if (settings->sweep.version == 0)
    settings->sweep.version = version_begun_with(settings->database);
  const PlannedSweep planned(settings->sweep, std::cerr);
  const Sweep sweep{planned.study, planned.design, planned.plan};
  if (settings->print_point > 0) {
    print_point(sweep, settings->print_point);
    return 0;
  }
  return run_shard(sweep, *settings, shard, planned.protocol.name);
}

}  // namespace palpate::runner::commands
