#pragma once
// The trials of a participant as far as they are fixed before the first answer, and as they must
// be after the answers that were given: for a registration, its check, and 'palpate schedule'.

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "protocols/protocol.h"
#include "protocols/schedule.h"
#include "protocols/session_plan.h"

namespace palpate::runner::study {

/// A trial for analysis, without its answer. Practice is left out, as its rounds depend on answers.
struct OrderRow {
  int session = 1;
  std::string renderer, shape;
  std::array<double, 4> orientation_wxyz{};
  struct Task {
    int block = 1;     ///< number
    std::string name;  ///< of the block; "": of the study of shapes
    int track = 1;
    std::optional<double> level;  ///< none: nothing is varied, or a catch trial
    bool catch_trial = false;
    int comparison = 0;              ///< its interval, from 1; 0: none is compared
    std::string reach = {};          ///< "field", "catch", "clamp"; "": no movement to a target
    std::vector<double> point = {};  ///< of several dimensions, in place of `level`
  };
  Task task = {};
  /// Compares what the order fixes: to_line().
  bool operator==(const OrderRow& other) const;
};

/// A trial that was shown.
struct ShownTrial {
  OrderRow row;
  bool practice = false;
  protocols::TrialOutcome outcome = {};
};

/// "session,renderer,shape,w,x,y,z" with 17 significant digits; of a block with a name followed by
/// ",block,name,track,level,catch,comparison", of a movement to a target also ",field", of a level
/// of several dimensions ",at,VALUE,VALUE,...".
std::string to_line(const OrderRow& row);

/// Whatever is fixed for participant number 1, 2, ..., a line each: the trials for analysis; of
/// blocks whose levels follow the answers the position of the block, its draws and the order of its
/// tracks.
std::string fixed_order(const protocols::Protocol& protocol, int participant_number);
/// The SHA-256 of these lines.
std::string order_checksum(const protocols::Protocol& protocol, int participant_number);

/// The trials for analysis that a participant must have been shown, given the answers.
struct ExpectedTrials {
  std::vector<OrderRow> rows;
  bool complete = false;  ///< every session came to its end
  /// Sessions whose last block, the levels of which a program chooses, has fewer trials than its
  /// procedure: only the session's notes tell whether the program ended it.
  int ended_by_program = 0;
};
/// \param shown  of the participant, in order
ExpectedTrials expected_trials(const protocols::Protocol& protocol, int participant_number,
                               const std::vector<ShownTrial>& shown);

/// Trials for analysis of a participant: exactly, or those that adaptive blocks usually take.
std::size_t planned_trials(const protocols::Protocol& protocol);
/// Whether answers choose levels of trials for analysis.
bool has_adaptive_blocks(const protocols::Protocol& protocol);

/// The order in which renderers or blocks come: "point, then ray".
std::string condition_order(const protocols::Protocol& protocol, int participant_number);
/// The same of trials that were shown.
std::string condition_order(const protocols::Protocol& protocol,
                            const std::vector<ShownTrial>& shown);

}  // namespace palpate::runner::study
