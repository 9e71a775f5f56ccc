#include "client/lab/page.h"

#include "client/chart/chart.h"

namespace lightmill::lab {

std::string png_data_uri(std::string_view png) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string uri = "data:image/png;base64,";
  for (std::size_t i = 0; i < png.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(png.size() - i, 3);
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      bits = bits << 8 | (k < left ? static_cast<std::uint8_t>(png[i + k]) : 0u);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      uri += k <= left ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
    }
  }
  return uri;
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

}  // namespace lightmill::lab
