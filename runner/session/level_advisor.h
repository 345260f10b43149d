#pragma once
// Somebody outside of the program who proposes the levels of adaptive blocks.

#include <optional>
#include <string>

#include "data/record.h"
#include "protocols/protocol.h"
#include "protocols/schedule.h"

namespace palpate::runner {

class LevelAdvisor {
 public:
  virtual ~LevelAdvisor() = default;
  /// Before a trial of an adaptive block, forces off. \return the level to be shown, within those
  /// of levels_of(block); nullopt: the block's own procedure goes on, and trouble() says why
  virtual std::optional<double> ask(const protocols::Trial& next) = 0;
  /// A trial of an adaptive block is on record.
  virtual void tell(const data::TrialRecord& record) = 0;
  /// Why the last question had no answer; empty: it had one.
  virtual const std::string& trouble() const = 0;
};

}  // namespace palpate::runner
