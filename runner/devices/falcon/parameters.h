#pragma once
// Every constant of the Novint Falcon. Source of sizes and scale: libnifalcon (commit f7c727a,
// BSD-3); differences are stated beside the constant.

#include <array>
#include <cstdint>

#include "stimuli/vec.h"

namespace palpate::runner::devices::falcon {

// Lengths of the legs, m: a delta of Clavel's type with Stamper's parallelograms.
inline constexpr double kThigh = 0.0600;             ///< a
inline constexpr double kShin = 0.1025;              ///< b, the parallelogram's long side
inline constexpr double kShinEnds = 0.0225;          ///< 2d, both end links of the parallelogram
inline constexpr double kGripRadial = 0.01443;       ///< c, shin joint to the grip's centre
inline constexpr double kGripTangential = -0.025;    ///< f, the same, tangential
inline constexpr double kBaseRadial = 0.0400;        ///< r, base to thigh joint
inline constexpr double kBaseTangential = -0.02309;  ///< s, the same, tangential
inline constexpr std::array<double, 3> kLegAzimuth = {105, -15, -135};  ///< degrees, legs 1, 2, 3
/// Cosine and sine of the azimuths, written out: std::cos is not constexpr.
inline constexpr std::array<double, 3> kLegCos = {-0.25881904510252074, 0.96592582628906831,
                                                  -0.70710678118654746};
inline constexpr std::array<double, 3> kLegSin = {0.96592582628906831, -0.25881904510252074,
                                                  -0.70710678118654757};

// Encoders: 320 slots, four edges each; the capstan turns the thigh 14.25 mm : 110 mm.
inline constexpr double kCountAngle = 14.25 / 110 * 2 * 3.14159265358979323846 / 1280;  ///< rad
inline constexpr double kZeroAngle = 35 * 3.14159265358979323846 / 180;  ///< rad; approximate

// Motors. A positive count turns the thigh down and pulls the grip in. The scale of force is
// uncertain by a factor of 2 to 4 until the device is calibrated with weights.
inline constexpr double kCountsPerTorque = -1e4;  ///< 1/(N m) at the thigh
inline constexpr int kMaxCount = 4095;            ///< larger values would wrap or saturate
/// Nominal newtons commanded for each newton of a known weight. Weighing refuses slopes outside
/// these. An implausible scale is never used for forces on a hand.
inline constexpr double kLeastSlope = 0.05, kMostSlope = 20;
inline constexpr double kPlausibleFactor = 4;  ///< of the nominal scale, up or down

// Workspace, m.
inline constexpr Vec3 kCentre{0, 0, 0.125};                 ///< Falcon frame
inline constexpr double kWorkspaceRadius = 0.04;            ///< about the centre, all reachable
inline constexpr double kNearest = 0.06, kFarthest = 0.20;  ///< range of plausible z
inline constexpr double kWidest = 0.09;                     ///< plausible distance from the axis

inline constexpr double kMaxStiffness = 3000;  ///< N/m at 1 kHz, from CHAI3D's list
inline constexpr double kResolution = 5e-5;    ///< m, about one count near the centre
inline constexpr double kMaxRate = 1000;       ///< Hz: the latency timer's 1 ms
inline constexpr double kMaxSpeed = 5;         ///< m/s; hands move the grip more slowly

// USB.
inline constexpr std::uint16_t kVendor = 0x0403, kProduct = 0xCB48;
inline constexpr std::uint8_t kInEndpoint = 0x81, kOutEndpoint = 0x02;

/// The world frame (x right, y away from the user, z up) from the Falcon's (x right, y up, z
/// towards the user), for directions and forces.
constexpr Vec3 to_world(const Vec3& v) { return {v.x, -v.z, v.y}; }
constexpr Vec3 from_world(const Vec3& v) { return {v.x, v.z, -v.y}; }

}  // namespace palpate::runner::devices::falcon
