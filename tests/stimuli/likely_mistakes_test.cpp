#include <gtest/gtest.h>

#include "data/base/text.h"
#include "stimuli/mesh_file.h"

namespace palpate::stimuli {
namespace {

std::string utf16(const std::string& ascii, bool big, bool marked) {
  std::string bytes = marked ? (big ? "\xFE\xFF" : "\xFF\xFE") : "";
  for (const char c : ascii) bytes += big ? std::string{'\0', c} : std::string{c, '\0'};
  return bytes;
}

std::string what_is_said_of(const std::string& name, const std::string& bytes) {
  try {
    read_mesh(name, bytes);
  } catch (const MeshError& error) {
    return error.faults().at(0);
  }
  return "";
}

TEST(LikelyMistakes, Utf16IsDistinguishedFromOtherBytes) {
  for (const bool big : {false, true}) {
    for (const bool marked : {false, true}) {
      EXPECT_TRUE(is_utf16(utf16("v 0 0 0\n", big, marked)));
      EXPECT_NE(what_is_said_of("m.obj", utf16("v 0 0 0\n", big, marked))
                    .find("UTF-16; save it as UTF-8"),
                std::string::npos);
      EXPECT_NE(what_is_said_of("m.stl", utf16("solid x\n", big, marked)).find("UTF-16"),
                std::string::npos);
    }
  }
  for (const std::string& bytes : {std::string("v 0 0 0"), std::string("\xEF\xBB\xBFv 0"),
                                   std::string("solid\0\0\0", 8), std::string("v"), std::string()})
    EXPECT_FALSE(is_utf16(bytes)) << bytes;
}

TEST(LikelyMistakes, ADecimalCommaIsDistinguishedFromOtherWords) {
  EXPECT_EQ(point_meant("0,5"), "; decimals follow a point: 0.5");
  EXPECT_EQ(point_meant("-12,25e-3"), "; decimals follow a point: -12.25e-3");
  for (const char* const word : {"0.5", "1,2,3", ",5", "5,", "a,b", "", "1,x"})
    EXPECT_EQ(point_meant(word), "") << word;
  EXPECT_EQ(what_is_said_of("m.obj", "v 0,5 0 0\n"),
            "m.obj: line 1: expected three finite coordinates after v, found \"0,5\"; decimals "
            "follow a point: 0.5");
}

}  // namespace
}  // namespace palpate::stimuli
