#pragma once
// Bodies that move and collide, against known answers: error and run time of our own step, beside
// Bullet and ODE if they are found. Also soft bodies against known solutions. Not for the servo.
// World frame, SI units.

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::runner::evidence {

/// A box, a shape that every engine supports.
struct BodyBox {
  Vec3 size;
  double mass = 0;  ///< kg; 0: it stands still
  Pose pose;
  Vec3 velocity{0, 0, 0}, spin{0, 0, 0};
  double restitution = 1, friction = 0;
};

/// The present motion of a box; `centre` is its centre of mass.
struct BoxMotion {
  Vec3 centre;
  Quat orientation;
  Vec3 velocity, spin;
};

struct BodyCase {
  std::string name, measure;  ///< "head-on", "speed, relative"
  Vec3 gravity{0, 0, 0};
  std::vector<BodyBox> boxes;
  double duration = 0;  ///< s
  /// Error of the moving boxes, in order. With `always`, the largest over all steps counts.
  std::function<double(std::span<const BoxMotion>)> error;
  bool always = false;
};
/// \param quick  shorter cases
std::vector<BodyCase> body_cases(bool quick);

/// Steps boxes of a case.
class BodyEngine {
 public:
  virtual ~BodyEngine() = default;
  virtual void step(double dt) = 0;
  virtual std::vector<BoxMotion> motion() const = 0;
};

/// The engines; those of other libraries exist if CMake finds the libraries.
struct BodyEngineKind {
  std::string name;
  std::unique_ptr<BodyEngine> (*make)(const BodyCase& of);
};
std::vector<BodyEngineKind> body_engines();

namespace peers {
std::unique_ptr<BodyEngine> make_bullet_bodies(const BodyCase& of);
std::unique_ptr<BodyEngine> make_ode_bodies(const BodyCase& of);
}  // namespace peers

struct BodyRow {
  std::string name, measure, engine;
  double error = 0;
  double us_per_step = 0;
};

/// All cases, in steps of 1 ms.
/// \param now  a clock, ns
std::vector<BodyRow> body_study(bool quick, const std::function<double()>& now,
                                const std::function<void(double)>& progress);

/// us, cost of a tick of the ray renderer while the probe pushes eleven bodies into each other: ten
/// dumbbells and a rocket of nine parts.
struct BodyTickCost {
  double median = 0, p99 = 0, most = 0;
  std::size_t ticks = 0;
};
BodyTickCost body_tick_cost(bool quick, const std::function<double()>& now);

/// One measured quantity of one soft body: its error against a known solution, and the cost of a
/// step.
struct SoftRow {
  std::string name, truth;
  std::size_t nodes = 0, elements = 0;
  double value = 0, reference = 0;  ///< in `unit`; the error is their difference
  std::string unit;
  double error = 0;    ///< share of the reference; in `unit` for the last two cases
  double step_ns = 0;  ///< of a step of the body; 0: no step
};

/// \param quick  without the meshes that take seconds to build
/// \param now    ns, a clock
std::vector<SoftRow> soft_study(bool quick, const std::function<double()>& now,
                                const std::function<void(double)>& progress);

}  // namespace palpate::runner::evidence
