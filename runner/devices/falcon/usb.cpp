#include "runner/devices/falcon/usb.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <new>
#include <utility>

#include "runner/devices/falcon/parameters.h"
#include "runner/devices/falcon/usb_context.h"

namespace palpate::runner::devices::falcon {
namespace {

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

}  // namespace palpate::runner::devices::falcon
