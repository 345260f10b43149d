#include "runner/evidence/scenes/scene_study.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <glm/geometric.hpp>
#include <memory>
#include <set>
#include <utility>

#include "data/base/words.h"
#include "rendering/tool.h"
#include "runner/evidence/accuracy/methods.h"
#include "runner/evidence/accuracy/peers.h"
#include "runner/evidence/scenes/meshes.h"
#include "runner/evidence/tick_meters.h"
#include "runner/evidence/verification/random_draws.h"
#include "runner/evidence/verification/surface_reference.h"
#include "runner/evidence/verification/surface_stroke.h"
#include "runner/scene_builder.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence {
namespace {

using stimuli::ObjectSpec;
using stimuli::ShapeKind;

constexpr std::size_t kMostTicks = 20'000;  // compared; the reference takes a millisecond for each
constexpr std::size_t kMostObjects = 4;     // stroked
// Of a reference for an analytic shape: 4 times finer than the scene's own mesh, so that its own
// error is a sixteenth, at least the first and at most the second of these.
constexpr int kFineBall = 6, kFinestBall = 8, kFineRim = 1024, kFinestRim = 4096;
constexpr std::size_t kFewTriangles = 100;  // a coarser mesh of these is another object
constexpr int kSmallSteps = 8;              // of a reference with bodies, in a tick

/// The result of a method, or the exact one, for a tick.
struct Answer {
  bool touching = false, known = true, torque_defined = true;
  Vec3 force{0}, torque{0};
  std::optional<Vec3> tip = std::nullopt;  ///< m, ideal
};

class Shower {
 public:
  Shower() = default;
  Shower(const Shower&) = delete;
  Shower& operator=(const Shower&) = delete;
  virtual ~Shower() = default;
  /// \param dt  s since the last tick
  virtual Answer tick(const touch::TimedPose& pose, double dt) = 0;
};

/// The renderer over a compiled scene.
class Law final : public Shower {
 public:
  Law(std::shared_ptr<const rendering::Scene> scene, const rendering::Renderer& renderer)
      : scene_(std::move(scene)), renderer_(renderer), state_(scene_->initial_state()) {}

  Answer tick(const touch::TimedPose& pose, double dt) override {
    state_.measured_side = pose.side;
    const rendering::Rendering r = renderer_.tick(*scene_, state_, pose.probe, dt);
    return {.touching = r.contacts > 0, .force = r.force, .torque = r.torque, .tip = r.ideal.tip};
  }

 private:
  std::shared_ptr<const rendering::Scene> scene_;
  const rendering::Renderer& renderer_;
  rendering::RenderState state_;
};

/// The same in steps of an eighth of a tick.
class SmallSteps final : public Shower {
 public:
  SmallSteps(std::shared_ptr<const rendering::Scene> scene, const rendering::Renderer& renderer)
      : law_(std::move(scene), renderer) {}

  Answer tick(const touch::TimedPose& pose, double dt) override {
    if (!last_) last_ = pose;
    Answer answer;
    for (int i = 1; i <= kSmallSteps; ++i) {
      const double share = i / static_cast<double>(kSmallSteps);
      touch::TimedPose between = pose;
      between.probe.tip = glm::mix(last_->probe.tip, pose.probe.tip, share);
      between.probe.tail = glm::mix(last_->probe.tail, pose.probe.tail, share);
      answer = law_.tick(between, dt / kSmallSteps);
    }
    last_ = pose;
    return answer;
  }

 private:
  Law law_;
  std::optional<touch::TimedPose> last_;
};

/// The segments of the tool of a scene at a pose, from the tip. The same for reference and peers.
class ToolPlaces {
 public:
  ToolPlaces(const rendering::Scene& scene, bool sides) : tool_(scene.tool()), sides_(sides) {}

  const rendering::PlacedTool& at(const touch::TimedPose& pose) {
    rendering::ToolPose place{pose.probe.tip, pose.probe.tail - pose.probe.tip};
    if (tool_ != nullptr) {
      place.frame = rendering::tool_frame(place.d, started_ ? &frame_ : nullptr, pose.side);
      frame_ = place.frame;
      started_ = true;
    }
    rendering::place(tool_, sides_, place, placed_);
    return placed_;
  }

