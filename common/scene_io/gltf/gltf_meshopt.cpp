#include "common/scene_io/gltf/gltf_meshopt.h"

#include <meshoptimizer.h>

#include "common/base/text.h"

namespace lightmill {
namespace {

/// The most decoded bytes for each encoded one. Sixteen equal bytes of vertices take two bits; a triangle of at most
/// twelve bytes takes eight.
constexpr std::uint64_t kMaxRatio = 64;
/// Decoded bytes of the last vertices and indices beyond this ratio: a block of 256 vertices of 256 bytes.
constexpr std::uint64_t kSlack = 65536;

std::string shown(const std::string& text) {
  return utf8_text(text.substr(0, 40));
}

void apply_filter(const JsonNode& filter, std::size_t count, std::size_t stride, std::string& out) {
  const std::string name = filter.text("NONE");
  if (name == "OCTAHEDRAL" && (stride == 4 || stride == 8)) {
    meshopt_decodeFilterOct(out.data(), count, stride);
  } else if (name == "QUATERNION" && stride == 8) {
    meshopt_decodeFilterQuat(out.data(), count, stride);
  } else if (name == "EXPONENTIAL" && stride % 4 == 0) {
    meshopt_decodeFilterExp(out.data(), count, stride);
  } else if (name != "NONE") {
    filter.fail(
        fmt::format("NONE, OCTAHEDRAL (stride 4 or 8), QUATERNION (8) or EXPONENTIAL (4, 8, …) is expected, got "
                    "\"{}\" with stride {}",
                    shown(name), stride));
  }
}

}  // namespace

std::string decode_meshopt(const JsonNode& extension, std::string_view bytes, std::uint64_t& budget) {
  const std::uint64_t count = extension["count"].whole(0, 1, std::uint64_t{1} << 31);
  const std::uint64_t stride = extension["byteStride"].whole(0, 1, 256);
  const std::string mode = extension["mode"].text();
  const bool vertices = mode == "ATTRIBUTES", triangles = mode == "TRIANGLES";
  if (!vertices && !triangles && mode != "INDICES") {
    extension["mode"].fail(fmt::format("ATTRIBUTES, TRIANGLES or INDICES is expected, got \"{}\"", shown(mode)));
    return {};
  }
  if (vertices ? stride == 0 || stride % 4 != 0 : stride != 2 && stride != 4) {
    extension["byteStride"].fail(
        fmt::format("{} is expected for {}, got {}", vertices ? "4, 8, …" : "2 or 4", mode, stride));
    return {};
  }
  if (count == 0 || (triangles && count % 3 != 0)) {
    extension["count"].fail("a number of whole elements is expected");
    return {};
  }
  const std::uint64_t size = count * stride;
  if (size > bytes.size() * kMaxRatio + kSlack) {
    extension["count"].fail(fmt::format("{} bytes cannot hold {} elements of {} bytes", bytes.size(), count, stride));
    return {};
  }
  if (size > budget) {
    extension["count"].fail(fmt::format("the compressed views of the file have more than {} bytes", kMaxMeshoptBytes));
    return {};
  }
  budget -= size;
  std::string out(size, '\0');
  const auto* from = reinterpret_cast<const unsigned char*>(bytes.data());
  const int error = vertices    ? meshopt_decodeVertexBuffer(out.data(), count, stride, from, bytes.size())
                    : triangles ? meshopt_decodeIndexBuffer(out.data(), count, stride, from, bytes.size())
                                : meshopt_decodeIndexSequence(out.data(), count, stride, from, bytes.size());
  if (error != 0) {
    extension.fail(fmt::format("the compressed data are damaged ({}, code {})", mode, error));
    return {};
  }
  if (vertices) {
    apply_filter(extension["filter"], count, stride, out);
  }
  return out;
}

}  // namespace lightmill
