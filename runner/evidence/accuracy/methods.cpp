#include "runner/evidence/accuracy/methods.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "rendering/facet_walk.h"
#include "rendering/first_contact.h"
#include "rendering/renderer.h"
#include "rendering/separation.h"
#include "runner/evidence/accuracy/peers.h"
#include "runner/evidence/verification/reference.h"
#include "stimuli/convex_mesh.h"

namespace palpate::runner::evidence {
namespace {

using Kind = rendering::ContactFeature::Kind;

ContactEstimate estimate_of(const rendering::WalkResult& hit, const rendering::LineProbe& probe) {
  if (hit.feature.kind == Kind::none) return {};
  return {true, hit.depth, hit.normal,
          probe.tip + hit.probe_fraction * (probe.tail - probe.tip) + hit.depth * hit.normal};
}

/// A whole tick of a renderer, force and torque included.
class WholeTick final : public ContactMethod {
 public:
  WholeTick(const stimuli::ConvexMesh& mesh, bool segment)
      : renderer_(segment ? rendering::ray_renderer() : rendering::point_renderer()),
        scene_(
            {{std::shared_ptr<const stimuli::ConvexMesh>(&mesh, [](const stimuli::ConvexMesh*) {}),
              Pose{}, stimuli::Material{}, 0, nullptr}},
            segment),
        state_(scene_.initial_state()) {}

  ContactEstimate tick(const rendering::LineProbe& probe) override {
    const rendering::Rendering r = renderer_.tick(scene_, state_, probe, 1e-3);
    return {r.contacts > 0, r.deepest.depth, r.deepest.normal, r.deepest.point};
  }

 private:
  const rendering::Renderer& renderer_;
  rendering::Scene scene_;
  rendering::RenderState state_;
};

struct RendererWalk {
  explicit RendererWalk(const stimuli::ConvexMesh& m) : mesh(m) {}
  rendering::WalkResult walk(rendering::ContactFeature start, const Vec3& tip,
                             const Vec3& d) const {
    return d == Vec3() ? walk_point(mesh, start, tip) : walk_segment(mesh, start, tip, d);
  }
  const stimuli::ConvexMesh& mesh;
};

/// The walk alone, from the feature of the last tick; entries by first contact.
template <class Walk>
class WarmWalk final : public ContactMethod {
 public:
  WarmWalk(const stimuli::ConvexMesh& mesh, bool segment)
      : mesh_(mesh), walk_(mesh), trees_(mesh, segment), tolerance_(1e-12 * mesh.size()) {}

  ContactEstimate tick(const rendering::LineProbe& probe) override {
    const Vec3 d = probe.tail - probe.tip;
    rendering::WalkResult hit;
    if (feature_.kind != Kind::none) {
      hit = walk_.walk(feature_, probe.tip, d);
    } else if (has_last_) {
      const rendering::ContactFeature first =
          d == Vec3() ? first_contact_point(mesh_, trees_, last_.tip, probe.tip, tolerance_).feature
                      : first_contact_segment(mesh_, trees_, last_, probe, tolerance_).feature;
      if (first.kind != Kind::none) hit = walk_.walk(first, probe.tip, d);
      if (hit.feature.kind == Kind::none) {
        // If contact was lost to rounding, there is no separating plane.
        find_separating_plane(mesh_, probe.tip, probe.tail, tolerance_, plane_, support_);
        if (!plane_.valid) hit = rendering::nearest_feature_segment(mesh_, probe.tip, d);
      }
    }
    feature_ = hit.feature;
    last_ = probe;
    has_last_ = true;
    return estimate_of(hit, probe);
  }

 private:
  const stimuli::ConvexMesh& mesh_;
  Walk walk_;
  rendering::ContactTrees trees_;
  double tolerance_;
  rendering::ContactFeature feature_;
  rendering::LineProbe last_;
  bool has_last_ = false;
  rendering::SeparatingPlane plane_;
  std::uint32_t support_ = 0;
};

/// The walk from the same facet at every tick.
class ColdWalk final : public ContactMethod {
 public:
  ColdWalk(const stimuli::ConvexMesh& mesh, bool) : walk_(mesh) {}
  ContactEstimate tick(const rendering::LineProbe& probe) override {
    return estimate_of(walk_.walk({Kind::facet, false, 0}, probe.tip, probe.tail - probe.tip),
                       probe);
  }

 private:
  RendererWalk walk_;
};

class FullScan final : public ContactMethod {
 public:
  FullScan(const stimuli::ConvexMesh& mesh, bool) : mesh_(mesh) {}
  ContactEstimate tick(const rendering::LineProbe& probe) override {
    const Vec3 d = probe.tail - probe.tip;
    return estimate_of(d == Vec3() ? rendering::nearest_feature_point(mesh_, probe.tip)
                                   : rendering::nearest_feature_segment(mesh_, probe.tip, d),
                       probe);
  }

 private:
  const stimuli::ConvexMesh& mesh_;
};

/// Brute force: the reference of the tests, timed. It gives no contact point.
class BruteForce final : public ContactMethod {
 public:
  BruteForce(const stimuli::ConvexMesh& mesh, bool) : mesh_(mesh) {}
  ContactEstimate tick(const rendering::LineProbe& probe) override {
    const ReferenceDepth reference = reference_depth(mesh_, probe);
    if (reference.depth < 0) return {};
    return {true, reference.depth, reference.normal,
            Vec3(std::numeric_limits<double>::quiet_NaN())};
  }

