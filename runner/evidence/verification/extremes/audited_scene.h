#pragma once
// A scene whose every tick is audited, for the extreme cases.

#include <algorithm>
#include <memory>
#include <sstream>
#include <string>
#include <utility>

#include "rendering/renderer.h"
#include "runner/evidence/verification/extreme_cases.h"
#include "runner/evidence/verification/tick_audit.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/polygon_soup.h"

namespace palpate::runner::evidence::extremes {

using MeshPointer = std::shared_ptr<const stimuli::ConvexMesh>;

inline MeshPointer solid(const stimuli::PolygonSoup& soup) {
  return std::make_shared<const stimuli::ConvexMesh>(soup);
}

inline constexpr double kStylus = 0.12;  // m
inline constexpr double kRounding =
    1e-9;  // of the object's size; smaller errors of lengths are rounding
inline constexpr const char* kLengthError = "worst error of a length, sizes of the object";

/// One object under a renderer, every tick compared with the reference.
class AuditedScene {
 public:
  AuditedScene(const rendering::Renderer& renderer, MeshPointer mesh, const Pose& pose = {})
      : renderer_(renderer),
        mesh_(std::move(mesh)),
        pose_(pose),
        scene_({{mesh_, pose, stimuli::Material{}, 0, nullptr}}, renderer.side_contact()),
        state_(scene_.initial_state()) {}

  const stimuli::ConvexMesh& mesh() const { return *mesh_; }
  const rendering::Renderer& renderer() const { return renderer_; }

  rendering::LineProbe to_world(const rendering::LineProbe& p) const {
    return {pose_.orientation * p.tip + pose_.position,
            pose_.orientation * p.tail + pose_.position};
  }

  rendering::Rendering tick(const rendering::LineProbe& world) {
    return renderer_.tick(scene_, state_, world, 1e-3);
  }

  /// A tick that must be right; probe in the object's frame.
  rendering::Rendering audited_tick(const rendering::LineProbe& local) {
    const rendering::LineProbe world = to_world(local);
    rendering::Rendering r = tick(world);
    const TickAudit audit = audit_tick(scene_, renderer_, world, r, kRounding);
    ++result_.ticks;
    result_.in_contact += r.contacts > 0;
    // Do not count the rounding that distance from the origin and a long probe add.
    const double rounding = audit.tolerance - kRounding * mesh_->size();
    const double error = std::max({audit.missed, audit.penetrates, audit.floats, audit.shallow});
    result_.worst = std::max(result_.worst, std::max(0.0, error - rounding) / mesh_->size());
    if ((!audit.good() || r.faults != 0) && result_.detail.empty()) {
      std::ostringstream out;
      out << renderer_.name() << ", tick " << result_.ticks << ": missed " << audit.missed
          << " m, penetrates " << audit.penetrates << " m, floats " << audit.floats
          << " m, too shallow by " << audit.shallow << " m, relative error of force " << audit.force
          << ", fault bits " << r.faults << (audit.finite ? "" : ", not finite") << "; size "
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
  const rendering::Renderer& renderer_;
  MeshPointer mesh_;
  Pose pose_;
  rendering::Scene scene_;
  rendering::RenderState state_;
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

}  // namespace palpate::runner::evidence::extremes
