#pragma once
// What the extreme cases share: a scene whose every tick is audited. Included by extreme_*.cpp
// alone.

#include <algorithm>
#include <cstdint>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "rendering/verification/extreme_cases.h"
#include "rendering/verification/random_paths.h"
#include "rendering/verification/tick_audit.h"

namespace palpate::rendering::extremes {

using MeshPointer = std::shared_ptr<const stimuli::ConvexMesh>;

inline MeshPointer solid(const stimuli::PolygonSoup& soup) {
  return std::make_shared<const stimuli::ConvexMesh>(soup);
}

inline constexpr double kStylus = 0.12;  // m
inline constexpr double kRounding =
    1e-9;  // of the object's size: smaller errors of lengths are none
inline constexpr const char* kLengthError = "worst error of a length, sizes of the object";

/// One object under a renderer, every tick compared with the reference.
class AuditedScene {
 public:
  AuditedScene(const Renderer& renderer, MeshPointer mesh, const Pose& pose = {})
      : renderer_(renderer),
        mesh_(std::move(mesh)),
        pose_(pose),
        scene_({{mesh_, pose, stimuli::Material{}, 0, nullptr}}, renderer.side_contact()),
        state_(scene_.initial_state()) {}

  const stimuli::ConvexMesh& mesh() const { return *mesh_; }
  const Renderer& renderer() const { return renderer_; }

  LineProbe to_world(const LineProbe& p) const {
    return {pose_.orientation * p.tip + pose_.position,
            pose_.orientation * p.tail + pose_.position};
  }

  Rendering tick(const LineProbe& world) { return renderer_.tick(scene_, state_, world, 1e-3); }

  /// A tick that must be right; probe in the object's frame.
  Rendering audited_tick(const LineProbe& local) {
    const LineProbe world = to_world(local);
    Rendering r = tick(world);
    const TickAudit audit = audit_tick(scene_, renderer_, world, r, kRounding);
    ++result_.ticks;
    result_.in_contact += r.contacts > 0;
    // The rounding that a distance from the origin and a long probe add does not count.
    const double rounding = audit.tolerance - kRounding * mesh_->size();
    const double error = std::max({audit.missed, audit.penetrates, audit.floats, audit.shallow});
    result_.worst = std::max(result_.worst, std::max(0.0, error - rounding) / mesh_->size());
    if ((!audit.good() || r.faults != 0) && result_.detail.empty()) {
      std::ostringstream out;
      out << renderer_.name() << ", tick " << result_.ticks << ": missed " << audit.missed
          << " m, penetrates " << audit.penetrates << " m, floats " << audit.floats
          << " m, too shallow by " << audit.shallow << " m, force off by " << audit.force
          << " of it, fault bits " << r.faults << (audit.finite ? "" : ", not finite") << "; size "
          << mesh_->size() << " m";
      result_.detail = out.str();
    }
    return r;
  }

  void fail(const std::string& what) {
    if (result_.detail.empty()) result_.detail = what;
  }

  /// Errors of lengths so far.
  ExtremeResult result() const {
    ExtremeResult result = result_;
    result.limit = kRounding;
    result.passed = result.detail.empty();
    return result;
  }

 private:
  const Renderer& renderer_;
  MeshPointer mesh_;
  Pose pose_;
  Scene scene_;
  RenderState state_;
  ExtremeResult result_;
};

/// The worst of several results.
class CombinedResult {
 public:
  void add(const ExtremeResult& one) {
    all_.worst = std::max(all_.worst, one.worst);
    all_.limit = one.limit;
    all_.ticks += one.ticks;
    all_.in_contact += one.in_contact;
    if (!one.passed && all_.detail.empty()) all_.detail = one.detail;
  }
  /// A case without any contact proves nothing.
  ExtremeResult result() const {
    ExtremeResult all = all_;
    if (all.in_contact == 0) all.detail = "nothing was touched";
    all.passed = all.detail.empty();
    return all;
  }

 private:
  ExtremeResult all_;
};

/// Paths of all kinds over one object, with probes of these lengths (m).
ExtremeResult paths_over(const Renderer& renderer, const MeshPointer& mesh, const Pose& pose,
                         const std::vector<double>& lengths, std::size_t ticks);

// By shape.
ExtremeResult sliver(const Renderer& renderer);
ExtremeResult needle(const Renderer& renderer);
ExtremeResult nearly_coplanar(const Renderer& renderer);
ExtremeResult duplicate_vertices(const Renderer& renderer);
ExtremeResult small_object(const Renderer& renderer);
ExtremeResult large_object(const Renderer& renderer);
ExtremeResult far_object(const Renderer& renderer);
ExtremeResult million_triangles(const Renderer& renderer);

// By motion of the hand.
ExtremeResult thin_plate(const Renderer& renderer);
ExtremeResult parallel_edge(const Renderer& renderer);
ExtremeResult through_vertices(const Renderer& renderer);
ExtremeResult zero_length(const Renderer& renderer);
ExtremeResult tiny_length(const Renderer& renderer);
ExtremeResult starts_inside(const Renderer& renderer);
ExtremeResult teleports(const Renderer& renderer);
ExtremeResult bad_poses(const Renderer& renderer);

// By energy over a closed path.
ExtremeResult closed_paths(const Renderer& renderer);
ExtremeResult closed_paths_lossy(const Renderer& renderer);
ExtremeResult closed_paths_in_the_blend(const Renderer& renderer);

}  // namespace palpate::rendering::extremes
