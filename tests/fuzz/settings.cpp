// Whatever a file of calibrations or of participants' settings holds: every fault is named, or all
// of its numbers are such as the forces on a hand may go by.

#include <cmath>
#include <cstdlib>

#include "protocols/parse.h"
#include "runner/devices/falcon/calibration.h"
#include "runner/participants/simulated_settings.h"
#include "tests/fuzz/input_file.h"

namespace {

void read_calibration_text(const std::string& text) {
  using namespace palpate::runner::devices::falcon;
  const Calibration calibration = parse_calibration(text, "calibration.json");
  for (const ForceCalibration& force : calibration.forces) {
    if (!std::isfinite(force.counts_per_torque) || force.counts_per_torque >= 0) std::abort();
  }
  for (const PairRegistration& pair : calibration.pairs) {
    if (!(pair.stylus_length > 0)) std::abort();
  }
  if (to_json(parse_calibration(to_json(calibration), "again.json")) != to_json(calibration)) {
    std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const palpate::testing::InputFile file("settings.json");
  try {
    read_calibration_text({reinterpret_cast<const char*>(data), size});
  } catch (const palpate::protocols::InputError&) {
  }
  try {
    palpate::runner::participants::load_simulated_settings(file.write(data, size));
  } catch (const palpate::protocols::InputError&) {
  }
  return 0;
}
