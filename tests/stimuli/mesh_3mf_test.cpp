#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "data/base/random.h"
#include "stimuli/closed_surface.h"
#include "stimuli/mesh_file.h"
#include "stimuli/polygon_soup.h"
#include "tests/shared/zip_file.h"

namespace palpate::stimuli {
namespace {

using palpate::testing::zip_file;
using palpate::testing::ZipForm;

constexpr const char* kRelationships =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
 <Relationship Target="/Metadata/thumbnail.png" Id="a" Type="http://schemas.openxmlformats.org/package/2006/relationships/metadata/thumbnail"/>
 <Relationship Target="/3D/3dmodel.model" Id="b" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>)";

/// A box of 2 x 4 x 6 about the origin, outward; corner k has the sign of axis a in its bit a.
std::string box(int corners = 8) {
  static constexpr int kTriangles[12][3] = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5},
                                            {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                            {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  std::string text = "<mesh><vertices>\n";
  for (int k = 0; k < corners; ++k) {
    text += "<vertex";
    for (int axis = 0; axis < 3; ++axis) {
      text += std::string(" ") + "xyz"[axis] + "=\"" + ((k >> axis & 1) != 0 ? "" : "-") +
              std::to_string(axis + 1) + "\"";
    }
    text += "/>\n";
  }
  text += "</vertices><triangles>\n";
  for (const auto& t : kTriangles) {
    text += "<triangle v1=\"" + std::to_string(t[0]) + "\" v2=\"" + std::to_string(t[1]) +
            "\" v3=\"" + std::to_string(t[2]) + "\"/>\n";
  }
  return text + "</triangles></mesh>";
}

std::string model(const std::string& resources, const std::string& build,
                  const std::string& attributes = "") {
  return R"(<?xml version="1.0" encoding="UTF-8"?>
<model xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" )" +
         attributes + ">\n<metadata name=\"Application\">test</metadata>\n<resources>\n" +
         resources + "\n</resources>\n<build>" + build + "</build>\n</model>\n";
}

std::string object(const std::string& inner, int id = 1, const std::string& more = "") {
  return "<object id=\"" + std::to_string(id) + "\" " + more + ">" + inner + "</object>";
}

const std::string kItem = "<item objectid=\"1\"/>";

std::string package(const std::string& model_text, const ZipForm& form = {}) {
  return zip_file({{"[Content_Types].xml", "<Types/>"},
                   {"_rels/.rels", kRelationships},
                   {"3D/3dmodel.model", model_text}},
                  form);
}

struct Extent {
  Vec3 low{1e9}, high{-1e9};
};
Extent extent_of(const PolygonSoup& soup) {
  Extent e;
  for (const Vec3& v : soup.vertices) {
    e.low = glm::min(e.low, v);
    e.high = glm::max(e.high, v);
  }
  return e;
}

void expect_near(const Vec3& a, const Vec3& b, double scale = 1) {
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(a[axis], b[axis], 1e-12 * scale) << axis;
}

double volume_of(const PolygonSoup& soup) {
  double six = 0;
  for (const auto& f : soup.faces) {
    six += glm::dot(soup.vertices[f[0]], glm::cross(soup.vertices[f[1]], soup.vertices[f[2]]));
  }
  return six / 6;
}

std::string fault_of(const std::string& bytes) {
  try {
    read_mesh("a.3mf", bytes);
    return "taken";
  } catch (const MeshError& error) {
    return error.what();
  }
}
std::string fault_in(const std::string& model_text) { return fault_of(package(model_text)); }

TEST(Mesh3mf, IsReadInItsUnit) {
  for (const auto& [unit, metres] : {std::pair("micron", 1e-6),
                                     {"millimeter", 1e-3},
                                     {"centimeter", 1e-2},
                                     {"inch", 0.0254},
                                     {"foot", 0.3048},
                                     {"meter", 1.0},
                                     {"", 1e-3}}) {
    const std::string attribute =
        *unit == '\0' ? std::string() : "unit=\"" + std::string(unit) + "\"";
    const PolygonSoup soup = read_mesh("a.3MF", package(model(object(box()), kItem, attribute)));
    EXPECT_EQ(soup.vertices.size(), 8U);
    EXPECT_EQ(soup.faces.size(), 12U);
    expect_near(extent_of(soup).high, metres * Vec3(1, 2, 3), metres);
    expect_near(extent_of(soup).low, -metres * Vec3(1, 2, 3), metres);
    EXPECT_NEAR(volume_of(soup), 48 * std::pow(metres, 3), 1e-12 * std::pow(metres, 3));
    EXPECT_GT(soup.coordinate_error, 0);
    EXPECT_LT(soup.coordinate_error, 1e-5 * metres);
    EXPECT_TRUE(soup.group_names.empty());
    EXPECT_EQ(closed_surface(soup).surface.triangles.size(), 12U);
  }
}

TEST(Mesh3mf, EveryFormOfArchiveIsRead) {
  const std::string text = model(object(box()), kItem);
  for (const bool deflated : {false, true}) {
    for (const bool large : {false, true}) {
      for (const char* const comment : {"", "a comment PK\5\6 in it"})
        EXPECT_EQ(read_mesh("a.3mf", package(text, {deflated, large, comment})).faces.size(), 12U);
    }
  }
  // Names of parts have no case; the relationship may be relative.
  std::string relative = kRelationships;
  relative.replace(relative.find("/3D/3dmodel"), 11, "3d/3DModel");
  EXPECT_EQ(read_mesh("a.3mf", zip_file({{"_rels/.rels", relative}, {"3D/3dmodel.model", text}}))
                .faces.size(),
            12U);
}

TEST(Mesh3mf, ItemsAndComponentsArePlaced) {
  // Rows of the matrix stand behind a row vector: x' = y, y' = -x, z' = 2 z, and a shift.
  const std::string turn = "transform=\"0 -1 0 1 0 0 0 0 2 10 20 30\"";
  const std::string resources =
      object(box(), 1, "name=\"lid\"") +
      object("<components><component objectid=\"1\"/><component objectid=\"1\" " + turn +
                 "/></components>",
             2) +
      object(box(), 3, "type=\"support\"");
  const PolygonSoup soup = read_mesh(
      "a.3mf",
      package(model(resources,
                    "<item objectid=\"2\" transform=\"1 0 0 0 1 0 0 0 1 100 0 0\"/>"
                    "<item objectid=\"1\" transform=\"-1 0 0 0 1 0 0 0 1 0 0 0\" printable=\"1\"/>"
                    "<item objectid=\"3\"/>",
                    "unit=\"meter\"")));
  ASSERT_EQ(soup.vertices.size(), 24U);
  ASSERT_EQ(soup.group_names, (std::vector<std::string>{"lid", "lid", "lid"}));
  EXPECT_EQ(std::count(soup.group_of.begin(), soup.group_of.end(), 1U), 12);
  expect_near(soup.vertices[7], Vec3(101, 2, 3), 100);
  expect_near(soup.vertices[15], Vec3(112, 19, 36),
              100);                                // (2, -1, 6) + (10, 20, 30) + (100, 0, 0)
  expect_near(soup.vertices[23], Vec3(-1, 2, 3));  // mirrored, and still outward:
  EXPECT_NEAR(volume_of(soup), 48 + 96 + 48, 1e-9);
}

TEST(Mesh3mf, ObjectsInOtherPartsAreRead) {
  // As slicers write it (production extension).
  const std::string root =
      model(object("<components><component p:path=\"/3D/Objects/Cube.model\" objectid=\"7\" "
                   "transform=\"1 0 0 0 1 0 0 0 1 5 0 0\"/></components>"),
            kItem,
            "unit=\"millimeter\" requiredextensions=\"p\" "
            "xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\"");
  const auto with = [&](const std::string& other) {
    return zip_file({{"_rels/.rels", kRelationships},
                     {"3D/3dmodel.model", root},
                     {"3D/Objects/cube.model", other}});
  };
  const PolygonSoup soup = read_mesh("a.3mf", with(model(object(box(), 7), "")));
  expect_near(extent_of(soup).high, Vec3(0.006, 0.002, 0.003));
  EXPECT_NE(fault_of(with(model(object(box(), 7), "", "unit=\"inch\"")))
                .find("one unit in all parts of the package, found another in "
                      "\"/3D/Objects/Cube.model\""),
            std::string::npos);
  EXPECT_NE(fault_of(with(model(object(box(), 8), ""))).find("the id of an object, found 7"),
            std::string::npos);
  EXPECT_EQ(fault_of(package(root)),
            "a.3mf: 3D/3dmodel.model: line 5: expected the name of a file in the archive, found "
            "\"/3D/Objects/Cube.model\"");
}

TEST(Mesh3mf, FaultsNameFileLineAndWhatWasExpected) {
  const std::string at = "a.3mf: 3D/3dmodel.model: line ";
  const auto expect = [&](const std::string& text, const std::string& fault) {
    EXPECT_EQ(fault_in(text), at + fault);
  };
  const auto changed = [](std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  const std::string good = model(object(box()), kItem, "unit=\"inch\"");
  EXPECT_EQ(fault_in(good), "taken");
  expect(changed(good, "inch", "mm"),
         "2: expected micron, millimeter, centimeter, inch, foot or meter, found \"mm\"");
  expect(changed(good, "x=\"1\"", "x=\"1,5\""), "7: expected a finite number x, found \"1,5\"");
  expect(changed(good, "y=\"-2\"", "why=\"-2\""), "6: expected a finite number y, found nothing");
  expect(changed(good, "v2=\"4\"", "v2=\"8\""),
         "15: expected numbers of vertices below 8, found \"8\"");
  expect(changed(good, "v3=\"6\"", "v3=\"-6\""),
         "15: expected a whole number v3 below 2^31, found \"-6\"");
  expect(changed(good, "</mesh>", "</mush>"), "27: expected XML, found \"mismatched tag\"");
  expect(changed(good, "objectid=\"1\"", "objectid=\"2\""),
         "29: expected the id of an object, found 2");
  expect(changed(good, "objectid=\"1\"", "objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 0 0\""),
         "29: expected a transform of twelve finite numbers, found \"1 0 0 0 1 0 0 0 1 0 0\"");
  expect(changed(good, "objectid=\"1\"", "objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 0 0 0 0\""),
         "29: expected a transform that leaves a solid, found \"1 0 0 0 1 0 0 0 0 0 0 0\"");
  expect(changed(good, "core/2015/02", "core/2095/02"),
         "2: expected a model of 3MF, core specification "
         "(http://schemas.microsoft.com/3dmanufacturing/core/2015/02), found nothing");
  expect(changed(good, "unit=", "requiredextensions=\"b\" xmlns:b=\"http://beams\" unit="),
         "2: expected a file that requires no extension but production and materials, found "
         "\"http://beams\"");
  expect(model(object(box()) + "\n" + object(box()), kItem),
         "28: expected an id that no other object has, found \"1\"");
  expect(model(object(""), kItem),
         "5: expected an object of triangles or components, found neither");
  expect(model(object("<components><component objectid=\"1\"/></components>"), kItem),
         "5: expected objects within at most 100 others, found a deeper one");
  EXPECT_EQ(fault_in(model(object(box()), "")),
            "a.3mf: expected an item in the build that is an object of the type model, found none");
  EXPECT_EQ(fault_in("<!DOCTYPE lolz [<!ENTITY a \"aaaa\">]><model/>"),
            "a.3mf: 3D/3dmodel.model: line 1: expected no document type, found \"DOCTYPE\"");
  EXPECT_EQ(fault_in(""),
            "a.3mf: 3D/3dmodel.model: line 1: expected XML, found \"no element found\"");
  // An open mesh is named by the object and its own numbers.
  std::string open = good;
  const std::size_t last = open.rfind("<triangle ");
  open.erase(last, open.find("/>", last) + 2 - last);
  try {
    closed_surface(
        read_mesh("a.3mf", package(changed(open, "<object ", "<object name=\"gear\" "))));
    ADD_FAILURE();
  } catch (const MeshError& error) {
    EXPECT_NE(std::string(error.what()).find("of object 1 \"gear\""), std::string::npos)
        << error.what();
  }
}

TEST(Mesh3mf, RefusesOtherArchives) {
  EXPECT_EQ(fault_of(""), "a.3mf: expected a ZIP archive, found an empty file");
  EXPECT_EQ(fault_of("solid cube"),
            "a.3mf: expected a ZIP archive, found another file, or one cut off");
  EXPECT_EQ(
      fault_of(zip_file({{"word/document.xml", "<x/>"}})),
      "a.3mf: _rels/.rels: expected a 3MF package, which has this part, found an archive of 1 "
      "other files");
  EXPECT_EQ(fault_of(zip_file({{"_rels/.rels", "<x/>"}})),
            "a.3mf: _rels/.rels: expected the relationship to a 3D model, found none");
  EXPECT_EQ(fault_of(zip_file({{"_rels/.rels", kRelationships}})),
            "a.3mf: _rels/.rels: expected the name of a file in the archive, found "
            "\"/3D/3dmodel.model\"");
  EXPECT_EQ(fault_of(zip_file({{"a", ""}, {"A", ""}})),
            "a.3mf: \"A\": expected a name that no other file has, found it twice");
}

TEST(Mesh3mf, MemoryStaysInProportionToTheFile) {
  // 40 MB of blanks in 40 KB.
  EXPECT_NE(fault_in(model(object(box()), kItem) + std::string(40'000'000, ' '))
                .find("packed to waste memory"),
            std::string::npos);
  // 12 triangles doubled 40 times.
  const auto doubled = [](const std::string& first) {
    std::string resources = first;
    for (int id = 2; id < 42; ++id) {
      const std::string part = "<component objectid=\"" + std::to_string(id - 1) + "\"/>";
      resources += object("<components>" + part + part + "</components>", id);
    }
    return model(resources, "<item objectid=\"41\"/>");
  };
  EXPECT_NE(fault_in(doubled(object(box()))).find("expected at most 131072 triangles in all items"),
            std::string::npos);
  EXPECT_NE(fault_in(doubled(object(box(), 1, "type=\"support\"")))
                .find("expected at most 131072 objects in all items"),
            std::string::npos);
}

TEST(Mesh3mf, DamagedFilesAreRefusedOrRead) {
  const std::string text = model(object(box()), kItem);
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  int taken = 0;
  for (const bool deflated : {false, true}) {
    for (const bool large : {false, true}) {
      const std::string good = package(text, {deflated, large, ""});
      for (std::size_t size = 0; size < good.size(); size += 7)
        EXPECT_NE(fault_of(good.substr(0, size)), "taken") << size;
      for (int i = 0; i < 2000; ++i) {
        std::string bad = good;
        for (int k = 0; k < 3; ++k)
          bad[random.below(bad.size())] = static_cast<char>(random.below(256));
        taken += fault_of(bad) == "taken" ? 1 : 0;
      }
    }
  }
  EXPECT_GT(taken, 0);     // bytes that nobody reads: dates, other files
  EXPECT_LT(taken, 4000);  // a checksum protects all others
}

}  // namespace
}  // namespace palpate::stimuli
