#include "runner/evidence/stability/integrators.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <vector>

#include "data/base/random.h"
#include "runner/devices/simulated.h"

namespace palpate::runner::evidence {
namespace {

constexpr int kTimedTicks = 500;

std::vector<double> forces() {
  Random random(1);
  std::vector<double> out;
  out.reserve(kTimedTicks);
  for (int i = 0; i < kTimedTicks; ++i) out.push_back(4 * random.unit() - 2);
  return out;
}

constexpr double kTick = 1e-3;  // s
constexpr int kMostSteps = 1024;

struct State {
  double x = 0, v = 0;
};

State explicit_euler(const Oscillator& o, State s, double force, int steps) {
  const double h = kTick / steps;
  for (int i = 0; i < steps; ++i) {
    const double a = (force - o.damping * s.v - o.stiffness * s.x) / o.mass;
    s = {s.x + h * s.v, s.v + h * a};
  }
  return s;
}

State semi_implicit_euler(const Oscillator& o, State s, double force, int steps) {
  const double h = kTick / steps;
  for (int i = 0; i < steps; ++i) {
    s.v += h * (force - o.damping * s.v - o.stiffness * s.x) / o.mass;
    s.x += h * s.v;
  }
  return s;
}

State implicit_euler(const Oscillator& o, State s, double force, int steps) {
  const double h = kTick / steps;
  const double factor = 1 / (o.mass + h * o.damping + h * h * o.stiffness);
  for (int i = 0; i < steps; ++i) {
    s.v = (o.mass * s.v + h * (force - o.stiffness * s.x)) * factor;
    s.x += h * s.v;
  }
  return s;
}

/// Closed form: two exponentials about the equilibrium, in extended precision.
class Reference {
 public:
  explicit Reference(const Oscillator& o) : stiffness_(o.stiffness) {
    using Complex = std::complex<long double>;
    const long double half = o.damping / (2.0L * o.mass);
    const Complex root = std::sqrt(Complex(half * half - o.stiffness / (long double)(o.mass), 0));
    r1_ = -half + root;
    r2_ = -half - root;
    e1_ = std::exp(r1_ * static_cast<long double>(kTick));
    e2_ = std::exp(r2_ * static_cast<long double>(kTick));
  }
  void advance(long double force) {
    const long double equilibrium = force / stiffness_;
    const std::complex<long double> x = x_ - equilibrium;
    const auto c2 = (v_ - r1_ * x) / (r2_ - r1_), c1 = x - c2;
    x_ = (c1 * e1_ + c2 * e2_).real() + equilibrium;
    v_ = (c1 * r1_ * e1_ + c2 * r2_ * e2_).real();
  }
  double x() const { return static_cast<double>(x_); }

 private:
  long double stiffness_, x_ = 0, v_ = 0;
  std::complex<long double> r1_, r2_, e1_, e2_;
};

/// \param make  returns a function that advances by a tick under a force and returns the position
template <class Make>
IntegratorRow measure(const Oscillator& o, const char* method, int steps,
                      const std::vector<double>& inputs, const std::function<double()>& now_ns,
                      const Make& make) {
  IntegratorRow row{o.name, method, steps, 0, 0};
  Reference reference(o);
  auto mover = make();
  for (const double force : inputs) {
    reference.advance(force);
    const double error = std::abs(mover(force) - reference.x());
    row.error = std::isfinite(error) ? std::max(row.error, error) : HUGE_VAL;
    if (!std::isfinite(error)) break;
  }
  if (row.error > 1) row.error = HUGE_VAL;  // m: it diverged
  const int laps = std::max(1, 40 / steps);
  double best = HUGE_VAL, sink = 0;
  for (int round = 0; round < 5; ++round) {
    auto timed = make();
    const double start = now_ns();
    for (int lap = 0; lap < laps; ++lap) {
      for (const double force : inputs) sink += timed(force);
    }
    best = std::min(best, (now_ns() - start) / (laps * kTimedTicks));
  }
  row.ns_per_tick = sink == 0.123456789 ? 0 : best;  // prevents the compiler from removing the loop
  return row;
}

}  // namespace

std::vector<IntegratorRow> compare_integrators(const std::function<double()>& now_ns) {
  const Oscillator oscillators[] = {{"relaxed hand (400 N/m, 10 N s/m)", 0.1, 10, 400},
                                    {"stiff (100 kN/m, 1 N s/m)", 0.1, 1, 1e5},
                                    {"overdamped (1 kN/m, 500 N s/m)", 0.1, 500, 1000}};
  using Step = State (*)(const Oscillator&, State, double, int);
  struct Method {
    const char* name;
    Step step;
  };
  const Method methods[] = {{"explicit", explicit_euler},
                            {"semi-implicit", semi_implicit_euler},
                            {"implicit", implicit_euler}};
  const std::vector<double> inputs = forces();
  std::vector<IntegratorRow> rows;
  for (const Oscillator& o : oscillators) {
    for (const Method& method : methods) {
      for (int steps = 1; steps <= kMostSteps; steps *= 4) {
        rows.push_back(measure(o, method.name, steps, inputs, now_ns, [&] {
          return [&o, step = method.step, steps, s = State()](double force) mutable {
            s = step(o, s, force, steps);
            return s.x;
          };
        }));
      }
    }
    rows.push_back(measure(o, "exact", 1, inputs, now_ns, [&] {
      return [spring = devices::SpringDamper(o.mass, o.damping, o.stiffness, kTick),
              k = o.stiffness, x = Vec3(), v = Vec3()](double force) mutable {
        const Vec3 equilibrium(force / k, 0, 0);
        x -= equilibrium;
        spring.advance(x, v);
        x += equilibrium;
        return x.x;
      };
    }));
  }
  return rows;
}

}  // namespace palpate::runner::evidence
