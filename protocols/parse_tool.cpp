#include "protocols/parse_tool.h"

#include <glm/geometric.hpp>
#include <string>

namespace palpate::protocols {
namespace {

using nlohmann::json;

constexpr NumberRange kToolPlace{-10, 10, "m"};
constexpr NumberRange kWorld{-1000, 1000, "m"};
constexpr NumberRange kGravity{-1000, 1000, "m/s^2"};
constexpr NumberRange kFactor{0, 100, "", true};
constexpr double kThinnest = 0.0005;  // m; thinner than any mesh can follow
constexpr NumberRange kRadius{0, 0.05, "m"};
constexpr double kShortest = 1e-6;  // m: a shorter segment is a slip of the decimal point

ToolSegmentSpec read_segment(ObjectReader& reader) {
  ToolSegmentSpec segment;
  reader.vector("from_m", segment.from, kToolPlace, Presence::required);
  reader.vector("to_m", segment.to, kToolPlace, Presence::required);
  reader.refuse_unknown_keys();
  return segment;
}

}  // namespace

void read_tool(ObjectReader& reader, ToolSpec& tool) {
  reader.section("tool", [&](ObjectReader& section) {
    section.number("radius_m", tool.radius, kRadius);
    const json* const list =
        section.array("segments", 1, ToolSpec::kMostSegments, Presence::required);
    if (list == nullptr) return;
    FaultList& faults = section.faults();
    for (std::size_t i = 0; i < list->size(); ++i) {
      const std::string pointer = child_pointer(section.pointer("segments"), i);
      const std::size_t before = faults.count();
      ObjectReader item((*list)[i], pointer, faults);
      const ToolSegmentSpec segment = read_segment(item);
      if (faults.count() == before && !(glm::distance(segment.from, segment.to) >= kShortest)) {
        faults.add(item.pointer("to_m"),
                   "expected another point than from_m, at least 1e-6 m from it: a segment has a "
                   "length");
      }
      tool.segments.push_back(segment);
    }
  });
}

void check_radius(ObjectReader& reader, const ToolSpec& tool, bool soft) {
  if (soft ? tool.radius == 0 || tool.radius >= kThinnest : tool.radius == 0) return;
  reader.faults().add(
      reader.pointer("tool") + "/radius_m",
      soft ? "expected 0.0005 to 0.05 m, or 0 for 0.002 m: a tool on a soft object has a radius"
           : "expected 0: objects are rigid, and rigid objects are touched by segments without "
             "thickness");
}

void read_reach(ObjectReader& reader, std::optional<ReachSpec>& reach) {
  reader.section("reach", [&](ObjectReader& section) {
    ReachSpec& read = reach.emplace();
    section.number("factor", read.factor, kFactor, Presence::required);
    const json* const pivot = section.member("pivot");
    if (pivot == nullptr) return;
    if (pivot->is_array()) {
      read.pivot = ReachSpec::Pivot::point;
      section.vector("pivot", read.point, kWorld);
    } else if (pivot->is_string()) {
      read_choice(*pivot, section.pointer("pivot"), read.pivot,
                  {{"grip", ReachSpec::Pivot::grip}, {"tail", ReachSpec::Pivot::tail}},
                  section.faults());
    } else {
      section.faults().add(
          section.pointer("pivot"),
          "expected 'grip', 'tail' or a point [x, y, z] of the world" + found_text(*pivot));
    }
  });
}

void read_gravity(ObjectReader& reader, Vec3& gravity) {
  reader.vector("gravity_m_per_s2", gravity, kGravity);
}

}  // namespace palpate::protocols