 private:
  const rendering::Tool* tool_;
  bool sides_, started_ = false;
  Mat3 frame_{1};
  rendering::PlacedTool placed_;
};

/// The triangles of one ideal tool's solid.
using Solid = std::vector<ReferenceTriangle>;

void add_part(const rendering::ScenePart& part, int shell, Solid& out) {
  const auto world = [&part](const Vec3& v) { return part.world_vector(v) + part.position; };
  const stimuli::PolygonSoup soup = part.mesh->polygons();
  for (const auto& face : soup.faces) {
    for (std::size_t i = 1; i + 1 < face.size(); ++i) {
      out.push_back({{world(soup.vertices[face[0]]), world(soup.vertices[face[i]]),
                      world(soup.vertices[face[i + 1]])},
                     part.material.stiffness,
                     shell});
    }
  }
}

void add_surface(const rendering::PlacedSurface& placed, Solid& out) {
  const stimuli::Surface& surface = *placed.surface;
  for (const stimuli::SurfaceTriangle& t : surface.triangles()) {
    if (t.is_back()) continue;
    ReferenceTriangle triangle;
    for (std::size_t k = 0; k < 3; ++k)
      triangle.corners[k] = placed.world_vector(surface.vertices()[t.corners[k]]) + placed.position;
    triangle.stiffness = surface.materials()[t.shell].stiffness;
    triangle.shell = static_cast<int>(t.shell);
    out.push_back(triangle);
  }
}

/// One for each ideal tool that is felt.
std::vector<Solid> solids_of(const rendering::Scene& scene) {
  std::vector<Solid> all;
  for (const rendering::PartGroup& group : scene.groups()) {
    if (!group.felt) continue;
    Solid solid;
    if (group.surface != rendering::PartGroup::kParts) {
      add_surface(scene.surfaces()[group.surface], solid);
    } else {
      for (std::uint32_t k = 0; k < group.part_count; ++k)
        add_part(scene.parts()[group.first_part + k], static_cast<int>(k), solid);
    }
    if (!solid.empty()) all.push_back(std::move(solid));
  }
  return all;
}

std::size_t triangles_in(const rendering::Scene& scene) {
  std::size_t count = 0;
  for (const Solid& solid : solids_of(scene)) count += solid.size();
  return count;
}

/// The definition, by brute force.
class ByReference final : public Shower {
 public:
  ByReference(const std::vector<Solid>& solids, const rendering::Scene& scene, bool sides)
      : tool_(scene, sides) {
    for (const Solid& solid : solids) references_.emplace_back(solid);
  }

  Answer tick(const touch::TimedPose& pose, double) override {
    const rendering::PlacedTool& placed = tool_.at(pose);
    rods_.clear();
    for (std::size_t i = 0; i < placed.count; ++i) {
      const rendering::PlacedSegment& s = placed.segments[i];
      rods_.push_back({s.from, s.from + s.along});
    }
    Answer out;
    out.tip = pose.probe.tip;
    double deepest = 0;
    for (SurfaceReference& reference : references_) {
      const ReferenceTick tick = reference.tick({pose.probe.tip, rods_});
      out.touching |= tick.touching;
      out.known &= tick.known;
      out.torque_defined &= tick.torque_defined;
      out.force += tick.force;
      out.torque += tick.torque;
      if (glm::length(tick.shift) <= deepest) continue;
      deepest = glm::length(tick.shift);
      out.tip = pose.probe.tip + tick.shift;
    }
    return out;
  }

  /// Whether a virtual tool would be inside a solid.
  bool inside(const touch::TimedPose& pose) {
    tick(pose, 0);
    return std::ranges::any_of(references_, [&](const SurfaceReference& reference) {
      return reference.inside({pose.probe.tip, rods_});
    });
  }
  /// Whether an ideal tool is inside its solid.
  bool ideal_inside() const {
    return std::ranges::any_of(references_, [&](const SurfaceReference& reference) {
      return reference.inside({reference.ideal_tip(), rods_});
    });
  }

 private:
  ToolPlaces tool_;
  std::vector<SurfaceReference> references_;
  std::vector<ReferenceSegment> rods_;
};

/// Another library: for each solid a spring along its deepest contact.
class ByPeer final : public Shower {
 public:
  ByPeer(std::shared_ptr<const rendering::Scene> scene, bool sides, const PeerLibrary& library)
      : scene_(std::move(scene)), tool_(*scene_, sides) {
    for (const rendering::PartGroup& group : scene_->groups()) {
      if (!group.felt) continue;
      solids_.emplace_back();
      if (group.surface != rendering::PartGroup::kParts) {
        add(scene_->surfaces()[group.surface], library);
      } else {
        for (std::uint32_t k = 0; k < group.part_count; ++k) {
          const rendering::ScenePart& part = scene_->parts()[group.first_part + k];
          solids_.back().push_back({library.make(*part.mesh), part.to_world, part.position,
                                    part.sphere_centre, part.sphere_radius,
                                    part.material.stiffness});
        }
      }
    }
  }

