#include "runner/devices/falcon/calibration.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string_view>

#include "data/base/json_text.h"
#include "protocols/json_document.h"
#include "protocols/object_reader.h"
#include "runner/devices/falcon/parameters.h"

namespace palpate::runner::devices::falcon {
namespace {

constexpr int kVersion = 1;
constexpr std::size_t kMany = 10'000;
constexpr double kNsPerDay = 86400e9;
constexpr double kMostForce = 20, kMostWeight = 20;  // N, kg; a Falcon holds 1 kg at most

/// Parses "2026-05-01T09:30:00Z", with any fraction of a second, to ns since 1970.
std::optional<std::int64_t> parse_utc(const std::string& text) {
  constexpr std::string_view kForm = "dddd-dd-ddTdd:dd:dd";
  if (text.size() <= kForm.size() || text.back() != 'Z') return std::nullopt;
  for (std::size_t i = 0; i < kForm.size(); ++i) {
    const bool digit = text[i] >= '0' && text[i] <= '9';
    if (kForm[i] == 'd' ? !digit : text[i] != kForm[i]) return std::nullopt;
  }
  const auto number = [&text](std::size_t at, std::size_t digits) {
    int value = 0;
    std::from_chars(text.data() + at, text.data() + at + digits, value);
    return value;
  };
  using namespace std::chrono;
  const year_month_day date{year(number(0, 4)), month(static_cast<unsigned>(number(5, 2))),
                            day(static_cast<unsigned>(number(8, 2)))};
  if (!date.ok() || number(0, 4) < 1970 || number(0, 4) > 2200 || number(11, 2) > 23 ||
      number(14, 2) > 59 || number(17, 2) > 60) {
    return std::nullopt;
  }
  const auto instant =
      sys_days(date) + hours(number(11, 2)) + minutes(number(14, 2)) + seconds(number(17, 2));
  return instant.time_since_epoch() / nanoseconds(1);
}

void read_date(protocols::ObjectReader& reader, std::string& out) {
  reader.text("made_utc", out);
  if (!parse_utc(out)) {
    reader.faults().add(reader.pointer("made_utc"),
                        "expected a time in UTC such as \"2026-05-01T09:30:00Z\"");
  }
}

void read_serial(protocols::ObjectReader& reader, const char* key, std::string& out) {
  constexpr std::size_t kMostSerial = 100;
  reader.text(key, out, kMostSerial);
}

ForceCalibration read_force(protocols::ObjectReader& reader) {
  ForceCalibration force;
  force.sealed = reader.sealed();
  read_serial(reader, "serial", force.serial);
  reader.number("counts_per_newton_metre", force.counts_per_torque,
                {kCountsPerTorque * kMostSlope, kCountsPerTorque * kLeastSlope, "1/(N m)"},
                protocols::Presence::required);
  reader.number("residual_n", force.residual, {0, kMostForce, "N"});
  reader.number("sideways_n_per_n", force.sideways, {0, kMostForce, "N/N"});
  reader.number("arm_weight_n", force.arm_weight, {-kMostForce, kMostForce, "N"});
  if (const auto* weights = reader.array("weights_kg", 0, kMany)) {
    for (std::size_t i = 0; i < weights->size(); ++i) {
      protocols::read_number(
          (*weights)[i], protocols::child_pointer(reader.pointer("weights_kg"), i),
          force.weights.emplace_back(), {0, kMostWeight, "kg", true}, reader.faults());
    }
  }
  read_date(reader, force.made_utc);
  return force;
}

PairRegistration read_pair(protocols::ObjectReader& reader) {
  PairRegistration pair;
  pair.sealed = reader.sealed();
  read_serial(reader, "tip_serial", pair.tip_serial);
  read_serial(reader, "tail_serial", pair.tail_serial);
  reader.vector("tail_position_m", pair.tail_in_tip.position, {-2, 2, "m"},
                protocols::Presence::required);
  reader.quaternion("tail_orientation_wxyz", pair.tail_in_tip.orientation);
  reader.number("stylus_length_m", pair.stylus_length, {0.02, 1, "m"},
                protocols::Presence::required);
  reader.number("residual_m", pair.residual, {0, 1, "m"});
  reader.integer("points", pair.points, {0, 1e6});
  read_date(reader, pair.made_utc);
  return pair;
}

template <class T, class Read>
void read_list(protocols::ObjectReader& root, const char* key, std::vector<T>& out, Read read) {
  const auto* list = root.array(key, 0, kMany);
  if (list == nullptr) return;
  for (std::size_t i = 0; i < list->size(); ++i) {
    protocols::ObjectReader reader((*list)[i], protocols::child_pointer(root.pointer(key), i),
                                   root.faults());
    out.push_back(read(reader));
    reader.refuse_unknown_keys();
  }
}

/// \param one  nullptr: none is stored
template <class Stored>
CalibrationVerdict judge(const std::string& what, const Stored* one, std::int64_t unix_ns) {
  if (one == nullptr) {
    return {CalibrationState::missing, what + ": none is stored; run palpate devices --calibrate"};
  }
  if (!one->sealed) {
    return {CalibrationState::stale,
            what +
                ": has no checksum, since an older version of palpate stored it; run palpate "
                "devices --calibrate again"};
  }
  const std::string& made_utc = one->made_utc;
  const auto made = parse_utc(made_utc);
  const double days = made ? static_cast<double>(unix_ns - *made) / kNsPerDay : NAN;
  std::ostringstream age;
  age << static_cast<long long>(std::floor(std::max(0.0, days)));
  if (days <= kCalibrationDays && days > -1) {  // one day of tolerance for adjusted clocks
    return {CalibrationState::good, what + ": made " + made_utc + ", " + age.str() + " days ago"};
  }
  return {CalibrationState::stale,
          what + ": made " + made_utc +
              (days < 0 ? ", in the future: check this computer's clock"
                        : ", " + age.str() + " days ago; run palpate devices --calibrate again")};
}

CalibrationVerdict implausible(const std::string& what, const ForceCalibration& force) {
  const double times = force.counts_per_torque / kCountsPerTorque;
  std::ostringstream text;
  text << std::setprecision(2) << what << ": its motors would be "
       << (times > 1 ? times : 1 / times) << " times " << (times > 1 ? "weaker" : "stronger")
       << " than a Falcon's (up to " << kPlausibleFactor
       << " is plausible), so it is not used; run palpate devices --calibrate again";
  return {CalibrationState::implausible, text.str()};
}

/// The force scale is safety-critical: other users must not be able to write the file.
void require_own(const std::string& path) {
  struct stat found {};
  if (::stat(path.c_str(), &found) != 0) return;  // reading it reports why
  const bool ours = found.st_uid == ::geteuid() || found.st_uid == 0;
  if (ours && (found.st_mode & (S_IWGRP | S_IWOTH)) == 0) return;
  throw protocols::InputError(
      {{path, "",
        ours ? "expected a file that only its owner can write, since it decides what force reaches "
               "a hand: chmod go-w"
             : "expected a file of this user or of root, since it decides what force reaches a "
               "hand: copy it once it has been checked"}});
}

constexpr double kTick = 1e-3;  // s
constexpr std::int64_t kWeighingTickNs = 1'000'000;
constexpr double kNearCentre = 0.01;  // m, at the start
constexpr int kLastTicks = 20;
constexpr int kMaxAttempts = 5;
constexpr long kMaxInterrupted = 20;  // ticks of a measurement
constexpr double kMaxDrift = 0.035;   // m, from the target; beyond it the motors are too weak
constexpr double kRamp = 0.5;         // s, from zero to full force
// In the nominal scale. The loop must stay stable with motors 4 times as strong.
constexpr double kStiffness = 250, kDamping = 5, kIntegral = 250;  // N/m, N s/m, N/(m s)
constexpr double kVelocityTime = 2.5e-3;                           // s, of the filter
constexpr double kMostResidualShare = 0.1;                         // share of the heaviest weight

/// PID control of the grip's position.
class PositionController {
 public:
  PositionController(const Vec3& position, double max_force)
      : last_(position), max_force_(max_force) {}

