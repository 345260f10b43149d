// Whatever a trajectory holds: every fault is named with its line, or its times increase.

#include <cstdlib>

#include "protocols/parse.h"
#include "runner/touch/forces.h"
#include "tests/fuzz/input_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const palpate::testing::InputFile file("trajectory.csv");
  try {
    const auto rows = palpate::runner::touch::read_trajectory(file.write(data, size));
    if (rows.empty()) std::abort();
    for (std::size_t i = 1; i < rows.size(); ++i) {
      if (!(rows[i].t > rows[i - 1].t)) std::abort();
    }
  } catch (const palpate::protocols::InputError&) {
  }
  return 0;
}