  Answer tick(const touch::TimedPose& pose, double) override {
    const rendering::PlacedTool& placed = tool_.at(pose);
    Answer out;
    for (std::vector<Piece>& solid : solids_) {
      double depth = 0, stiffness = 0;
      Vec3 normal{0}, point{0};
      for (Piece& piece : solid) {
        for (std::size_t i = 0; i < placed.count; ++i) {
          const rendering::PlacedSegment& s = placed.segments[i];
          const rendering::LineProbe rod{pose.probe.tip + s.from,
                                         pose.probe.tip + s.from + s.along};
          if (!piece.reaches(rod)) continue;
          const PeerContact contact = piece.peer->contact(piece.local(rod));
          if (!(contact.depth > depth)) continue;
          depth = contact.depth;
          stiffness = piece.stiffness;
          normal = piece.to_world * contact.normal;
          point = piece.to_world * contact.point + piece.position;
        }
      }
      if (!(depth > 0)) continue;
      out.touching = true;
      const Vec3 force = stiffness * depth * normal;
      out.force += force;
      out.torque += glm::cross(point - pose.probe.tip, force);
    }
    return out;
  }

 private:
  struct Piece {
    std::unique_ptr<Peer> peer;
    Mat3 to_world;
    Vec3 position, centre;
    double radius = 0, stiffness = 0;

    bool reaches(const rendering::LineProbe& rod) const {
      const Vec3 d = rod.tail - rod.tip;
      const double length2 = glm::dot(d, d);
      const double share =
          length2 > 0 ? std::clamp(glm::dot(centre - rod.tip, d) / length2, 0.0, 1.0) : 0.0;
      return glm::distance(centre, rod.tip + share * d) <= radius;
    }
    rendering::LineProbe local(const rendering::LineProbe& rod) const {
      const Mat3 back = glm::transpose(to_world);
      return {back * (rod.tip - position), back * (rod.tail - position)};
    }
  };

  void add(const rendering::PlacedSurface& placed, const PeerLibrary& library) {
    const stimuli::Surface& surface = *placed.surface;
    PeerMesh mesh;
    mesh.vertices.assign(surface.vertices().begin(), surface.vertices().end());
    for (const stimuli::SurfaceTriangle& t : surface.triangles()) {
      if (!t.is_back()) mesh.triangles.push_back(t.corners);
    }
    mesh.centre = surface.centre();
    mesh.radius = surface.radius();
    solids_.back().push_back({library.make_mesh(mesh), placed.to_world, placed.position,
                              placed.sphere_centre, placed.sphere_radius,
                              surface.materials().front().stiffness});
  }

