#pragma once
// Which level comes next: a pure function of the spec, the seed and the answers so far, the same on
// every machine and compiler.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "protocols/procedures/constant_stimuli.h"
#include "protocols/procedures/estimate.h"
#include "protocols/procedures/limits.h"
#include "protocols/procedures/procedure_spec.h"
#include "protocols/procedures/quest_plus.h"
#include "protocols/procedures/staircase.h"

namespace palpate::protocols {

/// A procedure and the answers to it. Copies are independent. The answers of a session that goes on
/// are recorded again, one by one.
class Procedure {
 public:
  /// \param spec  as the parser lets it pass
  Procedure(const ProcedureSpec& spec, std::uint64_t seed);

  std::optional<double> next_level() const;  ///< nullopt: the procedure is at its end
  /// A trial that was not answered is not recorded: its level comes again.
  void record(const Response& response);
  Estimate estimate() const;
  const std::vector<Response>& history() const { return history_; }

 private:
  std::variant<ConstantStimuliRun, StaircaseRun, QuestPlusRun, LimitsRun> run_;
  std::vector<Response> history_;
};

/// The procedure after these answers.
Procedure procedure_after(const ProcedureSpec& spec, std::uint64_t seed,
                          const std::vector<Response>& history);

/// A level and the track that asks for it.
struct TrackLevel {
  std::size_t track = 0;
  double level = 0;
};

/// Several procedures whose trials are mixed: each round has one trial of every track that is not
/// at its end, in an order by chance.
class InterleavedTracks {
 public:
  InterleavedTracks(const std::vector<ProcedureSpec>& specs, std::uint64_t seed);

  std::optional<TrackLevel> next() const;  ///< nullopt: all are at their ends
  /// The answer to a trial of next().track.
  void record(const Response& response);
  const std::vector<Procedure>& tracks() const { return tracks_; }

 private:
  void begin_round();

  std::uint64_t seed_;
  std::vector<Procedure> tracks_;
  std::vector<std::size_t> round_;  // tracks to come, the next one last
  std::uint64_t rounds_ = 0;
};

}  // namespace palpate::protocols
