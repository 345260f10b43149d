#include "runner/session/run_record.h"

#include <algorithm>
#include <utility>

namespace palpate::runner::session {
namespace {

void add_file(const std::string& name, const std::shared_ptr<const std::string>& bytes,
              std::vector<data::ProtocolFile>& files) {
  if (!bytes) return;
  const bool known =
      std::any_of(files.begin(), files.end(), [&](const auto& file) { return file.name == name; });
  if (!known) files.push_back({name, *bytes});
}

void add_files(const stimuli::ObjectSpec& spec, std::vector<data::ProtocolFile>& files) {
  for (const stimuli::ObjectSpec& part : spec.parts) add_files(part, files);
  add_file(spec.file_name, spec.file_bytes, files);
  if (spec.texture) add_file(spec.texture->file_name, spec.texture->file_bytes, files);
}

void add_files(const protocols::Protocol& protocol, std::vector<data::ProtocolFile>& files) {
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli) {
    add_files(stimulus.object, files);
    if (stimulus.sound) add_file(stimulus.sound->file_name, stimulus.sound->file_bytes, files);
    if (!stimulus.seen) continue;
    add_file(stimulus.seen->file_name, stimulus.seen->file_bytes, files);
    if (stimulus.seen->shape) add_files(*stimulus.seen->shape, files);
  }
  for (const protocols::PageSpec& page : protocol.pages) {
    for (const protocols::PagePicture& picture : page.pictures)
      add_file(picture.file, picture.bytes, files);
  }
}

}  // namespace

data::ProtocolInfo info_of(const protocols::Protocol& protocol) {
  data::ProtocolInfo info{protocol.name, protocol.source_text, protocol.sha256};
  add_files(protocol, info.files);
  for (const auto& group : protocol.group_protocols) add_files(*group, info.files);
  return info;
}

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

void RunRecord::write_down(std::int64_t at_ns, const std::string& text) {
  store_.validate_note(text);
  begin();
  note(at_ns, text);
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

int RunRecord::begin(const data::TrialRecord& planned, std::int64_t began_ns) {
  begin();
  return store_.begin_attempt(*run_, planned, began_ns);
}

void RunRecord::answered(const data::PageAnswer& answer) {
  begin();
  store_.add_page_answers(*run_, {answer});
}

std::vector<data::PageAnswer> RunRecord::answers() {
  if (participant_.id == 0) return {};
  return store_.answers_in_force(participant_, info_.session);
}

}  // namespace palpate::runner::session
