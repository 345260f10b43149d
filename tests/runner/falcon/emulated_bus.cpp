#include "tests/runner/falcon/emulated_bus.h"

#include <dlfcn.h>
#include <linux/usbdevice_fs.h>
#include <pthread.h>
#include <sys/ioctl.h>
#include <umockdev.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <fstream>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <vector>

namespace palpate::falcon::testing {
namespace {

constexpr const char* kPreload = "libumockdev-preload.so.0";
constexpr const char* kMark = "PALPATE_PRELOADED";  // of our own: umockdev's comes too late
constexpr int kPolls = 3;  // a servo looks once a tick; who looks more often is waiting
constexpr auto kIdle = std::chrono::microseconds(30);
constexpr std::uint8_t kOut = 0x02, kIn = 0x81;
constexpr std::uint8_t kGetDescriptor = 6, kStringDescriptor = 3, kSerialString = 3;

/// As lsusb would show them: device, configuration, interface, two bulk endpoints.
constexpr const char* kDescriptors =
    "1201000200000008030448CB000601020301"
    "09022000010100A02D"
    "0904000002FFFFFF02"
    "07058102400000"
    "07050202400000";
constexpr const char* kHubDescriptors =
    "12010002090001406B1D0200150603020101"
    "09021900010100E000"
    "090400000109000000"
    "0705810304000C";

/// A sanitizer's runtime must come before everything else that is preloaded.
std::string sanitizer_runtime() {
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    for (const char* name : {"libasan.so", "libtsan.so"}) {
      const auto at = line.find('/');
      if (at != std::string::npos && line.find(name) != std::string::npos) return line.substr(at);
    }
  }
  return "";
}

class Node {
 public:
  Node(UMockdevTestbed* testbed, int port, std::string serial)
      : testbed_(testbed), port_(port), serial_(std::move(serial)) {
    plug(2 + port);
  }
  ~Node() { unplug(); }
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  void plug(int address) {
    if (handler_ != nullptr) return;
    std::ostringstream device, node;
    node << "bus/usb/001/" << (address < 10 ? "00" : address < 100 ? "0" : "") << address;
    path_ = "/dev/" + node.str();
    device << "P: /devices/pci0000:00/0000:00:14.0/usb1/1-" << port_ << "\nN: " << node.str()
           << "\nE: DEVNAME=" << path_ << "\nE: DEVTYPE=usb_device\nE: SUBSYSTEM=usb\n"
           << "E: BUSNUM=001\nE: DEVNUM=" << address << "\nA: busnum=1\\n\nA: devnum=" << address
           << "\\n\nA: bConfigurationValue=1\\n\nA: speed=12\\n\nH: descriptors=" << kDescriptors
           << "\n\n";
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      unplugged_ = false;
    }
    GError* error = nullptr;
    if (!umockdev_testbed_add_from_string(testbed_, device.str().c_str(), &error)) {
      throw std::runtime_error(error->message);
    }
    handler_ = umockdev_ioctl_base_new();
    g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(&Node::handle), this);
    g_signal_connect(handler_, "client-vanished", G_CALLBACK(&Node::vanished), this);
    if (!umockdev_testbed_attach_ioctl(testbed_, path_.c_str(), handler_, &error)) {
      throw std::runtime_error(error->message);
    }
    umockdev_testbed_uevent(testbed_, sys_path().c_str(), "add");
  }

  void unplug() {
    if (handler_ == nullptr) return;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      unplugged_ = true;
    }
    umockdev_testbed_uevent(testbed_, sys_path().c_str(), "remove");
    umockdev_testbed_remove_device(testbed_, sys_path().c_str());
    retired_.push_back({handler_, path_});
    handler_ = nullptr;
  }

  /// Only when nobody has the node open any more: umockdev would lose its clients.
  void bury() {
    for (const auto& [handler, path] : retired_) {
      umockdev_testbed_detach_ioctl(testbed_, path.c_str(), nullptr);
      g_object_unref(handler);
    }
    retired_.clear();
  }

  Emulator emulator;
  std::mutex mutex_;
  bool held = false;

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
  struct Retired {
    UMockdevIoctlBase* handler;
    std::string path;
  };

  std::string sys_path() const {
    return "/sys/devices/pci0000:00/0000:00:14.0/usb1/1-" + std::to_string(port_);
  }

  static gboolean handle(UMockdevIoctlBase* /*base*/, UMockdevIoctlClient* client, gpointer self) {
    // A real device does not wait for a processor. Where rights allow, nor does this one.
    thread_local const bool asked = [] {
      const sched_param priority{60};
      pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority);
      return true;
    }();
    static_cast<void>(asked);
    return static_cast<Node*>(self)->ioctl(client) ? TRUE : FALSE;
  }

  /// A process has closed the node, or died.
  static void vanished(UMockdevIoctlBase* /*base*/, UMockdevIoctlClient* client, gpointer self) {
    auto* node = static_cast<Node*>(self);
    const std::lock_guard<std::mutex> lock(node->mutex_);
    for (std::deque<Urb>* queue : {&node->waiting_, &node->done_}) {
      std::erase_if(*queue, [client](const Urb& urb) {
        if (urb.client != client) return false;
        urb.release();
        return true;
      });
    }
    if (node->claimed_by_ == client) node->claimed_by_ = nullptr;
  }

  static bool complete(UMockdevIoctlClient* client, long result, int code) {
    umockdev_ioctl_client_complete(client, result, code);
    return true;
  }

  void finish(const Urb& urb, int status, std::size_t length) {
    urb.urb().status = status;
    urb.urb().actual_length = static_cast<int>(length);
    done_.push_back(urb);
  }

  bool ioctl(UMockdevIoctlClient* client) {
    const std::lock_guard<std::mutex> lock(mutex_);
    UMockdevIoctlData* argument = umockdev_ioctl_client_get_arg(client);
    switch (umockdev_ioctl_client_get_request(client)) {
      case USBDEVFS_GET_CAPABILITIES: {
        UMockdevIoctlData* data = umockdev_ioctl_data_resolve(argument, 0, 4, nullptr);
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
        return complete(client, unplugged_ ? -1 : 0, unplugged_ ? ENODEV : 0);
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

  bool discard(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
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

  bool submit(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
    if (unplugged_) return complete(client, -1, ENODEV);
    Urb urb;
    urb.client = client;
    urb.request = umockdev_ioctl_data_resolve(argument, 0, sizeof(usbdevfs_urb), nullptr);
    const auto size = static_cast<std::size_t>(urb.urb().buffer_length);
    urb.buffer =
        umockdev_ioctl_data_resolve(urb.request, offsetof(usbdevfs_urb, buffer), size, nullptr);
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

  /// A set-up packet and its data; the length of the data, -1 to stall.
  int control(std::uint8_t* packet, std::size_t size) {
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

  std::vector<std::uint8_t> string_descriptor(int index) const {
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

  void pump() {
    if (unplugged_) {
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

  bool reap(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
    pump();
    const auto mine = [this, client] {
      return std::find_if(done_.begin(), done_.end(),
                          [client](const Urb& urb) { return urb.client == client; });
    };
    if (mine() == done_.end() && ++empty_reaps_ > kPolls) {
      std::this_thread::sleep_for(kIdle);  // or a libusb that waits would spin even faster
      pump();
    }
    const auto found = mine();
    if (found == done_.end()) return complete(client, -1, unplugged_ ? ENODEV : EAGAIN);
    empty_reaps_ = 0;
    const Urb urb = *found;
    done_.erase(found);
    UMockdevIoctlData* out = umockdev_ioctl_data_resolve(argument, 0, sizeof(void*), nullptr);
    umockdev_ioctl_data_set_ptr(out, 0, urb.request);
    g_object_unref(out);
    complete(client, 0, 0);
    urb.release();
    return true;
  }

  UMockdevTestbed* testbed_;
  const int port_;
  const std::string serial_;
  std::string path_;
  UMockdevIoctlBase* handler_ = nullptr;
  std::vector<Retired> retired_;
  std::deque<Urb> waiting_, done_;
  UMockdevIoctlClient* claimed_by_ = nullptr;
  bool unplugged_ = false;
  int empty_reaps_ = 0;  // in a row
};

}  // namespace

bool rerun_preloaded(char** argv) {
  if (std::getenv(kMark) != nullptr) {
    // Only this program needs it set; what it starts inherits LD_PRELOAD.
    return dlsym(RTLD_DEFAULT, "umockdev_in_mock_environment") != nullptr;
  }
  std::string preload = sanitizer_runtime();
  if (!preload.empty()) preload += ":";
  preload += kPreload;
  setenv("LD_PRELOAD", preload.c_str(), 1);
  setenv(kMark, "1", 1);
  execv("/proc/self/exe", argv);
  return false;
}

struct EmulatedBus::Impl {
  UMockdevTestbed* testbed = umockdev_testbed_new();
  std::vector<std::unique_ptr<Node>> nodes;
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
  impl_->nodes.push_back(std::make_unique<Node>(impl_->testbed, index + 1, serial));
  return index;
}

void EmulatedBus::unplug(int index) { impl_->nodes.at(static_cast<std::size_t>(index))->unplug(); }

void EmulatedBus::plug(int index) {
  impl_->nodes.at(static_cast<std::size_t>(index))->plug(impl_->next_address++);
}

void EmulatedBus::hold(int index, bool held) {
  Node& node = *impl_->nodes.at(static_cast<std::size_t>(index));
  const std::lock_guard<std::mutex> lock(node.mutex_);
  node.held = held;
}

void EmulatedBus::with(int index, const std::function<void(Emulator&)>& use) {
  Node& node = *impl_->nodes.at(static_cast<std::size_t>(index));
  const std::lock_guard<std::mutex> lock(node.mutex_);
  use(node.emulator);
}

std::int64_t EmulatedBus::now_ns() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

}  // namespace palpate::falcon::testing
