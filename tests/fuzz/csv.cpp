// Whatever a CSV of trials holds: the rows that are trials are used, the others are counted, or the
// file is refused.

#include <stdexcept>

#include "analysis/input/trials.h"
#include "tests/fuzz/input_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const palpate::testing::InputFile file("trials.csv");
  try {
    palpate::analysis::read_trials_csv(file.write(data, size));
  } catch (const std::runtime_error&) {
  }
  return 0;
}
