#include "runner/session/effect_check.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "rendering/fields.h"
#include "runner/servo/field_demand.h"
#include "stimuli/texture.h"

namespace palpate::runner::session {
namespace {

using Kind = stimuli::FieldSpec::Kind;

constexpr double kValuesOfAPeriod = 4;     // resolution steps of a device in the shortest period
constexpr double kTicksOfAWave = 4;        // ticks in a period of a vibration, at least
constexpr double kCleanTicks = 8;          // below so many, a wave loses a sixth of its impulse
constexpr double kPress = 1;               // N, a usual press
constexpr double kUsualResolution = 3e-5;  // m, of devices with encoders
constexpr double kUsualSpeed = 0.3, kUsualTurn = 6;  // m/s and rad/s, of a hand on a circle
constexpr double kLeastNoise = 0.05;                 // N; less is not felt

template <class... Values>
std::string sentence(const Values&... values) {
  std::ostringstream text;
  (text << ... << values);
  return text.str();
}

std::string at_field(std::size_t i, const char* key) {
  return "/fields/" + std::to_string(i) + "/" + key;
}

}  // namespace

std::vector<std::string> effect_faults(const stimuli::ObjectSpec& object, double rate,
                                       const servo::DeviceCapabilities& device) {
  std::vector<std::string> out;
  if (object.texture && object.texture->depth > 0 &&
      object.texture->period < kValuesOfAPeriod * device.resolution) {
    out.push_back(sentence(" has at /texture/period_m ", object.texture->period, " m, and '",
                           device.name, "' resolves ", device.resolution, " m: expected at least ",
                           kValuesOfAPeriod * device.resolution, " m"));
  }
  const double highest = rate / kTicksOfAWave;
  if (object.transient && object.transient->amplitude > 0 &&
      object.transient->frequency > highest) {
    out.push_back(sentence(" has at /contact_transient/frequency_hz ", object.transient->frequency,
                           " Hz: expected at most a quarter of the rate, ", highest, " Hz"));
  }
  for (std::size_t i = 0; i < object.fields.size(); ++i) {
    const stimuli::FieldSpec& field = object.fields[i];
    if (field.kind == Kind::vibration && field.frequency > highest) {
      out.push_back(sentence(" has at ", at_field(i, "frequency_hz"), " ", field.frequency,
                             " Hz: expected at most a quarter of the rate, ", highest, " Hz"));
    }
  }
  return out;
}

std::vector<std::string> effect_notes(const stimuli::ObjectSpec& object,
                                      const stimuli::Texture* texture, double rate) {
  std::vector<std::string> out;
  if (texture != nullptr) {
    out.push_back(sentence("/texture/period_m: above ", texture->period() * rate / 4,
                           " m/s its ridges are felt as others (period x rate / 4)"));
    const double snaps = object.material.stiffness > 0
                             ? texture->greatest_curvature() * kPress / object.material.stiffness
                             : 0;
    if (snaps > 1) {
      out.push_back(sentence("/texture/depth_m: at ", kPress,
                             " N it snaps from groove to groove (curvature x force / stiffness is ",
                             snaps, "): a stiffer surface or a shallower texture does not"));
    }
  }
  if (object.transient && object.transient->amplitude > 0 &&
      object.transient->frequency > rate / kCleanTicks) {
    out.push_back(sentence("/contact_transient/frequency_hz: above an eighth of the rate, ",
                           rate / kCleanTicks, " Hz, a knock loses part of its impulse"));
  }
  for (std::size_t i = 0; i < object.fields.size(); ++i) {
    const stimuli::FieldSpec& field = object.fields[i];
    const servo::FieldDemand one = servo::demand_of({field}, rate, kUsualResolution);
    if (one.noise > kLeastNoise) {
      out.push_back(sentence(at_field(i, "low_pass_s"), ": a step of ", kUsualResolution,
                             " m of the position gives ", one.noise,
                             " N; a longer low pass gives less"));
    }
    if (field.destabilising)
      out.push_back(at_field(i, "destabilising") + ": this field may feed energy to the hand");
    if (field.kind == Kind::curl) {
      out.push_back(sentence(at_field(i, "damping_ns_per_m"), ": on a circle, at ", kUsualSpeed,
                             " m/s and ", kUsualTurn, " rad/s, it drives the hand with ",
                             1e3 * rendering::curl_power(std::abs(field.damping[0][0]), kUsualSpeed,
                                                         kUsualTurn, 1 / rate, field.low_pass),
                             " mW one way round, and brakes it the other"));
    }
  }
  return out;
}

}  // namespace palpate::runner::session
