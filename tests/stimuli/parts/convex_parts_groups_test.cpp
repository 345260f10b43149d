// Solids whose parts are groups or objects of one file.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <string>
#include <vector>

#include "stimuli/convex_mesh.h"
#include "stimuli/mesh_file.h"
#include "stimuli/parts/convex_parts.h"
#include "stimuli/parts/triangle_surface.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "tests/stimuli/concave_solids.h"
#include "tests/stimuli/part_checks.h"
#include "tests/stimuli/single_precision.h"

namespace palpate::stimuli {
namespace {

using checks::refusal;
using checks::volume;

// An .obj of several boxes, each a group; `faces` of the first one are left out.
std::string boxes_text(const std::vector<Vec3>& at, const char* statement, int left_out = 0) {
  std::string text;
  for (std::size_t b = 0; b < at.size(); ++b) {
    const PolygonSoup box = cube(0.02);
    text += std::string(statement) + " box " + std::to_string(b) + "\n";
    for (const Vec3& vertex : box.vertices) {
      const Vec3 place = vertex + at[b];
      text += "v " + std::to_string(place.x) + " " + std::to_string(place.y) + " " +
              std::to_string(place.z) + "\n";
    }
    for (std::size_t f = b == 0 ? static_cast<std::size_t>(left_out) : 0; f < 6; ++f) {
      text += "f";
      for (const std::uint32_t corner : box.faces[f])
        text += " " + std::to_string(8 * b + corner + 1);
      text += "\n";
    }
  }
  return text;
}

TEST(ConvexParts, ConvexMeshIsExactlyItsOnlyPart) {
  for (const PolygonSoup& soup : {cube(0.06), cone(0.03, 0.06, 32), icosphere(0.03, 2)}) {
    const ConvexMesh plain(soup);
    const std::vector<ConvexMesh> parts = convex_parts(soup);
    ASSERT_EQ(parts.size(), 1U);
    ASSERT_EQ(parts[0].facets().size(), plain.facets().size());
    for (std::size_t f = 0; f < plain.facets().size(); ++f) {
      EXPECT_EQ(parts[0].facets()[f].normal, plain.facets()[f].normal);
      EXPECT_EQ(parts[0].facets()[f].offset, plain.facets()[f].offset);
    }
    ASSERT_EQ(parts[0].vertices().size(), plain.vertices().size());
    for (std::size_t v = 0; v < plain.vertices().size(); ++v)
      EXPECT_EQ(parts[0].vertices()[v], plain.vertices()[v]);
  }
}

TEST(ConvexPartsOfGroups, ClosedGroupsOfAFileAreParts) {
  for (const char* statement : {"g", "o"}) {
    // Side by side, touching; and through each other.
    for (const double apart : {0.02, 0.013}) {
      const PolygonSoup soup = read_mesh(
          "boxes.obj", boxes_text({Vec3(0), Vec3(apart, 0, 0), Vec3(0, apart, 0)}, statement));
      const std::vector<ConvexMesh> parts = convex_parts(soup);
      ASSERT_EQ(parts.size(), 3U);
      for (const ConvexMesh& part : parts) EXPECT_NEAR(volume(part), 8e-6, 1e-12);
    }
  }
}

TEST(ConvexPartsOfGroups, AnOpenGroupBesideClosedOnesIsNamed) {
  const PolygonSoup soup = read_mesh("boxes.obj", boxes_text({Vec3(0), Vec3(0.03, 0, 0)}, "g", 2));
  const std::string text = refusal(soup);
  EXPECT_NE(text.find("not closed by themselves: open: edge"), std::string::npos) << text;
}

/// A cube as a group of a soup.
/// \param turned  all its faces, as for a void
void add_cube(PolygonSoup& soup, const std::string& name, double edge, const Vec3& at,
              bool turned = false) {
  const PolygonSoup box = cube(edge);
  const auto first = static_cast<std::uint32_t>(soup.vertices.size());
  for (const Vec3& vertex : box.vertices) soup.vertices.push_back(vertex + at);
  for (std::vector<std::uint32_t> face : box.faces) {
    for (std::uint32_t& corner : face) corner += first;
    if (turned) std::reverse(face.begin(), face.end());
    soup.faces.push_back(std::move(face));
    soup.group_of.push_back(static_cast<std::uint32_t>(soup.group_names.size()));
  }
  soup.group_names.push_back(name);
}

/// m^3; the groups must have plane convex faces.
double volume_of_groups(const PolygonSoup& soup) {
  double volume = 0;
  for (const SolidGroup& group : solid_groups(soup)) {
    TriangleSurface triangles;
    for (const auto& face : group.soup.faces) {
      for (std::size_t k = 2; k < face.size(); ++k)
        triangles.push_back({group.soup.vertices[face[0]], group.soup.vertices[face[k - 1]],
                             group.soup.vertices[face[k]]});
    }
    volume += bulk_of(triangles).volume;
  }
  return volume;
}

TEST(ConvexParts, LargeMeshesAreConvexAsTheirEdgesSay) {
  PolygonSoup ball = icosphere(0.05, 6);  // 81,920 triangles
  EXPECT_TRUE(convex_as_it_is(ball));
  PolygonSoup rounded = ball;
  rounded.coordinate_error = 3e-9;
  for (Vec3& v : rounded.vertices) v = checks::single_precision(v);
  EXPECT_TRUE(convex_as_it_is(rounded));
  PolygonSoup far = ball;  // a corner of no face
  far.vertices.emplace_back(1, 0, 0);
  EXPECT_EQ(convex_as_it_is(far).has_value(), convex_as_it_is(ball).has_value());
  PolygonSoup dented = ball;
  dented.vertices[0] *= 1 - 4e-4;  // deeper than the corners round it, 0.7 mm from it
  EXPECT_FALSE(convex_as_it_is(dented));
  PolygonSoup wavy = ball;
  for (Vec3& v : wavy.vertices) v *= 1 + 0.1 * std::sin(100 * v.x);
  EXPECT_FALSE(convex_as_it_is(wavy));
  for (const double far_away : {std::nan(""), HUGE_VAL, 1e200}) {
    PolygonSoup broken = wavy;
    for (std::size_t v = 0; v < broken.vertices.size(); v += 7) broken.vertices[v].y = far_away;
    EXPECT_FALSE(convex_as_it_is(broken)) << far_away;
  }
}

TEST(ConvexPartsOfGroups, VoidGroupBelongsToTheGroupAroundIt) {
  // In either order; in a shell inside a void of a larger shell, it belongs to the inner shell.
  for (const bool void_first : {false, true}) {
    PolygonSoup soup;
    if (void_first) add_cube(soup, "cavity", 0.02, Vec3(0.005, 0, 0), true);
    add_cube(soup, "shell", 0.06, Vec3(0));
    if (!void_first) add_cube(soup, "cavity", 0.02, Vec3(0.005, 0, 0), true);
    add_cube(soup, "beside", 0.06, Vec3(0.1, 0, 0));
    EXPECT_NEAR(volume_of_groups(soup), 2 * 0.06 * 0.06 * 0.06 - 8e-6, 1e-15);
    EXPECT_FALSE(convex_as_it_is(soup));
  }
  PolygonSoup nested;
  add_cube(nested, "outer", 0.1, Vec3(0));
  add_cube(nested, "gap", 0.08, Vec3(0), true);
  add_cube(nested, "core", 0.06, Vec3(0));
  add_cube(nested, "hole", 0.02, Vec3(0), true);
  EXPECT_NEAR(volume_of_groups(nested), 1e-3 - 0.512e-3 + 0.216e-3 - 0.008e-3, 1e-15);
  ASSERT_EQ(solid_groups(nested).size(), 2U);
  EXPECT_EQ(solid_groups(nested)[1].name, "group 'core'");
  EXPECT_EQ(solid_groups(nested)[1].soup.faces.size(), 12U);
}

TEST(ConvexPartsOfGroups, SeveralGroupsShellOwnsItsVoid) {
  PolygonSoup soup;
  add_cube(soup, "sides", 0.06, Vec3(0));
  add_cube(soup, "cavity", 0.02, Vec3(0), true);
  soup.group_of[0] = static_cast<std::uint32_t>(soup.group_names.size());
  soup.group_names.push_back("lid");
  EXPECT_NEAR(volume_of_groups(soup), 0.06 * 0.06 * 0.06 - 8e-6, 1e-15);
}

TEST(ConvexPartsOfGroups, AVoidOutsideASolidIsNamed) {
  for (const Vec3& at : {Vec3(0.1, 0, 0), Vec3(0.03, 0, 0)}) {  // beside the solid; half inside it
    PolygonSoup soup;
    add_cube(soup, "shell", 0.06, Vec3(0));
    add_cube(soup, "cavity", 0.02, at, true);
    EXPECT_EQ(refusal(soup),
              "group 'cavity': inside out: all faces are clockwise seen from outside, as of a "
              "void; expected counter-clockwise, or another closed group round it");
  }
}

TEST(ConvexPartsOfGroups, ManyGroupsTakeTheirOwnVerticesOnly) {
  PolygonSoup soup;
  const auto add = [&](std::size_t count) {
    for (std::size_t i = soup.group_names.size(); i < count; ++i) {
      const std::size_t row = i / 25 % 25, layer = i / 625;
      add_cube(soup, std::to_string(i), 0.01,
               0.03 * Vec3(double(i % 25), double(row), double(layer)));
    }
  };
  add(3000);
  const std::vector<ConvexMesh> parts = convex_parts(soup);
  ASSERT_EQ(parts.size(), 3000U);
  EXPECT_EQ(parts[1234].vertices().size(), 8U);
  EXPECT_LT(glm::length(parts[1234].centre() - 0.03 * Vec3(9, 24, 1)), 1e-12);
  add(10001);
  EXPECT_EQ(refusal(soup),
            "too many groups: expected at most 10000 that are closed by themselves, found more");
}

TEST(ConvexPartsOfGroups, GroupsFacesKeepTheirNumbersInMessages) {
  PolygonSoup soup;
  add_cube(soup, "closed", 0.02, Vec3(0));
  add_cube(soup, "open", 0.02, Vec3(0.1, 0, 0));
  soup.faces.pop_back();
  soup.group_of.pop_back();
  const std::string text = refusal(soup);
  bool named = false;
  for (std::uint32_t f = 6; f < 11; ++f) {
    std::string corners;
    for (const std::uint32_t corner : soup.faces[f])
      corners += (corners.empty() ? "" : " ") + std::to_string(corner);
    named = named || text.find(" of face " + std::to_string(f) + " (vertices " + corners +
                               ") has no face") != std::string::npos;
  }
  EXPECT_TRUE(named) << text;
}

TEST(ConvexPartsOfGroups, GroupsOfOneSurfaceAreOneSolid) {
  PolygonSoup soup = solids::l_shape().soup;
  soup.group_names = {"ends", "sides"};
  for (std::size_t f = 0; f < soup.faces.size(); ++f) soup.group_of.push_back(f < 2 ? 0 : 1);
  EXPECT_TRUE(solid_groups(soup).empty());
  EXPECT_NE(refusal(soup).find("not convex"), std::string::npos) << refusal(soup);
}

}  // namespace
}  // namespace palpate::stimuli