  std::shared_ptr<const rendering::Scene> scene_;
  ToolPlaces tool_;
  std::vector<std::vector<Piece>> solids_;
};

/// Springs on smooth surfaces alone: they have an exact answer.
ObjectSpec springs_of(ObjectSpec object) {
  object.texture.reset();
  object.fields.clear();
  object.transient.reset();
  stimuli::Material& m = object.material;
  m.damping = m.friction_static = m.friction_dynamic = 0;
  for (stimuli::Layer& layer : m.layers) {
    layer.damping = 0;
    layer.break_force.reset();
  }
  for (ObjectSpec& part : object.parts) part = springs_of(part);
  return object;
}

/// Adds the names of what springs_of() leaves out.
void name_left_out(const ObjectSpec& object, std::set<std::string>& names) {
  const stimuli::Material& m = object.material;
  if (m.damping != 0) names.insert("damping");
  if (m.has_friction()) names.insert("friction");
  for (const stimuli::Layer& layer : m.layers) {
    if (layer.damping != 0) names.insert("damping");
    if (layer.break_force) names.insert("breaking");
  }
  if (object.texture) names.insert("texture");
  if (!object.fields.empty()) names.insert("fields");
  if (object.transient) names.insert("knocks");
  for (const ObjectSpec& part : object.parts) name_left_out(part, names);
}

/// With so fine a mesh that its facets add little to an error. \param fine  cleared if it has none
ObjectSpec finest(ObjectSpec object, bool& fine) {
  const stimuli::ShapeTraits traits = stimuli::traits_of(object.shape);
  if (traits.subdivisions) {
    fine &= object.subdivisions + 2 <= kFinestBall;
    object.subdivisions =
        std::max(object.subdivisions, std::clamp(object.subdivisions + 2, kFineBall, kFinestBall));
  }
  if (traits.segments) {
    fine &= 4 * object.segments <= kFinestRim;
    object.segments =
        std::max(object.segments, std::clamp(4 * object.segments, kFineRim, kFinestRim));
  }
  if (object.soft && object.soft->resolution > 0) object.soft->resolution *= 2;
  for (ObjectSpec& part : object.parts) part = finest(part, fine);
  return object;
}

bool is_tessellated(const ObjectSpec& object) {
  const stimuli::ShapeTraits traits = stimuli::traits_of(object.shape);
  return traits.subdivisions || traits.segments ||
         std::ranges::any_of(object.parts, is_tessellated);
}

/// With a 4^-level of the triangles. \param changed  set if it is not as it was
ObjectSpec coarser(ObjectSpec object, int level, bool& changed, int& number) {
  const stimuli::ShapeTraits traits = stimuli::traits_of(object.shape);
  if (traits.subdivisions && object.subdivisions > level) {
    object.subdivisions -= level;
    changed = true;
  }
  if (traits.segments && object.segments >> (2 * level) >= 5) {
    object.segments >>= 2 * level;
    changed = true;
  }
  if (object.soft && object.soft->resolution >= 4 << (level - 1)) {
    object.soft->resolution >>= level;
    changed = true;
  }
  if (object.shape == ShapeKind::mesh && !object.soft) {
    const stimuli::ClosedSurface surface =
        stimuli::closed_surface(stimuli::polygons_of(object)).surface;
    const std::size_t wanted = surface.triangles.size() >> (2 * level);
    if (wanted >= kFewTriangles) {
      ObjectSpec mesh =
          mesh_object(coarsened(surface, wanted),
                      "coarser-" + std::to_string(level) + "-" + std::to_string(number++) + ".obj");
      mesh.pose = object.pose;
      mesh.material = object.material;
      mesh.body = object.body;
      object = std::move(mesh);
      changed = true;
    }
  }
  for (ObjectSpec& part : object.parts) part = coarser(part, level, changed, number);
  return object;
}

/// A method and how to begin with it.
struct Method {
  std::string name, description;
  std::size_t triangles = 0;
  std::function<std::unique_ptr<Shower>()> compared, timed;
};

/// All there is to compare in one scene.
class Study {
 public:
  Study(StudiedScene scene, const SceneStudySettings& settings)
      : scene_(std::move(scene)),
        settings_(settings),
        renderer_(renderer_for(settings.ray ? protocols::RendererKind::ray
                                            : protocols::RendererKind::point)) {
    out_.name = scene_.name;
    out_.renderer = renderer_.name();
    springs_ = scene_.spec;
    std::set<std::string> left_out;
    for (ObjectSpec& object : springs_.objects) {
      name_left_out(object, left_out);
      bodies_ |= object.body.has_value();
      soft_ |= object.soft.has_value();
      object = springs_of(object);
    }
    if (!left_out.empty()) {
      out_.notes.push_back(
          "Errors are those of springs on smooth surfaces. Left out of them, not of the times: " +
          listed({left_out.begin(), left_out.end()}) + ".");
    }
    if (scene_.spec.reach) {
      out_.notes.emplace_back(
          "The virtual stylus is compared: the reach stretches the path, and forces are those on "
          "the virtual stylus.");
    }
    compiled_ = compile(springs_);
    whole_ = compile(scene_.spec);
    set_truth();
    set_paths();
    set_methods();
  }

  SceneStudy run(const std::function<void(double)>& progress) {
    const double steps = static_cast<double>(methods_.size()) + 2;
    double done = 0;
    std::vector<std::vector<Answer>> truth;
    for (const auto& path : scene_.paths) {
      progress(done++ / static_cast<double>(scene_.paths.size()) * 2 / steps);
      truth.push_back(answers_of_truth(path));
    }
    done = 2;
    for (const Method& method : methods_) {
      progress(done++ / steps);
      SceneRow row;
      row.method = method.name;
      row.description = method.description;
      row.triangles = method.triangles;
      if (truth_) row.errors = errors_of(method, truth);
      time(method, truth, row);
      out_.rows.push_back(std::move(row));
    }
    mark_best();
    choose();
    progress(1);
    return std::move(out_);
  }

 private:
  using Path = std::vector<touch::TimedPose>;

  std::shared_ptr<const rendering::Scene> compile(const protocols::SceneSpec& spec) const {
    SceneBuilder builder;
    return std::make_shared<const rendering::Scene>(
        touch::build_scene(builder, scene_.name, spec, renderer_));
  }

