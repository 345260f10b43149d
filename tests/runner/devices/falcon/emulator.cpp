#include "tests/runner/devices/falcon/emulator.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <initializer_list>

#include "data/base/random.h"
#include "runner/devices/falcon/kinematics.h"
#include "runner/devices/falcon/packets.h"
#include "runner/devices/falcon/parameters.h"

namespace palpate::runner::devices::falcon::testing {
namespace {

constexpr std::int64_t kMonitorNs = 4'200'000;  // four bytes at 9600 baud
constexpr std::int64_t kBootByteNs = 70'000;    // one at 142 857
constexpr std::int64_t kPacketNs = 107'000;     // 16 at 1.5 M
constexpr std::int64_t kFirmwareNs = 40'000;    // assumed
constexpr std::size_t kChipBytes = 62;          // of data in a full IN packet
constexpr double kIndexCount = -60;             // of each axis: near the middle of its range
constexpr double kPowerUpOffset = -700;         // counts, before homing
constexpr double kStep = 1e-4;                  // s, of the plant
constexpr std::size_t kRecord = 60'000;         // packets

}  // namespace

void Emulator::preload(bool homed) {
  mode_ = Mode::run;
  baud_ = 2;
  homed_ = homed ? 7 : 0;
  homing_ = homed;
}

void Emulator::power_cycle() {
  mode_ = Mode::idle;
  out_.clear();
  heard_.clear();
  homed_ = leds_ = 0;
  homing_ = dtr_ = dtr_fell_ = false;
  motors_ = {};
}

void Emulator::lose_homing() { homed_ = 0; }

void Emulator::place(const Vec3& position) {
  position_ = position;
  velocity_ = Vec3(0);
  last_counts_ = counts();
}

bool Emulator::control_out(std::uint8_t request, std::uint16_t value) {
  switch (request) {
    case 0:
      if (value <= 1) out_.clear();
      return value <= 2;
    case 1:
      if ((value & 0x100) != 0) {
        const bool high = (value & 1) != 0;
        if (high && !dtr_) {  // the rising edge resets the processor
          mode_ = Mode::monitor;
          dtr_fell_ = false;
          homed_ = 0;
          heard_.clear();
        }
        dtr_fell_ = dtr_fell_ || (dtr_ && !high);
        dtr_ = high;
      }
      return true;
    case 2:
    case 4:
      return true;
    case 3:
      baud_ = value;
      return true;
    case 6:
      event_ = (value & 0x100) != 0 ? value & 0xFF : -1;
      return true;
    case 9:
      latency_ms_ = std::max(1, value & 0xFF);
      return true;
    default:
      return false;
  }
}

std::optional<std::vector<std::uint8_t>> Emulator::control_in(std::uint8_t request) const {
  if (request == 5) return std::vector<std::uint8_t>{0x01, 0x60};
  if (request == 10) return std::vector<std::uint8_t>{static_cast<std::uint8_t>(latency_ms_)};
  return std::nullopt;
}

void Emulator::answer(const std::vector<std::uint8_t>& bytes, std::int64_t due_ns) {
  for (const std::uint8_t byte : bytes) out_.push_back({byte, due_ns});
}

void Emulator::host_sends(const std::vector<std::uint8_t>& bytes, std::int64_t now_ns) {
  for (const std::uint8_t byte : bytes) {
    if (mode_ == Mode::monitor && baud_ == 0x4138) {
      monitor_takes(byte, now_ns);
    } else if (mode_ == Mode::monitor && baud_ == 0x0015 && dtr_fell_ && byte == 0x41) {
      mode_ = Mode::boot;
      image_.clear();
      ++uploads_;
      answer({0x41}, now_ns + kBootByteNs);
    } else if (mode_ == Mode::boot && baud_ == 0x0015) {
      boot_takes(byte, now_ns);
    } else if (mode_ == Mode::run && baud_ == 0x0002) {
      firmware_takes(byte, now_ns);
    }
  }
}

void Emulator::monitor_takes(std::uint8_t byte, std::int64_t now_ns) {
  heard_.push_back(byte);
  if (byte != 0x0D) return;
  const bool known = heard_ == std::vector<std::uint8_t>{0x0A, 0x43, 0x0D};
  heard_.clear();
  if (!known) return;
  if (faults.deaf_probes > 0) {
    --faults.deaf_probes;
    return;
  }
  if (faults.stray_byte) answer({0x00}, now_ns + kMonitorNs);
  answer({0x0A, 0x44, 0x2C, 0x0D}, now_ns + kMonitorNs);
}

void Emulator::boot_takes(std::uint8_t byte, std::int64_t now_ns) {
  image_.push_back(byte);
  wire_free_ns_ = std::max(wire_free_ns_, now_ns) + kBootByteNs;
  const bool spoil = image_.size() == 150;
  if (spoil && faults.lost_echoes > 0) {
    --faults.lost_echoes;
  } else if (spoil && faults.wrong_echoes > 0) {
    --faults.wrong_echoes;
    answer({static_cast<std::uint8_t>(byte ^ 0x10)}, wire_free_ns_);
  } else {
    answer({byte}, wire_free_ns_);
  }
  if (image_is_whole()) {
    mode_ = Mode::run;
    homed_ = 0;
    heard_.clear();
  }
}

bool Emulator::image_is_whole() const {
  const auto word = [this](std::size_t at) { return image_[at] | image_[at + 1] << 8; };
  if (image_.size() < 24 || word(0) != 0x08AA) return false;
  std::size_t at = 22;
  while (at + 2 <= image_.size()) {
    const int words = word(at);
    at += 2;
    if (words == 0) return at == image_.size();
    at += 4 + 2 * static_cast<std::size_t>(words);
  }
  return false;
}

void Emulator::firmware_takes(std::uint8_t byte, std::int64_t now_ns) {
  if (byte == '<') {
    if (!heard_.empty()) ++malformed_;
    heard_.clear();
  } else if (heard_.empty()) {
    return;
  }
  heard_.push_back(byte);
  if (heard_.size() == 16) {
    obey(now_ns);
    heard_.clear();
  }
}

void Emulator::obey(std::int64_t now_ns) {
  Packet packet;
  std::copy(heard_.begin(), heard_.end(), packet.begin());
  const auto command = decode_command(packet);
  if (!command) {
    ++malformed_;
    return;
  }
  ++packets_;
  move_to(now_ns);
  const bool had_torque = !torque_is_zero();
  motors_ = command->motors;
  record_.push_back({now_ns, motors_});
  if (record_.size() > kRecord) record_.pop_front();
  if (had_torque && torque_is_zero()) zeroed_ns_ = now_ns;
  for (const int motor : motors_) largest_count_ = std::max(largest_count_, std::abs(motor));
  if (!torque_is_zero()) {
    last_torque_ns_ = now_ns;
    if (homed_ != 7) torque_before_homing_ = true;
  }
  homing_ = command->homing;
  if (!homing_) homed_ = 0;
  leds_ = (command->green ? 2U : 0U) | (command->blue ? 4U : 0U) | (command->red ? 8U : 0U);

  Reply reply;
  const Vec3 now_counts = counts();
  for (int i = 0; i < 3; ++i) {
    const bool known = (homed_ >> i & 1U) != 0;
    reply.counts[static_cast<std::size_t>(i)] =
        static_cast<int>(std::lround(now_counts[i] + (known ? 0 : kPowerUpOffset)));
  }
  reply.buttons = buttons;
  reply.homed = static_cast<std::uint8_t>(homed_);
  const Packet bytes = encode(reply);
  if (faults.silent) return;
  const auto now_and_then = [this](int every) {
    return every > 0 && packets_ % static_cast<std::uint64_t>(every) == 0;
  };
  std::int64_t due = now_ns + 2 * kPacketNs + kFirmwareNs;
  if (now_and_then(faults.late_every)) due += faults.late_ns;
  const bool shortened = now_and_then(faults.short_every);
  const bool split = now_and_then(faults.split_every);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (shortened && (i == 6 || i == 7)) continue;
    out_.push_back({bytes[i], due + (split && i >= 9 ? 1'500'000 : 0)});
  }
}

