// Packets that make an image in tev or HDRView, and change a part of it. Pure.
// https://github.com/Tom94/tev, README, "Over the network"; src/Ipc.cpp has the layout of packets.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace lightmill {

/// The default address of viewers.
inline constexpr std::string_view kTevAddress = "127.0.0.1:14158";

/// A new image with the channels R, G and B, all black. It replaces an image of the same name. `grab_focus`: it is
/// shown at once.
std::string tev_create_image(std::string_view name, int width, int height, bool grab_focus);

/// New pixels of a part of an image. `planes`: all of R, then G, then B, each of width * height values in rows from the
/// top.
std::string tev_update_image(std::string_view name, int x, int y, int width, int height, std::span<const float> planes);

}  // namespace lightmill
