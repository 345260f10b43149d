#include "runner/participants/setting_ranges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>

namespace palpate::runner {
namespace {

enum class Kind { from_least, above_least, within, whole };

struct Range {
  std::string_view pointer;
  Kind kind;
  double least, most;
};

constexpr Kind kFrom = Kind::from_least;    // least <= x <= most
constexpr Kind kAbove = Kind::above_least;  // least < x <= most
constexpr Kind kWithin = Kind::within;      // least < x < most
constexpr Kind kWhole = Kind::whole;        // from_least, without a fraction

constexpr std::array kRanges = {
    Range{"/percept/contact_sd_m", kFrom, 0, 1},
    Range{"/percept/direction_sd_deg", kFrom, 0, 180},
    Range{"/percept/along_sd_m", kAbove, 0, 1},
    Range{"/percept/axis_sd_deg", kFrom, 0, 180},
    Range{"/percept/centre_jitter_m", kFrom, 0, 1},
    Range{"/percept/rate_hz", kAbove, 0, 1000},
    Range{"/percept/force_low_pass_s", kFrom, 0, 10},
    Range{"/percept/force_threshold_n", kFrom, 0, 100},
    Range{"/observer/model_contact_sd_m", kFrom, 0, 1},
    Range{"/observer/model_direction_sd_deg", kFrom, 0, 180},
    Range{"/observer/soft_min_scale_m", kAbove, 0, 1},
    Range{"/observer/places_along", kWhole, 2, 64},
    Range{"/observer/torque_floor", kFrom, 1e-30, 1},
    Range{"/observer/free_space_weight", kFrom, 0, 1000},
    Range{"/observer/floor", kFrom, -1e6, 0},
    Range{"/observer/beta", kFrom, 0, 1000},
    Range{"/observer/movement_scale_m", kAbove, 0, 10},
    Range{"/observer/turn_length_m_per_rad", kFrom, 0, 10},
    Range{"/observer/memory_s", kAbove, 0, 1e9},
    Range{"/observer/threshold", kWithin, 0, 1},
    Range{"/observer/non_decision_s", kFrom, 0, 60},
    Range{"/motor/reaction_delay_s", kFrom, 0, 10},
    Range{"/motor/slide_speed_m_per_s", kAbove, 0, 10},
    Range{"/motor/approach_speed_m_per_s", kAbove, 0, 10},
    Range{"/motor/indentation_m", kAbove, 0, 0.1},
    Range{"/motor/max_indentation_m", kAbove, 0, 0.1},
    Range{"/motor/heading_time_constant_s", kAbove, 0, 1000},
    Range{"/motor/mean_follow_s", kAbove, 0, 1e4},
    Range{"/motor/approach_distance_m", kAbove, 0, 10},
    Range{"/motor/approach_min_rise", kWithin, -1, 1},
    Range{"/search/aim_sd_m", kFrom, 0, 1},
    Range{"/search/pull_to_centre", kFrom, 0, 1000},
    Range{"/search/pull_to_centre_per_s", kFrom, 0, 1e4},
    Range{"/search/give_up_s", kAbove, 0, 1e4},
    Range{"/heading/interval_s", kAbove, 0, 1000},
    Range{"/heading/turning_time_s", kAbove, 0, 1000},
    Range{"/heading/hypotheses", kWhole, 2, 32},
    Range{"/heading/headings", kWhole, 2, 64},
    Range{"/heading/places", kWhole, 1, 8},
    Range{"/heading/look_ahead_m", kAbove, 0, 10},
    Range{"/stylus/tilt_deg", kFrom, 0, 90},
    Range{"/stylus/tilt_sd_deg", kFrom, 0, 90},
    Range{"/stylus/turning_deg_per_s", kFrom, 0, 1e5},
    Range{"/hand/stiffness_n_per_m", kAbove, 0, 1e5},
    Range{"/hand/damping_ns_per_m", kFrom, 0, 1000},
    Range{"/hand/mass_kg", kAbove, 0, 100},
    Range{"/hand/turn_stiffness_nm_per_rad", kAbove, 0, 1000},
    Range{"/hand/turn_damping_nms_per_rad", kFrom, 0, 100},
    Range{"/device/end_mass_kg", kAbove, 0, 100},
    Range{"/device/damping_ns_per_m", kFrom, 0, 1000},
    Range{"/device/friction_n", kFrom, 0, 100},
    Range{"/device/resolution_m", kFrom, 0, 0.01},
    Range{"/device/max_force_n", kAbove, 0, 1000},
    Range{"/device/max_stiffness_n_per_m", kAbove, 0, 1e6},
    Range{"/device/workspace_radius_m", kAbove, 0, 10},
    Range{"/between_participants/slide_speed_log_sd", kFrom, 0, 3},
    Range{"/between_participants/percept_noise_log_sd", kFrom, 0, 3},
    Range{"/between_participants/reaction_delay_log_sd", kFrom, 0, 3},
    Range{"/between_participants/non_decision_log_sd", kFrom, 0, 3},
    Range{"/between_participants/threshold_logit_sd", kFrom, 0, 10},
};

bool holds(const Range& range, double x) {
  switch (range.kind) {
    case Kind::from_least:
      return x >= range.least && x <= range.most;
    case Kind::above_least:
      return x > range.least && x <= range.most;
    case Kind::within:
      return x > range.least && x < range.most;
    case Kind::whole:
      return x >= range.least && x <= range.most && x == std::floor(x);
  }
  return false;
}

const char* words_of(Kind kind) {
  switch (kind) {
    case Kind::from_least:
      return "must be %g to %g";
    case Kind::above_least:
      return "must be above %g, at most %g";
    case Kind::within:
      return "must be above %g and below %g";
    case Kind::whole:
      return "must be a whole number, %g to %g";
  }
  return "";
}

}  // namespace

std::string range_fault(const std::string& pointer, double value) {
  const auto* const range = std::find_if(kRanges.begin(), kRanges.end(),
                                         [&](const Range& one) { return one.pointer == pointer; });
  if (range == kRanges.end() || holds(*range, value)) return "";
  char text[80];
  std::snprintf(text, sizeof text, words_of(range->kind), range->least, range->most);
  return text;
}

}  // namespace palpate::runner