  Vec3 force(const Vec3& position, const Vec3& target) {
    const double blend = kTick / (kVelocityTime + kTick);
    velocity_ += blend * ((position - last_) / kTick - velocity_);
    last_ = position;
    const Vec3 error = target - position;
    sum_ += kTick * error;
    const double strength = kIntegral * glm::length(sum_);
    if (strength > max_force_) sum_ *= max_force_ / strength;
    ramp_ = std::min(1.0, ramp_ + kTick / kRamp);
    const Vec3 wanted = kStiffness * error + kIntegral * sum_ - kDamping * velocity_;
    const double size = glm::length(wanted);
    if (ramp_ == 1 && size > max_force_) ++saturated_;
    return ramp_ * std::min(1.0, max_force_ / std::max(size, max_force_)) * wanted;
  }
  long saturated() const { return saturated_; }  ///< ticks

 private:
  Vec3 last_, velocity_, sum_;
  double max_force_;  // N, nominal
  double ramp_ = 0;
  long saturated_ = 0;
};

class WeighingProcedure {
 public:
  WeighingProcedure(servo::Device& device, servo::Clock& clock, Guide& guide)
      : device_(device), clock_(clock), guide_(guide), due_ns_(clock.now_ns()) {}
  ~WeighingProcedure() {
    // Send several: a single zero command could be skipped while a reply is pending.
    for (int i = 0; i < kLastTicks; ++i) {
      next_reading();
      device_.write(Vec3(0), Vec3(0));
    }
  }
  WeighingProcedure(const WeighingProcedure&) = delete;
  WeighingProcedure& operator=(const WeighingProcedure&) = delete;

