#include "runner/evidence/accuracy/union_study.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <numbers>
#include <utility>

#include "rendering/renderer.h"
#include "runner/evidence/verification/random_solids.h"
#include "runner/evidence/verification/reference.h"
#include "stimuli/orientation.h"
#include "stimuli/polygon_soup.h"

namespace palpate::runner::evidence {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
const OracleTool kPoint{{Vec3(0), Vec3(0)}};
const OracleTool kStylus{{Vec3(0), Vec3(0, 0, 0.12)}};

/// A coordinate of a hand: two slow sines of random frequency and phase; -1 to 1.
class Sway {
 public:
  explicit Sway(Random& random) {
    for (Wave& wave : waves_) wave = {2e-3 + 6e-3 * random.unit(), 7 * random.unit()};
  }
  double operator()(std::size_t tick) const {
    double sum = 0;
    for (const Wave& wave : waves_) {
      sum += 0.5 * std::sin(wave.rate * static_cast<double>(tick) + wave.phase);
    }
    return sum;
  }

 private:
  struct Wave {
    double rate, phase;  // rad a tick, rad
  };
  Wave waves_[2];
};

/// Comes down from above to the beginning of the path, 0.5 mm a tick.
void come_down(std::vector<OraclePose>& path, const Vec3& from, const OraclePose& to) {
  const double steps = std::ceil(glm::length(from - to.tip) / 5e-4);
  for (double step = 0; step < steps; ++step) {
    path.push_back({from + step / steps * (to.tip - from), to.axes});
  }
}

void by_closed_form(UnionCase& one, const std::function<Vec3(const Vec3&)>& displacement) {
  for (const OraclePose& pose : one.path) one.displacement.push_back(displacement(pose.tip));
}

/// Sets the truth by the oracle over these parts, which may be another division of the same body.
void by_oracle(UnionCase& one, const OracleParts& parts) {
  const UnionOracle oracle(parts, one.tool);
  OraclePose ideal = one.path[0];
  for (const OraclePose& pose : one.path) {
    ideal = oracle.tick(ideal, pose).ideal;
    one.displacement.push_back(ideal.tip - pose.tip);
  }
}

/// A path over both walls and the valley, up to 3 mm below it.
UnionCase groove_case(double opening, std::uint64_t seed, std::size_t ticks) {
  Random random(seed, {1});
  const Sway x(random), y(random), z(random);
  UnionCase one{groove(opening), kPoint, {}, {}};
  const auto tip = [&](std::size_t i) {
    return Vec3(2e-3 * x(i), 0.02 * y(i), -1e-3 + 2e-3 * z(i));
  };
  // The path leads down the middle of the groove, then to the first place.
  come_down(one.path, {0, 0, 0.058}, {{0, 0, 1e-4}, Mat3(1)});
  come_down(one.path, {0, 0, 1e-4}, {tip(0), Mat3(1)});
  for (std::size_t i = 0; one.path.size() < ticks; ++i) one.path.push_back({tip(i), Mat3(1)});
  by_closed_form(one, [&](const Vec3& at) { return groove_displacement(opening, at); });
  return one;
}

/// 16 boxes side by side under one plane; the stylus stands on it, tilted.
UnionCase seam_case(double overlap, std::uint64_t seed, std::size_t ticks) {
  Random random(seed, {2});
  const Sway x(random), y(random), z(random);
  UnionCase one{{}, kStylus, {}, {}};
  for (int i = 0; i < 16; ++i) {
    one.parts.push_back(
        box_part({0.006 * i - 0.048, -0.05, -0.04}, {0.006 * (i + 1) - 0.048 + overlap, 0.05, 0}));
  }
  const Vec3 up = glm::normalize(Vec3(0.4 * random.unit(), 0.4 * random.unit(), 1));
  const Vec3 side = glm::normalize(glm::cross(Vec3(0, 1, 0), up));
  const Mat3 axes(side, glm::cross(up, side), up);
  const auto tip = [&](std::size_t i) {
    return Vec3(0.04 * x(i), 0.04 * y(i), -2e-3 + 2e-3 * z(i));
  };
  come_down(one.path, tip(0) + Vec3(0, 0, 0.02), {tip(0), axes});
  for (std::size_t i = 0; one.path.size() < ticks; ++i) one.path.push_back({tip(i), axes});
  by_closed_form(one, [](const Vec3& at) { return Vec3(0, 0, std::max(0.0, -at.z)); });
  return one;
}

/// In the corner of a step, riser and tread.
UnionCase stair_case(std::uint64_t seed, std::size_t ticks) {
  Random random(seed, {3});
  const Sway x(random), y(random), z(random);
  UnionCase one{stairs(4, 0.03, 0.02), kPoint, {}, {}};
  const auto tip = [&](std::size_t i) {
    return Vec3(3e-3 * x(i), 0.02 * y(i), -0.02 + 3e-3 * z(i));
  };
  come_down(one.path, {0.01, 0, 0.02}, {{0.01, 0, -0.015}, Mat3(1)});
  come_down(one.path, {0.01, 0, -0.015}, {tip(0), Mat3(1)});
  for (std::size_t i = 0; one.path.size() < ticks; ++i) one.path.push_back({tip(i), Mat3(1)});
  by_closed_form(one, [](const Vec3& at) {
    return Vec3(std::max(0.0, -at.x), 0, std::max(0.0, -0.02 - at.z));
  });
  return one;
}

UnionCase cut_case(std::uint64_t seed, std::size_t ticks) {
  Random random(seed, {4});
  const stimuli::PolygonSoup solid =
      turned_and_moved(cut_cube(random, 4), stimuli::uniform_rotation(random), 0.05, Vec3(0));
  UnionCase one{cut_to_pieces(solid, 2, random), random_tool(random, 1), {}, {}};
  const OracleParts whole{part_of(solid)};
  one.path = random_tool_path(random, whole, one.tool, 2e-4, ticks);
  by_oracle(one, whole);
  return one;
}

UnionCase cluster_case(int segments, std::uint64_t seed, std::size_t ticks) {
  Random random(seed, {5, static_cast<std::uint64_t>(segments)});
  UnionCase one{random_cluster(random, 3 + static_cast<int>(random.below(6))),
                random_tool(random, segments),
                {},
                {}};
  one.path = random_tool_path(random, one.parts, one.tool, 2e-4, ticks);
  by_oracle(one, one.parts);
  return one;
}

/// One tick of a method.
struct UnionEstimate {
  Vec3 force;        // N
  OraclePose ideal;  // for methods that have one
};

class UnionRun {
 public:
  virtual ~UnionRun() = default;
  virtual UnionEstimate tick(const OraclePose& pose) = 0;
};

constexpr double kCarrier = 0.12;  // m, length of a stylus that carries a tool

bool is_point(const OracleTool& tool) { return tool.size() == 1 && tool[0].from == tool[0].to; }

/// \param apart  every part an object of its own
rendering::Scene scene_of(const UnionCase& one, bool apart, rendering::Tool tool) {
  std::vector<rendering::SceneObject> objects;
  for (const OraclePart& part : one.parts) {
    rendering::SceneObject object;
    object.mesh = part.mesh;
    object.pose = part.pose;
    object.material.stiffness = kStiffness;
    object.object = apart ? static_cast<int>(objects.size()) : 0;
    objects.push_back(std::move(object));
  }
  return rendering::Scene(std::move(objects), !is_point(one.tool), std::move(tool));
}

const rendering::Renderer& renderer_of_tool(const OracleTool& tool) {
  return is_point(tool) ? rendering::point_renderer() : rendering::ray_renderer();
}

class Law final : public UnionRun {
 public:
  explicit Law(const UnionCase& one)
      : tool_(one.tool),
        renderer_(renderer_of_tool(one.tool)),
        scene_(scene_of(one, false, tool_of(one.tool))),
        state_(scene_.initial_state()) {}

