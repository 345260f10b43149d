#include "data/base/json_text.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace palpate::data {
namespace {

/// Nested arrays or objects of this depth.
std::string nested(int depth, bool objects) {
  std::string begin, end;
  for (int i = 0; i < depth; ++i) {
    begin += objects ? R"({"a":)" : "[";
    end += objects ? "}" : "]";
  }
  return begin + (objects ? "1" : "") + end;
}

std::string fault_of(const std::string& text) {
  try {
    read_json(text);
    return "";
  } catch (const JsonError& error) {
    EXPECT_TRUE(json_or_discarded(text).is_discarded());
    EXPECT_THROW(read_ordered_json(text), JsonError);
    return error.what();
  }
}

TEST(JsonText, IsReadToADepthOf64) {
  for (const bool objects : {false, true}) {
    EXPECT_EQ(read_json(nested(64, objects)).dump(), nested(64, objects));
    EXPECT_EQ(read_ordered_json(nested(64, objects)).dump(), nested(64, objects));
    for (const int depth : {65, 100'000}) {
      EXPECT_EQ(fault_of(nested(depth, objects)),
                "expected objects and arrays at most 64 deep within each other, found deeper ones");
    }
  }
  // Side by side they are not deep.
  std::string wide = "[[]";
  for (int i = 0; i < 1000; ++i) wide += ",[]";
  EXPECT_EQ(read_json(wide + "]").size(), 1001U);
}

TEST(JsonText, FaultsNameTheirPlace) {
  EXPECT_EQ(fault_of("[1, x]"), "expected JSON in UTF-8, found other text at byte 4");
  EXPECT_EQ(fault_of(""), "expected JSON in UTF-8, found other text at byte 0");
  EXPECT_EQ(fault_of("[1] 2"), "expected JSON in UTF-8, found other text at byte 4");
  EXPECT_NE(fault_of("\"\xff\""), "");
  EXPECT_EQ(fault_of("[1e999]"), "expected JSON with numbers below 1e308, found a larger one");
  try {
    read_json("[1, x]");
    ADD_FAILURE();
  } catch (const JsonError& error) {
    EXPECT_EQ(error.byte, 4U);
  }
}

TEST(JsonText, KeysKeepTheirOrderOnRequest) {
  EXPECT_EQ(read_ordered_json(R"({"b":1,"a":2})").dump(), R"({"b":1,"a":2})");
  EXPECT_EQ(read_json(R"({"b":1,"a":2})").dump(), R"({"a":2,"b":1})");
}

TEST(JsonText, ExcerptsAreShort) {
  EXPECT_EQ(json_excerpt("abc"), "\"abc\"");
  EXPECT_EQ(json_excerpt("abcdef", 6), "\"ab...");
  EXPECT_EQ(json_excerpt({{std::string(100'000, 'k'), 1}}, 10), "{\"kkkkk...");
}

}  // namespace
}  // namespace palpate::data
