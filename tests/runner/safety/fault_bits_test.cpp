#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <string>

#include "runner/servo/servo_fault.h"

namespace palpate::runner {
namespace {

/// The bits that a header declares, as its text has them.
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

TEST(FaultBits, EveryBitThatIsDeclaredStandsInTheTableOnce) {
  std::set<std::uint32_t> declared = declared_in("rendering/render_fault.h");
  declared.merge(declared_in("runner/servo/servo_fault.h"));
  EXPECT_GE(declared.size(), 12u);
  std::set<std::uint32_t> told;
  std::set<std::string> names;
  for (const rendering::FaultBit& fault : kFaultBits) {
    EXPECT_TRUE(told.insert(fault.bit).second) << fault.name;
    EXPECT_TRUE(names.insert(fault.name).second) << fault.name;
    EXPECT_EQ(fault.bit & (fault.bit - 1), 0u) << fault.name;
    EXPECT_NE(std::string(fault.words), "");
    EXPECT_NE(std::string(fault.meaning), "");
  }
  EXPECT_EQ(told, declared);
}

}  // namespace
}  // namespace palpate::runner