  UnionEstimate tick(const OraclePose& pose) override {
    state_.measured_side = pose.axes[0];
    const rendering::Rendering r = renderer_.tick(scene_, state_, stylus(pose), 1e-3);
    UnionEstimate estimate{r.force, {r.ideal.tip, pose.axes}};
    if (tool_.size() > 1) {
      const Vec3 z = glm::normalize(r.ideal.tail - r.ideal.tip);
      const Vec3 x = glm::normalize(r.ideal_side - glm::dot(r.ideal_side, z) * z);
      estimate.ideal.axes = Mat3(x, glm::cross(z, x), z);
    }
    return estimate;
  }

 private:
  static rendering::Tool tool_of(const OracleTool& tool) {
    rendering::Tool made;
    if (tool.size() == 1) return made;
    for (const OracleSegment& segment : tool) made.segments.push_back({segment.from, segment.to});
    return made;
  }
  rendering::LineProbe stylus(const OraclePose& pose) const {
    if (tool_.size() == 1) return {pose.place(tool_[0].from), pose.place(tool_[0].to)};
    return {pose.tip, pose.place(Vec3(0, 0, kCarrier))};
  }

  const OracleTool& tool_;
  const rendering::Renderer& renderer_;
  rendering::Scene scene_;
  rendering::RenderState state_;
};

/// Ho, Basdogan & Srinivasan 2000, section 4: a concave object is several convex ones; each has its
/// own contact, and forces add, (3) to (5). Each segment is a probe.
class OnePerPart final : public UnionRun {
 public:
  explicit OnePerPart(const UnionCase& one)
      : tool_(one.tool), renderer_(renderer_of_tool(one.tool)), scene_(scene_of(one, true, {})) {
    states_.resize(tool_.size(), scene_.initial_state());
  }