  void start_at_centre() {
    guide_.ask("Move the grip to the centre of its workspace, hold it there, and press ENTER.");
    for (;;) {
      const Vec3 position = tick_free();
      if (!answered()) continue;
      if (glm::length(position) <= kNearCentre) break;
      std::ostringstream where;
      where << "That is not the centre yet: move it " << centimetres(-position.x) << " cm right, "
            << centimetres(-position.y) << " cm away from you, " << centimetres(-position.z)
            << " cm up (to within 1 cm), and press ENTER.";
      guide_.ask(where.str());
    }
    controller_.emplace(device_.read().stylus.tip, device_.capabilities().max_force);
  }

  Weighing measure(double weight, const std::string& question, const WeighingSettings& settings) {
    guide_.ask(question);
    do {
      tick_held(Vec3(0));
    } while (!answered());
    guide_.say("  measuring; do not touch it");
    for (int attempt = 0; attempt < kMaxAttempts; ++attempt) {
      const long interrupted = interrupted_, saturated = controller_->saturated();
      Weighing weighing{weight, mean_force(settings)};
      if (controller_->saturated() > saturated) {
        throw GuideError("the motors were at their limit: take lighter weights");
      }
      if (interrupted_ - interrupted <= kMaxInterrupted) return weighing;
    }
    throw GuideError(
        "this computer does not keep time: close other programs, or see palpate devices --timing");
  }

 private:
  /// Mean commanded force over whole cycles of slow motion up and down.
  Vec3 mean_force(const WeighingSettings& settings) {
    const auto ticks = [](double seconds) { return std::lround(seconds / kTick); };
    for (long i = 0; i < ticks(settings.settle); ++i) tick_held(Vec3(0));
    Vec3 mean(0);
    const long count = ticks(settings.cycle * settings.cycles);
    for (long i = 0; i < count; ++i) {
      const double phase = static_cast<double>(i) * kTick / settings.cycle;
      const double fraction = phase - std::floor(phase);
      const double triangle = fraction < 0.25   ? 4 * fraction
                              : fraction < 0.75 ? 2 - 4 * fraction
                                                : 4 * fraction - 4;
      mean += tick_held({0, 0, settings.sweep * triangle}) / static_cast<double>(count);
    }
    return mean;
  }

  static double centimetres(double metres) { return std::round(metres * 1000) / 10; }

  servo::DeviceReading next_reading() {
    // Do not make up for missed ticks.
    due_ns_ = std::max(due_ns_ + kWeighingTickNs, clock_.now_ns());
    clock_.wait_until(due_ns_);
    return device_.read();
  }

  /// nullopt: a guard process has just cut off forces; a zero command re-enables them.
  std::optional<Vec3> position() {
    const servo::DeviceReading reading = next_reading();
    if (reading.trouble == servo::DeviceTrouble::guarded) {
      ++interrupted_;
      device_.write(Vec3(0), Vec3(0));
      return std::nullopt;
    }
    if (reading.lost) throw GuideError(servo::advice(reading.trouble));
    return reading.stylus.tip;
  }

  Vec3 tick_free() {
    for (;;) {
      const auto at = position();
      if (!at) continue;
      device_.write(Vec3(0), Vec3(0));
      return *at;
    }
  }

  /// \return the force commanded
  Vec3 tick_held(const Vec3& target) {
    const auto at = position();
    if (!at) return commanded_;
    if (glm::length(*at - target) > kMaxDrift) {
      throw GuideError(
          "the grip drifted away from the centre: take lighter weights, and lower them slowly");
    }
    commanded_ = controller_->force(*at, target);
    device_.write(commanded_, Vec3(0));
    return commanded_;
  }

