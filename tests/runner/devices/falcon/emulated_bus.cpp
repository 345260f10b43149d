#include "tests/runner/devices/falcon/emulated_bus.h"

#include <umockdev.h>

#include <chrono>
#include <stdexcept>
#include <vector>

#include "tests/runner/devices/falcon/emulated_node.h"

namespace palpate::runner::devices::falcon::testing {
namespace {

constexpr const char* kHubDescriptors =
    "12010002090001406B1D0200150603020101"
    "09021900010100E000"
    "090400000109000000"
    "0705810304000C";

}  // namespace

struct EmulatedBus::Impl {
  UMockdevTestbed* testbed = umockdev_testbed_new();
  std::vector<std::unique_ptr<EmulatedNode>> nodes;
  int next_address = 40;
};

EmulatedBus::EmulatedBus() : impl_(std::make_unique<Impl>()) {
  const std::string hub =
      "P: /devices/pci0000:00/0000:00:14.0/usb1\nN: bus/usb/001/001\n"
      "E: DEVNAME=/dev/bus/usb/001/001\nE: DEVTYPE=usb_device\nE: SUBSYSTEM=usb\n"
      "A: busnum=1\\n\nA: devnum=1\\n\nA: bConfigurationValue=1\\n\nA: speed=480\\n\n"
      "H: descriptors=" +
      std::string(kHubDescriptors) + "\n\n";
  GError* error = nullptr;
  if (!umockdev_testbed_add_from_string(impl_->testbed, hub.c_str(), &error)) {
    throw std::runtime_error(error->message);
  }
}

EmulatedBus::~EmulatedBus() {
  for (const auto& node : impl_->nodes) {
    node->unplug();
    node->bury();
  }
  impl_->nodes.clear();
  g_object_unref(impl_->testbed);
}

int EmulatedBus::add(const std::string& serial) {
  const int index = static_cast<int>(impl_->nodes.size());
  impl_->nodes.push_back(std::make_unique<EmulatedNode>(impl_->testbed, index + 1, serial));
  return index;
}

void EmulatedBus::unplug(int index) { impl_->nodes.at(static_cast<std::size_t>(index))->unplug(); }

void EmulatedBus::plug(int index) {
  impl_->nodes.at(static_cast<std::size_t>(index))->plug(impl_->next_address++);
}

void EmulatedBus::hold(int index, bool held) {
  impl_->nodes.at(static_cast<std::size_t>(index))->with([held](EmulatedUsbfs& usbfs) {
    usbfs.held = held;
  });
}

void EmulatedBus::with(int index, const std::function<void(Emulator&)>& use) {
  impl_->nodes.at(static_cast<std::size_t>(index))->with([&use](EmulatedUsbfs& usbfs) {
    use(usbfs.emulator);
  });
}

std::int64_t EmulatedBus::now_ns() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

}  // namespace palpate::runner::devices::falcon::testing
