#include "runner/session/run_record.h"

#include <algorithm>
#include <utility>

namespace palpate::runner {

RunRecord::RunRecord(data::Store& store, const data::ProtocolInfo& protocol,
                     const data::Participant& participant, const data::RunInfo& info,
                     const std::optional<data::ProtocolInfo>& shown_with)
    : store_(store),
      protocol_(protocol),
      participant_(participant),
      info_(info),
      shown_with_(shown_with) {
  store_.validate_run(participant_, info_);
}

void RunRecord::begin() {
  if (run_) return;
  participant_ = store_.enrol(protocol_, participant_.code, participant_.number,
                              participant_.simulated, participant_.seed);
  run_ = store_.begin_run(participant_, info_, shown_with_ ? &*shown_with_ : nullptr);
  for (const Note& note : std::exchange(pending_, {}))
    store_.add_note(*run_, note.at_ns, note.text);
}

void RunRecord::note(std::int64_t at_ns, const std::string& text) {
  if (run_) {
    store_.add_note(*run_, at_ns, text);
    return;
  }
  store_.validate_note(text);
  pending_.push_back({at_ns, text});
}

void RunRecord::end(data::RunEnd how, std::int64_t ended_ns) {
  if (run_) store_.end_run(*run_, how, ended_ns);
}

std::vector<std::string> RunRecord::pending_notes() const {
  std::vector<std::string> texts;
  for (const Note& note : pending_) texts.push_back(note.text);
  return texts;
}

int RunRecord::begin(const data::TrialRecord& planned, std::int64_t began_ns) {
  begin();
  return store_.begin_attempt(*run_, planned, began_ns);
}

void RunRecord::answered(const std::vector<data::PageAnswer>& answers) {
  begin();
  store_.add_page_answers(*run_, answers);
}

bool RunRecord::has_answers(const std::string& page) {
  if (participant_.id == 0) return false;
  const std::vector<std::string> pages = store_.answered_pages(participant_, info_.session);
  return std::find(pages.begin(), pages.end(), page) != pages.end();
}

}  // namespace palpate::runner
