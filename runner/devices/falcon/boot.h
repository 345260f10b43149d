#pragma once
// From power-up to the first packet: is firmware loaded? If not, load it. The device forgets it
// when its power goes.

#include <cstdint>
#include <functional>

#include "runner/devices/falcon/image.h"
#include "runner/devices/falcon/transport.h"

namespace palpate::runner::falcon {

struct BootSettings {
  int monitor_probes = 100;                   ///< until the monitor answers
  std::int64_t monitor_wait_ns = 40'000'000;  ///< for each
  std::int64_t echo_wait_ns = 1'000'000'000;  ///< for the echo of a chunk
  int uploads = 10;                           ///< several are common
  int packet_probes = 10;                     ///< until running firmware answers
  std::int64_t packet_wait_ns = 100'000'000;  ///< for each
};

/// What the boot is at, for the experimenter's eyes.
struct BootProgress {
  enum class Stage : std::uint8_t { probing, monitor, uploading, running };
  Stage stage = Stage::probing;
  int attempt = 1;                 ///< of the upload
  std::size_t sent = 0, size = 0;  ///< bytes
  std::string trouble;             ///< why the attempt before was given up
};
using BootReport = std::function<void(const BootProgress&)>;

/// Puts the line into normal mode and asks for a packet. \throws TransportError when it fails.
bool firmware_runs(Transport& transport, const BootSettings& settings = {});

/// Makes the firmware run: nothing to do where it does, else uploads `image` (null: none was
/// named) and tries again where an echo is lost or wrong. \throws TransportError that names what
/// went wrong each time.
void boot(Transport& transport, const FirmwareImage* image, const BootSettings& settings = {},
          const BootReport& report = {});

}  // namespace palpate::runner::falcon
