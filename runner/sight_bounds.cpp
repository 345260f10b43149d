#include "runner/sight_bounds.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace palpate::runner {

std::string off_screen(const protocols::ViewSpec& view, const WorkspaceMap& workspace,
                       const protocols::SeenSpec& seen, const DrawnBounds& bounds) {
  constexpr double kNoiseReach = 3;  // sd
  const Vec3 upper_right = view.upper_left + view.lower_right - view.lower_left;
  struct Edge {
    const char* name;
    Vec3 from, to;  ///< as seen, with the screen to the left
  };
  const std::array edges{Edge{"lower", view.lower_left, view.lower_right},
                         Edge{"right", view.lower_right, upper_right},
                         Edge{"upper", upper_right, view.upper_left},
                         Edge{"left", view.upper_left, view.lower_left}};
  const double half = seen.turn_deg * std::numbers::pi / 360;
  const Quat turn(std::cos(half), std::sin(half) * seen.axis);
  const double radius =
      (seen.size_ratio * bounds.radius + kNoiseReach * seen.noise) / workspace.scale;
  double most = 0;
  const char* where = nullptr;
  for (const Edge& edge : edges) {
    // The plane of eye and edge; the screen is on its positive side.
    const Vec3 inwards = glm::normalize(glm::cross(edge.to - view.eye, edge.from - view.eye));
    for (const Vec3& point : bounds.points) {
      const Vec3 from_origin = seen.size_ratio * (point - bounds.origin);
      const Vec3 drawn = bounds.origin + seen.offset + turn * from_origin;
      const double out = radius - glm::dot(workspace.to_device(drawn) - view.eye, inwards);
      if (out <= most) continue;
      most = out;
      where = edge.name;
    }
  }
  if (where == nullptr) return {};
  char text[120];
  std::snprintf(text, sizeof text, "leaves the screen at its %s edge, by %.2g m at the object",
                where, most);
  return text;
}

}  // namespace palpate::runner
