#include "rendering/accuracy/union_study.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <memory>
#include <utility>

#include "rendering/renderer.h"
#include "rendering/verification/reference.h"

namespace palpate::rendering {
namespace {

constexpr double kCarrier = 0.12;  // m, length of a stylus that carries a tool

/// One tick of a method.
struct UnionEstimate {
  Vec3 force;        // N
  OraclePose ideal;  // of those that have one
};

class UnionRun {
 public:
  virtual ~UnionRun() = default;
  virtual UnionEstimate tick(const OraclePose& pose) = 0;
};

bool is_point(const OracleTool& tool) { return tool.size() == 1 && tool[0].from == tool[0].to; }

/// \param apart  every part an object of its own
Scene scene_of(const UnionCase& one, bool apart, Tool tool) {
  std::vector<SceneObject> objects;
  for (const OraclePart& part : one.parts) {
    SceneObject object;
    object.mesh = part.mesh;
    object.pose = part.pose;
    object.material.stiffness = kStiffness;
    object.object = apart ? static_cast<int>(objects.size()) : 0;
    objects.push_back(std::move(object));
  }
  return Scene(std::move(objects), !is_point(one.tool), std::move(tool));
}

const Renderer& renderer_for(const OracleTool& tool) {
  return is_point(tool) ? point_renderer() : ray_renderer();
}

class Law final : public UnionRun {
 public:
  explicit Law(const UnionCase& one)
      : tool_(one.tool),
        renderer_(renderer_for(one.tool)),
        scene_(scene_of(one, false, tool_of(one.tool))),
        state_(scene_.initial_state()) {}

  UnionEstimate tick(const OraclePose& pose) override {
    state_.measured_side = pose.axes[0];
    const Rendering r = renderer_.tick(scene_, state_, stylus(pose), 1e-3);
    UnionEstimate estimate{r.force, {r.ideal.tip, pose.axes}};
    if (tool_.size() > 1) {
      const Vec3 z = glm::normalize(r.ideal.tail - r.ideal.tip);
      const Vec3 x = glm::normalize(r.ideal_side - glm::dot(r.ideal_side, z) * z);
      estimate.ideal.axes = Mat3(x, glm::cross(z, x), z);
    }
    return estimate;
  }

 private:
  static Tool tool_of(const OracleTool& tool) {
    Tool made;
    if (tool.size() == 1) return made;
    for (const OracleSegment& segment : tool) made.segments.push_back({segment.from, segment.to});
    return made;
  }
  LineProbe stylus(const OraclePose& pose) const {
    if (tool_.size() == 1) return {pose.place(tool_[0].from), pose.place(tool_[0].to)};
    return {pose.tip, pose.place(Vec3(0, 0, kCarrier))};
  }

  const OracleTool& tool_;
  const Renderer& renderer_;
  Scene scene_;
  RenderState state_;
};

/// Ho, Basdogan & Srinivasan 2000, section 4: a concave object is several convex ones; each has its
/// own contact, and forces add, (3) to (5). Each segment is a probe.
class OnePerPart final : public UnionRun {
 public:
  explicit OnePerPart(const UnionCase& one)
      : tool_(one.tool), renderer_(renderer_for(one.tool)), scene_(scene_of(one, true, {})) {
    states_.resize(tool_.size(), scene_.initial_state());
  }

  UnionEstimate tick(const OraclePose& pose) override {
    UnionEstimate sum;
    for (std::size_t j = 0; j < tool_.size(); ++j) {
      const LineProbe probe{pose.place(tool_[j].from), pose.place(tool_[j].to)};
      sum.force += renderer_.tick(scene_, states_[j], probe, 1e-3).force;
    }
    return sum;
  }

 private:
  const OracleTool& tool_;
  const Renderer& renderer_;
  Scene scene_;
  std::vector<RenderState> states_;
};

class Penalties final : public UnionRun {
 public:
  explicit Penalties(const UnionCase& one) : one_(one) {}

  UnionEstimate tick(const OraclePose& pose) override {
    UnionEstimate sum;
    for (const OraclePart& part : one_.parts) {
      for (const OracleSegment& segment : one_.tool) {
        const ReferenceDepth least = reference_depth(
            *part.mesh,
            {local(part, pose.place(segment.from)), local(part, pose.place(segment.to))});
        if (least.depth > 0)
          sum.force += kStiffness * least.depth * (part.pose.orientation * least.normal);
      }
    }
    return sum;
  }

