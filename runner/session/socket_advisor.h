#pragma once
// Levels proposed by a program at a Unix domain socket on this machine: one JSON object a line.
//
//   to it    {"type": "begin", "version": 1, "protocol": NAME, "participant": NUMBER,
//             "group": NAME, "session": S, "history": [TRIAL, ...]}
//                                                   once a connection; trials of blocks on record
//            {"type": "ask", "trial": T, "block": NAME, "track": K, "stimulus": NAME,
//             "factors": {NAME: LEVEL}, "scale": "linear", "renderer": NAME, "path": POINTER,
//             "least": X, "most": Y, "own": LEVEL}
//            {"type": "tell", TRIAL...}             after every trial of an adaptive block
//            {"type": "refused", "trial": T, "message": TEXT}
//   from it  {"type": "level", "trial": T, "level": X}
//            {"type": "finished", "trial": T}       ends the block before that trial
//
// Where the level has several dimensions, "dimensions" takes the place of "path", "scale", "least"
// and "most", and the answer is "levels":
//
//   to it    {"type": "ask", ..., "dimensions": [{"name": NAME, "path": POINTER, "of": "standard",
//             "scale": "linear", "least": X, "most": Y}, ...], "own": {NAME: X, ...}}
//   from it  {"type": "levels", "trial": T, "levels": {NAME: X, ...}}
//
// TRIAL: "trial", "block", "track", "level", "success", "correct", "answered", "catch_trial",
// "response" and "response_time_s"; of several dimensions "levels" beside a null "level". "group"
// is null without groups, "response" without an answer. "trial" of "finished" may be left out.
// Answers to earlier questions are ignored. A program that does not answer in time, or sends an
// invalid line, is asked again before the next trial; after a closed connection or an overlong
// line, the session connects again.

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "data/record.h"
#include "protocols/protocol.h"
#include "protocols/schedule.h"
#include "runner/servo/device.h"

namespace palpate::runner::session {

/// A program's wish for the next trial: one of these.
struct Proposal {
  std::optional<double> level = std::nullopt;
  protocols::LevelPoint point = {};  ///< of several dimensions
  bool finished = false;             ///< the block ends
};

/// An external program that proposes the levels of adaptive blocks.
class LevelAdvisor {
 public:
  virtual ~LevelAdvisor() = default;
  /// Asks before a trial of an adaptive block, with forces off. \return what can be shown: a level
  /// within levels_of(block), a point within ranges_of(block); nullopt: the block's own procedure
  /// continues, and trouble() has the reason
  virtual std::optional<Proposal> ask(const protocols::Trial& next) = 0;
  /// Reports a recorded trial of an adaptive block.
  virtual void tell(const data::TrialRecord& record) = 0;
  /// The reason that the last question had no answer; empty: it had one.
  virtual const std::string& trouble() const = 0;
};

/// The reason that no program can be asked at a socket; empty: one listens.
std::string socket_fault(const std::string& path);

class SocketAdvisor final : public LevelAdvisor {
 public:
  static constexpr std::size_t kMostLine = 65536;  ///< bytes

  struct Settings {
    std::string path;     ///< of the program's socket
    double time_out = 1;  ///< s, for an answer
    int participant = 1;  ///< number
    int session = 1;
    const servo::DeviceCapabilities* device = nullptr;  ///< that shows the points; null: any can
  };
  /// Connects. \param protocol  must outlive it. \param history  completed trials of the session.
  /// \throws std::invalid_argument: no program listens there
  SocketAdvisor(const protocols::Protocol& protocol, Settings settings,
                const std::vector<data::TrialRecord>& history);
  ~SocketAdvisor() override;
  SocketAdvisor(const SocketAdvisor&) = delete;
  SocketAdvisor& operator=(const SocketAdvisor&) = delete;

  std::optional<Proposal> ask(const protocols::Trial& next) override;
  void tell(const data::TrialRecord& record) override;
  const std::string& trouble() const override { return trouble_; }

 private:
  using Deadline = std::chrono::steady_clock::time_point;
  bool connect();
  void disconnect();
  bool send(const std::string& line);
  /// The next line; nullopt: none until then, and trouble_ has the reason.
  std::optional<std::string> receive(Deadline until);
  std::optional<Proposal> proposal_in(const std::string& line, const protocols::Trial& next);
  /// The reason against a point; "": none.
  std::string fault_of(const protocols::LevelPoint& point, const protocols::Trial& next) const;
  std::string refusal(const std::string& message, int trial) const;

  const protocols::Protocol& protocol_;  ///< of the participant's group
  std::string group_;                    ///< "": none
  Settings settings_;
  std::string history_;  ///< of all trials so far, as JSON, separated by commas
  int socket_ = -1;
  std::string received_;  ///< bytes of an incomplete line
  std::string trouble_;
};

}  // namespace palpate::runner::session
