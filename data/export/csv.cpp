#include "data/export/csv.h"

#include <fcntl.h>

#include <deque>
#include <filesystem>
#include <optional>
#include <system_error>

#include "data/export/column_values.h"
#include "data/export/dataset_description.h"
#include "data/export/delimited_row.h"
#include "data/export/exported_columns.h"
#include "data/export/page_table.h"
#include "data/files/atomic_file.h"
#include "data/files/output_check.h"
#include "data/files/text_sink.h"
#include "data/store/export_log.h"

namespace palpate::data {
namespace {

namespace fs = std::filesystem;

struct CsvPaths {
  fs::path trials;
  std::optional<fs::path> attempts;  // if attempts were cut off
  std::optional<fs::path> pages;     // if they are asked for
  std::string codebook;              // "": none
};

/// A buffered sink for a temporary file, whose descriptor stays open for its commit.
FileSink sink_of(const AtomicFile& file, const std::string& path) {
  return {::fcntl(file.descriptor(), F_DUPFD_CLOEXEC, 0), path};
}

/// \throws StoreRefused
void require_writable(const fs::path& path, bool force, const ProtectedFiles& others) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    throw StoreRefused(path.string() + ": is not a file; name the CSV file to be written");
  }
  const std::string reason = write_refusal(path.string(), force, others);
  if (!reason.empty()) throw StoreRefused(path.string() + ": " + reason);
}

/// A file beside that of the trials. It takes its name, so that studies exported into one folder
/// keep their own: a_attempts.csv beside a.csv, but attempts.csv beside trials.csv.
fs::path companion(const fs::path& trials, const std::string& what) {
  if (trials.filename() == "trials.csv") return trials.parent_path() / (what + ".csv");
  const bool csv = trials.extension() == ".csv";
  const std::string stem = csv ? trials.stem().string() : trials.filename().string();
  return trials.parent_path() / (stem + "_" + what + ".csv");
}

/// \throws StoreRefused
CsvPaths checked_paths(Store& store, const std::string& path, const ExportSettings& settings) {
  const fs::path trials(path), attempts = companion(trials, "attempts");
  if (trials.filename().empty()) throw StoreRefused("'" + path + "' names no file to write to");
  for (const char* reserved : {"attempts.csv", "pages.csv"}) {
    if (trials.filename() != reserved) continue;
    throw StoreRefused(path +
                       ": that name is reserved for a file beside trials.csv; choose another");
  }
  const fs::path pages = companion(trials, "pages");
  CsvPaths paths{.trials = trials, .attempts = {}, .pages = {}, .codebook = settings.codebook};
  if (settings.pages) paths.pages = pages;
  if (store.counts().cut_off > 0) paths.attempts = attempts;
  ProtectedFiles others;
  others.add(store.path(), "it is the database itself, or SQLite's file beside it");
  require_writable(trials, settings.force, others);
  if (paths.attempts) require_writable(attempts, settings.force, others);
  if (paths.pages) require_writable(pages, settings.force, others);
  if (!paths.codebook.empty()) {
    others.add(trials.string(), "the trials go there");
    others.add(attempts.string(), "the attempts that were cut off go there");
    if (paths.pages) others.add(pages.string(), "the answers to pages go there");
    require_writable(paths.codebook, settings.force, others);
  }
  return paths;
}

/// \return rows
std::int64_t write_trials(Store& store, TextSink& out, const ExportClock& clock,
                          ExportedParticipants& participants, ProgressCounter& counter) {
  std::int64_t rows = 0;
  DelimitedRow row(DelimitedFormat::csv);
  row << trial_columns(clock);
  out.write(row.end());
  store.for_each_trial([&](const StoredTrial& trial) {
    put_trial(row, trial, clock);
    out.write(row.end());
    participants.add(trial.participant);
    ++rows;
    counter.next();
  });
  return rows;
}