 private:
  const stimuli::ConvexMesh& mesh_;
};

template <class M>
std::unique_ptr<ContactMethod> make(const stimuli::ConvexMesh& mesh, bool segment) {
  return std::make_unique<M>(mesh, segment);
}

template <std::size_t kIndex>
class PeerMethod final : public ContactMethod {
 public:
  PeerMethod(const stimuli::ConvexMesh& mesh, bool) : peer_(peer_libraries()[kIndex].make(mesh)) {}
  ContactEstimate tick(const rendering::LineProbe& probe) override {
    const PeerContact contact = peer_->contact(probe);
    return {!(contact.depth < 0), contact.depth, contact.normal, contact.point};
  }

 private:
  std::unique_ptr<Peer> peer_;
};

double angle_between(const Vec3& a, const Vec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

}  // namespace

std::vector<MethodDefinition> contact_methods() {
  std::vector<MethodDefinition> methods = {
      {"tick", "the renderer's whole tick, force and torque included", true, true, false,
       make<WholeTick>},
      {"walk", "its walk alone, from the last tick's feature", true, true, false,
       make<WarmWalk<RendererWalk>>},
      {"walk-float", "the walk written out in single precision", true, true, false,
       make<WarmWalk<PlainWalk<float>>>},
      {"walk-cold", "the walk from facet 0 at every tick", false, false, false, make<ColdWalk>},
      {"scan", "the walk's features, all of them measured at every tick", false, false, true,
       make<FullScan>},
      {"brute-force", "the reference of the tests", false, false, true, make<BruteForce>},
  };
  constexpr std::unique_ptr<ContactMethod> (*kMakePeer[])(const stimuli::ConvexMesh&, bool) = {
      make<PeerMethod<0>>, make<PeerMethod<1>>};
  const auto libraries = peer_libraries();
  for (std::size_t i = 0; i < libraries.size(); ++i) {
    if (!libraries[i].make) continue;
    methods.push_back(
        {libraries[i].name,
         std::string(libraries[i].name) + " " + libraries[i].version + ", " + libraries[i].method,
         true, false, false, kMakePeer[i]});
  }
  return methods;
}

ErrorSpread error_spread(std::vector<double> errors) {
  ErrorSpread s;
  s.count = errors.size();
  if (errors.empty()) return s;
  double squares = 0;
  for (const double e : errors) squares += e * e;
  const auto n = static_cast<double>(errors.size());
  s.rms = std::sqrt(squares / n);
  std::sort(errors.begin(), errors.end());
  s.p999 = errors[static_cast<std::size_t>(std::ceil(0.999 * n)) - 1];
  s.worst = errors.back();
  return s;
}

void ErrorTally::add(const rendering::LineProbe& probe, const std::vector<LocalDepth>& truth,
                     const ContactEstimate& estimate) {
  ++counts_.ticks;
  const bool gave_up = std::isnan(estimate.depth);
  const bool touching = estimate.touching && !gave_up;
  if (truth.empty()) {
    if (!touching) return;
    ++counts_.phantom;
    depth_.push_back(estimate.depth);
    force_.push_back(kStiffness * estimate.depth);
    return;
  }
  if (!touching) {
    ++counts_.lost;
    counts_.gave_up += gave_up ? 1 : 0;
    depth_.push_back(truth.front().depth);
    force_.push_back(kStiffness * truth.front().depth);
    return;
  }
  const LocalDepth& held =
      *std::max_element(truth.begin(), truth.end(), [&](const LocalDepth& a, const LocalDepth& b) {
        return glm::dot(a.normal, estimate.normal) < glm::dot(b.normal, estimate.normal);
      });
  // Depths equal within rounding count as the least: there an edge's two facets have the same
  // direction.
  counts_.deeper += held.depth > truth.front().depth + 1e-12 ? 1 : 0;
  const Vec3 exact_force = kStiffness * held.depth * held.normal;
  const Vec3 force = kStiffness * estimate.depth * estimate.normal;
  depth_.push_back(std::abs(estimate.depth - held.depth));
  normal_.push_back(angle_between(estimate.normal, held.normal));
  force_.push_back(glm::length(force - exact_force));
  if (held.flat_angle < kFlat || std::isnan(estimate.point.x)) return;
  const Vec3 exact_point =
      probe.tip + held.probe_fraction * (probe.tail - probe.tip) + held.depth * held.normal;
  point_.push_back(glm::length(estimate.point - exact_point));
  torque_.push_back(glm::length(glm::cross(estimate.point - probe.tip, force) -
                                glm::cross(exact_point - probe.tip, exact_force)));
}

ErrorSummary ErrorTally::summary() const {
  ErrorSummary s = counts_;
  s.depth = error_spread(depth_);
  s.normal = error_spread(normal_);
  s.point = error_spread(point_);
  s.force = error_spread(force_);
  s.torque = error_spread(torque_);
  return s;
}

}  // namespace palpate::runner::evidence
