#include "runner/devices/falcon/calibration.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string_view>

#include "protocols/json_document.h"
#include "runner/devices/falcon/parameters.h"

namespace palpate::runner::devices::falcon {

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

namespace {

constexpr int kVersion = 1;
constexpr std::size_t kMany = 10'000;
constexpr double kNsPerDay = 86400e9;

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

ForceCalibration read_force(protocols::ObjectReader& reader) {
  ForceCalibration force;
  reader.text("serial", force.serial);
  reader.number("counts_per_newton_metre", force.counts_per_torque,
                {kCountsPerTorque * kMostSlope, kCountsPerTorque * kLeastSlope, "1/(N m)"},
                protocols::Presence::required);
  reader.number("residual_n", force.residual, {0, 1e3, "N"});
  reader.number("sideways_n_per_n", force.sideways, {0, 1e3, "N/N"});
  reader.number("arm_weight_n", force.arm_weight, {-1e3, 1e3, "N"});
  if (const auto* weights = reader.array("weights_kg", 0, kMany)) {
    for (std::size_t i = 0; i < weights->size(); ++i) {
      const auto& weight = (*weights)[i];
      if (weight.is_number()) {
        force.weights.push_back(weight.get<double>());
      } else {
        reader.faults().add(protocols::child_pointer(reader.pointer("weights_kg"), i),
                            "expected a mass in kg");
      }
    }
  }
  read_date(reader, force.made_utc);
  return force;
}

PairRegistration read_pair(protocols::ObjectReader& reader) {
  PairRegistration pair;
  reader.text("tip_serial", pair.tip_serial);
  reader.text("tail_serial", pair.tail_serial);
  reader.vector("tail_position_m", pair.tail_in_tip.position, {-2, 2, "m"});
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

CalibrationVerdict judge(const std::string& what, const std::string& made_utc, bool known,
                         std::int64_t unix_ns) {
  if (!known) {
    return {CalibrationState::missing, what + ": none is stored; run palpate devices --calibrate"};
  }
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

}  // namespace

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
  ordered_json forces = ordered_json::array(), pairs = ordered_json::array();
  for (const ForceCalibration& force : calibration.forces) {
    forces.push_back({{"serial", force.serial},
                      {"counts_per_newton_metre", force.counts_per_torque},
                      {"residual_n", force.residual},
                      {"sideways_n_per_n", force.sideways},
                      {"arm_weight_n", force.arm_weight},
                      {"weights_kg", force.weights},
                      {"made_utc", force.made_utc}});
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
    verdict = both(verdict, force != nullptr && !plausible(*force)
                                ? implausible(what, *force)
                                : judge(what, force != nullptr ? force->made_utc : "",
                                        force != nullptr, unix_ns));
  }
  return verdict;
}

CalibrationVerdict judge_pair(const Calibration& calibration, const std::string& tip,
                              const std::string& tail, std::int64_t unix_ns) {
  const PairRegistration* pair = calibration.pair_of(tip, tail);
  return judge("registration of the devices " + tip + " (tip) and " + tail + " (tail)",
               pair != nullptr ? pair->made_utc : "", pair != nullptr, unix_ns);
}

}  // namespace palpate::runner::devices::falcon
