#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <string>

#include "data/base/text.h"

namespace palpate {
namespace {

using namespace std::string_literals;

TEST(Printable, KeepsPlainTextOfAnyLanguage) {
  for (const std::string text : {"", "cube", "Würfel", "形", "🙂 ok", "שלום", "− … µ"})
    EXPECT_EQ(printable(text), text);
}

TEST(Printable, EscapesControlCharacters) {
  EXPECT_EQ(printable("a\x1b[31mb"), "a\\u001b[31mb");
  EXPECT_EQ(printable("\x1b]0;title\x07"), "\\u001b]0;title\\u0007");
  EXPECT_EQ(printable("a\r\n\tb"), "a\\u000d\\u000a\\u0009b");
  EXPECT_EQ(printable("a\0b"s), "a\\u0000b");
  EXPECT_EQ(printable("\x7f"), "\\u007f");
  EXPECT_EQ(printable("\xC2\x9B"
                      "31m"),
            "\\u009b31m");  // CSI as UTF-8
  EXPECT_EQ(printable("\xC2\x85"), "\\u0085");
}

TEST(Printable, EscapesChangesOfDirection) {
  for (const auto& [text, shown] : {std::pair{"\u202E", "\\u202e"},
                                    {"\u202A", "\\u202a"},
                                    {"\u2066", "\\u2066"},
                                    {"\u2069", "\\u2069"},
                                    {"\u200E", "\\u200e"},
                                    {"\u200F", "\\u200f"},
                                    {"\u061C", "\\u061c"},
                                    {"\u2028", "\\u2028"},
                                    {"\uFEFF", "\\ufeff"},
                                    {"\U000E0041", "\\U000e0041"}})
    EXPECT_EQ(printable(text), shown);
}

TEST(Printable, EscapesBytesThatAreNotUtf8) {
  EXPECT_EQ(printable("\x9B"
                      "31m"),
            "\\x9b31m");  // CSI as one byte
  EXPECT_EQ(printable("\xC0\xAF"), "\\xc0\\xaf");
  EXPECT_EQ(printable("\xED\xA0\x80"), "\\xed\\xa0\\x80");
  EXPECT_EQ(printable("\xF4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");
  EXPECT_EQ(printable("ab\xE5\xBD"), "ab\\xe5\\xbd");
}

TEST(Printable, KeepsLineFeedsOnRequest) {
  EXPECT_EQ(printable_lines("a\nb\r\n\x1b"), "a\nb\\u000d\n\\u001b");
}

TEST(Printable, CutsBetweenCharacters) {
  EXPECT_EQ(printable("Würfel", 3), "Wü…");
  EXPECT_EQ(printable("Würfel", 2), "W…");
  EXPECT_EQ(printable("Würfel", 7), "Würfel");
  EXPECT_EQ(printable("a\x1b"
                      "b",
                      4),
            "a…");
}

TEST(Printable, IsPlainForAnyInput) {
  constexpr std::uint32_t kSeed = 7;
  std::mt19937 generator(kSeed);
  for (int i = 0; i < 2000; ++i) {
    std::string text;
    for (int k = 0; k < 12; ++k) text += static_cast<char>(generator() & 0xFFU);
    const std::string shown = printable(text);
    EXPECT_TRUE(is_plain_utf8(shown)) << shown;
    EXPECT_EQ(printable(shown), shown);
    EXPECT_EQ(is_plain_utf8(text), shown == text);
  }
}

}  // namespace
}  // namespace palpate
