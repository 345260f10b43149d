#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "data/base/random.h"
#include "runner/devices/falcon/packets.h"

namespace palpate::runner::devices::falcon {
namespace {

std::string text(const Packet& packet) { return {packet.begin(), packet.end()}; }

std::vector<Packet> packets_in(PacketStream& stream, std::string_view bytes) {
  std::vector<Packet> found;
  for (const char byte : bytes) {
    if (const auto packet = stream.take(static_cast<std::uint8_t>(byte))) found.push_back(*packet);
  }
  return found;
}

TEST(FalconPackets, KnownCommandsAreEncoded) {
  Command command;
  command.green = true;
  EXPECT_EQ(text(encode(command)), "<AAAAAAAAAAAADA>");
  command.motors = {-500, 1234, 0};
  EXPECT_EQ(text(encode(command)), "<MAOPCNEAAAAADA>");
}

TEST(FalconPackets, EveryCommandIsDecodedAsEncoded) {
  for (int motor = -4095; motor <= 4095; motor += 13) {
    for (int bits = 0; bits < 16; ++bits) {
      const Command sent{{motor, -motor, 4095},
                         (bits & 1) != 0,
                         (bits & 2) != 0,
                         (bits & 4) != 0,
                         (bits & 8) != 0};
      const auto got = decode_command(encode(sent));
      ASSERT_TRUE(got);
      EXPECT_EQ(got->motors, sent.motors);
      EXPECT_EQ(got->homing, sent.homing);
      EXPECT_EQ(got->green, sent.green);
      EXPECT_EQ(got->blue, sent.blue);
      EXPECT_EQ(got->red, sent.red);
    }
  }
}

TEST(FalconPackets, NoMotorGoesBeyondTwelveBits) {
  const auto got = decode_command(encode(Command{{70000, -70000, 4096}}));
  ASSERT_TRUE(got);
  EXPECT_EQ(got->motors, (std::array<int, 3>{4095, -4095, 4095}));
}

TEST(FalconPackets, EveryReplyIsDecodedAsEncoded) {
  for (int count = -32768; count <= 32767; count += 97) {
    for (int bits = 0; bits < 128; bits += 5) {
      const Reply sent{{count, -count - 1, 32767},
                       static_cast<std::uint8_t>(bits & 15),
                       static_cast<std::uint8_t>(bits >> 4)};
      const auto got = decode_reply(encode(sent));
      ASSERT_TRUE(got);
      EXPECT_EQ(got->counts, sent.counts);
      EXPECT_EQ(got->buttons, sent.buttons);
      EXPECT_EQ(got->homed, sent.homed);
      EXPECT_EQ(got->all_homed(), sent.homed == 7);
    }
  }
}

TEST(FalconPackets, BytesBeyondTheirRangeAreRefused) {
  const Packet good = encode(Reply{{1, 2, 3}, 5, 7});
  ASSERT_TRUE(decode_reply(good));
  for (std::size_t at = 0; at < good.size(); ++at) {
    for (int byte = 0; byte < 256; ++byte) {
      Packet packet = good;
      packet[at] = static_cast<std::uint8_t>(byte);
      const bool number = at >= 1 && at <= 12;
      const bool fits = at == 0    ? byte == '<'
                        : at == 15 ? byte == '>'
                        : number   ? byte >= 0x41 && byte <= 0x50
                        : at == 13 ? byte >= 0x41 && byte <= 0xC0
                                   : true;  // byte 14 is not known to mean anything
      EXPECT_EQ(decode_reply(packet).has_value(), fits) << at << ' ' << byte;
    }
  }
}

TEST(FalconPackets, PacketsAreFoundHoweverTheStreamIsSplit) {
  const std::string first = text(encode(Reply{{1, -2, 3}, 0, 7}));
  const std::string second = text(encode(Reply{{400, 500, -600}, 1, 7}));
  PacketStream stream;
  EXPECT_EQ(packets_in(stream, first + second).size(), 2U);  // joined
  for (std::size_t cut = 1; cut < first.size(); ++cut) {     // split
    EXPECT_TRUE(packets_in(stream, first.substr(0, cut)).empty());
    const auto found = packets_in(stream, first.substr(cut));
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(text(found[0]), first);
  }
  EXPECT_EQ(stream.dropped(), 0U);
  EXPECT_EQ(packets_in(stream, "AB>zz" + second).size(), 1U);  // litter before
  EXPECT_EQ(stream.dropped(), 0U);
}

TEST(FalconPackets, AReplyOfFourteenBytesIsDroppedAndTheNextFound) {
  const std::string whole = text(encode(Reply{{1, -2, 3}, 0, 7}));
  PacketStream stream;
  for (int n = 1; n <= 10; ++n) {
    const std::string shortened =
        whole.substr(0, 6) + whole.substr(8);  // ends with '>' all the same
    ASSERT_EQ(shortened.size(), 14U);
    const auto found = packets_in(stream, shortened + whole);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(text(found[0]), whole);
    EXPECT_EQ(stream.dropped(), static_cast<std::uint64_t>(n));
  }
}

TEST(FalconPackets, ALongPacketIsDropped) {
  PacketStream stream;
  const std::string whole = text(encode(Reply{}));
  EXPECT_TRUE(packets_in(stream, whole.substr(0, 15) + "AA>").empty());
  EXPECT_EQ(stream.dropped(), 1U);
  EXPECT_EQ(packets_in(stream, whole).size(), 1U);
}

TEST(FalconPackets, RandomBytesNeverBreakTheStream) {
  constexpr std::uint64_t kSeed = 7;
  Random random(kSeed);
  PacketStream stream;
  const std::string whole = text(encode(Reply{{1, -2, 3}, 0, 7}));
  // Bytes near the alphabet, so that many sequences resemble packets.
  constexpr std::string_view kAlphabet = "<>ABCDEFGHIJKLMNOPQ\xC0\xC1";
  std::uint64_t good = 0;
  for (int round = 0; round < 20000; ++round) {
    std::string noise;
    for (int i = 0; i < 40; ++i) noise += kAlphabet[random.below(kAlphabet.size())];
    for (const Packet& packet : packets_in(stream, noise)) {
      EXPECT_EQ(packet.front(), '<');
      EXPECT_EQ(packet.back(), '>');
      good += decode_reply(packet).has_value() ? 1 : 0;
    }
    const auto found = packets_in(stream, whole);  // '<' restarts: the next is never lost
    ASSERT_EQ(found.size(), 1U);
    ASSERT_EQ(text(found[0]), whole);
  }
  EXPECT_GT(good, 0U);
  EXPECT_GT(stream.dropped(), 0U);
}

}  // namespace
}  // namespace palpate::runner::devices::falcon
