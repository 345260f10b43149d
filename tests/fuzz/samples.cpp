// Whatever a stored blob of samples holds: it is refused, or the samples come back the same when
// they are packed again; and the memory that it asks for is in proportion to its bytes.

#include <cstdlib>
#include <string>

#include "data/store/attempts.h"
#include "data/store/store.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace palpate;
  if (size < 4) return 0;
  const int packing = 1 + data[0] % data::kSamplesPacking;
  const std::int64_t count = data[1] + 256 * data[2] + 65536 * data[3];
  try {
    const auto first = data::unpack_samples(data + 4, size - 4, count, packing);
    if (static_cast<std::int64_t>(first.samples.size()) != count) std::abort();
    const data::PackedSamples again = data::pack_samples(first.samples, first.bodies);
    const auto back =
        data::unpack_samples(again.bytes.data(), again.bytes.size(), count, again.packing);
    if (data::pack_samples(back.samples, back.bodies).bytes != again.bytes) std::abort();
  } catch (const data::StoreError&) {
  }
  return 0;
}
