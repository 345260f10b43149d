#include "runner/display/timeline.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace palpate::runner::display {

void Timeline::clear() {
  moments_.clear();
  index_ = 0;
  faults_ = {};
}

void Timeline::add(SceneMoment moment) {
  if (!moments_.empty() && !(time_of(moment) > last())) clear();
  moments_.push_back(std::move(moment));
  count(moments_.back(), true);
  while (moments_.size() > kMost || last() - first() > kSpan) {
    count(moments_.front(), false);
    moments_.pop_front();
    if (index_ > 0) --index_;
  }
  time_ = std::clamp(time_, first(), last());
}

void Timeline::count(const SceneMoment& moment, bool added) {
  for (std::uint32_t left = moment.sample.faults; left != 0; left &= left - 1) {
    Fault& fault = faults_[static_cast<std::size_t>(std::countr_zero(left))];
    fault.bit = left & (~left + 1);
    fault.count += added ? 1 : -1;
    if (added) fault.last = time_of(moment);
  }
}

std::vector<Timeline::Fault> Timeline::faults() const {
  std::vector<Fault> out;
  for (const Fault& fault : faults_)
    if (fault.count > 0) out.push_back(fault);
  return out;
}

const SceneMoment* Timeline::shown() const {
  if (moments_.empty()) return nullptr;
  if (state_ == State::following) return &moments_.back();
  return &moments_[std::min(index_, moments_.size() - 1)];
}

double Timeline::first() const { return moments_.empty() ? 0 : time_of(moments_.front()); }
double Timeline::last() const { return moments_.empty() ? 0 : time_of(moments_.back()); }

double Timeline::now() const {
  const SceneMoment* const moment = shown();
  return moment == nullptr ? 0 : time_of(*moment);
}

std::size_t Timeline::index_at(double time) const {
  const auto after =
      std::upper_bound(moments_.begin(), moments_.end(), time,
                       [](double t, const SceneMoment& moment) { return t < time_of(moment); });
  return after == moments_.begin() ? 0 : static_cast<std::size_t>(after - moments_.begin()) - 1;
}

void Timeline::pause() { seek(now()); }

void Timeline::play() {
  const double from = now();
  seek(from >= last() ? first() : from);
  state_ = State::playing;
}

void Timeline::follow() { state_ = State::following; }

void Timeline::step(int moments) {
  pause();
  if (moments_.empty()) return;
  const auto most = static_cast<std::ptrdiff_t>(moments_.size()) - 1;
  const auto to =
      std::clamp(static_cast<std::ptrdiff_t>(index_) + moments, std::ptrdiff_t{0}, most);
  index_ = static_cast<std::size_t>(to);
  time_ = time_of(moments_[index_]);
}

void Timeline::seek(double time) {
  state_ = State::paused;
  if (moments_.empty()) return;
  index_ = index_at(time);
  time_ = time_of(moments_[index_]);
}

void Timeline::set_speed(double speed) {
  if (std::isfinite(speed)) speed_ = std::clamp(speed, kSlowest, kFastest);
}

void Timeline::advance(double seconds) {
  if (state_ != State::playing || moments_.empty() || !(seconds > 0)) return;
  time_ += speed_ * seconds;
  if (time_ < last()) {
    index_ = index_at(time_);
  } else {
    seek(last());
  }
}

}  // namespace palpate::runner::display
