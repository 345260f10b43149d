#include "runner/session/signals.h"

namespace palpate::runner::session {

bool SessionSound::start() {
  if (player_ == nullptr || on_record_) return true;
  try {
    player_->turn_on();
  } catch (const sound::SoundError& error) {
    say_(error.what());
    return false;
  }
  on_record_ = true;
  station_.log.note(station_.clock.now_ns(), sound::to_json_text(*player_));
  return true;
}

void SessionSound::stop() {
  if (!on_record_) return;
  on_record_ = false;
  player_->turn_off();
  const sound::SoundReport heard = player_->report();
  if (player_->has_noise()) station_.log.note(station_.clock.now_ns(), sound::to_json_text(heard));
  if (heard.underruns > 0) say_("the sound had " + std::to_string(heard.underruns) + " gaps");
}

bool SessionSound::has_failed() {
  if (!on_record_ || !player_->failed()) return false;
  say_(player_->report().trouble);
  stop();
  return true;
}

void SessionSound::go_tone() {
  const auto& sounds = station_.protocol.sounds;
  if (player_ != nullptr && (station_.protocol.masking_noise || (sounds && sounds->go)))
    player_->tone();
}

void SessionSound::cue(participants::SoundCue cue) {
  const auto& sounds = station_.protocol.sounds;
  if (player_ == nullptr || !sounds) return;
  if (cue == participants::SoundCue::ready && sounds->ready) player_->tone(sound::Tone::ready);
  if (cue == participants::SoundCue::right && sounds->feedback) player_->tone(sound::Tone::right);
  if (cue == participants::SoundCue::wrong && sounds->feedback) player_->tone(sound::Tone::wrong);
}

TrialSignals::TrialSignals(const Station& station, Markers& markers, SessionSound& sound,
                           std::string participant, int session)
    : station_(station), markers_(markers), sound_(sound) {
  marker_.participant = std::move(participant);
  marker_.session = session;
}

void TrialSignals::send(Marker::Kind kind, std::int64_t time_ns) {
  marker_.kind = kind;
  marker_.time_ns = time_ns;
  markers_.send(marker_);
}

void TrialSignals::began(const protocols::Trial& trial) {
  began_feeling_ = turned_ = false;
  marker_.block = trial.block;
  marker_.trial = trial.trial;
  marker_.shape = station_.protocol.stimuli[static_cast<std::size_t>(trial.stimulus)].name;
  marker_.renderer = protocols::to_string(trial.renderer);
  marker_.attempt = 0;
  marker_.response.clear();
}

void TrialSignals::onset(const data::TrialRecord& so_far) {
  if (turned_) return;
  sound_.go_tone();
  marker_.attempt = so_far.attempt;
  send(began_feeling_ ? Marker::Kind::interval : Marker::Kind::trial_start, so_far.onset_ns);
  began_feeling_ = true;
}

void TrialSignals::first_contact(std::int64_t time_ns) {
  if (!turned_) send(Marker::Kind::first_contact, time_ns);
}

void TrialSignals::answered(const data::TrialRecord& record) {
  marker_.response = record.response;
  send(record.timed_out ? Marker::Kind::time_out : Marker::Kind::response, record.response_ns);
}

void TrialSignals::cut_off() { send(Marker::Kind::cut_off, station_.clock.now_ns()); }

void TrialSignals::mark(int code, std::int64_t time_ns) {
  Marker own = marker_;
  own.kind = Marker::Kind::mark;
  own.code = code;
  own.time_ns = time_ns;
  markers_.send(own);
}

}  // namespace palpate::runner::session
