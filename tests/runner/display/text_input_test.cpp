// Typed input, byte by byte.

#include <gtest/gtest.h>

#include "runner/display/text_display.h"

namespace palpate::runner::display {
namespace {

using Kind = ConsoleCommand::Kind;

/// "key:1 command:3(text) unknown:..."
std::string heard(TextInput& input, std::string_view bytes) {
  std::string out;
  for (const TextInput::Event& event : input.feed(bytes, 5)) {
    if (const auto* key = std::get_if<KeyPress>(&event)) {
      EXPECT_EQ(key->time_ns, 5);
      out += "key:" + key->key + " ";
    } else if (const auto* command = std::get_if<ConsoleCommand>(&event)) {
      EXPECT_EQ(command->time_ns, 5);
      out +=
          "command:" + std::to_string(static_cast<int>(command->kind)) + "(" + command->text + ") ";
    } else {
      out += "unknown:" + std::get<TextInput::Unknown>(event).line + " ";
    }
  }
  return out;
}
std::string heard(std::string_view bytes) {
  TextInput input;
  return heard(input, bytes);
}
std::string command(Kind kind, const std::string& text = "") {
  return "command:" + std::to_string(static_cast<int>(kind)) + "(" + text + ") ";
}

TEST(TextInput, SingleKeysAnswer) {
  EXPECT_EQ(heard("1a \r\n\xC3\xA4"), "key:1 key:a key:space key:enter key:enter key:\xC3\xA4 ");
  EXPECT_EQ(heard(std::string_view("\x01\0", 2)), "");
  EXPECT_EQ(heard("\t"), "key:tab ");
  EXPECT_EQ(heard("1\x7f\b"), "key:1 key:backspace key:backspace ");
}

TEST(TextInput, KeypadAnswersAsDigits) {
  EXPECT_EQ(heard("\x1bOp\x1bOy\x1bOM"), "key:0 key:9 key:enter ");
}

TEST(TextInput, EscapeAndF12AreEmergencyKeysAlsoInACommand) {
  EXPECT_EQ(heard("\x1b"), command(Kind::emergency_zero, "the key Escape"));
  EXPECT_EQ(heard("\x1b[24~"), command(Kind::emergency_zero, "the key F12"));
  EXPECT_EQ(heard(":no\x1b"), command(Kind::emergency_zero, "the key Escape"));
  EXPECT_EQ(heard("\x1b[A\x1b[D\x1b[5~"), "key:up key:left ") << "cursor keys are none";
  EXPECT_EQ(heard(":no\x1b[A"), "");
}

TEST(TextInput, AltWithAKeyIsAnEmergencyNotAnAnswer) {
  EXPECT_EQ(heard("\x1b\x31"), command(Kind::emergency_zero, "the key Alt+1"));
  EXPECT_EQ(heard("\x1b\xC3\xA4"), command(Kind::emergency_zero, "the key Alt+\xC3\xA4"));
  EXPECT_EQ(heard("\x1b["), command(Kind::emergency_zero, "the key Alt+["));
  EXPECT_EQ(heard("\x1b:clear\n"),
            command(Kind::emergency_zero, "the key Escape") + command(Kind::clear_fault));
}

TEST(TextInput, LinesAreCommands) {
  EXPECT_EQ(heard(":pause\n:go\r:repeat\n"),
            command(Kind::pause) + command(Kind::resume) + command(Kind::repeat_trial));
  EXPECT_EQ(heard(":stop\n: stop block \n:zero\n:clear\n"),
            command(Kind::stop_after_trial) + command(Kind::stop_after_block) +
                command(Kind::emergency_zero, ":zero") + command(Kind::clear_fault));
  EXPECT_EQ(
      heard(":note  1: \xC3\xA4 \n:quit withdrawn\n:quit\n"),
      command(Kind::note, "1: \xC3\xA4") + command(Kind::quit, "withdrawn") + command(Kind::quit));
  EXPECT_EQ(heard(":answer 12,5\n:answer\n"),
            command(Kind::answer, "12,5") + command(Kind::answer));
  EXPECT_EQ(heard(":quitx\n:\n:note\n"), "unknown::quitx unknown:: unknown::note ");
}

TEST(TextInput, LinesCanBeEdited) {
  EXPECT_EQ(heard(":pausX\xC3\xA4\x7f\x7f"
                  "e\n"),
            command(Kind::pause));
  EXPECT_EQ(heard(":note a\x15"
                  "1"),
            "key:1 ");
  EXPECT_EQ(heard(":\x7f"
                  "1"),
            "key:1 ");
}

TEST(TextInput, InputMayBeSplitAnywhere) {
  TextInput input;
  EXPECT_EQ(heard(input, ":note \xE2\x82"), "");
  EXPECT_EQ(input.line(), ":note ");
  EXPECT_EQ(heard(input, "\xAC\n1"), command(Kind::note, "\xE2\x82\xAC") + "key:1 ");
  EXPECT_EQ(heard("\xFF\xC0\x80\xE2\x31"
                  "2"),
            "key:1 key:2 ")
      << "no UTF-8";
}

TEST(TextInput, ArbitraryInputIsSurvived) {
  std::uint32_t state = 1;
  TextInput input;
  for (int i = 0; i < 20000; ++i) {
    std::string bytes;
    for (int k = 0; k < 5; ++k) {
      state = state * 1664525u + 1013904223u;
      bytes += static_cast<char>(state >> 24);
    }
    input.feed(bytes, i);
  }
  EXPECT_LE(input.line().size(), 4004u);
}

}  // namespace
}  // namespace palpate::runner::display
