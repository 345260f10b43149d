#pragma once
// The kernel's usbfs of one Falcon's node for libusb: its calls are answered by an emulator.
// Internal to the emulated bus.

#include <linux/usbdevice_fs.h>
#include <umockdev.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "tests/runner/devices/falcon/emulator.h"

namespace palpate::runner::devices::falcon::testing {

/// One call at a time: callers hold the node's lock.
class EmulatedUsbfs {
 public:
  explicit EmulatedUsbfs(std::string serial) : serial_(std::move(serial)) {}

  /// Answers a request of a process. \returns true, even for an error
  bool ioctl(UMockdevIoctlClient* client);
  /// A process has closed the node, or died.
  void forget(UMockdevIoctlClient* client);

  Emulator emulator;
  bool held = false;       ///< by another program: it cannot be claimed here
  bool unplugged = false;  ///< pending and new transfers fail

 private:
  struct Urb {
    UMockdevIoctlData* request = nullptr;
    UMockdevIoctlData* buffer = nullptr;
    UMockdevIoctlClient* client = nullptr;
    usbdevfs_urb& urb() const { return *reinterpret_cast<usbdevfs_urb*>(request->data); }
    void release() const {
      g_object_unref(buffer);
      g_object_unref(request);
    }
  };

  void finish(const Urb& urb, int status, std::size_t length);
  bool discard(UMockdevIoctlClient* client, UMockdevIoctlData* argument);
  bool submit(UMockdevIoctlClient* client, UMockdevIoctlData* argument);
  bool reap(UMockdevIoctlClient* client, UMockdevIoctlData* argument);
  /// A set-up packet and its data; the length of the data, -1 to stall.
  int control(std::uint8_t* packet, std::size_t size);
  std::vector<std::uint8_t> string_descriptor(int index) const;
  /// Completes waiting reads for which the emulator has packets.
  void pump();

  const std::string serial_;
  std::deque<Urb> waiting_, done_;
  UMockdevIoctlClient* claimed_by_ = nullptr;
  int empty_reaps_ = 0;  // in a row
};

}  // namespace palpate::runner::devices::falcon::testing
