#pragma once
// What the extreme cases share. Included by extreme_*.cpp alone.

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

inline constexpr double kShare = 1e-9;  // of the object's size: errors of lengths up to it are none
inline constexpr const char* kLengthError = "worst error of a length, sizes of the object";

/// One object under a renderer, every tick held against the reference.
class Watch {
 public:
  Watch(const Renderer& renderer, MeshPointer mesh, const Pose& pose = {})
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

  /// A tick that must be right; the object's frame.
  Rendering audited(const LineProbe& local) {
    const LineProbe world = to_world(local);
    Rendering r = tick(world);
    const TickAudit audit = audit_tick(scene_, renderer_, world, r, kShare);
    ++result_.ticks;
    result_.in_contact += r.contacts > 0;
    // What rounding adds far from the origin and along a long probe is not the object's.
    const double rounding = audit.tolerance - kShare * mesh_->size();
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
    result.limit = kShare;
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

/// The sum of many.
class Several {
 public:
  void add(const ExtremeResult& one) {
    all_.worst = std::max(all_.worst, one.worst);
    all_.limit = one.limit;
    all_.ticks += one.ticks;
    all_.in_contact += one.in_contact;
    if (!one.passed && all_.detail.empty()) all_.detail = one.detail;
  }
  /// One that touched nothing at all shows nothing.
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

// By the way that the hand takes.
ExtremeResult thin_plate(const Renderer& renderer);
ExtremeResult parallel_edge(const Renderer& renderer);
ExtremeResult through_vertices(const Renderer& renderer);
ExtremeResult zero_length(const Renderer& renderer);
ExtremeResult tiny_length(const Renderer& renderer);
ExtremeResult starts_inside(const Renderer& renderer);
ExtremeResult teleports(const Renderer& renderer);
ExtremeResult bad_poses(const Renderer& renderer);

// By the energy of a way that ends where it began.
ExtremeResult closed_paths(const Renderer& renderer);
ExtremeResult closed_paths_lossy(const Renderer& renderer);
ExtremeResult closed_paths_in_the_blend(const Renderer& renderer);

}  // namespace palpate::rendering::extremes
