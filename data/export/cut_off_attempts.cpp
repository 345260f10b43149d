#include "data/export/cut_off_attempts.h"

#include "data/export/column_values.h"

namespace palpate::data {

std::int64_t write_attempts(Store& store, TextSink& out, const ExportClock& clock,
                            ExportedParticipants& participants, ProgressCounter& counter) {
  std::int64_t rows = 0;
  DelimitedRow row(DelimitedFormat::csv);
  row << attempt_columns(clock.times());
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

}  // namespace palpate::data