  void set_truth() {
    protocols::SceneSpec fine = springs_;
    bool refined = false, far_finer = true;
    for (ObjectSpec& object : fine.objects) {
      refined |= is_tessellated(object) && !object.soft;
      object = finest(object, far_finer);
    }
    if (!far_finer && !soft_) {
      out_.notes.emplace_back(
          "A mesh of this scene is so fine that the one it is compared with is not 4 times finer: "
          "errors "
          "leave out a part of that of its facets.");
    }
    if (bodies_ || soft_) {
      const bool fixed_elements = std::ranges::any_of(springs_.objects, [](const ObjectSpec& one) {
        return one.soft && (one.shape == ShapeKind::mesh || one.soft->resolution == 0);
      });
      if (fixed_elements) {
        out_.truth = "none";
        out_.notes.emplace_back(
            "No errors: the elements of a soft body cannot be made finer here (a .msh file, or no "
            "\"resolution\": state one for a shape).");
        return;
      }
      out_.truth = soft_ ? "this renderer with twice as many elements along each side"
                         : "this renderer in steps of an eighth of a tick, on finer meshes";
      std::shared_ptr<const rendering::Scene> scene;
      try {
        scene = compile(fine);
      } catch (const stimuli::MeshError& error) {
        out_.truth = "none";
        out_.notes.push_back("No errors: a finer scene is refused (" + error.faults().front() +
                             ").");
        return;
      }
      truth_ = [this, scene]() -> std::unique_ptr<Shower> {
        if (soft_) return std::make_unique<Law>(scene, renderer_);
        return std::make_unique<SmallSteps>(scene, renderer_);
      };
      return;
    }
    out_.truth = refined ? "the ideal tool by its definition, by brute force, on finer meshes of "
                           "the analytic shapes"
                         : "the ideal tool by its definition, by brute force over all triangles";
    finest_ = refined ? compile(fine) : compiled_;
    solids_ = solids_of(*finest_);
    by_definition_ = true;
    truth_ = [this] {
      return std::make_unique<ByReference>(solids_, *finest_, renderer_.side_contact());
    };
  }

  void set_paths() {
    if (scene_.paths.empty()) {
      for (std::size_t i = 0; i < std::min(kMostObjects, scene_.spec.objects.size()); ++i)
        stroke(scene_.spec.objects[i], i);
      if (scene_.spec.objects.size() > kMostObjects)
        out_.notes.push_back("Only the first " + std::to_string(kMostObjects) +
                             " objects are stroked.");
    } else {
      for (Path& path : scene_.paths) {
        for (touch::TimedPose& pose : path)
          pose.probe = touch::virtual_stylus(scene_.spec, pose.probe);
        if (path.size() <= kMostTicks) continue;
        path.resize(kMostTicks);
        out_.notes.push_back("Only the first " + std::to_string(kMostTicks) +
                             " rows of the path are compared.");
      }
    }
    for (const Path& path : scene_.paths) out_.ticks += path.size();
  }

  /// A hand that follows the object by the law's depth; the path is then the same for all.
  void stroke(const ObjectSpec& object, std::size_t number) {
    constexpr int kTries = 16;
    const auto [centre, radius] = sphere_of(object);
    for (int attempt = 0; attempt < kTries; ++attempt) {
      SurfaceStrokeSettings hand;
      hand.centre = centre;
      hand.radius = radius;
      hand.side = settings_.ray;
      hand.seed = settings_.seed + 1000 * number + static_cast<std::uint64_t>(attempt);
      hand.lifted = 0.1;
      SurfaceStroke stroke(hand);
      Law law(compiled_, renderer_);
      Path path;
      double depth = 0;
      for (int i = 0; i < settings_.ticks; ++i) {
        touch::TimedPose pose;
        pose.t = 1e-3 * i;
        pose.probe = stroke.next(depth);
        if (i == 0 && by_definition_ && ByReference(solids_, *finest_, settings_.ray).inside(pose))
          break;
        const Answer answer = law.tick(pose, i > 0 ? 1e-3 : 0);
        depth = answer.touching ? glm::distance(*answer.tip, pose.probe.tip) : 0;
        path.push_back(pose);
      }
      if (path.empty()) continue;
      scene_.paths.push_back(std::move(path));
      return;
    }
    out_.notes.push_back("Object " + std::to_string(number) +
                         " is not stroked: the tool has no place beside it.");
  }

