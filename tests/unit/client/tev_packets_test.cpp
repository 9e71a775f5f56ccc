#include "client/tev/tev_packets.h"

#include <gtest/gtest.h>

#include <array>

#include "common/base/digest.h"

namespace lightmill {
namespace {

std::string hex(std::string_view bytes) {
  std::string text;
  for (const char byte : bytes) {
    text += fmt::format("{:02x}", static_cast<unsigned char>(byte));
  }
  return text;
}

// Written by hand from the layout in tev's Ipc.cpp.
constexpr const char* kCreate =
    "1c000000"  // 28 bytes
    "04"        // CreateImage
    "01"        // grabs the focus
    "6a6f6200"  // "job"
    "02000000"
    "01000000"  // 2x1
    "03000000"
    "5200"
    "4700"
    "4200";
constexpr const char* kUpdate =
    "6c000000"  // 108 bytes
    "06"        // UpdateImageV3
    "00"        // does not grab it
    "6a6f6200"  // "job"
    "03000000"
    "5200"
    "4700"
    "4200"
    "00000000"
    "00000000"
    "02000000"
    "01000000"  // at 0,0, 2x1
    "0000000000000000"
    "0200000000000000"
    "0400000000000000"  // each channel after the other
    "0100000000000000"
    "0100000000000000"
    "0100000000000000"
    "0000803f"
    "00000000"
    "0000003f"
    "00000040"
    "0000803e"
    "00008040";  // 1 0, 0.5 2, 0.25 4

TEST(TevPackets, AreThoseOfTheFormat) {
  EXPECT_EQ(hex(tev_create_image("job", 2, 1, true)), kCreate);
  EXPECT_EQ(hex(tev_update_image("job", 0, 0, 2, 1, std::array{1.0f, 0.0f, 0.5f, 2.0f, 0.25f, 4.0f})), kUpdate);
}

TEST(TevPackets, ANameEndsAtItsFirstNul) {
  EXPECT_EQ(tev_create_image(std::string_view("job\0x", 5), 2, 1, true), tev_create_image("job", 2, 1, true));
}

}  // namespace
}  // namespace lightmill
