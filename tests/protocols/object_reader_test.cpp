// Members of a JSON object by kind: accepted values, values that leave the variable unchanged, and
// the text and place of faults.

#include "protocols/object_reader.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocols/parse.h"

namespace palpate::protocols {
namespace {
namespace reading {

/// Reads one member and returns its faults.
template <class Read>
std::vector<Fault> faults_when(const std::string& text, Read read) {
  FaultList found("file.json");
  const nlohmann::json value = nlohmann::json::parse(text);
  ObjectReader reader(value, "/at", found);
  read(reader);
  try {
    found.throw_if_any();
  } catch (const InputError& error) {
    return error.faults();
  }
  return {};
}

std::string only(const std::vector<Fault>& faults) {
  if (faults.size() != 1) return std::to_string(faults.size()) + " faults";
  return faults[0].location + ": " + faults[0].expected;
}

TEST(ObjectReader, ASeedIsAWholeNumberHoweverWritten) {
  const auto seed_of = [](const std::string& written) {
    std::uint64_t seed = 77;
    const auto faults = faults_when("{\"seed\": " + written + "}",
                                    [&](ObjectReader& reader) { reader.seed("seed", seed); });
    if (!faults.empty()) {
      EXPECT_EQ(faults[0].location, "/at/seed");
      EXPECT_EQ(seed, 77U) << "left as it was";
      return std::optional<std::uint64_t>();
    }
    return std::optional<std::uint64_t>(seed);
  };
  EXPECT_EQ(seed_of("0"), 0U);
  EXPECT_EQ(seed_of("0.0"), 0U);
  EXPECT_EQ(seed_of("2e3"), 2000U);
  EXPECT_EQ(seed_of("2000.0"), 2000U);
  EXPECT_EQ(seed_of("9007199254740992.0"), 9007199254740992U) << "2^53";
  EXPECT_EQ(seed_of("18446744073709551615"), 18446744073709551615U);
  for (const char* wrong : {"9007199254740994.0", "2.5", "-1", "-1.0", "1e300", "\"7\"", "true",
                            "null", "[1]", "18446744073709551616"}) {
    EXPECT_EQ(seed_of(wrong), std::nullopt) << wrong;
  }
}

TEST(ObjectReader, NumbersKeepToTheirRange) {
  const NumberRange closed{-2, 5, "m"}, open{0, 5, "N", true};
  const auto number_of = [](const std::string& written, const NumberRange& range) {
    double number = 0.25;
    const auto faults = faults_when("{\"x\": " + written + "}", [&](ObjectReader& reader) {
      reader.number("x", number, range);
    });
    return std::pair(number, only(faults));
  };
  for (const auto& [written, value] :
       std::vector<std::pair<std::string, double>>{{"-2", -2}, {"5", 5}, {"1.5", 1.5}, {"0", 0}}) {
    EXPECT_EQ(number_of(written, closed), std::pair(value, std::string("0 faults")));
  }
  EXPECT_EQ(number_of("-2.001", closed),
            std::pair(0.25, std::string("/at/x: expected a number from -2 to 5 m, found -2.001")));
  EXPECT_EQ(number_of("5.5", closed).second, "/at/x: expected a number from -2 to 5 m, found 5.5");
  EXPECT_EQ(number_of("0", open).second, "/at/x: expected a number above 0 up to 5 N, found 0");
  EXPECT_EQ(number_of("1e-9", open).first, 1e-9);
  EXPECT_EQ(number_of("5", open).first, 5);
  EXPECT_EQ(number_of("true", closed).second,
            "/at/x: expected a number from -2 to 5 m, found true");
}

TEST(ObjectReader, IntegersMayBeWrittenWithAZeroFraction) {
  const auto integer_of = [](const std::string& written) {
    int number = 7;
    const auto faults = faults_when("{\"n\": " + written + "}", [&](ObjectReader& reader) {
      reader.integer("n", number, {1, 100});
    });
    return std::pair(number, faults.size());
  };
  EXPECT_EQ(integer_of("76.0"), std::pair(76, std::size_t{0}));
  EXPECT_EQ(integer_of("1"), std::pair(1, std::size_t{0}));
  EXPECT_EQ(integer_of("100"), std::pair(100, std::size_t{0}));
  for (const char* wrong : {"0", "101", "76.5", "\"76\"", "null", "1e20"})
    EXPECT_EQ(integer_of(wrong), std::pair(7, std::size_t{1})) << wrong;
}

TEST(ObjectReader, NullMeansAMissingOptionalNumber) {
  std::optional<double> number = 3;
  std::optional<int> integer = 4;
  const auto read = [&](ObjectReader& reader) {
    reader.number("x", number, {0, 10});
    reader.integer("n", integer, {0, 10});
  };
  EXPECT_TRUE(faults_when(R"({"x": null, "n": null})", read).empty());
  EXPECT_EQ(number, 3);
  EXPECT_EQ(integer, 4);
  EXPECT_TRUE(faults_when(R"({"x": 1.5, "n": 2})", read).empty());
  EXPECT_EQ(number, 1.5);
  EXPECT_EQ(integer, 2);
  EXPECT_EQ(faults_when(R"({"x": 11, "n": 2.5})", read).size(), 2U);
  EXPECT_EQ(number, 1.5);
  EXPECT_EQ(integer, 2);
}

TEST(ObjectReader, NamesAreLettersDigitsAndDashesInside) {
  const auto takes = [](const std::string& word) {
    std::string name = "before";
    const bool good = faults_when(nlohmann::json{{"name", word}}.dump(), [&](ObjectReader& reader) {
                        reader.name("name", name);
                      }).empty();
    EXPECT_EQ(name, good ? word : "before");
    return good;
  };
  for (const std::string& good : {std::string("a"), std::string("Ho-2000"), std::string("9-"),
                                  std::string("azAZ09"), std::string(64, 'x')})
    EXPECT_TRUE(takes(good)) << good;
  for (const std::string& wrong : {std::string(), std::string("-a"), std::string("a b"),
                                   std::string("a_b"), std::string("é"), std::string(65, 'x')})
    EXPECT_FALSE(takes(wrong)) << wrong;
  std::string name;
  EXPECT_EQ(only(faults_when("{}", [&](ObjectReader& reader) { reader.name("name", name); })),
            "/at/name: missing; this key is required");
}

TEST(ObjectReader, VectorsAndRotationsHaveTheirNumbersInOrder) {
  Vec3 v(7);
  Quat q(1, 0, 0, 0);
  const auto read = [&](ObjectReader& reader) {
    reader.vector("v", v, {-1, 1, "m"});
    reader.quaternion("q", q);
  };
  EXPECT_TRUE(faults_when(R"({"v": [0.1, -0.2, 0.3], "q": [0.5, 0.1, -0.7, 0.5]})", read).empty());
  EXPECT_EQ(v, Vec3(0.1, -0.2, 0.3));
  EXPECT_NEAR(q.w, 0.5, 1e-6);
  EXPECT_NEAR(q.x, 0.1, 1e-6);
  EXPECT_NEAR(q.y, -0.7, 1e-6);
  EXPECT_NEAR(q.z, 0.5, 1e-6);
  EXPECT_NEAR(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z, 1, 1e-15) << "normalised";
  EXPECT_EQ(only(faults_when(R"({"v": [0, 2, 0]})", read)),
            "/at/v/1: expected a number from -1 to 1 m, found 2");
  EXPECT_EQ(only(faults_when(R"({"v": [0, 1]})", read)),
            "/at/v: expected an array of 3 numbers, found [0,1]");
  EXPECT_EQ(
      only(faults_when(R"({"q": [0.5, 0.5, 0.5, 0.6]})", read)),
      "/at/q: expected a unit quaternion [w, x, y, z] (within 1e-6), found [0.5,0.5,0.5,0.6] of "
      "length 1.053565375");
  EXPECT_TRUE(faults_when(R"({"q": [1.0000009, 0, 0, 0]})", read).empty());
  EXPECT_EQ(faults_when(R"({"q": [1.0000011, 0, 0, 0]})", read).size(), 1U);
}

TEST(ObjectReader, TextsAndBooleansAreNotConverted) {
  std::string text = "before";
  bool truth = false;
  const auto read = [&](ObjectReader& reader) {
    reader.text("t", text);
    reader.boolean("b", truth);
  };
  EXPECT_TRUE(faults_when(R"({"t": "", "b": true})", read).empty());
  EXPECT_EQ(text, "");
  EXPECT_TRUE(truth);
  EXPECT_EQ(only(faults_when(R"({"t": 4})", read)), "/at/t: expected a text, found 4");
  EXPECT_EQ(only(faults_when(R"({"b": 0})", read)), "/at/b: expected true or false, found 0");
  EXPECT_EQ(only(faults_when("{\"t\": \"a\\u0000b\"}", read)).substr(0, 40),
            "/at/t: expected a text without U+0000, f");
  EXPECT_EQ(text, "");
  EXPECT_TRUE(truth);
}

TEST(ObjectReader, ArraysHaveBoundsAndObjectsAreObjects) {
  const auto read = [](ObjectReader& reader) { reader.array("a", 2, 3); };
  EXPECT_TRUE(faults_when(R"({"a": [1, 2]})", read).empty());
  EXPECT_TRUE(faults_when(R"({"a": [1, 2, 3]})", read).empty());
  EXPECT_EQ(only(faults_when(R"({"a": [1]})", read)),
            "/at/a: expected an array of 2 to 3 elements, found 1");
  EXPECT_EQ(only(faults_when(R"({"a": [1, 2, 3, 4]})", read)),
            "/at/a: expected an array of 2 to 3 elements, found 4");
  EXPECT_EQ(only(faults_when(R"({"a": {}})", read)),
            "/at/a: expected an array of 2 to 3 elements, found {}");
  EXPECT_EQ(only(faults_when("[1]", read)), "/at: expected an object, found [1]");
}

TEST(FoundText, ShowsSixtyCharactersAtMost) {
  EXPECT_EQ(found_text("abc"), ", found \"abc\"");
  EXPECT_EQ(found_text(nlohmann::json::parse(R"({"a":[1,"x",null],"b":{}})")),
            R"(, found {"a":[1,"x",null],"b":{}})");
  EXPECT_EQ(found_text(std::string(58, 'x')), ", found \"" + std::string(58, 'x') + "\"");
  EXPECT_EQ(found_text(std::string(59, 'x')), ", found \"" + std::string(56, 'x') + "...");
  EXPECT_EQ(found_text(std::string(100000, 'x')), ", found \"" + std::string(56, 'x') + "...");
  EXPECT_EQ(found_text("ü"), ", found \"\\u00fc\"") << "ASCII only";
  const nlohmann::json numbers(std::vector<int>(1000, 1));
  EXPECT_EQ(found_text(numbers).size(), std::string(", found ").size() + 60);
}

TEST(FoundText, BeginsWithTheValueAsItIsWritten) {
  std::string letters;
  for (int i = 0; i < 200; ++i) letters += static_cast<char>('a' + i % 26);
  for (const nlohmann::json& value :
       {nlohmann::json(letters), nlohmann::json::array({letters, letters}),
        nlohmann::json{{"k", letters}}, nlohmann::json(12345.5), nlohmann::json("short")}) {
    const std::string whole = value.dump(), shown = found_text(value);
    const std::string begin = shown.substr(std::string(", found ").size(), 40);
    EXPECT_TRUE(whole.starts_with(begin)) << shown;
  }
}

TEST(ObjectReader, UnknownKeysAreNamedWithTheNearestKnown) {
  bool truth = false;
  const auto read = [&](ObjectReader& reader) {
    reader.boolean("feedback", truth);
    reader.refuse_unknown_keys();
  };
  EXPECT_TRUE(faults_when(R"({"feedback": true})", read).empty());
  const std::string near = only(faults_when(R"({"feedbak": true})", read));
  EXPECT_EQ(near.substr(0, 13), "/at/feedbak: ");
  EXPECT_NE(near.find("feedback"), std::string::npos) << near;
}

}  // namespace reading
}  // namespace
}  // namespace palpate::protocols
