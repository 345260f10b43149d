#include "analysis/movement/measures.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <stdexcept>
#include <string_view>

#include "analysis/movement/signal.h"
#include "analysis/statistics/quantiles.h"

namespace palpate::analysis {
namespace {

double seconds(std::size_t ticks, double rate) { return static_cast<double>(ticks) / rate; }
std::size_t ticks_of(double seconds, double rate) {
  return std::max<std::size_t>(1, static_cast<std::size_t>(std::llround(seconds * rate)));
}
// Lets a duration equal to the limit pass despite rounding.
constexpr double kMeasureRounding = 1e-9;

using Values = std::vector<double>;

/// Sets values by their names.
class Filling {
 public:
  void set(const char* name, std::optional<double> value) {
    if (value && std::isfinite(*value)) values_[measure_named(name)] = value;
  }
  const MeasureValues& values() const { return values_; }

 private:
  MeasureValues values_{};
};

std::optional<double> mean_of(const Values& values) {
  if (values.empty()) return std::nullopt;
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

std::optional<double> sd_of(const Values& values) {
  if (values.size() < 2) return std::nullopt;
  const double centre = *mean_of(values);
  double sum = 0;
  for (const double value : values) sum += (value - centre) * (value - centre);
  return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

std::optional<double> greatest_of(const Values& values) {
  if (values.empty()) return std::nullopt;
  return *std::max_element(values.begin(), values.end());
}

/// Stretches found in each piece, with indices in the trial.
template <class Find>
std::vector<Stretch> in_pieces(const std::vector<Stretch>& pieces, const Find& find) {
  std::vector<Stretch> all;
  for (const Stretch& piece : pieces) {
    for (const Stretch& one : find(piece))
      all.push_back({piece.begin + one.begin, piece.begin + one.end});
  }
  return all;
}

/// Mean of the movements' values, weighted by their paths.
class ByMovement {
 public:
  void add(const std::optional<double>& value, double path) {
    if (!value || !(path > 0)) return;
    sum_ += *value * path;
    path_ += path;
  }
  std::optional<double> mean() const {
    return path_ > 0 ? std::optional(sum_ / path_) : std::nullopt;
  }

 private:
  double sum_ = 0, path_ = 0;
};

void put_motion(const SmoothPath& smooth, const std::vector<Stretch>& pieces, double rate,
                Filling& out) {
  constexpr double kPeakShare = 0.05, kPeakLeast = 0.005;
  const Values& speed = smooth.speed;
  double length = 0;
  for (const Stretch& piece : pieces) length += path_length(part_of(smooth.place, piece));
  out.set("path_length", length);
  out.set("speed_mean", mean_of(speed));
  Values sorted = speed;
  std::sort(sorted.begin(), sorted.end());
  out.set("speed_p95", sorted_quantile(sorted, 0.95));
  if (length > 0) {
    const double least = std::max(kPeakShare * sorted.back(), kPeakLeast);
    std::size_t found = 0;
    for (const Stretch& piece : pieces) found += peaks(part_of(speed, piece), least);
    out.set("speed_peaks_per_m", static_cast<double>(found) / length);
  }
  ByMovement whole, arc, jerk, speed_jerk;
  for (const Stretch& piece : pieces)
    whole.add(sparc(part_of(speed, piece), rate), path_length(part_of(smooth.place, piece)));
  out.set("sparc", whole.mean());
  for (const Stretch& one : smooth.movements) {
    const std::vector<Vec3> way = part_of(smooth.place, one);
    const Values its_speed = part_of(speed, one);
    const double its_length = path_length(way);
    arc.add(sparc(its_speed, rate), its_length);
    jerk.add(log_dimensionless_jerk(way, rate), its_length);
    speed_jerk.add(log_dimensionless_jerk_of_speed(its_speed, rate), its_length);
  }
  out.set("movements", static_cast<double>(smooth.movements.size()));
  out.set("sparc_movement", arc.mean());
  out.set("ldlj", jerk.mean());
  out.set("ldlj_speed", speed_jerk.mean());
}

/// Sets "force_mean" and the other measures of force.
void put_force(const std::string& suffix, const Values& force, Filling& out) {
  out.set(("force_mean" + suffix).c_str(), mean_of(force));
  out.set(("force_sd" + suffix).c_str(), sd_of(force));
  out.set(("force_max" + suffix).c_str(), greatest_of(force));
}

void put_forces(const MovementTrial& trial, const std::vector<Stretch>& pieces,
                const std::vector<Stretch>& episodes, Filling& out) {
  const std::size_t n = trial.tip.size();
  Values all, along, across, normal_force(n);
  for (std::size_t i = 0; i < n; ++i) {
    if (!trial.contact[i]) continue;
    normal_force[i] = glm::dot(trial.force[i], trial.normal[i]);
    all.push_back(glm::length(trial.force[i]));
    along.push_back(normal_force[i]);
    across.push_back(glm::length(trial.force[i] - normal_force[i] * trial.normal[i]));
  }
  put_force("", all, out);
  put_force("_n", along, out);
  put_force("_t", across, out);
  Values peaks_of_episodes;
  for (const Stretch& one : episodes)
    peaks_of_episodes.push_back(*greatest_of(part_of(normal_force, one)));
  out.set("press_peak", mean_of(peaks_of_episodes));
  double squares = 0;
  std::size_t rates = 0;
  for (const Stretch& one : in_pieces(pieces, [&](const Stretch& piece) {
         return stretches(part_of(trial.contact, piece));
       })) {
    for (std::size_t i = one.begin + 1; i + 1 < one.end; ++i, ++rates) {
      const double rate = (normal_force[i + 1] - normal_force[i - 1]) * trial.rate / 2;
      squares += rate * rate;
    }
  }
  if (rates > 0) out.set("force_rate", std::sqrt(squares / static_cast<double>(rates)));
}

void put_procedures(const MovementTrial& trial, const std::vector<Stretch>& pieces,
                    const Values& tangential_speed, Filling& out) {
  std::vector<ContactMotion> motion(trial.tip.size());
  for (std::size_t i = 0; i < motion.size(); ++i) {
    if (trial.contact[i])
      motion[i] = {tangential_speed[i], glm::dot(trial.force[i], trial.normal[i]),
                   trial.on_edge[i]};
  }
  std::vector<Procedure> found;
  for (const Stretch& piece : pieces) {
    for (const Procedure one :
         procedures(part_of(trial.contact, piece), part_of(motion, piece), trial.rate))
      found.push_back(one);
  }
  if (found.empty()) return;
  constexpr std::array<const char*, kProcedures> kNames = {"share_static", "share_pressure",
                                                           "share_lateral", "share_contour"};
  for (std::size_t k = 0; k < kProcedures; ++k) {
    const auto count = std::count(found.begin(), found.end(), static_cast<Procedure>(k));
    out.set(kNames[k], static_cast<double>(count) / static_cast<double>(found.size()));
  }
}

void put_surface(const MovementTrial& trial, const TouchedSurface& surface, Filling& out) {
  std::vector<std::size_t> parts;
  for (std::size_t i = 0; i < trial.tip.size(); ++i) {
    if (trial.contact[i]) parts.push_back(surface.part_of(trial.point[i]));
  }
  if (parts.empty()) {
    out.set("coverage", 0);
    return;
  }
  out.set("coverage", coverage_by_tick(trial, surface).back());
  out.set("entropy", entropy(parts));
  out.set("transitions",
          static_cast<double>(transitions(parts)) * trial.rate / static_cast<double>(parts.size()));
}

}  // namespace

std::vector<Stretch> contact_episodes(const std::vector<bool>& contact, double rate) {
  constexpr double kGap = 0.05, kShortest = 0.02;
  std::vector<Stretch> joined;
  for (const Stretch& one : stretches(contact)) {
    if (!joined.empty() && seconds(one.begin - joined.back().end, rate) < kGap - kMeasureRounding)
      joined.back().end = one.end;
    else
      joined.push_back(one);
  }
  std::erase_if(joined, [rate](const Stretch& one) {
    return seconds(one.size(), rate) < kShortest - kMeasureRounding;
  });
  return joined;
}

std::vector<Stretch> stops(const std::vector<bool>& contact, const std::vector<double>& speed,
                           double rate) {
  constexpr double kSlow = 0.005, kShortest = 0.05;
  std::vector<bool> slow(contact.size());
  for (std::size_t i = 0; i < slow.size(); ++i) slow[i] = contact[i] && speed[i] < kSlow;
  std::vector<Stretch> found = stretches(slow);
  std::erase_if(found, [rate](const Stretch& one) {
    return seconds(one.size(), rate) < kShortest - kMeasureRounding;
  });
  return found;
}

std::size_t strokes(const std::vector<bool>& contact, const std::vector<Stretch>& stops,
                    const std::vector<Vec3>& path, double rate) {
  constexpr double kWay = 0.05;
  const std::size_t way = ticks_of(kWay, rate);
  std::vector<bool> moving = contact;
  for (const Stretch& stop : stops) {
    for (std::size_t i = stop.begin; i < stop.end; ++i) moving[i] = false;
  }
  std::size_t count = 0;
  for (const Stretch& one : stretches(moving)) {
    if (one.size() < way) continue;
    ++count;
    bool turning = false;
    for (std::size_t i = one.begin + way; i + way < one.end; ++i) {
      const bool turns = glm::dot(path[i] - path[i - way], path[i + way] - path[i]) < 0;
      count += turns && !turning;
      turning = turns;
    }
  }
  return count;
}

Procedure procedure_of(const std::vector<ContactMotion>& window) {
  constexpr double kFast = 0.01, kPressing = 0.3;
  double speed = 0, force = 0;
  double least = window.front().normal_force, greatest = least;
  std::size_t on_edge = 0;
  for (const ContactMotion& tick : window) {
    speed += tick.tangential_speed;
    force += tick.normal_force;
    least = std::min(least, tick.normal_force);
    greatest = std::max(greatest, tick.normal_force);
    on_edge += tick.on_edge;
  }
  const double n = static_cast<double>(window.size());
  if (speed / n >= kFast)
    return 2 * on_edge >= window.size() ? Procedure::contour : Procedure::lateral;
  return greatest - least > kPressing * (force / n) ? Procedure::pressure : Procedure::stationary;
}

std::vector<Procedure> procedures(const std::vector<bool>& contact,
                                  const std::vector<ContactMotion>& motion, double rate) {
  constexpr double kWindow = 0.1;
  const std::size_t window = ticks_of(kWindow, rate);
  std::vector<Procedure> found;
  for (const Stretch& one : stretches(contact)) {
    for (std::size_t i = one.begin; i + window <= one.end; i += window) {
      const auto first = motion.begin() + static_cast<std::ptrdiff_t>(i);
      found.push_back(procedure_of({first, first + static_cast<std::ptrdiff_t>(window)}));
    }
  }
  return found;
}

const std::array<MeasureDefinition, kMeasures>& measure_definitions() {
  using enum MeasureScale;
  static constexpr std::array<MeasureDefinition, kMeasures> kAll = {{
      {"path_length", "m", log, "length of the tip's path"},
      {"contact_path", "m", log, "length of the tip's path in contact"},
      {"contact_share", "1", logit, "ticks with contact over all ticks"},
      {"approaches", "1", count,
       "contact episodes; gaps under 50 ms joined, episodes under 20 ms dropped"},
      {"episode_time", "s", log, "mean length of a contact episode"},
      {"speed_mean", "m/s", log, "mean speed of the tip"},
      {"speed_contact", "m/s", log, "mean speed along the surface, in contact"},
      {"speed_p95", "m/s", log, "95th percentile of the tip's speed"},
      {"speed_peaks_per_m", "1/m", count,
       "maxima of speed with a prominence of 5 % of the greatest and 5 mm/s, by path"},
      {"sparc", "1", identity, "spectral arc length of the trial's speed, up to 10 Hz"},
      {"movements", "1", count,
       "stretches with 5 % of the greatest speed or more, for 100 ms or more"},
      {"sparc_movement", "1", identity, "spectral arc length by movement, weighted by path"},
      {"ldlj", "1", identity, "log dimensionless vector jerk by movement, weighted by path"},
      {"ldlj_speed", "1", identity, "the same from the second difference of speed"},
      {"force_mean", "N", log, "mean force in contact"},
      {"force_sd", "N", log, "standard deviation of the force in contact"},
      {"force_max", "N", log, "greatest force in contact"},
      {"force_mean_n", "N", log, "mean force along the normal in contact"},
      {"force_sd_n", "N", log, "standard deviation of the force along the normal"},
      {"force_max_n", "N", log, "greatest force along the normal"},
      {"force_mean_t", "N", log, "mean force along the surface in contact"},
      {"force_sd_t", "N", log, "standard deviation of the force along the surface"},
      {"force_max_t", "N", log, "greatest force along the surface"},
      {"press_peak", "N", log, "mean over episodes of the greatest force along the normal"},
      {"force_rate", "N/s", log, "root mean square change of the force along the normal"},
      {"stops", "1", count, "slower than 5 mm/s for 50 ms or more in contact"},
      {"stop_time", "s", log, "mean length of a stop"},
      {"strokes", "1", count,
       "movements in contact of 50 ms or more between stops and turns by more than 90 degrees"},
      {"edge_dwell", "s", count,
       "contact within 3 mm of an edge of 30 degrees or more; compared as the log of it and 1 s"},
      {"coverage", "1", logit,
       "share of 10,000 places on the surface within 5 mm of a contact point, or of the touched "
       "part "
       "of the segment"},
      {"entropy", "1", logit,
       "normalised entropy of contact time over 64 equal parts of the surface; 1: even"},
      {"transitions", "1/s", count, "changes between these parts, per time in contact"},
      {"coverage_rate", "1/s", count, "coverage per time of the trial"},
      {"duration", "s", log, "duration of the samples"},
      {"share_static", "1", logit,
       "windows of 100 ms in contact slower than 10 mm/s with steady force"},
      {"share_pressure", "1", logit,
       "windows slower than 10 mm/s whose force changes by more than 0.3 of its mean"},
      {"share_lateral", "1", logit, "windows of 10 mm/s or more along the surface, off edges"},
      {"share_contour", "1", logit, "windows of 10 mm/s or more along the surface, on an edge"},
  }};
  return kAll;
}

std::size_t measure_named(const char* name) {
  const auto& all = measure_definitions();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (std::string_view(all[i].name) == name) return i;
  }
  throw std::invalid_argument(std::string("no measure is named ") + name);
}

std::vector<Stretch> pieces_of(const MovementTrial& trial) {
  std::vector<Stretch> pieces;
  std::size_t begin = 0;
  for (const std::size_t at : trial.breaks) {
    if (at > begin) pieces.push_back({begin, at});
    begin = at;
  }
  if (trial.tip.size() > begin) pieces.push_back({begin, trial.tip.size()});
  return pieces;
}

SmoothPath smooth_path(const MovementTrial& trial, const MovementSettings& settings) {
  SmoothPath smooth;
  const std::vector<Stretch> pieces = pieces_of(trial);
  for (const Stretch& piece : pieces) {
    const std::vector<Vec3> path = low_pass(part_of(trial.tip, piece), trial.rate, settings.cutoff);
    const std::vector<Vec3> moves = velocity(path, trial.rate);
    smooth.place.insert(smooth.place.end(), path.begin(), path.end());
    smooth.velocity.insert(smooth.velocity.end(), moves.begin(), moves.end());
  }
  smooth.speed = lengths(smooth.velocity);
  const double greatest = greatest_of(smooth.speed).value_or(0);
  smooth.movements = in_pieces(pieces, [&](const Stretch& piece) {
    return movements(part_of(smooth.speed, piece), trial.rate, greatest);
  });
  return smooth;
}

std::vector<double> coverage_by_tick(const MovementTrial& trial, const TouchedSurface& surface) {
  constexpr double kStep = TouchedSurface::kReach / 2;
  std::vector<Vec3> points;
  std::vector<std::size_t> last;  // index of the last point of each tick in contact
  for (std::size_t i = 0; i < trial.tip.size(); ++i) {
    if (!trial.contact[i]) continue;
    points.push_back(trial.point[i]);
    if (!trial.touched.empty()) {
      const auto& [from, to] = trial.touched[i];
      const auto steps = static_cast<int>(std::ceil(glm::length(to - from) / kStep));
      for (int k = 0; k <= steps && steps > 0; ++k)
        points.push_back(glm::mix(from, to, static_cast<double>(k) / steps));
    }
    last.push_back(points.size() - 1);
  }
  const std::vector<double> shares = surface.coverage(points);
  std::vector<double> by_tick;
  by_tick.reserve(last.size());
  for (const std::size_t at : last) by_tick.push_back(shares[at]);
  return by_tick;
}

MeasureValues measure(const MovementTrial& trial, const TouchedSurface* surface,
                      const MovementSettings& settings) {
  Filling out;
  const std::size_t n = trial.tip.size();
  if (n < 2) return out.values();
  const std::vector<Stretch> pieces = pieces_of(trial);
  const SmoothPath smooth = smooth_path(trial, settings);
  const std::vector<Vec3>&path = smooth.place, &moves = smooth.velocity;
  const Values& speed = smooth.speed;
  put_motion(smooth, pieces, trial.rate, out);
  const double duration = static_cast<double>(n) / trial.rate;
  out.set("duration", duration);

  double contact_path = 0;
  Values along(n), along_in_contact;
  std::size_t edge_ticks = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (!trial.contact[i]) continue;
    along[i] = glm::length(moves[i] - glm::dot(moves[i], trial.normal[i]) * trial.normal[i]);
    along_in_contact.push_back(along[i]);
    if (!trial.on_edge.empty()) edge_ticks += trial.on_edge[i];
  }
  for (const Stretch& piece : pieces) {
    for (std::size_t i = piece.begin + 1; i < piece.end; ++i) {
      if (trial.contact[i] && trial.contact[i - 1])
        contact_path += glm::length(path[i] - path[i - 1]);
    }
  }
  out.set("contact_share", static_cast<double>(along_in_contact.size()) / static_cast<double>(n));
  out.set("contact_path", contact_path);
  out.set("speed_contact", mean_of(along_in_contact));
  if (!trial.on_edge.empty()) out.set("edge_dwell", static_cast<double>(edge_ticks) / trial.rate);

