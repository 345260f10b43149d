#pragma once
// Whether a tool that is pressed into a soft body comes to rest, where the body is stepped more
// slowly than the servo ticks: over moduli, contact stiffnesses, rates of the body, and tools.

#include <cstdint>
#include <string>
#include <vector>

namespace palpate::runner {

struct SoftCase {
  double young = 20000;    ///< Pa
  double stiffness = 800;  ///< N/m, of the spring between tool and surface
  double rate = 250;       ///< Hz, of the body's steps
  double radius = 0.002;   ///< m, of the tool, which stands on the body
  double poisson = 0.45;
  double damping = 0.01;  ///< s, of the body
  // The path of the tool's tip:
  double x = 0.0003, y = 0.0002;  ///< m, off the middle of the slab
  double depth = 0.003;           ///< m, of the virtual tool, in the end
  double speed = 0.02;            ///< m/s, downwards
};

struct SoftSwing {
  SoftCase what;
  double force = 0;  ///< N, mean, once it is held
  double swing = 0;  ///< share of it: highest less lowest over the last 0.2 s, or 1 s of what rings
  double held = 0;   ///< s, until then
  bool finite = true;    ///< every force was a number
  bool accepted = true;  ///< a scene may have this rate with this modulus
  /// At rest as far as a hand can tell.
  bool settles() const { return finite && swing <= kAtRest; }
  static constexpr double kAtRest = 0.01;
};

/// A slab, 60 x 60 x 30 mm, pressed by an upright tool that is then held still for 1.5 s. Without
/// damping, where scenes may have it and it still swings then: up to 12.5 s.
SoftSwing press_and_hold(const SoftCase& what);

/// 1 kPa to 10 MPa, 0.2 to 3 kN/m, 62.5 to 1000 Hz, tools of 2 and 10 mm, with plain and with
/// nearly incompressible material.
std::vector<SoftCase> soft_cases();
/// The same where each tool presses at a place within 20 mm of the middle, 1 to 6 mm deep, at 5 to
/// 200 mm/s, as drawn with the seed.
std::vector<SoftCase> soft_cases_elsewhere(std::uint64_t seed);

/// Worst swing of each modulus and rate, as a table, and what it says in a sentence.
std::string soft_map_text(const std::vector<SoftSwing>& map);

}  // namespace palpate::runner
