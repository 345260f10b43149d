#pragma once
// The last minute of a touched scene: the moment shown, and the passing of time.

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "runner/display/scene/scene_drawing.h"

namespace palpate::runner::display {

/// Belongs to the display's thread. Times in s, of the moments.
class Timeline {
 public:
  static constexpr double kSpan = 60;                      ///< s; older moments are dropped
  static constexpr std::size_t kMost = 60'001;             ///< moments
  static constexpr double kSlowest = 0.001, kFastest = 4;  ///< factors on the speed

  enum class State {
    following,  ///< the newest moment is shown
    playing,    ///< time runs on from an earlier moment
    paused,
  };

  /// Appends a later moment; one that is not later restarts the timeline.
  void add(SceneMoment moment);
  void clear();

  /// The moment to show; none before the first.
  const SceneMoment* shown() const;
  bool empty() const { return moments_.empty(); }
  const std::deque<SceneMoment>& moments() const { return moments_; }
  double first() const;  ///< s, of the first moment; 0 if empty, as the others
  double last() const;
  double now() const;  ///< of the moment shown
  State state() const { return state_; }
  double speed() const { return speed_; }

  void pause();
  /// Plays from the moment shown; at the end, from the beginning.
  void play();
  void follow();
  /// Pauses this many moments later; negative: earlier.
  void step(int moments);
  /// Pauses at the last moment not after `time`, or the first.
  void seek(double time);
  void set_speed(double speed);

  /// A fault in the kept moments: how often it occurred, and its last time (s).
  struct Fault {
    std::uint32_t bit = 0;
    std::size_t count = 0;
    double last = 0;
  };
  /// One for each bit that occurred, lowest first.
  std::vector<Fault> faults() const;
  /// \param seconds  elapsed real time
  void advance(double seconds);

 private:
  std::size_t index_at(double time) const;
  void count(const SceneMoment& moment, bool added);

  std::deque<SceneMoment> moments_;
  State state_ = State::following;
  double time_ = 0;        ///< shown, unless it follows the newest
  std::size_t index_ = 0;  ///< likewise
  double speed_ = 1;
  std::array<Fault, 32> faults_{};  ///< of each bit
};

/// s
inline double time_of(const SceneMoment& moment) {
  return 1e-9 * static_cast<double>(moment.sample.time_ns);
}

}  // namespace palpate::runner::display