  static std::pair<Vec3, double> sphere_of(const ObjectSpec& object) {
    std::vector<Vec3> corners;
    if (object.soft && object.shape == ShapeKind::mesh) return {object.pose.position, 0.03};
    add_corners(object, object.pose, corners);
    Vec3 low(HUGE_VAL), high(-HUGE_VAL);
    for (const Vec3& v : corners) {
      low = glm::min(low, v);
      high = glm::max(high, v);
    }
    const Vec3 centre = 0.5 * (low + high);
    double radius = 0;
    for (const Vec3& v : corners) radius = std::max(radius, glm::distance(v, centre));
    return {centre, radius};
  }

  void add_law(const std::string& name, const std::string& description,
               const std::shared_ptr<const rendering::Scene>& springs,
               const std::shared_ptr<const rendering::Scene>& whole) {
    methods_.push_back({name, description, triangles_in(*whole),
                        [this, springs] { return std::make_unique<Law>(springs, renderer_); },
                        [this, whole] { return std::make_unique<Law>(whole, renderer_); }});
  }

  /// \param of  makes another scene of one; returns whether it differs
  void try_law(const std::string& name, const std::string& description,
               const std::function<bool(protocols::SceneSpec&)>& of) {
    try {
      protocols::SceneSpec springs = springs_, whole = scene_.spec;
      if (!of(springs) || !of(whole)) return;
      add_law(name, description, compile(springs), compile(whole));
    } catch (const stimuli::MeshError& error) {
      out_.notes.push_back("No row \"" + name + "\": " + error.faults().front() + ".");
    }
  }

  void set_methods() {
    add_law("law", "this program's renderer on the scene as it is", compiled_, whole_);
    for (const int level : {1, 2}) {
      try_law(level == 1 ? "law, a quarter" : "law, a sixteenth",
              level == 1 ? "the same with a quarter of the triangles"
                         : "the same with a sixteenth of the triangles",
              [level](protocols::SceneSpec& spec) {
                bool changed = false;
                int number = 0;
                for (ObjectSpec& object : spec.objects)
                  object = coarser(object, level, changed, number);
                return changed;
              });
    }
    const bool convex =
        compiled_->surfaces().empty() && compiled_->parts().size() <= scene_.spec.objects.size();
    if (convex || bodies_ || soft_) {
      out_.notes.emplace_back(convex ? "No row \"hull\": every object is convex."
                                     : "No row \"hull\": something moves or gives.");
    } else {
      try_law("hull", "the same on the convex hull of each object", [](protocols::SceneSpec& spec) {
        int number = 0;
        for (ObjectSpec& object : spec.objects) object = hull_of(object, number++);
        return true;
      });
    }
    add_peers();
  }

  void add_peers() {
    if (bodies_ || soft_) {
      out_.notes.emplace_back("No other libraries: something moves or gives.");
      return;
    }
    for (const PeerLibrary& library : peer_libraries()) {
      if (library.make == nullptr) {
        out_.notes.push_back(std::string("Method ") + library.name +
                             ": absent from this build (PALPATE_PEERS).");
        continue;
      }
      const std::string how = compiled_->surfaces().empty() ? library.method : library.mesh_method;
      const auto make = [this, &library] {
        return std::make_unique<ByPeer>(compiled_, settings_.ray, library);
      };
      methods_.push_back({library.name,
                          std::string(library.name) + " " + library.version + ", " + how,
                          triangles_in(*compiled_), make, make});
    }
  }

  static double step_of(const Path& path, std::size_t i) {
    return i > 0 ? path[i].t - path[i - 1].t : 0;
  }

  std::vector<Answer> answers_of_truth(const Path& path) {
    std::vector<Answer> all;
    const std::unique_ptr<Shower> shower =
        truth_ ? truth_() : std::make_unique<Law>(compiled_, renderer_);
    const auto* reference = dynamic_cast<const ByReference*>(shower.get());
    constexpr std::size_t kTriedEach = 25;
    for (std::size_t i = 0; i < path.size(); ++i) {
      all.push_back(shower->tick(path[i], step_of(path, i)));
      out_.touching += all.back().touching ? 1 : 0;
      out_.unknown += all.back().known ? 0 : 1;
      if (reference == nullptr || !all.back().touching || i % kTriedEach != 0) continue;
      ++out_.tried;
      out_.found_inside += reference->ideal_inside() ? 1 : 0;
    }
    return all;
  }

