#include "data/export/column_values.h"

namespace palpate::data {

void put_attempt(DelimitedRow& row, const StoredTrial& attempt, const ExportClock& clock) {
  const TrialRecord& record = attempt.record;
  row << attempt.participant.code << record.session << record.block << record.trial
      << record.attempt << record.renderer << record.shape;
  for (const double q : record.orientation_wxyz) row << q;
  row << record.practice << clock.onset_utc(attempt) << attempt.cut_off_reason << attempt.run.device
      << attempt.participant.simulated << attempt.protocol_sha256 << attempt.run.program_version
      << attempt.participant.enrolled_number;
  if (clock.relative()) row << clock.elapsed(attempt);
}

void put_sample(DelimitedRow& row, const SampleRecord& sample) {
  row << sample.tick;
  constexpr int kNanometre = 9, kMicronewton = 6;  // decimals
  for (const auto& vector : {sample.tip, sample.tail}) {
    for (const double x : vector) row.rounded(x, kNanometre);
  }
  for (const auto& vector : {sample.force, sample.torque, sample.device1, sample.device2}) {
    for (const double x : vector) row.rounded(x, kMicronewton);
  }
  row.rounded(sample.depth, kNanometre);
  row << unsigned{sample.contacts} << unsigned{sample.contact_type} << unsigned{sample.buttons}
      << sample.faults << static_cast<double>(sample.period_ns) / 1e9
      << static_cast<double>(sample.lateness_ns) / 1e9
      << static_cast<double>(sample.compute_ns) / 1e9;
}

}  // namespace palpate::data
