#pragma once
// An object as a scene file or protocol describes it, as plain values (the keys:
// protocols/scene.schema.json), and the parameters of each shape, in one table. Every other
// function that distinguishes shapes is a switch without `default:`, so that the compiler
// (-Wswitch) reports those that lack a new shape. How to add one: README.md. SI units.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::stimuli {

enum class ShapeKind {
  sphere,
  cone,
  cylinder,
  cube,
  box,
  mesh,
  none,  ///< no surface: force fields alone
  compound
};

/// A layer of an object: its surface moved inwards, felt beside the surface.
struct Layer {
  double depth = 0;      ///< m; each plane of the surface moves inwards by this
  double stiffness = 0;  ///< N/m
  double damping = 0;    ///< N s/m
  std::optional<double> break_force = std::nullopt;  ///< N; a greater force breaks the layer
};

class Texture;

/// The fine structure of an object's surface (texture.h), as its file has it.
struct TextureSpec {
  enum class Kind {
    sine,       ///< ridges across `direction`
    trapezoid,  ///< the same with flat tops and smooth flanks
    cones,      ///< truncated cones on a square grid
    noise,      ///< 1/f^exponent between two wavelengths
    image,      ///< the grey values of a picture, white: a crest
  };
  Kind kind = Kind::sine;
  double period = 0.002;    ///< m; cones: their mean spacing; noise: the shortest wave
  double depth = 0;         ///< m, from crest to valley; 0: a smooth surface
  Vec3 direction{1, 0, 0};  ///< unit, across the ridges, in the object's frame
  bool around = false;      ///< ridges along the meridians of +z, instead of `direction`
  double phase = 0;         ///< degrees; 0: a crest at the object's origin
  std::optional<double> ridge = std::nullopt;  ///< m, of a flat top; default period / 2
  std::optional<double> ramp = std::nullopt;   ///< m, of a flank; default period / 8
  double tip_radius = 0;   ///< m, of the ball that feels the texture; 0: a point
  double jitter = 0;       ///< of a cone's place, 0 to 1, of half the free way to its neighbours
  std::uint64_t seed = 0;  ///< of cones and noise
  double exponent = 1;     ///< noise
  std::optional<double> longest = std::nullopt;  ///< m, of waves of noise; default 16 periods
  std::string file_name;                         ///< image: as the scene or protocol names it
  std::string file;                              ///< image: resolved path
  std::shared_ptr<const std::string> file_bytes = nullptr;  ///< image: the PNG file
};

/// A force that depends on where the hand is or how it moves, without a surface. In the object's
/// frame, in which it moves.
struct FieldSpec {
  enum class Kind {
    constant,   ///< force
    spring,     ///< towards a ball
    channel,    ///< towards a tube about a segment
    viscous,    ///< -B v
    curl,       ///< b axis x v
    vibration,  ///< amplitude sin(2 pi f t) along a direction
  };
  Kind kind = Kind::constant;
  bool at_grip = false;        ///< acts on the grip of the stylus; false: on its tip
  Vec3 force{0};               ///< N
  Vec3 centre{0};              ///< m; spring: the ball's; channel: one end of the segment
  Vec3 to{0};                  ///< m; channel: the other end
  double radius = 0;           ///< m; spring: of the ball; channel: half its width
  double stiffness = 0;        ///< N/m
  Mat3 damping{0};             ///< N s/m; curl: the scalar is damping[0][0]
  bool destabilising = false;  ///< viscous, curl: may feed energy
  double low_pass = 0.002;     ///< s, of the velocity
  Vec3 axis{0, 0, 1};          ///< unit; curl: right-handed about it; vibration: along it
  double amplitude = 0;        ///< N
  double frequency = 0;        ///< Hz
  bool always = false;         ///< vibration: also without contact
};

/// The knock of a contact: F_n += A v exp(-t/tau) sin(2 pi f t) from the first contact on, v the
/// speed of entry. Okamura, Dennerlein & Howe 1998.
struct TransientSpec {
  double amplitude = 10;   ///< N per m/s; 0: none
  double frequency = 100;  ///< Hz
  double decay = 0.01;     ///< s, tau
};

/// Mechanical properties of an object. Terms that are 0 or empty are left out of the tick.
struct Material {
  double stiffness = 800;       ///< N/m, along the contact normal, from the surface on
  double damping = 0;           ///< N s/m, along the contact normal
  double friction_static = 0;   ///< Coulomb's coefficient while the contact sticks; >= dynamic
  double friction_dynamic = 0;  ///< while it slides
  std::vector<Layer> layers;    ///< of other stiffness under the surface, by increasing depth
  /// In the frame of the mesh that carries the material; null: smooth.
  std::shared_ptr<const Texture> texture = nullptr;

  bool has_friction() const { return friction_static > 0; }
};

