#pragma once
// What is kept of a session and of every trial. Plain values; SI units; times are int64 nanoseconds.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace palpate {

/// One servo tick of a trial, as it is kept when the protocol asks for samples.
struct SampleRecord {
  std::uint32_t tick = 0;              ///< from time zero of the trial
  std::array<double, 3> tip{}, tail{}; ///< m, world frame
  std::array<double, 3> force{};       ///< N, on the hand
  std::array<double, 3> torque{};      ///< N m, about the virtual tip
  double depth = 0;                    ///< m, deepest contact
  std::uint8_t contacts = 0;
  std::uint8_t contact_type = 0;
  std::uint8_t buttons = 0;
  std::uint8_t faults = 0;             ///< fault bits of the tick
};

/// One presentation of one trial.
struct TrialRecord {
  int session = 1, block = 1, trial = 1;
  int attempt = 1;
  std::string renderer, shape, response;  ///< response empty: none
  bool correct = false, practice = false, timed_out = false;
  std::array<double, 4> orientation_wxyz{1, 0, 0, 0};
  double response_time = 0;                  ///< s, from time zero
  std::optional<double> first_contact_time;  ///< s, from time zero
  std::int64_t onset_ns = 0;                 ///< session clock (CLOCK_MONOTONIC; virtual when simulated)
  std::int64_t response_ns = 0;              ///< session clock
  std::string onset_utc;                     ///< ISO 8601, UTC, microseconds
  std::array<double, 3> start_tip{}, start_tail{};  ///< m, at time zero
  std::uint64_t ticks = 0, missed_ticks = 0;
  std::int64_t longest_period_ns = 0;
  std::uint32_t faults = 0;                  ///< or of all ticks' fault bits
  bool started_inside = false;               ///< the stylus was inside an object at time zero
  double max_force = 0;                      ///< N
  std::vector<SampleRecord> samples;         ///< empty unless asked for
};

}  // namespace palpate
