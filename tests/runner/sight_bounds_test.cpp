#include "runner/sight_bounds.h"

#include <gtest/gtest.h>

#include "protocols/parse.h"
#include "runner/scene_builder.h"
#include "stimuli/polygon_soup.h"

namespace palpate::runner {
namespace {

protocols::ViewSpec view() {
  protocols::ViewSpec out;
  out.lower_left = {-0.2, 0.2, -0.1};
  out.lower_right = {0.2, 0.2, -0.1};
  out.upper_left = {-0.2, 0.2, 0.1};
  out.eye = {0, -0.3, 0};
  return out;
}

TEST(SightBounds, PointAtTheEdgeIsTheLimit) {
  // Half way to the screen things may be half as far from the middle.
  const WorkspaceMap workspace{Vec3(0), 2};  // virtual metres are halves
  const auto at = [&](double x, double z) {
    return off_screen(view(), workspace, {}, {Vec3(0), {Vec3(2 * x, 2 * -0.05, 2 * z)}, 0});
  };
  EXPECT_EQ(at(0.0999, 0), "");
  EXPECT_EQ(at(-0.0999, 0.0499), "");
  EXPECT_NE(at(0.101, 0).find("right edge"), std::string::npos);
  EXPECT_NE(at(-0.101, 0).find("left edge"), std::string::npos);
  EXPECT_NE(at(0, 0.051).find("upper edge"), std::string::npos);
  EXPECT_NE(at(0, -0.051).find("lower edge"), std::string::npos);
}

TEST(SightBounds, SizeOffsetTurnAndNoiseCount) {
  const WorkspaceMap workspace{Vec3(0), 1};
  const DrawnBounds bar{Vec3(0), {Vec3(0.08, -0.05, 0), Vec3(-0.08, -0.05, 0)}, 0};
  protocols::SeenSpec seen;
  EXPECT_EQ(off_screen(view(), workspace, seen, bar), "");
  seen.size_ratio = 1.4;
  EXPECT_NE(off_screen(view(), workspace, seen, bar), "");
  seen.size_ratio = 1;
  seen.offset = {0.03, 0, 0};
  EXPECT_NE(off_screen(view(), workspace, seen, bar).find("right"), std::string::npos);
  seen.offset = Vec3(0);
  seen.turn_deg = 90;
  seen.axis = {0, 1, 0};  // upright, it is too long
  EXPECT_NE(off_screen(view(), workspace, seen, bar), "");
  seen.turn_deg = 0;
  seen.noise = 0.01;
  EXPECT_NE(off_screen(view(), workspace, seen, bar), "");
}

protocols::Protocol with_edge(double edge, const std::string& orientation) {
  return protocols::parse_protocol_text(R"({"version": 2, "name": "s", "renderers": ["point"],
    "view": {"screen_m": [[-0.2, 0.2, -0.1], [0.2, 0.2, -0.1], [-0.2, 0.2, 0.1]], "eye_m": [0, -0.3, 0]},
    "orientation": ")" + orientation + R"(",
    "stimuli": [{"name": "a", "shape": "cube", "edge_m": 0.05, "seen": {"what": "object"}}],
    "blocks": [{"name": "b", "task": "rate", "stimuli": ["a"], "level": {"path": "/edge_m"},
      "procedure": {"kind": "constant", "levels": [0.05, )" +
                                            std::to_string(edge) + R"(], "repetitions": 1}}]})",
                                        "s.json");
}

TEST(SightBounds, EveryLevelStaysOnTheScreen) {
  EXPECT_NO_THROW(StimulusLibrary(with_edge(0.08, "fixed")));
  // Turned, its corners reach farther.
  EXPECT_THROW(StimulusLibrary(with_edge(0.08, "uniform")), stimuli::MeshError);
  try {
    StimulusLibrary(with_edge(0.12, "fixed"));
    FAIL();
  } catch (const stimuli::MeshError& error) {
    EXPECT_NE(std::string(error.what()).find("'a at 0.12': /seen/what: leaves the screen"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace palpate::runner