  UnionEstimate tick(const OraclePose& pose) override {
    UnionEstimate sum;
    for (std::size_t j = 0; j < tool_.size(); ++j) {
      const rendering::LineProbe probe{pose.place(tool_[j].from), pose.place(tool_[j].to)};
      sum.force += renderer_.tick(scene_, states_[j], probe, 1e-3).force;
    }
    return sum;
  }

 private:
  const OracleTool& tool_;
  const rendering::Renderer& renderer_;
  rendering::Scene scene_;
  std::vector<rendering::RenderState> states_;
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

/// A hook of three segments is lowered behind a beam, pulled up against it, rocked and lowered.
UnionCase hook_case(std::uint64_t seed, std::size_t ticks) {
  Random random(seed, {6});
  const Sway x(random), z(random), turn(random);
  // The short arm is below the beam; the long one stands beside it.
  UnionCase one{{box_part({-0.01, -0.05, -0.01}, {0.01, 0.05, 0.01})},
                {{Vec3(0), Vec3(0, 0, 0.08)},
                 {Vec3(0), Vec3(-0.03, 0, 0)},
                 {Vec3(-0.03, 0, 0), Vec3(-0.03, 0, 0.015)}},
                {},
                {}};
  const auto pose = [&](std::size_t i) {
    const double angle = 0.15 * turn(i);
    const Vec3 up(std::sin(angle), 0, std::cos(angle)), y(0, 1, 0);
    return OraclePose{{0.011 + 3e-3 * x(i), 0.01, -0.012 + 4e-3 * z(i)},
                      Mat3(glm::cross(y, up), y, up)};
  };
  // From beyond the end of the beam.
  OraclePose start = pose(0);
  start.tip.y = -0.09;
  come_down(one.path, start.tip - Vec3(0, 0, 0.01), {start.tip, start.axes});
  come_down(one.path, start.tip, pose(0));
  for (std::size_t i = 0; one.path.size() < ticks; ++i) one.path.push_back(pose(i));
  by_oracle(one, one.parts);
  return one;
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

std::vector<UnionCaseKind> union_case_kinds() {
  constexpr const char* kClosed = "closed form";
  constexpr const char* kOracle = "oracle";
  std::vector<UnionCaseKind> kinds;
  const auto add_groove = [&](const char* name, double degrees) {
    kinds.push_back({name, kClosed, [degrees](std::uint64_t seed, std::size_t ticks) {
                       return groove_case(degrees * kDegree, seed, ticks);
                     }});
  };
  add_groove("groove of 2 degrees", 2);
  add_groove("groove of 10 degrees", 10);
  add_groove("groove of 45 degrees", 45);
  add_groove("groove of 90 degrees", 90);
  add_groove("groove of 150 degrees", 150);
  add_groove("groove of 178 degrees", 178);
  kinds.push_back({"16 boxes that abut", kClosed, [](std::uint64_t seed, std::size_t ticks) {
                     return seam_case(0, seed, ticks);
                   }});
  kinds.push_back({"16 boxes that overlap", kClosed, [](std::uint64_t seed, std::size_t ticks) {
                     return seam_case(0.004, seed, ticks);
                   }});
  kinds.push_back({"corner of a stair", kClosed, stair_case});
  kinds.push_back({"solid cut in four", "oracle on the whole", cut_case});
  const auto add_cluster = [&](const char* name, int segments) {
    kinds.push_back({name, kOracle, [segments](std::uint64_t seed, std::size_t ticks) {
                       return cluster_case(segments, seed, ticks);
                     }});
  };
  add_cluster("cluster, one segment", 1);
  add_cluster("cluster, two segments", 2);
  add_cluster("cluster, three segments", 3);
  kinds.push_back({"hook behind a beam", kOracle, hook_case});
  return kinds;
}

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

}  // namespace palpate::runner::evidence
