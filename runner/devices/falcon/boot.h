#pragma once
// Starting a Falcon: finds out whether firmware is running and uploads it if not. The device loses
// its firmware when it is switched off.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "runner/devices/falcon/transport.h"

namespace palpate::runner::devices::falcon {

/// A firmware file named by the user; none is shipped. A stream for the boot ROM of TI's C28x
/// processors: 16-bit little-endian words; key 0x08AA, 8 reserved words, entry point; blocks of a
/// count n, a destination and n words; a count of 0 ends the stream.
struct FirmwareImage {
  std::vector<std::uint8_t> bytes;
  std::uint32_t entry = 0;
  int blocks = 0;
};

/// Checks the structure; the format has no checksum. \throws InputError naming `file` and the byte.
FirmwareImage parse_image(std::vector<std::uint8_t> bytes, const std::string& file);
/// \throws InputError.
FirmwareImage read_image(const std::string& file);

struct BootSettings {
  int monitor_probes = 100;                   ///< most probes until the boot monitor answers
  std::int64_t monitor_wait_ns = 40'000'000;  ///< for each
  std::int64_t echo_wait_ns = 1'000'000'000;  ///< for the echo of a chunk
  int uploads = 10;                           ///< attempts; several are common
  int packet_probes = 30;                     ///< most probes until running firmware answers
  std::int64_t packet_wait_ns = 100'000'000;  ///< for each
};

/// Progress of the start, to be displayed.
struct BootProgress {
  enum class Step : std::uint8_t { probing, monitor, uploading, running };
  Step step = Step::probing;
  int attempt = 1;                 ///< of the upload
  std::size_t sent = 0, size = 0;  ///< bytes
  std::string trouble;             ///< why the previous attempt failed
};
using BootReport = std::function<void(const BootProgress&)>;

/// Puts the line into normal mode and requests a packet; true if one came. \throws TransportError.
bool firmware_runs(Transport& transport, const BootSettings& settings = {});

/// Uploads `image` (null: none given) if no firmware is running, and repeats the upload if an echo
/// is lost or wrong. \throws TransportError listing the failure of every attempt.
void boot(Transport& transport, const FirmwareImage* image, const BootSettings& settings = {},
          const BootReport& report = {});

}  // namespace palpate::runner::devices::falcon
