#pragma once
// The USB line to a Falcon: libusb-1.0, asynchronous transfers with two reads always queued, all in
// the calling thread. In a build without libusb these functions throw.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "runner/devices/falcon/transport.h"

namespace palpate::runner::devices::falcon {

/// A connected Falcon.
struct UsbListing {
  std::string serial;  ///< its serial number, else "port-BUS-PATH"
  int bus = 0, address = 0;
  std::string trouble;  ///< reason why it cannot be opened; empty: it can
};

/// Whether USB was built in.
bool usb_available() noexcept;

/// \throws TransportError if USB cannot be used.
std::vector<UsbListing> list_usb();

/// Opens and claims a Falcon. \param serial  empty: the only one. \throws TransportError.
std::unique_ptr<Transport> open_usb(const std::string& serial);

/// Counts Falcons as they are plugged in and unplugged.
class HotplugListener {
 public:
  virtual ~HotplugListener() = default;
  /// Handles events for up to `wait_ns`.
  virtual void poll(std::int64_t wait_ns) = 0;
  int arrived() const { return arrived_; }  ///< total, including those connected at first
  int left() const { return left_; }

 protected:
  int arrived_ = 0, left_ = 0;
};
/// \throws TransportError.
std::unique_ptr<HotplugListener> listen_for_hotplug();

/// The message for a libusb error code, with the remedy. \param what  e.g. "cannot open the Falcon"
std::string usb_error(const std::string& what, int code);

}  // namespace palpate::runner::devices::falcon
