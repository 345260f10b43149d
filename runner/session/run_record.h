#pragma once
// What a live session puts on record of itself: who, which run, its notes, its trials.

#include <optional>
#include <string>
#include <vector>

#include "data/store/store.h"
#include "protocols/protocol.h"
#include "runner/session/protocol_info.h"
#include "runner/session/trial_log.h"

namespace palpate::runner {

/// Somebody new is enrolled, and takes a number, when the first trial begins and not before: who
/// came as far as the pre-flight only, or stood before a display that did not open, is nobody to
/// the counterbalancing. What is noted until then waits here.
class RunRecord final : public TrialLog {
 public:
  /// \param participant  from Store::look_up. \throws StoreRefused: the store takes no such run.
  /// \param shown_with  where other texts are shown than those of the participant's protocol
  RunRecord(data::Store& store, const data::ProtocolInfo& protocol,
            const data::Participant& participant, const data::RunInfo& info,
            const std::optional<data::ProtocolInfo>& shown_with = std::nullopt);

  const data::Participant& participant() const { return participant_; }
  int session() const { return info_.session; }
  bool begun() const { return run_.has_value(); }

  /// Enrols and begins the run now, where that has not been done.
  void begin();
  /// \param at_ns  session clock. \throws StoreRefused: a text that no database keeps.
  void note(std::int64_t at_ns, const std::string& text);
  /// Where nothing has begun, nothing is on record.
  void end(data::RunEnd how, std::int64_t ended_ns);
  /// Notes that wait for the run to begin.
  std::vector<std::string> waiting() const;

  int begin(const data::TrialRecord& planned, std::int64_t began_ns) override;
  void finish(const data::TrialRecord& record) override { store_.finish_attempt(*run_, record); }
  void cut_off(const std::string& reason) override { store_.cut_off_attempt(*run_, reason); }

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
  std::vector<Note> waiting_;
};

}  // namespace palpate::runner
