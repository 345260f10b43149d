#pragma once
// Signals of a session beside forces and words: sound to the participant's
// headphones, markers to other recorders. Belongs to the session's thread.

#include <cstdint>
#include <functional>
#include <string>
#include <utility>

#include "data/record.h"
#include "runner/participants/respondent.h"
#include "runner/session/markers.h"
#include "runner/session/station.h"
#include "runner/sound/player.h"

namespace palpate::runner::session {

/// Plays while trials run; its start and end are on record. Does nothing without a player.
class SessionSound {
 public:
  /// \param say  takes messages for the experimenter. Both must outlive it.
  SessionSound(const Station& station, std::function<void(const std::string&)> say)
      : station_(station), player_(station.sound), say_(std::move(say)) {}

  /// Starts the sound, unless it plays. False: the output cannot be opened, which is reported.
  bool start();
  /// Stops the sound if it plays.
  void stop();
  /// True if the output has failed since start(), as when headphones are pulled out: reports it and
  /// stops the sound.
  bool has_failed();
  /// Plays the tone for "go": forces are on.
  void go_tone();
  /// Plays the protocol's sound for the cue, if it has one.
  void cue(participants::SoundCue cue);

 private:
  const Station& station_;
  sound::SoundPlayer* player_;
  std::function<void(const std::string&)> say_;
  bool on_record_ = false;  ///< its start is on record, its end is not yet
};

/// The events of trials, as markers and as the tone for "go".
class TrialSignals {
 public:
  /// \param participant  code. All but the code must outlive it.
  TrialSignals(const Station& station, Markers& markers, SessionSound& sound,
               std::string participant, int session);

  void began(const protocols::Trial& trial);
  /// An interval is about to begin. \param turned  it follows a turn of an adjustment, which
  /// changes the forces: no event for others
  void interval(bool turned) { turned_ = turned; }
  void onset(const data::TrialRecord& so_far);
  void first_contact(std::int64_t time_ns);
  void answered(const data::TrialRecord& record);
  void cut_off();
  /// A program's own mark, with its own code.
  void mark(int code, std::int64_t time_ns);

 private:
  void send(Marker::Kind kind, std::int64_t time_ns);

  const Station& station_;
  Markers& markers_;
  SessionSound& sound_;
  Marker marker_;               ///< of the current trial, to be filled in
  bool began_feeling_ = false;  ///< the first interval of the trial has begun
  bool turned_ = false;
};

}  // namespace palpate::runner::session