  const auto put_stretches = [&](const char* number, const char* time,
                                 const std::vector<Stretch>& found) {
    out.set(number, static_cast<double>(found.size()));
    Values times;
    for (const Stretch& one : found) times.push_back(static_cast<double>(one.size()) / trial.rate);
    out.set(time, mean_of(times));
  };
  const std::vector<Stretch> episodes = in_pieces(pieces, [&](const Stretch& piece) {
    return contact_episodes(part_of(trial.contact, piece), trial.rate);
  });
  put_stretches("approaches", "episode_time", episodes);
  std::size_t stroked = 0;
  const std::vector<Stretch> resting = in_pieces(pieces, [&](const Stretch& piece) {
    const std::vector<bool> contact = part_of(trial.contact, piece);
    std::vector<Stretch> found = stops(contact, part_of(speed, piece), trial.rate);
    stroked += strokes(contact, found, part_of(path, piece), trial.rate);
    return found;
  });
  put_stretches("stops", "stop_time", resting);
  out.set("strokes", static_cast<double>(stroked));
  put_forces(trial, pieces, episodes, out);
  if (!trial.on_edge.empty()) put_procedures(trial, pieces, along, out);
  if (surface != nullptr) {
    put_surface(trial, *surface, out);
    const auto& covered = out.values()[measure_named("coverage")];
    if (covered) out.set("coverage_rate", *covered / duration);
  }
  return out.values();
}

}  // namespace palpate::analysis
