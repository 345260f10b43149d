#pragma once
// Owning pointers to libusb's objects, for usb*.cpp.

#include <libusb-1.0/libusb.h>

#include <memory>

#include "runner/devices/falcon/usb.h"

namespace palpate::runner::devices::falcon {

using UsbContext = std::unique_ptr<libusb_context, decltype(&libusb_exit)>;
using UsbHandle = std::unique_ptr<libusb_device_handle, decltype(&libusb_close)>;
using UsbDevice = std::unique_ptr<libusb_device, decltype(&libusb_unref_device)>;

/// \throws TransportError.
UsbContext make_usb_context();
/// Every Falcon on the bus.
std::vector<UsbDevice> falcons_on(libusb_context* context);
/// Opens a Falcon; nullptr: it cannot be opened, and `listing.trouble` has the reason.
UsbHandle open_listed(libusb_device* device, UsbListing& listing);

}  // namespace palpate::runner::devices::falcon