std::optional<std::vector<std::uint8_t>> Emulator::in_packet(std::int64_t now_ns,
                                                             std::size_t size) {
  std::size_t ready = 0;
  bool event = false;
  for (; ready < out_.size() && out_[ready].due_ns <= now_ns; ++ready) {
    event = event || out_[ready].byte == event_;
  }
  const std::int64_t latency_ns = std::int64_t{latency_ms_} * 1'000'000;
  const bool full = ready >= kChipBytes || event;
  if (!full && now_ns < last_in_ns_ + latency_ns) return std::nullopt;
  // The timer keeps its own period unless it was not polled for long.
  last_in_ns_ = now_ns < last_in_ns_ + 2 * latency_ns && !full ? last_in_ns_ + latency_ns : now_ns;
  std::vector<std::uint8_t> packet = {0x01, 0x60};
  const std::size_t count = std::min({ready, kChipBytes, size - 2});
  for (std::size_t i = 0; i < count; ++i) {
    packet.push_back(out_.front().byte);
    out_.pop_front();
  }
  return packet;
}

Vec3 Emulator::counts() const {
  const auto legs = inverse(position_);
  return legs ? encoder_counts({(*legs)[0].thigh, (*legs)[1].thigh, (*legs)[2].thigh})
              : last_counts_;
}

