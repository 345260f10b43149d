#include "protocols/answer_keys.h"

#include <gtest/gtest.h>

#include <utility>

namespace palpate::protocols {
namespace {

TEST(AnswerKeys, ArePressedOrRefusedWithTheNames) {
  for (const char* const name : {"1", "a", "A", "/", "~", "\u00e4", "\u00c4", "\u0436", "space",
                                 "enter", "tab", "backspace", "left", "right", "up", "down"})
    EXPECT_EQ(key_fault(name), "") << name;
  for (const char* const name :
       {"", " ", "hello world", "F2", "button 1", "\t", "\u00a0", "\u7403", "\U0001F600", "ab"}) {
    EXPECT_NE(key_fault(name).find("expected a key that somebody can press: 'space', 'enter'"),
              std::string::npos)
        << name;
  }
  EXPECT_NE(key_fault("escape").find("emergency"), std::string::npos);
  EXPECT_NE(key_fault("F12").find("emergency"), std::string::npos);
  EXPECT_NE(key_fault(":").find("command"), std::string::npos);
}

TEST(AnswerKeys, NamesOfOtherProgramsAreRecognised) {
  for (const auto& [name, meant] : {std::pair{"num_1", "1"},
                                    {"KP_4", "4"},
                                    {"Numpad0", "0"},
                                    {"Return", "enter"},
                                    {"Space", "space"},
                                    {"ArrowLeft", "left"},
                                    {"keyA", "a"}}) {
    EXPECT_TRUE(key_fault(name).ends_with("did you mean '" + std::string(meant) + "'?")) << name;
  }
  EXPECT_EQ(key_fault("hello world").find("did you mean"), std::string::npos);
}

TEST(AnswerKeys, OneKeyHasOneNameWhateverTheCase) {
  for (const auto& [upper, lower] : {std::pair{"A", "a"},
                                     {"Z", "z"},
                                     {"\u00c4", "\u00e4"},
                                     {"\u0178", "\u00ff"},
                                     {"\u0160", "\u0161"},
                                     {"\u03a9", "\u03c9"},
                                     {"\u0416", "\u0436"},
                                     {"\u0401", "\u0451"}}) {
    EXPECT_EQ(one_key(upper), one_key(lower));
    EXPECT_EQ(one_key(lower), lower);
  }
  for (const char* const name : {"1", "[", "{", "\u00d7", "\u00f7", "space", "left"})
    EXPECT_EQ(one_key(name), name);
  KeysTaken keys;
  EXPECT_EQ(keys.add("A"), "");
  EXPECT_EQ(keys.add("b"), "");
  EXPECT_EQ(keys.add("a"), "expected another key: this is the same as 'A'");
}

}  // namespace
}  // namespace palpate::protocols
