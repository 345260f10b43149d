#include "runner/evidence/accuracy/study.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <set>
#include <stdexcept>

#include "runner/evidence/accuracy/analytic_stroke.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"
#include "stimuli/shapes.h"

namespace palpate::runner::evidence {
namespace {

constexpr double kPi = 3.14159265358979324;
const Vec3 kBox(0.08, 0.06, 0.04);  // m; all sides differ, unlike the cube's

std::vector<stimuli::ShapeKind> analytic_shapes() {
  std::vector<stimuli::ShapeKind> all;
  for (const stimuli::ShapeKind shape : stimuli::kShapes) {
    if (stimuli::traits_of(shape).analytic) all.push_back(shape);
  }
  return all;
}

/// A stroke with the exact depths in the shape, and in the polyhedron at some ticks.
struct TestStroke {
  AnalyticStroke path;
  std::vector<std::vector<LocalDepth>> of_shape;
  std::vector<std::vector<LocalDepth>> of_polyhedron;  ///< every `stride`-th tick in contact
};

std::vector<TestStroke> test_strokes(const stimuli::ObjectSpec& shape,
                                     const AccuracySettings& settings, bool segment) {
  std::vector<TestStroke> all;
  for (int i = 1; i <= settings.paths; ++i) {
    AnalyticStrokeSettings hand;
    hand.seed = static_cast<std::uint64_t>(i);
    hand.contact_ticks = settings.contact_ticks;
    hand.length = segment ? settings.length : 0;
    TestStroke stroke{analytic_stroke(shape, hand), {}, {}};
    for (const rendering::LineProbe& probe : stroke.path.poses) {
      stroke.of_shape.push_back(local_depths(shape, probe));
    }
    all.push_back(std::move(stroke));
  }
  return all;
}

/// One method over all test strokes.
class MethodRun {
 public:
  MethodRun(const MethodDefinition& kind, const stimuli::ConvexMesh& mesh, bool segment,
            std::size_t stride, const std::function<double()>& now)
      : kind_(kind), mesh_(mesh), segment_(segment), stride_(stride), now_(now) {}

  void over(const TestStroke& stroke, int timings) {
    const std::size_t begin = stroke.path.approach, end = stroke.path.poses.size();
    // Methods that visit everything have no history: run them only at compared ticks.
    const std::size_t step = kind_.visits_all ? stride_ : 1;
    std::vector<ContactEstimate> estimates;
    double fastest = pass(stroke, step, &estimates);
    for (int i = 1; i < timings && total_ + fastest < kMostTime; ++i) {
      fastest = std::min(fastest, pass(stroke, step, nullptr));
    }
    total_ += fastest;
    ticks_ += estimates.size();
    for (std::size_t i = 0; i < estimates.size(); ++i) {
      const std::size_t tick = begin + i * step;
      if (tick >= end) break;
      shape_.add(stroke.path.poses[tick], stroke.of_shape[tick], estimates[i]);
      if ((tick - begin) % stride_ == 0) {
        polyhedron_.add(stroke.path.poses[tick], stroke.of_polyhedron[(tick - begin) / stride_],
                        estimates[i]);
      }
    }
  }

  void report(AccuracyRow& row) const {
    row.ns_per_tick = total_ / static_cast<double>(ticks_);
    row.shape_errors = shape_.summary();
    row.polyhedron_errors = polyhedron_.summary();
  }

 private:
  static constexpr double kMostTime = 2e8;  // ns; repeat timing only while the total is below

  /// Runs the approach untimed, then the contact. Returns ns.
  double pass(const TestStroke& stroke, std::size_t step,
              std::vector<ContactEstimate>* estimates) const {
    const auto method = kind_.make(mesh_, segment_);
    const auto& poses = stroke.path.poses;
    if (kind_.has_history) {
      for (std::size_t i = 0; i < stroke.path.approach; ++i) method->tick(poses[i]);
    }
    ContactEstimate last;
    if (estimates) estimates->reserve((poses.size() - stroke.path.approach) / step + 1);
    const double start = now_();
    for (std::size_t i = stroke.path.approach; i < poses.size(); i += step) {
      last = method->tick(poses[i]);
      if (estimates) estimates->push_back(last);
    }
    return now_() - start;
  }