  SceneErrors errors_of(const Method& method, const std::vector<std::vector<Answer>>& truth) {
    SceneErrors errors;
    std::vector<double> force;
    for (std::size_t p = 0; p < scene_.paths.size(); ++p) {
      const Path& path = scene_.paths[p];
      const std::unique_ptr<Shower> shower = method.compared();
      for (std::size_t i = 0; i < path.size(); ++i) {
        const Answer answer = shower->tick(path[i], step_of(path, i));
        const Answer& exact = truth[p][i];
        if (!exact.known || (!exact.touching && !answer.touching)) continue;
        errors.lost += exact.touching && !answer.touching ? 1 : 0;
        errors.phantom += !exact.touching && answer.touching ? 1 : 0;
        force.push_back(glm::distance(answer.force, exact.force));
        if (settings_.ray && exact.torque_defined && exact.touching) {
          errors.torque_max =
              std::max(errors.torque_max.value_or(0), glm::distance(answer.torque, exact.torque));
        }
        if (answer.tip) {
          errors.tip_max =
              std::max(errors.tip_max.value_or(0), glm::distance(*answer.tip, *exact.tip));
        }
      }
    }
    const ErrorSpread spread = error_spread(std::move(force));
    errors.ticks = spread.count;
    errors.force_rms = spread.rms;
    errors.force_p999 = spread.p999;
    errors.force_max = spread.worst;
    return errors;
  }

  void time(const Method& method, const std::vector<std::vector<Answer>>& truth, SceneRow& row) {
    row.median_ns = row.p99_ns = HUGE_VAL;
    for (int round = 0; round < settings_.rounds; ++round) {
      std::vector<std::uint64_t> counts = time_once(method, truth, false);
      if (counts.empty()) return;
      row.timed += counts.size();
      std::ranges::sort(counts);
      row.median_ns = std::min(row.median_ns, at(counts, 0.5));
      row.p99_ns = std::min(row.p99_ns, at(counts, 0.99));
      row.worst_ns = std::max(row.worst_ns, at(counts, 1));
    }
    std::vector<std::uint64_t> cold = time_once(method, truth, true);
    std::ranges::sort(cold);
    row.cold_median_ns = at(cold, 0.5);
    row.cold_p99_ns = at(cold, 0.99);
  }

  double at(const std::vector<std::uint64_t>& sorted, double share) const {
    if (sorted.empty()) return 0;
    return ns_ *
           static_cast<double>(
               sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))]);
  }

  std::vector<std::uint64_t> time_once(const Method& method,
                                       const std::vector<std::vector<Answer>>& truth, bool cold) {
    std::vector<std::uint64_t> counts;
    for (std::size_t p = 0; p < scene_.paths.size(); ++p) {
      const Path& path = scene_.paths[p];
      const std::unique_ptr<Shower> shower = method.timed();
      for (std::size_t i = 0; i < path.size(); ++i) {
        if (cold && counts.size() >= settings_.cold) return counts;
        const bool counts_here = out_.touching == 0 || truth[p][i].touching;
        if (cold && counts_here) sweep();
        const double dt = step_of(path, i);
        const std::uint64_t start = begin_count();
        const Answer answer = shower->tick(path[i], dt);
        const std::uint64_t count = end_count() - start;
        if (counts_here && std::isfinite(answer.force.x)) counts.push_back(count);
      }
    }
    return counts;
  }

  void sweep() {
    constexpr std::size_t kLine = 64;
    for (std::size_t i = 0; i < swept_.size(); i += kLine) ++swept_[i];
  }

  void mark_best() {
    for (SceneRow& row : out_.rows) {
      if (!row.errors) continue;
      row.best = std::ranges::none_of(out_.rows, [&row](const SceneRow& other) {
        return &other != &row && other.errors && other.median_ns <= row.median_ns &&
               other.errors->force_rms <= row.errors->force_rms &&
               (other.median_ns < row.median_ns || other.errors->force_rms < row.errors->force_rms);
      });
    }
  }

  double stiffest() const {
    double most = 0;
    for (std::uint32_t i = 0; i < compiled_->materials(); ++i)
      most = std::max(most, compiled_->material_of(i).stiffness);
    return most;
  }

  /// The quickest whose force is within what a device resolves, 99.9 % of the time.
  void choose() {
    const double limit = kResolved * stiffest();
    constexpr double kAsNear = 1.05;  // times the least error: then the quicker one
    double least = HUGE_VAL;
    for (const SceneRow& row : out_.rows) {
      if (row.errors && row.errors->ticks > 0) least = std::min(least, row.errors->force_rms);
    }
    const SceneRow *quickest = nullptr, *nearest = nullptr;
    for (const SceneRow& row : out_.rows) {
      if (!row.errors || row.errors->ticks == 0) continue;
      if (row.errors->force_rms <= kAsNear * least &&
          (nearest == nullptr || row.median_ns < nearest->median_ns))
        nearest = &row;
      if (row.errors->force_p999 > limit && limit > 0) continue;
      if (quickest == nullptr || row.median_ns < quickest->median_ns) quickest = &row;
    }
    char text[400];
    if (out_.touching == 0) {
      out_.choose = "Nothing to choose: nothing is touched on this path.";
    } else if (nearest == nullptr) {
      out_.choose = "Nothing to choose: no exact answer is known for this scene.";
    } else if (quickest != nullptr) {
      std::snprintf(
          text, sizeof text,
          "Choose \"%s\": the quickest (median %.2f us, p99 %.2f us) of those whose force "
          "is within what a device resolves (0.03 mm, here %.2g N) in 99.9 %% of ticks.",
          quickest->method.c_str(), 1e-3 * quickest->median_ns, 1e-3 * quickest->p99_ns, limit);
      out_.choose = text;
    } else {
      std::snprintf(
          text, sizeof text,
          "Choose \"%s\": the nearest (rms %.2g N, 99.9 %% within %.2g N), though none is "
          "within what a device resolves (0.03 mm, here %.2g N).",
          nearest->method.c_str(), nearest->errors->force_rms, nearest->errors->force_p999, limit);
      out_.choose = text;
    }
  }

  static constexpr std::size_t kSwept = 6 << 20;  // bytes; more than a core's second cache has

  StudiedScene scene_;
  SceneStudySettings settings_;
  const rendering::Renderer& renderer_;
  SceneStudy out_;
  protocols::SceneSpec springs_;
  bool bodies_ = false, soft_ = false, by_definition_ = false;
  std::shared_ptr<const rendering::Scene> compiled_, whole_, finest_;
  std::vector<Solid> solids_;
  std::function<std::unique_ptr<Shower>()> truth_;
  std::vector<Method> methods_;
  std::vector<char> swept_ = std::vector<char>(kSwept);
  double ns_ = nanoseconds_per_count();
};

}  // namespace

