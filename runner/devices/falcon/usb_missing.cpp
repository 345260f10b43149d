// For builds without libusb.

#include "runner/devices/falcon/usb.h"

namespace palpate::runner::devices::falcon {
namespace {
[[noreturn]] void refuse() {
  throw TransportError(
      "this program was built without USB: install libusb-1.0-0-dev and build it again");
}
}  // namespace

bool usb_available() noexcept { return false; }
std::vector<UsbListing> list_usb() { refuse(); }
std::unique_ptr<Transport> open_usb(const std::string& /*serial*/) { refuse(); }
std::unique_ptr<HotplugListener> listen_for_hotplug() { refuse(); }
std::string usb_error(const std::string& what, int /*code*/) { return what; }

}  // namespace palpate::runner::devices::falcon