  bool answered() {
    const Guide::Answer answer = guide_.answer();
    if (answer == Guide::Answer::stop) throw GuideError("stopped; nothing was stored");
    return answer == Guide::Answer::proceed;
  }

  servo::Device& device_;
  servo::Clock& clock_;
  Guide& guide_;
  std::int64_t due_ns_;
  std::optional<PositionController> controller_;
  Vec3 commanded_;
  long interrupted_ = 0;  // ticks
};

}  // namespace

void wait_until_homed(servo::Device& device, servo::Clock& clock, Guide& guide) {
  constexpr std::int64_t kTickNs = 1'000'000;
  servo::DeviceTrouble announced = servo::DeviceTrouble::none;
  for (;;) {
    clock.wait_until(clock.now_ns() + kTickNs);
    const servo::DeviceReading reading = device.read();
    device.write(Vec3(0), Vec3(0));
    if (!reading.lost && reading.trouble == servo::DeviceTrouble::none) return;
    if (reading.trouble == servo::DeviceTrouble::unplugged ||
        reading.trouble == servo::DeviceTrouble::guard_lost) {
      throw GuideError(servo::advice(reading.trouble));
    }
    if (reading.lost && reading.trouble != announced &&
        reading.trouble != servo::DeviceTrouble::guarded) {
      announced = reading.trouble;
      guide.say(device.capabilities().serial + ": " + servo::advice(announced));
    }
    if (guide.answer() == Guide::Answer::stop) throw GuideError("stopped; nothing was stored");
  }
}

bool plausible(const ForceCalibration& force) {
  const double times = force.counts_per_torque / kCountsPerTorque;
  return times >= 1 / kPlausibleFactor && times <= kPlausibleFactor;
}

const ForceCalibration* Calibration::force_of(const std::string& serial) const {
  const auto found = std::find_if(forces.begin(), forces.end(),
                                  [&](const auto& force) { return force.serial == serial; });
  return found == forces.end() ? nullptr : &*found;
}

const PairRegistration* Calibration::pair_of(const std::string& tip,
                                             const std::string& tail) const {
  const auto found = std::find_if(pairs.begin(), pairs.end(), [&](const auto& pair) {
    return pair.tip_serial == tip && pair.tail_serial == tail;
  });
  return found == pairs.end() ? nullptr : &*found;
}

void Calibration::put(const ForceCalibration& force) {
  std::erase_if(forces, [&](const ForceCalibration& old) { return old.serial == force.serial; });
  forces.push_back(force);
}

void Calibration::put(const PairRegistration& pair) {
  std::erase_if(pairs, [&](const auto& old) {
    return old.tip_serial == pair.tip_serial && old.tail_serial == pair.tail_serial;
  });
  pairs.push_back(pair);
}

Calibration parse_calibration(const std::string& text, const std::string& path) {
  protocols::FaultList faults(path);
  const nlohmann::json json = protocols::read_json(text, faults);
  Calibration calibration;
  protocols::ObjectReader root(json, "", faults);
  int version = kVersion;
  root.integer("version", version, {kVersion, kVersion}, protocols::Presence::required);
  read_list(root, "forces", calibration.forces, read_force);
  read_list(root, "pairs", calibration.pairs, read_pair);
  root.refuse_unknown_keys();
  faults.throw_if_any();
  return calibration;
}

Calibration read_calibration(const std::string& path) {
  if (!std::filesystem::exists(path)) return {};
  require_own(path);
  return parse_calibration(protocols::read_text_file(path), path);
}

std::string to_json(const Calibration& calibration) {
  using nlohmann::ordered_json;
  const auto seal = [](ordered_json& object, bool sealed) {
    if (sealed) object["sha256"] = json_checksum(nlohmann::json(object));
  };
  ordered_json forces = ordered_json::array(), pairs = ordered_json::array();
  for (const ForceCalibration& force : calibration.forces) {
    forces.push_back({{"serial", force.serial},
                      {"counts_per_newton_metre", force.counts_per_torque},
                      {"residual_n", force.residual},
                      {"sideways_n_per_n", force.sideways},
                      {"arm_weight_n", force.arm_weight},
                      {"weights_kg", force.weights},
                      {"made_utc", force.made_utc}});
    seal(forces.back(), force.sealed);
  }
  for (const PairRegistration& pair : calibration.pairs) {
    const Vec3& p = pair.tail_in_tip.position;
    const Quat& q = pair.tail_in_tip.orientation;
    pairs.push_back({{"tip_serial", pair.tip_serial},
                     {"tail_serial", pair.tail_serial},
                     {"tail_position_m", {p.x, p.y, p.z}},
                     {"tail_orientation_wxyz", {q.w, q.x, q.y, q.z}},
                     {"stylus_length_m", pair.stylus_length},
                     {"residual_m", pair.residual},
                     {"points", pair.points},
                     {"made_utc", pair.made_utc}});
    seal(pairs.back(), pair.sealed);
  }
  const ordered_json all = {{"version", kVersion}, {"forces", forces}, {"pairs", pairs}};
  return all.dump(2) + "\n";
}

CalibrationVerdict both(const CalibrationVerdict& a, const CalibrationVerdict& b) {
  return {std::max(a.state, b.state),
          a.text + (a.text.empty() || b.text.empty() ? "" : "\n") + b.text};
}

CalibrationVerdict judge_forces(const Calibration& calibration,
                                const std::vector<std::string>& serials, std::int64_t unix_ns) {
  CalibrationVerdict verdict;
  for (const std::string& serial : serials) {
    const ForceCalibration* force = calibration.force_of(serial);
    const std::string what = "force of the Falcon " + serial;
    verdict = both(verdict, force != nullptr && !plausible(*force) ? implausible(what, *force)
                                                                   : judge(what, force, unix_ns));
  }
  return verdict;
}

CalibrationVerdict judge_pair(const Calibration& calibration, const std::string& tip,
                              const std::string& tail, std::int64_t unix_ns) {
  const PairRegistration* pair = calibration.pair_of(tip, tail);
  return judge("registration of the devices " + tip + " (tip) and " + tail + " (tail)", pair,
               unix_ns);
}

ForceCalibration fit_scale(const std::vector<Weighing>& weighings) {
  const auto n = static_cast<double>(weighings.size());
  double mean_weight = 0;
  Vec3 mean_force(0);
  for (const Weighing& w : weighings) {
    mean_weight += w.weight / n;
    mean_force += w.force / n;
  }
  double spread = 0, heaviest = 0;
  Vec3 slope(0);  // nominal N for each N of weight
  for (const Weighing& w : weighings) {
    spread += (w.weight - mean_weight) * (w.weight - mean_weight);
    slope += (w.weight - mean_weight) * (w.force - mean_force);
    heaviest = std::max(heaviest, w.weight);
  }
  if (!(spread > 0)) throw GuideError("at least two different weights are needed");
  slope /= spread;
  if (!(slope.z > kLeastSlope && slope.z < kMostSlope)) {
    std::ostringstream text;
    text << "the commanded force rose by " << slope.z
         << " N for each N of weight, which is impossible: "
         << "did every weight hang freely from the grip?";
    throw GuideError(text.str());
  }
  double square = 0;
  for (const Weighing& w : weighings) {
    const double deviation = w.force.z - mean_force.z - slope.z * (w.weight - mean_weight);
    square += deviation * deviation / n;
  }
  ForceCalibration force;
  // A slope above 1 means motors weaker than nominal, so a newton metre takes more counts.
  force.counts_per_torque = kCountsPerTorque * slope.z;
  force.residual = std::sqrt(square) / slope.z;
  force.sideways = std::hypot(slope.x, slope.y) / slope.z;
  force.arm_weight = (mean_force.z - slope.z * mean_weight) / slope.z;
  if (force.residual > kMostResidualShare * heaviest) {
    std::ostringstream text;
    text << "the weights lie " << force.residual << " N off a straight line ("
         << kMostResidualShare * heaviest << " N are allowed): was a weight wrong or touched?";
    throw GuideError(text.str());
  }
  return force;
}

ForceCalibration weigh(servo::Device& device, servo::Clock& clock, Guide& guide,
                       const WeighingSettings& settings) {
  WeighingProcedure procedure(device, clock, guide);
  procedure.start_at_centre();
  std::vector<Weighing> weighings = {
      procedure.measure(0, "Let go of the grip: the motors hold it. Press ENTER.", settings)};
  for (const double mass : settings.weights) {
    std::ostringstream question;
    question << "Hang " << mass
             << " kg from the grip, lower it slowly, stop it from swinging, and press ENTER.";
    weighings.push_back(procedure.measure(mass * settings.gravity, question.str(), settings));
  }
  ForceCalibration force = fit_scale(weighings);
  force.serial = device.capabilities().serial;
  force.weights = settings.weights;
  return force;
}

}  // namespace palpate::runner::devices::falcon