 private:
  static Vec3 local(const OraclePart& part, const Vec3& world) {
    return glm::conjugate(part.pose.orientation) * (world - part.pose.position);
  }

  const UnionCase& one_;
};

std::unique_ptr<UnionRun> start(std::size_t method, const UnionCase& one) {
  if (method == 0) return std::make_unique<Law>(one);
  if (method == 1) return std::make_unique<OnePerPart>(one);
  return std::make_unique<Penalties>(one);
}

/// One method over the cases of one kind.
class Tally {
 public:
  Tally(std::size_t method, const UnionSettings& settings, const std::function<double()>& now)
      : method_(method), settings_(settings), now_(now) {}

  void over(const UnionCase& one) {
    std::vector<UnionEstimate> estimates(one.path.size());
    double fastest = 0;
    for (int i = 0; i < settings_.timings; ++i) {
      const auto run = start(method_, one);
      const double begin = now_();
      for (std::size_t t = 0; t < one.path.size(); ++t) estimates[t] = run->tick(one.path[t]);
      const double took = now_() - begin;
      fastest = i == 0 ? took : std::min(fastest, took);
    }
    total_ns_ += fastest;
    const UnionOracle oracle(one.parts, one.tool);
    for (std::size_t t = 0; t < one.path.size(); ++t) {
      const Vec3 exact = kStiffness * one.displacement[t];
      const double error = glm::length(estimates[t].force - exact);
      errors_.push_back(error);
      const bool touching = glm::length(exact) > 1e-12 * kStiffness * oracle.size();
      in_contact_ += touching;
      off_by_a_tenth_ += touching && !(error <= 0.1 * glm::length(exact));
      inside_ += union_methods()[method_].one_ideal_tool &&
                 !(oracle.depth(estimates[t].ideal) <= 1e-12 * oracle.size());
    }
  }

  void report(UnionRow& row) const {
    row.method = union_methods()[method_].name;
    row.one_ideal_tool = union_methods()[method_].one_ideal_tool;
    row.ticks = errors_.size();
    row.ns_per_tick = total_ns_ / static_cast<double>(errors_.size());
    row.in_contact = in_contact_;
    row.inside = inside_;
    row.off_by_a_tenth = off_by_a_tenth_;
    row.force = error_spread(errors_);
  }

 private:
  std::size_t method_;
  const UnionSettings& settings_;
  const std::function<double()>& now_;
  double total_ns_ = 0;
  std::size_t in_contact_ = 0, inside_ = 0, off_by_a_tenth_ = 0;
  std::vector<double> errors_;
};

}  // namespace

const std::vector<UnionMethod>& union_methods() {
  static const std::vector<UnionMethod> methods{
      {"law", "one ideal tool for each object, the renderers' whole ticks", true},
      {"one per part",
       "one contact search for each part and segment as in the paper, forces added up", false},
      {"penalties",
       "least penetration depth of each part and segment, by brute force without memory, forces "
       "added up",
       false}};
  return methods;
}

std::vector<UnionRow> union_study(const UnionSettings& settings, const std::function<double()>& now,
                                  const std::function<void(double)>& progress) {
  const std::vector<UnionCaseKind> kinds = union_case_kinds();
  std::vector<UnionRow> rows;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    progress(static_cast<double>(k) / static_cast<double>(kinds.size()));
    std::vector<UnionCase> cases;
    for (int seed = 1; seed <= settings.seeds; ++seed) {
      cases.push_back(kinds[k].draw(static_cast<std::uint64_t>(seed), settings.ticks));
    }
    for (std::size_t method = 0; method < union_methods().size(); ++method) {
      Tally tally(method, settings, now);
      for (const UnionCase& one : cases) tally.over(one);
      UnionRow row;
      row.name = kinds[k].name;
      row.truth = kinds[k].truth;
      row.segments = cases.front().tool.size();
      tally.report(row);
      rows.push_back(std::move(row));
    }
  }
  progress(1);
  return rows;
}

}  // namespace palpate::rendering
