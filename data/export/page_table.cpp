#include "data/export/page_table.h"

#include <cstdint>
#include <span>
#include <vector>

#include "data/export/delimited_row.h"

namespace palpate::data {
std::span<const Column> page_columns() {
  static const std::vector<Column> all = {
      {"participant_id", "Pseudonym of the participant"},
      {"protocol", "Name of the protocol"},
      {"session", "Session of the participant, from 1", "1"},
      {"page", "Name of the page"},
      {"item", "Name of the question; 'consent' for a consent"},
      {"answer",
       "As typed, or the choice in the protocol's own language; missing: left "
       "out. For a consent: agree"},
      {"consent_version", "Version of a consent's text, as in the protocol"},
      {"text_sha256", "SHA-256 of the text or question that was shown"},
      {"answered_utc", "Time of the answer, ISO 8601, UTC", "ISO 8601"},
      {"replaced",
       "Whether a later answer to the same question is in force",
       "",
       {{"0", "in force"}, {"1", "corrected later, by the participant or the experimenter"}}},
      {"simulated",
       "Who answered",
       "",
       {{"0", "a person"}, {"1", "SIMULATED: drawn at random, or not at a real device"}}},
  };
  return all;
}

std::int64_t write_pages(Store& store, TextSink& out, const ExportClock& clock,
                         ExportedParticipants& participants) {
  DelimitedRow row(DelimitedFormat::csv);
  row << page_columns();
  out.write(row.end());
  std::int64_t rows = 0;
  for (const StoredPageAnswer& one : store.page_answers()) {
    const PageAnswer& answer = one.answer;
    row << one.participant.code << one.protocol_name << one.session << answer.page << answer.item
        << answer.answer << answer.version << answer.text_sha256
        << clock.utc(one.participant, one.unix_ns) << one.replaced << one.participant.simulated;
    out.write(row.end());
    participants.add(one.participant);
    ++rows;
  }
  return rows;
}

}  // namespace palpate::data
