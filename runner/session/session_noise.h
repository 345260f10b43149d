#pragma once
// Masking noise in a live session: it sounds while trials are run, and what was heard goes on
// record.

#include <functional>
#include <string>

#include "runner/session/station.h"

namespace palpate::runner {

/// Belongs to the session's thread. Does nothing where the station has no noise.
class SessionNoise {
 public:
  /// \param say  takes messages for the experimenter. The station must outlive it.
  SessionNoise(const LiveStation& station, std::function<void(const std::string&)> say)
      : station_(station), say_(std::move(say)) {}

  /// On, if it is not. False: the sound output cannot be opened, which is said.
  bool start();
  /// Off, if it is on.
  void stop();
  /// True where the output has failed since start(), as when headphones are pulled out: it is said,
  /// and the noise is off.
  bool has_failed();
  /// "Go": forces are on.
  void go_tone();
  /// Of the protocol's sounds, where it has this one.
  void cue(SoundCue cue);

 private:
  const LiveStation& station_;
  std::function<void(const std::string&)> say_;
  bool on_record_ = false;  ///< its start is on record, its end is not
};

}  // namespace palpate::runner
