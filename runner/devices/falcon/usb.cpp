#include "runner/devices/falcon/usb.h"

#include <libusb-1.0/libusb.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <new>
#include <span>
#include <sstream>
#include <utility>

#include "runner/devices/falcon/packets.h"
#include "runner/devices/falcon/parameters.h"

namespace palpate::runner::devices::falcon {
namespace {

using UsbContext = std::unique_ptr<libusb_context, decltype(&libusb_exit)>;
using UsbHandle = std::unique_ptr<libusb_device_handle, decltype(&libusb_close)>;
using UsbDevice = std::unique_ptr<libusb_device, decltype(&libusb_unref_device)>;

constexpr std::size_t kPacket = 64;         // bytes, of both bulk endpoints
constexpr std::size_t kStatus = 2;          // bytes of line status that head every IN packet
constexpr unsigned kControlTimeout = 1000;  // ms
constexpr std::int64_t kSecond = 1'000'000'000;

/// Bytes received and not read yet; when full, the oldest are overwritten.
class ByteRing {
 public:
  void put(std::uint8_t byte) {
    bytes_[end_++ % bytes_.size()] = byte;
    begin_ = std::max(begin_, end_ - std::min(end_, bytes_.size()));
  }
  std::size_t take(std::span<std::uint8_t> out) {
    const std::size_t count = std::min(out.size(), end_ - begin_);
    for (std::size_t i = 0; i < count; ++i) out[i] = bytes_[begin_++ % bytes_.size()];
    return count;
  }
  void clear() { begin_ = end_; }

 private:
  std::array<std::uint8_t, 4096> bytes_{};
  std::size_t begin_ = 0, end_ = 0;  // these count all bytes; a size_t does not overflow
};

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

UsbContext make_usb_context() {
  libusb_context* context = nullptr;
  const int code = libusb_init(&context);
  if (code != LIBUSB_SUCCESS) throw TransportError(usb_error("USB cannot be used", code));
  return {context, &libusb_exit};
}

/// Every Falcon on the bus.
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

/// Opens a Falcon; nullptr: it cannot be opened, and `listing.trouble` has the reason.
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

class UsbTransport final : public Transport {
 public:
  explicit UsbTransport(std::string serial)
      : context_(make_usb_context()), serial_(std::move(serial)) {
    for (Slot& slot : in_) slot.owner = this;
    for (Slot& slot : out_) slot.owner = this;
    open();
  }
  ~UsbTransport() override { close(); }
  UsbTransport(const UsbTransport&) = delete;
  UsbTransport& operator=(const UsbTransport&) = delete;

  const std::string& serial() const override { return serial_; }

  void control(std::uint8_t request, std::uint16_t value) override {
    const int code = handle_ == nullptr
                         ? LIBUSB_ERROR_NO_DEVICE
                         : libusb_control_transfer(handle_.get(), LIBUSB_REQUEST_TYPE_VENDOR,
                                                   request, value, 0, nullptr, 0, kControlTimeout);
    if (code == LIBUSB_ERROR_NO_DEVICE) gone_ = true;
    if (code < 0) throw TransportError(usb_error("cannot set up the Falcon " + serial_, code));
  }

  void reopen() override {
    close();
    open();
  }

  bool send(std::span<const std::uint8_t> bytes) noexcept override {
    if (gone_ || bytes.size() > kPacket) return false;
    const auto slot = std::find_if(out_.begin(), out_.end(), [](const Slot& s) { return !s.busy; });
    if (slot == out_.end()) return false;
    std::copy(bytes.begin(), bytes.end(), slot->bytes.begin());
    return submit(*slot, kOutEndpoint, bytes.size(), &UsbTransport::sent);
  }

  std::size_t receive(std::span<std::uint8_t> bytes, std::int64_t wait_ns) noexcept override {
    const std::int64_t end = wait_ns > 0 ? now_ns() + wait_ns : 0;
    pump(0);
    std::size_t count = ring_.take(bytes);
    while (count == 0 && end > 0 && !gone_) {
      const std::int64_t left = end - now_ns();
      if (left <= 0) break;
      pump(left);
      count = ring_.take(bytes);
    }
    return count;
  }

  bool drain(std::int64_t wait_ns) noexcept override {
    const std::int64_t end = now_ns() + wait_ns;
    const auto busy = [this] {
      return std::any_of(out_.begin(), out_.end(), [](const Slot& s) { return s.busy; });
    };
    while (busy() && now_ns() < end) pump(end - now_ns());
    return !busy() && !gone_;
  }

  bool gone() const noexcept override { return gone_; }

  std::int64_t now_ns() noexcept override {
    return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
  }

 private:
  struct Slot {
    libusb_transfer* transfer = libusb_alloc_transfer(0);
    std::array<std::uint8_t, kPacket> bytes{};
    UsbTransport* owner = nullptr;
    bool busy = false;

    Slot() {
      if (transfer == nullptr) throw std::bad_alloc();
    }
    ~Slot() {
      // A busy one is leaked: the kernel may still write into it.
      if (!busy) libusb_free_transfer(transfer);
    }
    Slot(const Slot&) = delete;
    Slot& operator=(const Slot&) = delete;
  };

