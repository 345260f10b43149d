#include "protocols/parse_body.h"

namespace palpate::protocols {
namespace {

constexpr NumberRange kMass{1e-6, 1e4, "kg"};
constexpr NumberRange kDensity{0.01, 1e5, "kg/m^3"};
// Ten times as fast as a hand: beyond it a unit was mistaken.
constexpr NumberRange kVelocity{-100, 100, "m/s"};
constexpr NumberRange kSpin{-1000, 1000, "rad/s"};
constexpr NumberRange kBodyDamping{0, 1000, "1/s"};
constexpr NumberRange kRestitution{0, 1};
constexpr NumberRange kBodyFriction{0, 10};
constexpr NumberRange kGravity{-1000, 1000, "m/s^2"};

}  // namespace

void read_body(ObjectReader& reader, std::optional<stimuli::Body>& body) {
  reader.section("body", [&](ObjectReader& section) {
    if (!reader.member("body")->is_object()) return;
    stimuli::Body& read = body.emplace();
    const auto number = [&section](const char* key, std::optional<double>& out,
                                   const NumberRange& range) {
      if (section.member(key) == nullptr) return;  // known now, for faults of unknown ones
      double value = 1;
      section.number(key, value, range);
      out = value;
    };
    number("mass_kg", read.mass, kMass);
    number("density_kg_per_m3", read.density, kDensity);
    if (section.has("mass_kg") == section.has("density_kg_per_m3")) {
      section.faults().add(section.pointer(),
                           section.has("mass_kg")
                               ? "expected mass_kg or density_kg_per_m3, not both"
                               : "expected mass_kg or density_kg_per_m3");
    }
    section.vector("velocity_m_per_s", read.velocity, kVelocity);
    section.vector("spin_rad_per_s", read.spin, kSpin);
    section.number("damping_per_s", read.damping, kBodyDamping);
    section.number("restitution", read.restitution, kRestitution);
    section.number("friction", read.friction, kBodyFriction);
  });
}

void read_gravity(ObjectReader& reader, Vec3& gravity) {
  reader.vector("gravity_m_per_s2", gravity, kGravity);
}

}  // namespace palpate::protocols
