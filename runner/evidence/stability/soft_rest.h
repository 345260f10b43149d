#pragma once
// Whether a tool pressed into a soft body comes to rest, although the body has slower steps than
// the servo: over moduli, contact stiffnesses, rates of the body, and tools.

#include <cstdint>
#include <string>
#include <vector>

namespace palpate::runner::evidence {

struct SoftCase {
  double young = 20000;    ///< Pa
  double stiffness = 800;  ///< N/m, of the spring between tool and surface
  double rate = 250;       ///< Hz, of the body's steps
  double radius = 0.002;   ///< m, of the tool, which is upright on the body
  double poisson = 0.45;
  double damping = 0.01;  ///< s, of the body
  // The path of the tool's tip:
  double x = 0.0003, y = 0.0002;  ///< m, off the middle of the slab
  double depth = 0.003;           ///< m, final depth of the virtual tool
  double speed = 0.02;            ///< m/s, downwards
};

struct SoftSwing {
  SoftCase what;
  double force = 0;      ///< N, mean while it is held
  double swing = 0;      ///< share of the force: range over the last 0.2 s, or 1 s if undamped
  double held = 0;       ///< s, duration of holding
  bool finite = true;    ///< every force was finite
  bool accepted = true;  ///< scenes allow this rate with this modulus
  /// Whether it is at rest for a human hand.
  bool settles() const { return finite && swing <= kAtRest; }
  static constexpr double kAtRest = 0.01;
};

/// A slab, 60 x 60 x 30 mm, pressed by an upright tool that is then held still for 1.5 s. If it is
/// undamped, allowed in scenes and still swings: up to 12.5 s.
SoftSwing press_and_hold(const SoftCase& what);

/// 1 kPa to 10 MPa, 0.2 to 3 kN/m, 62.5 to 1000 Hz, tools of 2 and 10 mm, with plain and with
/// nearly incompressible material.
std::vector<SoftCase> soft_cases();
/// The same, but each tool presses at a place within 20 mm of the middle, 1 to 6 mm deep, at 5 to
/// 200 mm/s, drawn with the seed.
std::vector<SoftCase> soft_cases_elsewhere(std::uint64_t seed);

/// Table of the worst swing for each modulus and rate, with a sentence that sums it up.
std::string soft_map_text(const std::vector<SoftSwing>& map);

}  // namespace palpate::runner::evidence