void Emulator::pass_indices(const Vec3& now_counts) {
  for (int i = 0; i < 3; ++i) {
    const bool passed = (now_counts[i] > kIndexCount) != (last_counts_[i] > kIndexCount);
    if (homing_ && passed) homed_ |= 1U << i;
  }
  last_counts_ = now_counts;
}

void Emulator::move_to(std::int64_t now_ns) {
  if (moved_ns_ < 0) {
    moved_ns_ = now_ns;
    last_counts_ = counts();
  }
  const double dt = std::min(1e-9 * static_cast<double>(now_ns - moved_ns_), 0.05);
  moved_ns_ = now_ns;
  const int steps = std::max(1, static_cast<int>(std::lround(dt / kStep)));
  const double h = dt / steps;
  const Vec3 torque = Vec3(motors_[0], motors_[1], motors_[2]) / plant.counts_per_torque;
  for (int k = 0; k < steps; ++k) {
    time_ += h;
    const auto legs = inverse(position_);
    if (!legs) break;
    force_ = force_of(jacobian(*legs), torque);
    const Vec3 target = plant.hand ? plant.hand(time_) : kCentre;
    Vec3 push = force_ + plant.load + plant.hand_stiffness * (target - position_);
    // Integrate the damper implicitly, so that a stiff hand stays stable.
    velocity_ = (velocity_ + h / plant.mass * push) / (1 + h * plant.hand_damping / plant.mass);
    const double speed = glm::length(velocity_), held = h * plant.friction / plant.mass;
    velocity_ = speed > held ? (1 - held / speed) * velocity_ : Vec3(0);
    const Vec3 next = position_ + h * velocity_;
    if (inverse(next) && next.z > 0.075 && next.z < 0.178) {
      position_ = next;
    } else {
      velocity_ = Vec3(0);  // a mechanical stop
    }
    pass_indices(counts());
  }
}

std::vector<std::uint8_t> synthetic_image(std::size_t words) {
  std::vector<std::uint8_t> bytes;
  const auto put = [&bytes](std::initializer_list<std::uint64_t> more) {
    for (const std::uint64_t word : more) {
      bytes.push_back(static_cast<std::uint8_t>(word & 0xFF));
      bytes.push_back(static_cast<std::uint8_t>(word >> 8 & 0xFF));
    }
  };
  put({0x08AA, 0, 0, 0, 0, 0, 0, 0, 0, 0x3F, 0x8002});
  Random random(words);
  for (const std::size_t count : {words - words / 4, words / 4}) {
    put({count, 0x3F, 0x8002});
    for (std::size_t i = 0; i < count; ++i) put({random.next()});
  }
  put({0});
  return bytes;
}

}  // namespace palpate::runner::devices::falcon::testing
