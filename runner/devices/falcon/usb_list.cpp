#include <array>
#include <span>
#include <sstream>

#include "runner/devices/falcon/parameters.h"
#include "runner/devices/falcon/serial.h"
#include "runner/devices/falcon/usb_context.h"

namespace palpate::runner::devices::falcon {
namespace {

/// The USB port, which identifies a device without a serial number across re-plugging.
std::string port_of(libusb_device* device) {
  std::array<std::uint8_t, 8> ports{};
  const int depth = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  std::ostringstream text;
  text << "port-" << int{libusb_get_bus_number(device)};
  for (int i = 0; i < depth; ++i) {
    text << (i == 0 ? '-' : '.') << int{ports[static_cast<std::size_t>(i)]};
  }
  return text.str();
}

std::string place_of(const UsbListing& listing) {
  return "the Falcon on bus " + std::to_string(listing.bus) + ", address " +
         std::to_string(listing.address);
}

class LibusbHotplugListener final : public HotplugListener {
 public:
  LibusbHotplugListener() : context_(make_usb_context()) {
    const int code = libusb_hotplug_register_callback(
        context_.get(), LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED | LIBUSB_HOTPLUG_EVENT_DEVICE_LEFT,
        LIBUSB_HOTPLUG_ENUMERATE, kVendor, kProduct, LIBUSB_HOTPLUG_MATCH_ANY,
        &LibusbHotplugListener::changed, this, &handle_);
    if (code != LIBUSB_SUCCESS) throw TransportError(usb_error("cannot watch the bus", code));
  }
  ~LibusbHotplugListener() override { libusb_hotplug_deregister_callback(context_.get(), handle_); }
  LibusbHotplugListener(const LibusbHotplugListener&) = delete;
  LibusbHotplugListener& operator=(const LibusbHotplugListener&) = delete;

  void poll(std::int64_t wait_ns) override {
    timeval wait{wait_ns / 1'000'000'000, (wait_ns % 1'000'000'000) / 1000};
    libusb_handle_events_timeout_completed(context_.get(), &wait, nullptr);
  }

 private:
  static int LIBUSB_CALL changed(libusb_context* /*context*/, libusb_device* /*device*/,
                                 libusb_hotplug_event event, void* self) {
    auto* listener = static_cast<LibusbHotplugListener*>(self);
    ++(event == LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED ? listener->arrived_ : listener->left_);
    return 0;
  }

  UsbContext context_;
  libusb_hotplug_callback_handle handle_ = 0;
};

}  // namespace

bool usb_available() noexcept { return true; }

std::string usb_error(const std::string& what, int code) {
  std::string text = what + ": ";
  switch (code) {
    case LIBUSB_ERROR_ACCESS:
      return text +
             "no permission. Where palpate is installed as a package: sudo adduser NAME palpate, "
             "and log in again. Else put this line into /etc/udev/rules.d/60-falcon.rules and plug "
             "the device in again:\n  SUBSYSTEM==\"usb\", ATTR{idVendor}==\"0403\", "
             "ATTR{idProduct}==\"cb48\", MODE=\"0660\", GROUP=\"plugdev\", TAG+=\"uaccess\"";
    case LIBUSB_ERROR_BUSY:
      return text + "another program holds it; close that program";
    case LIBUSB_ERROR_NO_DEVICE:
      return text + "it was unplugged";
    case LIBUSB_ERROR_TIMEOUT:
      return text + "it does not answer; check its power supply and cable";
    case LIBUSB_ERROR_PIPE:
      return text + "it refused the request; is this a Falcon?";
    default:
      return text + libusb_strerror(code) + " (" + libusb_error_name(code) + ")";
  }
}

UsbContext make_usb_context() {
  libusb_context* context = nullptr;
  const int code = libusb_init(&context);
  if (code != LIBUSB_SUCCESS) throw TransportError(usb_error("USB cannot be used", code));
  return {context, &libusb_exit};
}

std::vector<UsbDevice> falcons_on(libusb_context* context) {
  libusb_device** list = nullptr;
  const auto count = libusb_get_device_list(context, &list);
  if (count < 0) {
    throw TransportError(usb_error("the USB devices cannot be listed", static_cast<int>(count)));
  }
  std::vector<UsbDevice> found;
  found.reserve(static_cast<std::size_t>(count));
  for (ssize_t i = 0; i < count; ++i) {
    libusb_device_descriptor descriptor{};
    if (libusb_get_device_descriptor(list[i], &descriptor) == LIBUSB_SUCCESS &&
        descriptor.idVendor == kVendor && descriptor.idProduct == kProduct) {
      found.emplace_back(libusb_ref_device(list[i]), &libusb_unref_device);
    }
  }
  libusb_free_device_list(list, 1);
  return found;
}

UsbHandle open_listed(libusb_device* device, UsbListing& listing) {
  listing = {port_of(device), libusb_get_bus_number(device), libusb_get_device_address(device), ""};
  libusb_device_handle* handle = nullptr;
  const int code = libusb_open(device, &handle);
  if (code != LIBUSB_SUCCESS) {
    listing.trouble = usb_error("cannot open " + place_of(listing), code);
    return {nullptr, &libusb_close};
  }
  libusb_device_descriptor descriptor{};
  libusb_get_device_descriptor(device, &descriptor);
  std::array<unsigned char, 64> text{};
  const int length = descriptor.iSerialNumber == 0
                         ? 0
                         : libusb_get_string_descriptor_ascii(handle, descriptor.iSerialNumber,
                                                              text.data(), text.size());
  if (length > 0) {
    const std::string serial =
        clean_serial(std::span(text).first(static_cast<std::size_t>(length)));
    if (!serial.empty()) listing.serial = serial;
  }
  return {handle, &libusb_close};
}

std::vector<UsbListing> list_usb() {
  const UsbContext context = make_usb_context();
  const std::vector<UsbDevice> devices = falcons_on(context.get());
  std::vector<UsbListing> listings(devices.size());
  for (std::size_t i = 0; i < devices.size(); ++i) open_listed(devices[i].get(), listings[i]);
  return listings;
}

std::unique_ptr<HotplugListener> listen_for_hotplug() {
  return std::make_unique<LibusbHotplugListener>();
}

}  // namespace palpate::runner::devices::falcon
