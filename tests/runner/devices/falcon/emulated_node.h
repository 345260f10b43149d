#pragma once
// The device node of one emulated Falcon: it joins and leaves the mocked bus, and passes requests
// of processes to its usbfs. Internal to the emulated bus.

#include <umockdev.h>

#include <functional>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "tests/runner/devices/falcon/emulated_usbfs.h"

namespace palpate::runner::devices::falcon::testing {

class EmulatedNode {
 public:
  /// Plugged in.
  EmulatedNode(UMockdevTestbed* testbed, int port, std::string serial)
      : testbed_(testbed), port_(port), usbfs_(std::move(serial)) {
    plug(2 + port);
  }
  ~EmulatedNode() { unplug(); }
  EmulatedNode(const EmulatedNode&) = delete;
  EmulatedNode& operator=(const EmulatedNode&) = delete;

  void plug(int address);
  void unplug();
  /// Call it only when no process has the node open: umockdev would lose its clients.
  void bury();

  /// While no process is answered.
  void with(const std::function<void(EmulatedUsbfs&)>& use) {
    const std::lock_guard<std::mutex> lock(mutex_);
    use(usbfs_);
  }

 private:
  struct Retired {
    UMockdevIoctlBase* handler;
    std::string path;
  };

  std::string sys_path() const;
  // Callbacks of umockdev, in its own threads.
  static gboolean handle(UMockdevIoctlBase* base, UMockdevIoctlClient* client, gpointer self);
  static void vanished(UMockdevIoctlBase* base, UMockdevIoctlClient* client, gpointer self);

  UMockdevTestbed* testbed_;
  const int port_;
  std::mutex mutex_;  // guards usbfs_
  EmulatedUsbfs usbfs_;
  std::string path_;
  UMockdevIoctlBase* handler_ = nullptr;
  std::vector<Retired> retired_;
};

}  // namespace palpate::runner::devices::falcon::testing
