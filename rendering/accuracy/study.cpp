#include "rendering/accuracy/study.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <set>
#include <stdexcept>

#include "rendering/accuracy/hand_path.h"
#include "stimuli/primitives.h"
#include "stimuli/shapes.h"

namespace palpate::rendering {
namespace {

constexpr double kPi = 3.14159265358979324;

std::vector<stimuli::ShapeKind> analytic_shapes() {
  std::vector<stimuli::ShapeKind> all;
  for (const stimuli::ShapeKind shape : stimuli::kShapes) {
    if (stimuli::needs_of(shape).analytic) all.push_back(shape);
  }
  return all;
}

/// A path with the exact answers of the shape, and of the polyhedron at some ticks.
struct Course {
  HandPath path;
  std::vector<std::vector<WayOut>> of_shape;
  std::vector<std::vector<WayOut>> of_polyhedron;  ///< every `stride`-th tick in contact
};

std::vector<Course> courses(const stimuli::ObjectSpec& shape, const AccuracySettings& settings,
                            bool segment) {
  std::vector<Course> all;
  for (int i = 1; i <= settings.paths; ++i) {
    HandPathSettings hand;
    hand.seed = static_cast<std::uint64_t>(i);
    hand.contact_ticks = settings.contact_ticks;
    hand.length = segment ? settings.length : 0;
    Course course{hand_path(shape, hand), {}, {}};
    for (const LineProbe& probe : course.path.poses) {
      course.of_shape.push_back(ways_out(shape, probe));
    }
    all.push_back(std::move(course));
  }
  return all;
}

/// One method over all courses.
class Run {
 public:
  Run(const MethodKind& kind, const stimuli::ConvexMesh& mesh, bool segment, std::size_t stride,
      const std::function<double()>& now)
      : kind_(kind), mesh_(mesh), segment_(segment), stride_(stride), now_(now) {}

  void over(const Course& course, int timings) {
    const std::size_t begin = course.path.approach, end = course.path.poses.size();
    // What looks at everything needs no tick before: it is asked at the ticks that count only.
    const bool all = kind_.remembers || kind_.name == "walk-cold";
    const std::size_t step = all ? 1 : stride_;
    std::vector<Answer> answers;
    double fastest = pass(course, step, &answers);
    for (int i = 1; i < timings && total_ + fastest < kMostTime; ++i) {
      fastest = std::min(fastest, pass(course, step, nullptr));
    }
    total_ += fastest;
    ticks_ += answers.size();
    for (std::size_t i = 0; i < answers.size(); ++i) {
      const std::size_t tick = begin + i * step;
      if (tick >= end) break;
      shape_.add(course.path.poses[tick], course.of_shape[tick], answers[i]);
      if ((tick - begin) % stride_ == 0) {
        polyhedron_.add(course.path.poses[tick], course.of_polyhedron[(tick - begin) / stride_],
                        answers[i]);
      }
    }
  }

  void report(AccuracyRow& row) const {
    row.ns_per_tick = total_ / static_cast<double>(ticks_);
    row.shape_errors = shape_.summary();
    row.polyhedron_errors = polyhedron_.summary();
  }

 private:
  static constexpr double kMostTime = 2e8;  // ns; timed again only while the whole took less

  /// The approach untimed, then the contact. Returns ns.
  double pass(const Course& course, std::size_t step, std::vector<Answer>* answers) const {
    const auto method = kind_.make(mesh_, segment_);
    const auto& poses = course.path.poses;
    if (kind_.remembers) {
      for (std::size_t i = 0; i < course.path.approach; ++i) method->tick(poses[i]);
    }
    Answer last;
    if (answers) answers->reserve((poses.size() - course.path.approach) / step + 1);
    const double start = now_();
    for (std::size_t i = course.path.approach; i < poses.size(); i += step) {
      last = method->tick(poses[i]);
      if (answers) answers->push_back(last);
    }
    return now_() - start;
  }

  const MethodKind& kind_;
  const stimuli::ConvexMesh& mesh_;
  bool segment_;
  std::size_t stride_;
  const std::function<double()>& now_;
  double total_ = 0;
  std::size_t ticks_ = 0;
  ErrorTally shape_, polyhedron_;
};

bool meets(const AccuracyRow& row, const Demand& demand) {
  const ErrorSummary& e = row.shape_errors;
  return e.lost == 0 && e.phantom == 0 && e.depth.p999 < demand.position &&
         e.normal.p999 < demand.direction;
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
      return 12;
    case stimuli::ShapeKind::mesh:
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
    spec.subdivisions = level;
    // Steps of 2 where labs choose, then of 4.
    spec.segments = level < 5 ? 8 << level : 128 << (2 * (level - 4));
    if (triangles_of(spec) > most_triangles && !all.empty()) break;
    all.push_back(spec);
    if (!stimuli::needs_of(shape).subdivisions && !stimuli::needs_of(shape).segments)
      break;  // nothing to refine
  }
  return all;
}

std::vector<AccuracyRow> accuracy_study(const AccuracySettings& settings,
                                        const std::function<double()>& now,
                                        const std::function<void(double)>& progress) {
  const std::vector<MethodKind> methods = accuracy_methods();
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
      std::vector<Course> all = courses(specs.front(), settings, segment);
      for (const stimuli::ObjectSpec& spec : specs) {
        const stimuli::ConvexMesh mesh(stimuli::polygons_of(spec));
        const double visits = static_cast<double>(mesh.facets().size() + mesh.edges().size()) *
                              settings.contact_ticks * settings.paths;
        const auto stride = static_cast<std::size_t>(std::ceil(visits / settings.visits));
        for (Course& course : all) {
          course.of_polyhedron.clear();
          for (std::size_t i = course.path.approach; i < course.path.poses.size(); i += stride) {
            course.of_polyhedron.push_back(
                ways_out(mesh, course.path.poses[i], Vec3(0, 0, 1), kPi));
          }
        }
        for (const MethodKind& kind : methods) {
          progress(done / work);
          Run run(kind, mesh, segment, stride, now);
          for (const Course& course : all) run.over(course, settings.timings);
          AccuracyRow row;
          row.shape = stimuli::needs_of(shape).name;
          row.triangles = triangles_of(spec);
          row.facets = mesh.facets().size();
          row.edges = mesh.edges().size();
          row.subdivisions = stimuli::needs_of(shape).subdivisions ? spec.subdivisions : 0;
          row.segments = stimuli::needs_of(shape).segments ? spec.segments : 0;
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
                  const Demand& demand) {
  std::set<int> all, failing;
  for (const AccuracyRow& row : rows) {
    if (row.shape != shape || row.method != "tick") continue;
    all.insert(row.triangles);
    if (!meets(row, demand)) failing.insert(row.triangles);
  }
  const auto first = failing.empty() ? all.begin() : all.upper_bound(*failing.rbegin());
  return first == all.end() ? 0 : *first;
}

}  // namespace palpate::rendering
