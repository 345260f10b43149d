// The keys that a protocol may name, and their characters.

#include "runner/display/key_names.h"

#include <GLFW/glfw3.h>
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "data/base/utf8.h"

namespace palpate::runner::display {
namespace {

// The layout's name of a key needs a window system: without one only the key's place on a US
// keyboard counts.
std::string first_name(int key) {
  const std::vector<std::string> names = key_names(key, -1);
  return names.empty() ? "" : names.front();
}

TEST(KeyNames, CharactersAreUtf8) {
  // First and last of each length, Unicode 15, table 3-6.
  const std::map<unsigned, std::string> known{{0x20, " "},
                                              {0x7E, "~"},
                                              {0x80, "\xC2\x80"},
                                              {0x7FF, "\xDF\xBF"},
                                              {0x800, "\xE0\xA0\x80"},
                                              {0xFFFD, "\xEF\xBF\xBD"},
                                              {0x10000, "\xF0\x90\x80\x80"},
                                              {0x10FFFF, "\xF4\x8F\xBF\xBF"},
                                              {0xE4, "\xC3\xA4"},
                                              {0x20AC, "\xE2\x82\xAC"},
                                              {0x1F600, "\xF0\x9F\x98\x80"}};
  for (const auto& [character, bytes] : known) EXPECT_EQ(utf8(character), bytes) << character;
}

TEST(KeyNames, KeysWithoutACharacterHaveNames) {
  const std::map<int, std::string> known{{GLFW_KEY_SPACE, "space"},
                                         {GLFW_KEY_ESCAPE, "escape"},
                                         {GLFW_KEY_ENTER, "enter"},
                                         {GLFW_KEY_KP_ENTER, "enter"},
                                         {GLFW_KEY_TAB, "tab"},
                                         {GLFW_KEY_LEFT, "left"},
                                         {GLFW_KEY_BACKSPACE, "backspace"},
                                         {GLFW_KEY_RIGHT, "right"},
                                         {GLFW_KEY_UP, "up"},
                                         {GLFW_KEY_DOWN, "down"}};
  for (const auto& [key, name] : known) EXPECT_EQ(first_name(key), name);
  EXPECT_EQ(first_name(GLFW_KEY_F5), "");
  EXPECT_EQ(first_name(GLFW_KEY_LEFT_SHIFT), "");
}

TEST(KeyNames, LettersAndDigitsNameThemselvesAndTheKeypadGivesDigits) {
  std::set<std::string> names;
  for (char c = 'a'; c <= 'z'; ++c) {
    EXPECT_EQ(first_name(GLFW_KEY_A + c - 'a'), std::string(1, c));
    names.insert(first_name(GLFW_KEY_A + c - 'a'));
  }
  for (char c = '0'; c <= '9'; ++c) {
    const std::string digit(1, c);
    EXPECT_EQ(first_name(GLFW_KEY_0 + c - '0'), digit);
    EXPECT_EQ(first_name(GLFW_KEY_KP_0 + c - '0'), digit);
    EXPECT_EQ(keypad_character(GLFW_KEY_KP_0 + c - '0'), digit);
    EXPECT_TRUE(on_keypad(GLFW_KEY_KP_0 + c - '0'));
    EXPECT_FALSE(on_keypad(GLFW_KEY_0 + c - '0'));
    EXPECT_EQ(keypad_character(GLFW_KEY_0 + c - '0'), "") << "not on the keypad";
  }
  EXPECT_EQ(names.size(), 26U);
  EXPECT_EQ(first_name(GLFW_KEY_MINUS), "-");
  EXPECT_EQ(first_name(GLFW_KEY_GRAVE_ACCENT), "`");
  EXPECT_EQ(first_name(GLFW_KEY_APOSTROPHE), "'");
  EXPECT_EQ(keypad_character(GLFW_KEY_KP_DECIMAL), ".");
  EXPECT_EQ(keypad_character(GLFW_KEY_KP_SUBTRACT), "-");
  EXPECT_EQ(keypad_character(GLFW_KEY_KP_ENTER), "");
  EXPECT_TRUE(on_keypad(GLFW_KEY_KP_EQUAL));
  EXPECT_FALSE(on_keypad(GLFW_KEY_LEFT_SHIFT));
}

TEST(KeyNames, APressMatchesAnAnswerKeyInAnyCase) {
  const std::vector<std::pair<std::string, std::string>> keys{
      {"A", "ball"}, {"2", "box"}, {"\xC3\xA9", "cone"}, {"[", "bar"}};
  EXPECT_EQ(match_key({"a"}, keys), "A");
  EXPECT_EQ(match_key({"\xC3\xA9", "2"}, keys), "\xC3\xA9") << "the layout's first";
  EXPECT_EQ(match_key({"q", "2"}, keys), "2") << "no answer of the layout: that of the place";
  EXPECT_EQ(match_key({"q", "w"}, keys), "q");
  EXPECT_EQ(match_key({"{"}, keys), "{") << "only letters have two cases";
  EXPECT_EQ(match_key({}, keys), "");
}

TEST(KeyNames, EmergencyKeysAreNamedAsPrinted) {
  EXPECT_STREQ(emergency_key_name(GLFW_KEY_F12), "the key F12");
  EXPECT_STREQ(emergency_key_name(GLFW_KEY_ESCAPE), "the key Escape");
}

}  // namespace
}  // namespace palpate::runner::display
