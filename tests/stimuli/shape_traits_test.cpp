// The table of shapes agrees with the geometry of each shape.

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "stimuli/shapes.h"
#include "stimuli/signed_distance.h"

namespace palpate::stimuli {
namespace {
namespace shape_traits {

bool is_primitive(ShapeKind shape) {
  return shape != ShapeKind::mesh && shape != ShapeKind::compound && shape != ShapeKind::none;
}

/// Whether a change of the description changes the polygons.
template <class Change>
bool depends_on(ShapeKind shape, const Change& change) {
  ObjectSpec spec;
  spec.shape = shape;
  const PolygonSoup before = polygons_of(spec);
  change(spec);
  const PolygonSoup after = polygons_of(spec);
  return before.vertices != after.vertices || before.faces != after.faces;
}

TEST(ShapeTraits, AreTheNumbersThatTheGeometryDependsOn) {
  std::set<std::string> names;
  for (const ShapeKind shape : kShapes) {
    const ShapeTraits traits = traits_of(shape);
    EXPECT_TRUE(names.insert(traits.name).second) << traits.name;
    if (!is_primitive(shape)) continue;
    EXPECT_EQ(traits.radius, depends_on(shape, [](ObjectSpec& s) { s.radius *= 1.5; }))
        << traits.name;
    EXPECT_EQ(traits.height, depends_on(shape, [](ObjectSpec& s) { s.height *= 1.5; }))
        << traits.name;
    EXPECT_EQ(traits.edge, depends_on(shape, [](ObjectSpec& s) { s.edge *= 1.5; })) << traits.name;
    EXPECT_EQ(traits.size, depends_on(shape, [](ObjectSpec& s) { s.size.y *= 1.5; }))
        << traits.name;
    EXPECT_EQ(traits.subdivisions, depends_on(shape, [](ObjectSpec& s) { s.subdivisions -= 1; }))
        << traits.name;
    EXPECT_EQ(traits.segments, depends_on(shape, [](ObjectSpec& s) { s.segments += 8; }))
        << traits.name;
  }
  EXPECT_EQ(names.size(), kShapes.size());
}

TEST(ShapeTraits, AnalyticShapesHaveZeroSignedDistanceOnCorners) {
  for (const ShapeKind shape : kShapes) {
    const ShapeTraits traits = traits_of(shape);
    if (!traits.analytic) continue;
    ObjectSpec spec;
    spec.shape = shape;
    for (const Vec3& corner : polygons_of(spec).vertices)
      EXPECT_NEAR(signed_distance(spec, corner).distance, 0, 1e-12) << traits.name;
  }
  EXPECT_FALSE(traits_of(ShapeKind::mesh).analytic);
  EXPECT_FALSE(traits_of(ShapeKind::compound).analytic);
}

/// Those of runner/participants/shape_lines.h; other shapes have distances on a grid.
TEST(ShapeTraits, SpheresConesCylindersAndCubesHaveFormulas) {
  std::set<std::string> with_formula;
  for (const ShapeKind shape : kShapes) {
    if (traits_of(shape).formula) with_formula.insert(traits_of(shape).name);
    EXPECT_LE(traits_of(shape).formula, traits_of(shape).analytic) << traits_of(shape).name;
  }
  EXPECT_EQ(with_formula, (std::set<std::string>{"sphere", "cone", "cylinder", "cube"}));
}

}  // namespace shape_traits
}  // namespace
}  // namespace palpate::stimuli