  struct Candidate {
    UsbListing listing;
    UsbHandle handle{nullptr, &libusb_close};
  };

  void open() {
    const std::vector<UsbDevice> devices = falcons_on(context_.get());
    std::vector<Candidate> candidates(devices.size());
    std::string others;
    for (std::size_t i = 0; i < devices.size(); ++i) {
      candidates[i].handle = open_listed(devices[i].get(), candidates[i].listing);
      const UsbListing& listing = candidates[i].listing;
      others += "\n  there is " + (listing.trouble.empty() ? listing.serial : listing.trouble);
    }
    if (serial_.empty() && candidates.size() > 1) {
      throw TransportError("several Falcons are plugged in; name one by its serial number:" +
                           others);
    }
    const auto named = [this](const Candidate& c) { return c.listing.serial == serial_; };
    if (!serial_.empty() && std::count_if(candidates.begin(), candidates.end(), named) > 1) {
      throw TransportError("several devices have the serial number " + serial_ +
                           "; unplug all but one:" + others);
    }
    for (Candidate& candidate : candidates) {
      if (!serial_.empty() && candidate.listing.serial != serial_) continue;
      if (candidate.handle == nullptr) throw TransportError(candidate.listing.trouble);
      claim(std::move(candidate.handle), candidate.listing.serial);
      return;
    }
    throw TransportError(
        (serial_.empty() ? "no Falcon is plugged in" : "no Falcon " + serial_ + " is plugged in") +
        others);
  }

  void claim(UsbHandle handle, const std::string& serial) {
    libusb_set_auto_detach_kernel_driver(handle.get(), 1);
    const int code = libusb_claim_interface(handle.get(), 0);
    if (code != LIBUSB_SUCCESS) {
      throw TransportError(usb_error("cannot claim the Falcon " + serial, code));
    }
    serial_ = serial;
    handle_ = std::move(handle);
    gone_ = false;
    ring_.clear();
    control(request::kPurge, 1);
    control(request::kPurge, 2);
    for (Slot& slot : in_) submit(slot, kInEndpoint, kPacket, &UsbTransport::received);
    if (!gone_) return;
    close();
    throw TransportError("the Falcon " + serial_ + " cannot be read");
  }

  /// Cancels all transfers before closing: they point into this object.
  void close() noexcept {
    closing_ = true;
    const auto busy = [this] {
      return std::any_of(in_.begin(), in_.end(), [](const Slot& s) { return s.busy; }) ||
             std::any_of(out_.begin(), out_.end(), [](const Slot& s) { return s.busy; });
    };
    for (Slot& slot : in_) {
      if (slot.busy) libusb_cancel_transfer(slot.transfer);
    }
    for (Slot& slot : out_) {
      if (slot.busy) libusb_cancel_transfer(slot.transfer);
    }
    const std::int64_t end = now_ns() + kSecond;
    while (busy() && now_ns() < end) pump(end - now_ns());
    if (handle_ != nullptr) libusb_release_interface(handle_.get(), 0);
    handle_.reset();
    gone_ = true;
    closing_ = false;
  }

  bool submit(Slot& slot, std::uint8_t endpoint, std::size_t size,
              libusb_transfer_cb_fn done) noexcept {
    libusb_fill_bulk_transfer(slot.transfer, handle_.get(), endpoint, slot.bytes.data(),
                              static_cast<int>(size), done, &slot, 0);
    slot.busy = libusb_submit_transfer(slot.transfer) == LIBUSB_SUCCESS;
    gone_ = gone_ || !slot.busy;
    return slot.busy;
  }

  void pump(std::int64_t wait_ns) noexcept {
    timeval wait{wait_ns / kSecond, (wait_ns % kSecond) / 1000};
    libusb_handle_events_timeout_completed(context_.get(), &wait, nullptr);
  }

  static void LIBUSB_CALL received(libusb_transfer* transfer) {
    auto& slot = *static_cast<Slot*>(transfer->user_data);
    UsbTransport& self = *slot.owner;
    slot.busy = false;
    if (transfer->status != LIBUSB_TRANSFER_COMPLETED) {
      self.gone_ = true;
      return;
    }
    const auto length = static_cast<std::size_t>(std::max(transfer->actual_length, 0));
    for (std::size_t i = kStatus; i < std::min(length, slot.bytes.size()); ++i) {
      self.ring_.put(slot.bytes[i]);
    }
    if (!self.closing_) self.submit(slot, kInEndpoint, kPacket, &UsbTransport::received);
  }

  static void LIBUSB_CALL sent(libusb_transfer* transfer) {
    auto& slot = *static_cast<Slot*>(transfer->user_data);
    slot.busy = false;
    if (transfer->status != LIBUSB_TRANSFER_COMPLETED) slot.owner->gone_ = true;
  }

  UsbContext context_;
  UsbHandle handle_{nullptr, &libusb_close};
  std::string serial_;
  std::array<Slot, 2> in_;
  std::array<Slot, 4> out_;
  ByteRing ring_;
  bool gone_ = true, closing_ = false;
};

}  // namespace

std::unique_ptr<Transport> open_usb(const std::string& serial) {
  return std::make_unique<UsbTransport>(serial);
}

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
