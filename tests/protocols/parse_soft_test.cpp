// Bounds of soft objects, as in the published schema: accepted at both ends, refused beyond.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "protocols/parse.h"

namespace palpate::protocols {
namespace {
namespace soft_bounds {

using nlohmann::json;

std::vector<std::string> faults_with(const json& soft, double stiffness = 1000) {
  json all{{"young_pa", 20000}};
  all.update(soft);
  const json document{{"version", 1},
                      {"name", "soft"},
                      {"renderers", {"ray"}},
                      {"stimuli",
                       {{{"name", "block"},
                         {"shape", "cube"},
                         {"edge_m", 0.05},
                         {"stiffness_n_per_m", stiffness},
                         {"soft", all}},
                        {{"name", "die"}, {"shape", "cube"}, {"edge_m", 0.05}}}},
                      {"repetitions", 1},
                      {"response", {{"keys", {{"1", "block"}, {"2", "die"}}}}}};
  std::vector<std::string> found;
  try {
    parse_protocol_text(document.dump(), "p.json");
  } catch (const InputError& error) {
    for (const Fault& fault : error.faults()) found.push_back(fault.location);
  }
  return found;
}

using Places = std::vector<std::string>;
const std::string kSoft = "/stimuli/0/soft";

TEST(ParseSoft, NumbersKeepToThePublishedBounds) {
  struct Bounds {
    std::string key;
    double least, most, below, above;
  };
  for (const Bounds& one : std::vector<Bounds>{{"young_pa", 1000, 1e7, 999, 10000001},
                                               {"poisson", 0, 0.495, -0.001, 0.4951},
                                               {"density_kg_per_m3", 100, 20000, 99, 20001},
                                               {"damping_s", 0, 1, -0.001, 1.001},
                                               {"resolution", 2, 24, 1, 25}}) {
    EXPECT_EQ(faults_with({{one.key, one.least}}), Places{}) << one.key;
    EXPECT_EQ(faults_with({{one.key, one.most}}), Places{}) << one.key;
    EXPECT_EQ(faults_with({{one.key, one.below}}), Places{kSoft + "/" + one.key});
    EXPECT_EQ(faults_with({{one.key, one.above}}), Places{kSoft + "/" + one.key});
  }
  EXPECT_EQ(faults_with(json::object(), 200), Places{});
  EXPECT_EQ(faults_with(json::object(), 3000), Places{});
  for (const double wrong : {199.0, 3001.0})
    EXPECT_EQ(faults_with(json::object(), wrong), Places{"/stimuli/0/stiffness_n_per_m"});
}

TEST(ParseSoft, HeldPointsAreLimitedInNumberAndDistance) {
  const std::string fixed = kSoft + "/fixed";
  for (const char* word : {"base", "none"}) EXPECT_EQ(faults_with({{"fixed", word}}), Places{});
  EXPECT_EQ(faults_with({{"fixed", "top"}}), Places{fixed});
  const auto point = [](double x, double y, double z) { return json::array({x, y, z}); };
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      json at = point(0, 0, 0);
      const auto i = static_cast<std::size_t>(axis);
      at[i] = sign * 1000;
      EXPECT_EQ(faults_with({{"fixed", json::array({at})}}), Places{});
      at[i] = sign * 1000.5;
      EXPECT_EQ(faults_with({{"fixed", json::array({point(0, 0, 0), at})}}),
                Places{fixed + "/1/" + std::to_string(axis)});
    }
  }
  EXPECT_EQ(faults_with({{"fixed", json::array({json::array({0, 0})})}}), Places{fixed + "/0"});
  EXPECT_EQ(faults_with({{"fixed", json::array()}}), Places{fixed});
  json many = json::array();
  for (int i = 0; i < 1000; ++i) many.push_back(point(0, 0, 1e-5 * i));
  EXPECT_EQ(faults_with({{"fixed", many}}), Places{});
  many.push_back(point(0, 0, 1));
  EXPECT_EQ(faults_with({{"fixed", many}}), Places{fixed});
}

}  // namespace soft_bounds
}  // namespace
}  // namespace palpate::protocols
