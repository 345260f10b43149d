#include "data/export/sweep_csv.h"

#include <fcntl.h>

#include "data/export/delimited_row.h"
#include "data/files/atomic_file.h"
#include "data/files/output_check.h"
#include "data/files/text_sink.h"

namespace palpate::data {
namespace {

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
