// Bytes with a meaning in protobuf messages.
#pragma once

#include <array>
#include <string_view>

namespace lightmill {

inline constexpr std::array<std::string_view, 6> kWireWords{"\xff\xff\xff\xff\x0f",
                                                            "\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01",
                                                            "\x0a\x05",
                                                            std::string_view("\0", 1),
                                                            "\x1a",
                                                            std::string_view("\0\0\xc0\x7f", 4)};

}  // namespace lightmill
