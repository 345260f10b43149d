#include "runner/devices/falcon/driver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <memory>
#include <span>
#include <utility>

#include "runner/devices/falcon/kinematics.h"

namespace palpate::runner::devices::falcon {
namespace {

constexpr int kMaxImplausible = 5;  // in a row; more: the encoders have lost their reference
constexpr double kSlack = 0.002;    // m, beyond the fastest hand's motion
constexpr std::int64_t kHaltReply = 20'000'000;  // ns
constexpr int kHaltTries = 3;

}  // namespace

FalconDriver::FalconDriver(std::unique_ptr<Transport> transport, const DriverSettings& settings)
    : transport_(std::move(transport)), settings_(settings) {
  restart();
}

FalconDriver::~FalconDriver() { halt(); }

void FalconDriver::restart() noexcept {
  stream_.reset();
  reading_ = {};
  waiting_ = located_ = fresh_ = false;
  replied_ns_ = transport_->now_ns();
  halt();
  update();
}

void FalconDriver::reopen() {
  if (reading_.trouble != servo::DeviceTrouble::unplugged &&
      reading_.trouble != servo::DeviceTrouble::silent)
    return;
  transport_->reopen();
  if (settings_.boot) settings_.boot(*transport_);
  restart();
}

void FalconDriver::take_replies(std::int64_t wait_ns) noexcept {
  bool fresh = false;
  std::array<std::uint8_t, 256> bytes{};
  for (std::size_t count = bytes.size(); count == bytes.size(); wait_ns = 0) {  // until all is read
    count = transport_->receive(bytes, wait_ns);
    for (const std::uint8_t byte : std::span(bytes).first(count)) {
      const auto packet = stream_.take(byte);
      if (!packet) continue;
      const auto reply = decode_reply(*packet);
      if (!reply) {
        stream_.count_bad();
        continue;
      }
      reply_ = *reply;
      fresh = true;
      ++counts_.replies;
    }
  }
  counts_.malformed = stream_.dropped();
  if (fresh) {
    replied_ns_ = transport_->now_ns();
    waiting_ = false;
    fresh_ = true;
  }
}

const DriverReading& FalconDriver::update() noexcept {
  take_replies(0);
  const bool fresh = std::exchange(fresh_, false);
  if (transport_->gone()) {
    reading_.trouble = servo::DeviceTrouble::unplugged;
  } else if (transport_->now_ns() - replied_ns_ > settings_.silence_ns || counts_.replies == 0) {
    reading_.trouble = servo::DeviceTrouble::silent;
  } else if (fresh) {
    reading_.buttons = reply_.buttons;
    if (reply_.all_homed()) {
      locate();
    } else {
      reading_.trouble = servo::DeviceTrouble::not_homed;
    }
  } else if (reading_.usable() && waiting_) {
    reading_.trouble = servo::DeviceTrouble::late;
  }
  if (!reading_.usable()) located_ = false;
  return reading_;
}

void FalconDriver::locate() noexcept {
  const auto& counts = reply_.counts;
  const auto found = forward(thigh_angles({counts[0], counts[1], counts[2]}),
                             located_ ? falcon_position_ : kCentre);
  const double passed = 1e-9 * static_cast<double>(replied_ns_ - located_ns_);  // s
  const bool plausible = found && (!located_ || glm::length(found->position - falcon_position_) <=
                                                    kSlack + kMaxSpeed * passed);
  if (!plausible) {
    ++counts_.implausible;
    // Repeat the last valid position, if any, for a few ticks.
    const bool lost = ++implausible_in_a_row_ >= kMaxImplausible || !located_;
    reading_.trouble = lost ? servo::DeviceTrouble::implausible : servo::DeviceTrouble::late;
    return;
  }
  implausible_in_a_row_ = 0;
  falcon_position_ = found->position;
  located_ns_ = replied_ns_;
  located_ = true;
  reading_.position = to_world(falcon_position_ - kCentre);
  reading_.trouble = servo::DeviceTrouble::none;
}

std::array<int, 3> FalconDriver::motors_for(const Vec3& force) noexcept {
  std::array<int, 3> motors{};
  const auto legs = inverse(falcon_position_);
  if (!legs) return motors;
  const auto torque = torque_for(jacobian(*legs), from_world(force));
  if (!torque) return motors;
  Vec3 counts = settings_.counts_per_torque * *torque;
  const double peak = std::max({std::abs(counts.x), std::abs(counts.y), std::abs(counts.z)});
  if (!std::isfinite(counts.x + counts.y + counts.z)) return motors;
  // Scale all three by one factor: separate clipping would rotate the force.
  if (peak > kMaxCount) {
    counts *= kMaxCount / peak;
    ++counts_.saturated;
  }
  for (int i = 0; i < 3; ++i) {
    motors[static_cast<std::size_t>(i)] = static_cast<int>(std::lround(counts[i]));
  }
  return motors;
}

bool FalconDriver::send(const std::array<int, 3>& motors) noexcept {
  const bool homed = reply_.all_homed() && reading_.trouble != servo::DeviceTrouble::silent;
  Command command;
  command.motors = motors;
  command.green = homed;
  command.red = !homed;
  if (!transport_->send(encode(command))) return false;
  motors_ = motors;
  sent_ns_ = transport_->now_ns();
  waiting_ = true;
  return true;
}

void FalconDriver::push(const Vec3& force) noexcept {
  if (transport_->gone()) return;
  // Send one packet at a time: it is unknown whether the firmware can handle several.
  if (waiting_) {
    if (transport_->now_ns() - sent_ns_ < settings_.resend_ns) {
      ++counts_.late;
      return;
    }
    ++counts_.resent;
    stream_.reset();
  }
  send(reading_.usable() && located_ ? motors_for(force) : std::array<int, 3>{});
}

bool FalconDriver::halt() noexcept {
  const auto await_reply = [this](std::int64_t wait_ns) {
    const std::int64_t end = transport_->now_ns() + wait_ns;
    for (std::int64_t left = wait_ns; waiting_ && left > 0 && !transport_->gone();
         left = end - transport_->now_ns()) {
      take_replies(left);
    }
    return !waiting_;
  };
  await_reply(settings_.resend_ns);
  for (int i = 0; i < kHaltTries && !transport_->gone(); ++i) {
    if (send({}) && transport_->drain(kHaltReply) && await_reply(kHaltReply)) return true;
  }
  return false;
}

double guaranteed_force(double counts_per_torque) {
  const double torque = kMaxCount / std::abs(counts_per_torque);
  double least = force_in_every_direction(kCentre, torque);
  constexpr int kSteps = 12;
  for (int i = 0; i <= kSteps; ++i) {
    const double polar = 3.14159265358979323846 * i / kSteps;
    for (int k = 0; k < 2 * kSteps; ++k) {
      const double turn = 3.14159265358979323846 * k / kSteps;
      const Vec3 direction(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn),
                           std::cos(polar));
      least =
          std::min(least, force_in_every_direction(kCentre + kWorkspaceRadius * direction, torque));
    }
  }
  return least;
}

}  // namespace palpate::runner::devices::falcon