SceneStudy study_scene(StudiedScene scene, const SceneStudySettings& settings,
                       const std::function<void(double)>& progress) {
  return Study(std::move(scene), settings).run(progress);
}

std::vector<StudiedScene> study_scenes() {
  std::vector<StudiedScene> all;
  const auto add = [&all](const char* name, std::vector<ObjectSpec> objects) -> StudiedScene& {
    StudiedScene scene;
    scene.name = name;
    scene.spec.objects = std::move(objects);
    all.push_back(std::move(scene));
    return all.back();
  };
  const auto shape = [](ShapeKind kind) {
    ObjectSpec object;
    object.shape = kind;
    return object;
  };
  const auto at = [](ObjectSpec object, const Vec3& place) {
    object.pose.position = place;
    return object;
  };
  for (const ShapeKind kind :
       {ShapeKind::sphere, ShapeKind::cone, ShapeKind::cylinder, ShapeKind::cube})
    add(stimuli::traits_of(kind).name, {shape(kind)});

  ObjectSpec ball = shape(ShapeKind::sphere), bar = shape(ShapeKind::cylinder);
  ball.radius = 0.015;
  bar.radius = 0.006;
  ObjectSpec dumbbell = shape(ShapeKind::compound);
  dumbbell.parts = {at(ball, Vec3(0, 0, 0.03)), at(ball, Vec3(0, 0, -0.03)), bar};
  add("dumbbell (compound)", {dumbbell});

  const ObjectSpec gear_object = mesh_object(gear(12), "gear.obj");
  add("gear (closed surface)", {gear_object});
  add("plate with bores (closed surface)", {mesh_object(plate_with_bores(3), "plate.obj")});
  add("scan (closed surface)", {mesh_object(scan(5), "scan.obj")});

  ObjectSpec layered = shape(ShapeKind::cube);
  layered.material.stiffness = 300;
  layered.material.layers = {{.depth = 0.001, .stiffness = 800}};
  add("cube with a layer", {layered});

  StudiedScene& cross = add("gear, tool of three segments", {gear_object});
  cross.spec.tool.segments = {{Vec3(0), Vec3(0, 0, 0.12)},
                              {Vec3(-0.01, 0, 0), Vec3(0.01, 0, 0)},
                              {Vec3(0, -0.01, 0), Vec3(0, 0.01, 0)}};

  ObjectSpec loose = shape(ShapeKind::cube);
  loose.body = stimuli::Body{.mass = 2, .damping = 20};
  add("cube that moves (2 kg)", {loose});

  ObjectSpec soft = shape(ShapeKind::cube);
  soft.soft = stimuli::Soft{.resolution = 4};
  add("soft cube (20 kPa)", {soft});
  return all;
}

}  // namespace palpate::runner::evidence
