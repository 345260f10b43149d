#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <string>

#include "runner/safety/fault_signals.h"

namespace palpate::runner::safety {
namespace {

/// The bits declared in a header's text.
std::set<std::uint32_t> declared_in(const std::string& header) {
  std::ifstream in(std::string(PALPATE_SOURCE_DIR) + "/" + header);
  const std::string text(std::istreambuf_iterator<char>(in), {});
  static const std::regex declared(R"(constexpr std::uint32_t k\w+ =\s+(\d+);)");
  std::set<std::uint32_t> bits;
  for (std::sregex_iterator at(text.begin(), text.end(), declared), end; at != end; ++at) {
    bits.insert(static_cast<std::uint32_t>(std::stoul((*at)[1])));
  }
  return bits;
}

TEST(FaultTable, HasOneRowForEveryDeclaredBit) {
  std::set<std::uint32_t> declared = declared_in("rendering/render_fault.h");
  declared.merge(declared_in("runner/servo/sample.h"));
  EXPECT_GE(declared.size(), 12u);
  std::set<std::uint32_t> told;
  std::set<std::string> names, words;
  for (const rendering::FaultBit& fault : kFaultTable) {
    EXPECT_TRUE(told.insert(fault.bit).second) << fault.name;
    EXPECT_TRUE(names.insert(fault.name).second) << fault.name;
    EXPECT_EQ(fault.bit & (fault.bit - 1), 0u) << fault.name;
    EXPECT_TRUE(words.insert(fault.words).second) << fault.name;
    EXPECT_NE(std::string(fault.words), "");
    EXPECT_NE(std::string(fault.meaning), "");
  }
  EXPECT_EQ(told, declared);
}

TEST(FaultTable, TheConsoleNamesEveryDeclaredBit) {
  EXPECT_EQ(fault_words(0), "");
  std::set<std::uint32_t> declared = declared_in("rendering/render_fault.h");
  declared.merge(declared_in("runner/servo/sample.h"));
  std::uint32_t all = 0;
  for (const std::uint32_t bit : declared) {
    all |= bit;
    EXPECT_EQ(fault_words(bit), fault_row(bit).words);
    EXPECT_EQ(fault_words(bit).find("unknown"), std::string::npos) << bit;
  }
  EXPECT_EQ(fault_words(all).find("unknown"), std::string::npos);
  EXPECT_EQ(fault_words(servo::servo_fault::kDeviceLost | servo::servo_fault::kTripped),
            "device lost, forces off");
  EXPECT_EQ(fault_words(servo::servo_fault::kTripped | 1U << 31U),
            "forces off, unknown (2147483648)");
}

TEST(FaultTable, FaultsThatSwitchForcesOffHaveAMessage) {
  // The codebook describes faults that switch forces off as "zero force until cleared".
  for (const rendering::FaultBit& fault : kFaultTable) {
    const bool cuts = std::string(fault.meaning).find("until cleared") != std::string::npos;
    const bool off = fault.bit == servo::servo_fault::kTripped;
    EXPECT_EQ(std::string(fault.why).empty(), !cuts && !off) << fault.name;
  }
}

}  // namespace
}  // namespace palpate::runner::safety
