#pragma once
// The record of a live session: its participant, run, notes and trials.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "data/record.h"
#include "data/store/store.h"
#include "protocols/protocol.h"
#include "runner/session/trial_log.h"

namespace palpate::runner::session {

/// Converts a protocol to its record: its text, and the contents of
/// every file that it names.
data::ProtocolInfo info_of(const protocols::Protocol& protocol);

/// The log of a live session. A new participant is enrolled, and takes a number of the
/// counterbalancing, with the first answer to a page, note of the experimenter or trial, not when
/// the pre-flight was abandoned or a display did not open. The program's own earlier notes are kept
/// here and written with the run.
class RunRecord final : public TrialLog {
 public:
  /// \param participant  from Store::look_up. \throws StoreRefused: the store refuses such a run.
  /// \param shown_with  the texts shown, if they differ from those of the participant's protocol
  RunRecord(data::Store& store, const data::ProtocolInfo& protocol,
            const data::Participant& participant, const data::RunInfo& info,
            const std::optional<data::ProtocolInfo>& shown_with = std::nullopt);

  const data::Participant& participant() const { return participant_; }
  int session() const { return info_.session; }
  bool begun() const { return run_.has_value(); }

  /// Enrols the participant and begins the run, unless done already.
  void begin();
  /// \param at_ns  session clock. \throws StoreRefused: the text cannot be stored.
  void note(std::int64_t at_ns, const std::string& text) override;
  /// A note of the experimenter: on disk when this returns, so it begins the run. \throws
  /// StoreRefused: the text cannot be stored.
  void write_down(std::int64_t at_ns, const std::string& text);
  /// Ends the run; without a run, records nothing.
  void end(data::RunEnd how, std::int64_t ended_ns);

  int begin(const data::TrialRecord& planned, std::int64_t began_ns) override;
  void finish(const data::TrialRecord& record) override { store_.finish_attempt(*run_, record); }
  void cut_off(const std::string& reason) override { store_.cut_off_attempt(*run_, reason); }
  void answered(const data::PageAnswer& answer) override;
  std::vector<data::PageAnswer> answers() override;

 private:
  struct Note {
    std::int64_t at_ns = 0;
    std::string text;
  };
  data::Store& store_;
  const data::ProtocolInfo protocol_;
  data::Participant participant_;
  const data::RunInfo info_;
  const std::optional<data::ProtocolInfo> shown_with_;
  std::optional<data::Run> run_;  ///< none: not begun
  std::vector<Note> pending_;
};

}  // namespace palpate::runner::session
