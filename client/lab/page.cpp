#include "client/lab/page.h"

#include <absl/strings/escaping.h>

#include <algorithm>
#include <cmath>

#include "client/chart/chart.h"
#include "common/image/color.h"
#include "common/image/png.h"

namespace lightmill::lab {

std::string png_data_uri(std::string_view png) {
  return "data:image/png;base64," + absl::Base64Escape({png.data(), png.size()});
}

std::string page_css() {
  return R"css(
:root{color-scheme:light dark;--back:#fff;--text:#222;--faint:#666;--line:#ccc;--box:#f5f5f5;--warn:#a33}
@media (prefers-color-scheme:dark){:root{--back:#16181c;--text:#ddd;--faint:#aaa;--line:#444;--box:#202329;--warn:#f88}}
body{font:15px/1.45 sans-serif;background:var(--back);color:var(--text);margin:2em auto;max-width:1340px;padding:0 1em}
h1{font-size:1.6em}h2{font-size:1.25em;border-bottom:1px solid var(--line);margin-top:2em}
.faint{color:var(--faint)}.warn{color:var(--warn)}
.scroll{overflow-x:auto}table{border-collapse:collapse;margin:1em 0;font-variant-numeric:tabular-nums}
th,td{padding:.25em .7em;text-align:right;border-bottom:1px solid var(--line);white-space:nowrap}
th:first-child,td:first-child{text-align:left}th{font-weight:600}
.charts{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,560px),1fr));gap:1em}
.pictures{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,240px),1fr));gap:1em}
figure{margin:0}figcaption{font-size:.9em;color:var(--faint)}
.frame{overflow:hidden;background:#000;cursor:zoom-in;line-height:0}.frame.near{cursor:zoom-out}
.frame img{width:100%;image-rendering:auto;transition:transform .15s}.frame.near img{image-rendering:pixelated}
.frame img.difference{display:none}.show-difference .frame.both img.difference{display:inline}
.show-difference .frame.both img.plain{display:none}
)css" + chart_css();
}

std::string page_script() {
  return R"js(
for (const section of document.querySelectorAll(".pictures")) {
  const frames = [...section.querySelectorAll(".frame")];
  for (const frame of frames) {
    frame.addEventListener("click", event => {
      const near = !frame.classList.contains("near");
      const box = frame.getBoundingClientRect();
      const x = 100 * (event.clientX - box.left) / box.width, y = 100 * (event.clientY - box.top) / box.height;
      for (const other of frames) {
        other.classList.toggle("near", near);
        for (const image of other.children) {
          image.style.transformOrigin = `${x}% ${y}%`;
          image.style.transform = near ? "scale(6)" : "";
        }
      }
    });
  }
  const box = section.parentElement.querySelector("input.differences");
  box?.addEventListener("change", () => section.classList.toggle("show-difference", box.checked));
}
)js";
}

namespace {

constexpr double kFloor = 0.1;  // limits the noise of dark pixels, as 0.01 does in relMSE
constexpr double kFull = 0.25;

}  // namespace

Result<std::string> difference_png(const RgbImage& picture, const RgbImage& reference) {
  const std::size_t pixels = picture.pixels();
  const auto mean = [&](const RgbImage& image, std::size_t i) {
    return (double{image.values[i]} + image.values[pixels + i] + image.values[2 * pixels + i]) / 3;
  };
  std::vector<std::uint8_t> bytes(3 * pixels, 0);
  for (std::size_t i = 0; i < pixels; ++i) {
    const double r = mean(reference, i);
    const double off = (mean(picture, i) - r) / (std::abs(r) + kFloor) / kFull;
    const double strength = std::isfinite(off) ? std::min(std::abs(off), 1.0) : 1.0;
    const auto full = static_cast<std::uint8_t>(std::lround(255 * std::sqrt(strength)));
    const auto half = static_cast<std::uint8_t>(full / 2);
    bytes[3 * i] = off < 0 ? 0 : full;
    bytes[3 * i + 1] = off < 0 ? half : static_cast<std::uint8_t>(full / 4);
    bytes[3 * i + 2] = off < 0 ? full : 0;
  }
  return encode_png(picture.width, picture.height, bytes);
}

Result<std::string> picture_png(const RgbImage& picture) {
  return encode_png(picture.width, picture.height, to_srgb8(picture, ViewSettings{}));
}

}  // namespace lightmill::lab
