#include "tests/runner/devices/falcon/emulated_usbfs.h"

#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

#include "tests/runner/devices/falcon/emulated_bus.h"

namespace palpate::runner::devices::falcon::testing {
namespace {

constexpr int kPolls = 3;  // a servo polls once a tick; a client that polls more often is waiting
constexpr auto kIdle = std::chrono::microseconds(30);
constexpr std::uint8_t kOut = 0x02, kIn = 0x81;
constexpr std::uint8_t kGetDescriptor = 6, kStringDescriptor = 3, kSerialString = 3;

bool complete(UMockdevIoctlClient* client, long result, int code) {
  umockdev_ioctl_client_complete(client, result, code);
  return true;
}

}  // namespace

void EmulatedUsbfs::forget(UMockdevIoctlClient* client) {
  for (std::deque<Urb>* queue : {&waiting_, &done_}) {
    std::erase_if(*queue, [client](const Urb& urb) {
      if (urb.client != client) return false;
      urb.release();
      return true;
    });
  }
  if (claimed_by_ == client) claimed_by_ = nullptr;
}

void EmulatedUsbfs::finish(const Urb& urb, int status, std::size_t length) {
  urb.urb().status = status;
  urb.urb().actual_length = static_cast<int>(length);
  done_.push_back(urb);
}

bool EmulatedUsbfs::ioctl(UMockdevIoctlClient* client) {
  UMockdevIoctlData* argument = umockdev_ioctl_client_get_arg(client);
  switch (umockdev_ioctl_client_get_request(client)) {
    case USBDEVFS_GET_CAPABILITIES: {
      UMockdevIoctlData* data = umockdev_ioctl_data_resolve(argument, 0, 4, nullptr);
      if (data == nullptr) return complete(client, -1, EFAULT);
      const std::uint32_t all = USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_BULK_CONTINUATION |
                                USBDEVFS_CAP_NO_PACKET_SIZE_LIM |
                                USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
      std::memcpy(data->data, &all, sizeof all);
      g_object_unref(data);
      return complete(client, 0, 0);
    }
    case USBDEVFS_CLAIMINTERFACE:
    case USBDEVFS_DISCONNECT_CLAIM:
      if (held || (claimed_by_ != nullptr && claimed_by_ != client)) {
        return complete(client, -1, EBUSY);
      }
      claimed_by_ = client;
      return complete(client, 0, 0);
    case USBDEVFS_RELEASEINTERFACE:
      if (claimed_by_ == client) claimed_by_ = nullptr;
      [[fallthrough]];
    case USBDEVFS_CLEAR_HALT:
    case USBDEVFS_RESET:
    case USBDEVFS_SETCONFIGURATION:
    case USBDEVFS_SETINTERFACE:
      return complete(client, unplugged ? -1 : 0, unplugged ? ENODEV : 0);
    case USBDEVFS_GETDRIVER:
    case USBDEVFS_IOCTL:
      return complete(client, -1, ENODATA);
    case USBDEVFS_DISCARDURB:
      return discard(client, argument);
    case USBDEVFS_SUBMITURB:
      return submit(client, argument);
    case USBDEVFS_REAPURB:
    case USBDEVFS_REAPURBNDELAY:
      return reap(client, argument);
    default:
      return complete(client, -1, ENOTTY);
  }
}

bool EmulatedUsbfs::discard(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
  gulong address = 0;
  std::memcpy(&address, argument->data, sizeof address);
  const auto found =
      std::find_if(waiting_.begin(), waiting_.end(), [address, client](const Urb& urb) {
        return urb.client == client && urb.request->client_addr == address;
      });
  if (found == waiting_.end()) return complete(client, -1, EINVAL);
  const Urb urb = *found;
  waiting_.erase(found);
  finish(urb, -ENOENT, 0);
  return complete(client, 0, 0);
}

bool EmulatedUsbfs::submit(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
  if (unplugged) return complete(client, -1, ENODEV);
  Urb urb;
  urb.client = client;
  // A client killed in the meantime provides no memory.
  urb.request = umockdev_ioctl_data_resolve(argument, 0, sizeof(usbdevfs_urb), nullptr);
  if (urb.request == nullptr) return complete(client, -1, EFAULT);
  const auto size = static_cast<std::size_t>(urb.urb().buffer_length);
  urb.buffer =
      umockdev_ioctl_data_resolve(urb.request, offsetof(usbdevfs_urb, buffer), size, nullptr);
  if (urb.buffer == nullptr) {
    g_object_unref(urb.request);
    return complete(client, -1, EFAULT);
  }
  if (urb.urb().type == USBDEVFS_URB_TYPE_CONTROL) {
    const int length = control(urb.buffer->data, size);
    finish(urb, length < 0 ? -EPIPE : 0, static_cast<std::size_t>(std::max(length, 0)));
  } else if (urb.urb().endpoint == kOut) {
    emulator.host_sends({urb.buffer->data, urb.buffer->data + size}, EmulatedBus::now_ns());
    finish(urb, 0, size);
  } else if (urb.urb().endpoint == kIn) {
    waiting_.push_back(urb);
  } else {
    finish(urb, -EPIPE, 0);
  }
  pump();
  return complete(client, 0, 0);
}

int EmulatedUsbfs::control(std::uint8_t* packet, std::size_t size) {
  const std::uint8_t type = packet[0], request = packet[1];
  const auto value = static_cast<std::uint16_t>(packet[2] | packet[3] << 8);
  std::vector<std::uint8_t> data;
  if (type == 0x40) return emulator.control_out(request, value) ? 0 : -1;
  if (type == 0xC0) {
    const auto answer = emulator.control_in(request);
    if (!answer) return -1;
    data = *answer;
  } else if (type == 0x80 && request == kGetDescriptor && value >> 8 == kStringDescriptor) {
    data = string_descriptor(value & 0xFF);
    if (data.empty()) return -1;
  } else {
    return -1;
  }
  const std::size_t length = std::min(data.size(), size - 8);
  std::copy_n(data.begin(), length, packet + 8);
  return static_cast<int>(length);
}

std::vector<std::uint8_t> EmulatedUsbfs::string_descriptor(int index) const {
  if (index == 0) return {4, kStringDescriptor, 0x09, 0x04};  // English
  if (index != kSerialString) return {};
  std::vector<std::uint8_t> data = {static_cast<std::uint8_t>(2 + 2 * serial_.size()),
                                    kStringDescriptor};
  for (const char letter : serial_) {
    data.push_back(static_cast<std::uint8_t>(letter));
    data.push_back(0);
  }
  return data;
}

void EmulatedUsbfs::pump() {
  if (unplugged) {
    for (const Urb& urb : waiting_) finish(urb, -ENODEV, 0);
    waiting_.clear();
  }
  while (!waiting_.empty()) {
    const Urb urb = waiting_.front();
    const auto packet = emulator.in_packet(EmulatedBus::now_ns(),
                                           static_cast<std::size_t>(urb.urb().buffer_length));
    if (!packet) return;
    waiting_.pop_front();
    std::copy(packet->begin(), packet->end(), urb.buffer->data);
    finish(urb, 0, packet->size());
  }
}

bool EmulatedUsbfs::reap(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
  pump();
  const auto mine = [this, client] {
    return std::find_if(done_.begin(), done_.end(),
                        [client](const Urb& urb) { return urb.client == client; });
  };
  if (mine() == done_.end() && ++empty_reaps_ > kPolls) {
    std::this_thread::sleep_for(kIdle);  // slows the spinning of a waiting libusb
    pump();
  }
  const auto found = mine();
  if (found == done_.end()) return complete(client, -1, unplugged ? ENODEV : EAGAIN);
  empty_reaps_ = 0;
  const Urb urb = *found;
  done_.erase(found);
  UMockdevIoctlData* out = umockdev_ioctl_data_resolve(argument, 0, sizeof(void*), nullptr);
  if (out == nullptr) {
    urb.release();
    return complete(client, -1, EFAULT);
  }
  umockdev_ioctl_data_set_ptr(out, 0, urb.request);
  g_object_unref(out);
  complete(client, 0, 0);
  urb.release();
  return true;
}

}  // namespace palpate::runner::devices::falcon::testing
