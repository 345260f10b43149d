#include "tests/runner/devices/falcon/emulated_node.h"

#include <pthread.h>

#include <sstream>
#include <stdexcept>

namespace palpate::runner::devices::falcon::testing {
namespace {

/// As lsusb would show it: device, configuration, interface, two bulk endpoints.
constexpr const char* kFalconDescriptors =
    "1201000200000008030448CB000601020301"
    "09022000010100A02D"
    "0904000002FFFFFF02"
    "07058102400000"
    "07050202400000";

}  // namespace

void EmulatedNode::plug(int address) {
  if (handler_ != nullptr) return;
  std::ostringstream device, node;
  node << "bus/usb/001/" << (address < 10 ? "00" : address < 100 ? "0" : "") << address;
  path_ = "/dev/" + node.str();
  device << "P: /devices/pci0000:00/0000:00:14.0/usb1/1-" << port_ << "\nN: " << node.str()
         << "\nE: DEVNAME=" << path_ << "\nE: DEVTYPE=usb_device\nE: SUBSYSTEM=usb\n"
         << "E: BUSNUM=001\nE: DEVNUM=" << address << "\nA: busnum=1\\n\nA: devnum=" << address
         << "\\n\nA: bConfigurationValue=1\\n\nA: speed=12\\n\nH: descriptors="
         << kFalconDescriptors << "\n\n";
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    usbfs_.unplugged = false;
  }
  GError* error = nullptr;
  if (!umockdev_testbed_add_from_string(testbed_, device.str().c_str(), &error)) {
    throw std::runtime_error(error->message);
  }
  handler_ = umockdev_ioctl_base_new();
  g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(&EmulatedNode::handle), this);
  g_signal_connect(handler_, "client-vanished", G_CALLBACK(&EmulatedNode::vanished), this);
  if (!umockdev_testbed_attach_ioctl(testbed_, path_.c_str(), handler_, &error)) {
    throw std::runtime_error(error->message);
  }
  umockdev_testbed_uevent(testbed_, sys_path().c_str(), "add");
}

void EmulatedNode::unplug() {
  if (handler_ == nullptr) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    usbfs_.unplugged = true;
  }
  umockdev_testbed_uevent(testbed_, sys_path().c_str(), "remove");
  umockdev_testbed_remove_device(testbed_, sys_path().c_str());
  retired_.push_back({handler_, path_});
  handler_ = nullptr;
}

void EmulatedNode::bury() {
  for (const auto& [handler, path] : retired_) {
    umockdev_testbed_detach_ioctl(testbed_, path.c_str(), nullptr);
    g_object_unref(handler);
  }
  retired_.clear();
}

std::string EmulatedNode::sys_path() const {
  return "/sys/devices/pci0000:00/0000:00:14.0/usb1/1-" + std::to_string(port_);
}

gboolean EmulatedNode::handle(UMockdevIoctlBase* /*base*/, UMockdevIoctlClient* client,
                              gpointer self) {
  // A real device does not wait for a processor. Use real-time priority if allowed.
  thread_local const bool asked = [] {
    const sched_param priority{60};
    pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority);
    return true;
  }();
  static_cast<void>(asked);
  auto* node = static_cast<EmulatedNode*>(self);
  const std::lock_guard<std::mutex> lock(node->mutex_);
  return node->usbfs_.ioctl(client) ? TRUE : FALSE;
}

void EmulatedNode::vanished(UMockdevIoctlBase* /*base*/, UMockdevIoctlClient* client,
                            gpointer self) {
  auto* node = static_cast<EmulatedNode*>(self);
  const std::lock_guard<std::mutex> lock(node->mutex_);
  node->usbfs_.forget(client);
}

}  // namespace palpate::runner::devices::falcon::testing