  const MethodDefinition& kind_;
  const stimuli::ConvexMesh& mesh_;
  bool segment_;
  std::size_t stride_;
  const std::function<double()>& now_;
  double total_ = 0;
  std::size_t ticks_ = 0;
  ErrorTally shape_, polyhedron_;
};

bool meets(const AccuracyRow& row, const ErrorLimits& limits) {
  const ErrorSummary& e = row.shape_errors;
  return e.lost == 0 && e.phantom == 0 && e.depth.p999 < limits.position &&
         e.normal.p999 < limits.direction;
}

}  // namespace

int triangles_of(const stimuli::ObjectSpec& spec) {
  switch (spec.shape) {
    case stimuli::ShapeKind::sphere:
      return 20 << (2 * spec.subdivisions);
    case stimuli::ShapeKind::cone:
      return 2 * spec.segments - 2;
    case stimuli::ShapeKind::cylinder:
      return 4 * spec.segments - 4;
    case stimuli::ShapeKind::cube:
    case stimuli::ShapeKind::box:
      return 12;
    case stimuli::ShapeKind::mesh:
    case stimuli::ShapeKind::none:
    case stimuli::ShapeKind::compound:
      break;
  }
  throw std::invalid_argument("triangles_of: a mesh or compound is no analytic primitive");
}

std::vector<stimuli::ObjectSpec> tessellations(stimuli::ShapeKind shape, int most_triangles) {
  std::vector<stimuli::ObjectSpec> all;
  for (int level = 0; level <= 8; ++level) {
    stimuli::ObjectSpec spec;
    spec.shape = shape;
    spec.size = kBox;
    spec.subdivisions = level;
    // Factors of 2 in the range that labs use, then of 4.
    spec.segments = level < 5 ? 8 << level : 128 << (2 * (level - 4));
    if (triangles_of(spec) > most_triangles && !all.empty()) break;
    all.push_back(spec);
    if (!stimuli::traits_of(shape).subdivisions && !stimuli::traits_of(shape).segments)
      break;  // nothing to refine
  }
  return all;
}

std::vector<AccuracyRow> accuracy_study(const AccuracySettings& settings,
                                        const std::function<double()>& now,
                                        const std::function<void(double)>& progress) {
  const std::vector<MethodDefinition> methods = contact_methods();
  // Finer tessellations take longer, though less than in proportion.
  const auto weight = [](const stimuli::ObjectSpec& spec) {
    return 100 + std::sqrt(triangles_of(spec));
  };
  const std::vector<stimuli::ShapeKind> shapes = analytic_shapes();
  double work = 0, done = 0;
  for (const stimuli::ShapeKind shape : shapes) {
    for (const stimuli::ObjectSpec& spec : tessellations(shape, settings.most_triangles)) {
      work += 2 * weight(spec) * static_cast<double>(methods.size());
    }
  }
  std::vector<AccuracyRow> rows;
  for (const stimuli::ShapeKind shape : shapes) {
    const auto specs = tessellations(shape, settings.most_triangles);
    for (const bool segment : {true, false}) {
      std::vector<TestStroke> all = test_strokes(specs.front(), settings, segment);
      for (const stimuli::ObjectSpec& spec : specs) {
        const stimuli::ConvexMesh mesh(stimuli::polygons_of(spec));
        const double visits = static_cast<double>(mesh.facets().size() + mesh.edges().size()) *
                              settings.contact_ticks * settings.paths;
        const auto stride = static_cast<std::size_t>(std::ceil(visits / settings.visits));
        for (TestStroke& stroke : all) {
          stroke.of_polyhedron.clear();
          for (std::size_t i = stroke.path.approach; i < stroke.path.poses.size(); i += stride) {
            stroke.of_polyhedron.push_back(
                local_depths(mesh, stroke.path.poses[i], Vec3(0, 0, 1), kPi));
          }
        }
        for (const MethodDefinition& kind : methods) {
          progress(done / work);
          MethodRun run(kind, mesh, segment, stride, now);
          for (const TestStroke& stroke : all) run.over(stroke, settings.timings);
          AccuracyRow row;
          row.shape = stimuli::traits_of(shape).name;
          row.triangles = triangles_of(spec);
          row.facets = mesh.facets().size();
          row.edges = mesh.edges().size();
          row.subdivisions = stimuli::traits_of(shape).subdivisions ? spec.subdivisions : 0;
          row.segments = stimuli::traits_of(shape).segments ? spec.segments : 0;
          row.probe = segment ? "ray" : "point";
          row.method = kind.name;
          run.report(row);
          rows.push_back(std::move(row));
          done += weight(spec);
        }
      }
    }
  }
  progress(1);
  return rows;
}

int triangles_for(const std::vector<AccuracyRow>& rows, const std::string& shape,
                  const ErrorLimits& limits) {
  std::set<int> all, failing;
  for (const AccuracyRow& row : rows) {
    if (row.shape != shape || row.method != "tick") continue;
    all.insert(row.triangles);
    if (!meets(row, limits)) failing.insert(row.triangles);
  }
  const auto first = failing.empty() ? all.begin() : all.upper_bound(*failing.rbegin());
  return first == all.end() ? 0 : *first;
}

}  // namespace palpate::runner::evidence
