#include "runner/session/replay_comparison.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <string>
#include <utility>

#include "runner/session/replay.h"

namespace palpate::runner::session {
namespace {

using protocols::RendererKind;

ReplayedInterval interval_of(const data::TrialRecord& record, std::size_t number) {
  const data::IntervalRecord interval = data::intervals_of(record)[number];
  return {interval.stimulus, interval.renderer, interval.level, interval.standard};
}

double length(const std::array<double, 3>& v) { return std::hypot(v[0], v[1], v[2]); }

/// Takes a renderer's forces tick by tick.
class Summarizer {
 public:
  explicit Summarizer(std::string renderer) { sum_.renderer = std::move(renderer); }

  void add(double time, double force, double depth, int contacts) {
    if (contacts > 0 && !sum_.first_contact) sum_.first_contact = time;
    in_contact_ += contacts > 0;
    square_sum_ += force * force;
    sum_.max_force = std::max(sum_.max_force, force);
    sum_.max_depth = std::max(sum_.max_depth, depth);
  }
  ForceSummary over(std::size_t ticks) {
    sum_.time_in_contact = static_cast<double>(in_contact_) / static_cast<double>(ticks);
    sum_.rms_force = std::sqrt(square_sum_ / static_cast<double>(ticks));
    return sum_;
  }

 private:
  ForceSummary sum_;
  std::size_t in_contact_ = 0;
  double square_sum_ = 0;  // N^2
};

std::string other_renderer(const std::string& renderer, bool other) {
  const char* const ray = protocols::to_string(RendererKind::ray);
  const char* const point = protocols::to_string(RendererKind::point);
  return (renderer == ray) != other ? ray : point;
}

RenderedForce rendered(const servo::Sample& sample) {
  const rendering::Rendering& r = sample.rendering;
  return {r.force, r.torque, r.deepest.depth};
}

/// The renderers of the intervals: "point", "ray" or, in order of appearance, "point, ray".
std::string renderers_of(const data::TrialRecord& record, bool other) {
  std::string all;
  for (const data::IntervalRecord& interval : data::intervals_of(record)) {
    const std::string one = other_renderer(interval.renderer, other);
    if (all.find(one) == std::string::npos) all += (all.empty() ? "" : ", ") + one;
  }
  return all;
}

ForceSummary render_again(const protocols::Protocol& protocol, const data::TrialRecord& record,
                          ReplayComparison& out) {
  Summarizer shown(renderers_of(record, false));
  double time = 0;
  out.ticks.reserve(record.samples.size());
  replay(protocol, record, false,
         [&](std::size_t interval, const data::SampleRecord& was, const ReplayedSample& is) {
           if (interval == out.intervals.size()) {
             out.intervals.push_back(interval_of(record, interval));
             time = 0;
           } else {
             time += static_cast<double>(is.period_ns) * 1e-9;
           }
           if (was.period_ns <= 0) out.periods_known = false;
           ReplayedInterval& now = out.intervals.back();
           ++now.ticks;
           if (equals_record(record, was, is)) {
             ++out.equal_ticks;
             ++now.equal_ticks;
           } else if (!out.first_difference) {
             out.first_difference = was.tick;
             out.differing_interval = interval + 1;
           }
           shown.add(time, length(was.force), was.depth, was.contacts);
           out.ticks.push_back({time, interval + 1, &was, rendered(is), {}});
         });
  return shown.over(out.ticks.size());
}

ForceSummary render_other(const protocols::Protocol& protocol, const data::TrialRecord& record,
                          ReplayComparison& out) {
  Summarizer shown(renderers_of(record, true));
  double square_sum = 0;  // N^2
  auto tick = out.ticks.begin();
  replay(
      protocol, record, true,
      [&](std::size_t, const data::SampleRecord& was, const servo::Sample& is) {
        const rendering::Rendering& r = is.rendering;
        shown.add(tick->time, glm::length(r.force), r.deepest.depth, static_cast<int>(r.contacts));
        const double apart = glm::length(r.force - Vec3(was.force[0], was.force[1], was.force[2]));
        square_sum += apart * apart;
        out.max_difference = std::max(out.max_difference, apart);
        tick->other = rendered(is);
        ++tick;
      });
  out.rms_difference = std::sqrt(square_sum / static_cast<double>(out.ticks.size()));
  return shown.over(out.ticks.size());
}

}  // namespace

ReplayComparison compare_with_record(const protocols::Protocol& protocol,
                                     const data::TrialRecord& record, bool compare_other) {
  ReplayComparison out;
  out.recorded = render_again(protocol, record, out);
  if (compare_other) out.other = render_other(protocol, record, out);
  return out;
}

}  // namespace palpate::runner::session