void put_point(DelimitedRow& row, const SweepRow& point) {
  row << point.point << (point.reason.empty() ? "ok" : "failed") << point.reason;
  for (const SweepValue& value : point.values) {
    if (const auto* const number = std::get_if<double>(&value)) {
      row << *number;
    } else {
      row << std::string_view(std::get<std::string>(value));
    }
  }
  for (const std::optional<double>& figure : point.figures) row << figure;
}

}  // namespace

std::int64_t write_attempts(Store& store, TextSink& out, const ExportClock& clock,
                            ExportedParticipants& participants, ProgressCounter& counter) {
  std::int64_t rows = 0;
  DelimitedRow row(DelimitedFormat::csv);
  row << attempt_columns(clock);
  out.write(row.end());
  store.for_each_cut_off([&](const StoredTrial& attempt) {
    put_attempt(row, attempt, clock);
    out.write(row.end());
    participants.add(attempt.participant);
    ++rows;
    counter.next();
  });
  return rows;
}

ExportResult export_csv(Store& store, const std::string& path, const ExportSettings& settings) {
  const CsvPaths paths = checked_paths(store, path, settings);
  ExportResult result;
  ExportedParticipants participants;
  ProgressCounter counter(settings);
  const ExportClock clock(store, settings.times);
  std::deque<AtomicFile> files;
  const auto write_file = [&files](const std::string& target, const auto& write) {
    FileSink sink = sink_of(files.emplace_back(target), target);
    write(sink);
    sink.close(true);
  };
  write_file(paths.trials.string(), [&](TextSink& sink) {
    result.trials = write_trials(store, sink, clock, participants, counter);
  });
  if (paths.attempts) {
    result.attempts_path = paths.attempts->string();
    write_file(result.attempts_path, [&](TextSink& sink) {
      result.attempts = write_attempts(store, sink, clock, participants, counter);
    });
  }
  if (paths.pages) {
    result.pages_path = paths.pages->string();
    write_file(result.pages_path, [&](TextSink& sink) {
      result.answers = write_pages(store, sink, clock, participants);
    });
  }
  if (!paths.codebook.empty()) {
    write_file(paths.codebook, [&](TextSink& sink) {
      DelimitedRow row(DelimitedFormat::csv);
      for (const CodebookRow& cells :
           codebook_rows(all_facts(label_protocols(store, settings)), settings, clock)) {
        for (const std::string& cell : cells) row << cell;
        sink.write(row.end());
      }
    });
  }
  result.simulated = participants.any_simulated();
  result.not_recorded = participants.record(
      store.path(), settings.recorded_as.empty() ? path : settings.recorded_as, "csv");
  commit_all(files, settings.force);
  return result;
}

std::vector<CodebookRow> codebook_of(const std::vector<ProtocolInfo>& protocols,
                                     const ExportSettings& settings) {
  std::map<std::string, StudyLabel> labels;
  for (const ProtocolInfo& protocol : protocols)
    labels[protocol.sha256].facts = settings.facts(protocol);
  std::vector<CodebookRow> rows =
      codebook_rows(all_facts(labels), settings, ExportClock(protocols, settings.times));
  for (CodebookRow& row : rows)
    for (std::string& text : row) text = guarded_text(text);
  return rows;
}

std::int64_t export_sweep_csv(SweepFile& sweep, const std::string& path, bool force,
                              const std::function<void(std::int64_t)>& progress) {
  ProtectedFiles others;
  others.add(sweep.path(), "it is the sweep itself");
  const std::string refusal = write_refusal(path, force, others);
  if (!refusal.empty()) throw StoreRefused(path + ": " + refusal);
  AtomicFile file(path);
  FileSink sink(::fcntl(file.descriptor(), F_DUPFD_CLOEXEC, 0), path);
  DelimitedRow row(DelimitedFormat::csv);
  for (const std::string& column : sweep_columns(sweep.plan())) row << std::string_view(column);
  sink.write(row.end());
  std::int64_t points = 0;
  sweep.for_each([&](const SweepRow& point) {
    put_point(row, point);
    sink.write(row.end());
    ++points;
    if (progress && points % 1000 == 0) progress(points);
  });
  sink.close(true);
  file.commit(force);
  return points;
}

}  // namespace palpate::data