/// The material of a soft object.
struct Soft {
  enum class Fixed {
    base,    ///< the lowest nodes, local frame, at least three; a tenth of a sphere's height
    none,    ///< it moves freely
    points,  ///< the node nearest to each of `points`
  };
  double young = 20000;   ///< Pa
  double poisson = 0.45;  ///< 0 to 0.495
  double density = 1000;  ///< kg/m^3
  double damping = 0.01;  ///< s; ratio of viscosity to elastic modulus
  Fixed fixed = Fixed::base;
  std::vector<Vec3> points = {};  ///< m, local frame
  int resolution = 10;            ///< elements along the longest side
};

/// An object that moves as a rigid body.
struct Body {
  std::optional<double> mass = std::nullopt;     ///< kg; or
  std::optional<double> density = std::nullopt;  ///< kg/m^3
  Vec3 velocity{0, 0, 0};                        ///< m/s, of the centre of mass, at first
  Vec3 spin{0, 0, 0};                            ///< rad/s, at first
  double damping = 0;                            ///< 1/s, of velocity and spin
  double restitution = 0.5;  ///< of speed along the normal, in collisions with objects
  double friction = 0.3;     ///< Coulomb's coefficient, against objects; for the probe see Material
};

/// Local frames: sphere, cube, box and cylinder centred, cylinder axis +z; cone axis +z, apex at
/// +height/2, base at -height/2.
struct ObjectSpec {
  ShapeKind shape = ShapeKind::sphere;
  double radius = 0.03;   ///< m; sphere, cone, cylinder
  double height = 0.06;   ///< m; cone, cylinder
  double edge = 0.06;     ///< m; cube
  Vec3 size{0.06};        ///< m; box, its three edges
  int subdivisions = 4;   ///< sphere: an icosphere of 20 * 4^subdivisions triangles
  int segments = 64;      ///< cone, cylinder: corners of the rim
  std::string file_name;  ///< mesh: as the scene or protocol names its file
  std::string file;       ///< mesh: resolved path of a file that mesh_file.h reads
  double scale = 1;       ///< mesh: m for each unit of the file
  /// mesh: paths of all files read from the disk for it, including a .gltf's buffers.
  std::vector<std::string> files_read;
  /// mesh: the file's contents when the protocol was read, for the record; nullptr: read them from
  /// the disk, as for a scene.
  std::shared_ptr<const std::string> file_bytes;
  std::vector<ObjectSpec> parts;  ///< compound: placed relative to the compound
  Pose pose;
  Material material;
  std::optional<Body> body = std::nullopt;  ///< nullopt: it stands still
  std::optional<Soft> soft = std::nullopt;  ///< nullopt: it is rigid
  std::optional<TextureSpec> texture = std::nullopt;
  std::vector<FieldSpec> fields = {};
  std::optional<TransientSpec> transient = std::nullopt;
};

struct ShapeTraits {
  const char* name;                                   ///< in files
  bool radius = false, height = false, edge = false;  ///< the lengths that define it
  bool size = false;                                  ///< three of them
  bool subdivisions = false, segments = false;        ///< how finely it is tessellated
  /// Its surface is known exactly: it has a signed distance and local penetration depths, and the
  /// accuracy study uses it.
  bool analytic = false;
  /// Simulated participants model it by a formula (runner/participants/shape_lines.h); others by
  /// distances on a grid.
  bool formula = false;
};

constexpr ShapeTraits traits_of(ShapeKind shape) {
  switch (shape) {
    case ShapeKind::sphere:
      return {.name = "sphere",
              .radius = true,
              .subdivisions = true,
              .analytic = true,
              .formula = true};
    case ShapeKind::cone:
      return {.name = "cone",
              .radius = true,
              .height = true,
              .segments = true,
              .analytic = true,
              .formula = true};
    case ShapeKind::cylinder:
      return {.name = "cylinder",
              .radius = true,
              .height = true,
              .segments = true,
              .analytic = true,
              .formula = true};
    case ShapeKind::cube:
      return {.name = "cube", .edge = true, .analytic = true, .formula = true};
    case ShapeKind::box:
      return {.name = "box", .size = true, .analytic = true};
    case ShapeKind::mesh:
      return {.name = "mesh"};
    case ShapeKind::none:
      return {.name = "none"};
    case ShapeKind::compound:
      return {.name = "compound"};
  }
  throw std::invalid_argument("no such shape");
}

/// All shapes, in order of declaration; `compound` is the last one.
inline constexpr auto kShapes = [] {
  std::array<ShapeKind, static_cast<std::size_t>(ShapeKind::compound) + 1> all{};
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<ShapeKind>(i);
  return all;
}();

/// Poses within poses.
/// The pose, in the frame of the parent of `outer`, of an object that has the pose `inner` in the
/// frame of `outer`.
inline Pose compose(const Pose& outer, const Pose& inner) {
  return {outer.orientation * inner.position + outer.position,
          outer.orientation * inner.orientation};
}

}  // namespace palpate::stimuli
