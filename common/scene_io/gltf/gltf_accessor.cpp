// Buffer views and accessors of GltfData.

#include "common/base/check.h"

#include <algorithm>

#include "common/base/number_text.h"
#include "common/scene_io/gltf/gltf_data.h"
#include "common/scene_io/gltf/gltf_meshopt.h"

namespace lightmill {
namespace {

/// The most elements of all accessors without data together. Such accessors are zeros, which cost no byte of the file.
constexpr std::uint64_t kMaxZeroElements = 4'000'000;
constexpr std::uint64_t kMaxCount = std::uint64_t{1} << 31;

/// How often accessors may read each byte of the buffers, on average. A byte takes up to 8 in memory, and stays there
/// as part of a mesh.
constexpr std::uint64_t kMaxReadings = 8;

enum ComponentType : std::uint32_t {
  kInt8 = 5120,
  kUint8 = 5121,
  kInt16 = 5122,
  kUint16 = 5123,
  kUint32 = 5125,
  kFloat = 5126,
};

template <class T>
double component(const char* at, bool normalized) {
  T value;
  std::memcpy(&value, at, sizeof value);
  const auto number = static_cast<double>(value);
  if constexpr (std::is_integral_v<T>) {
    // −128 and −127 are both −1.
    return normalized ? std::max(number / static_cast<double>(std::numeric_limits<T>::max()), -1.0) : number;
  }
  return number;
}

double component(std::uint64_t type, const char* at, bool normalized) {
  switch (type) {
    case kInt8:
      return component<std::int8_t>(at, normalized);
    case kUint8:
      return component<std::uint8_t>(at, normalized);
    case kInt16:
      return component<std::int16_t>(at, normalized);
    case kUint16:
      return component<std::uint16_t>(at, normalized);
    case kUint32:
      return component<std::uint32_t>(at, normalized);
    default:
      return component<float>(at, normalized);
  }
}

std::string_view type_name(std::size_t components) {
  constexpr std::array<std::string_view, 5> kNames{"", "SCALAR", "VEC2", "VEC3", "VEC4"};
  return components == 16 ? "MAT4" : kNames[components];
}

}  // namespace

/// Elements of an accessor in a buffer.
struct GltfData::Accessor {
  std::string_view bytes;  ///< from the first element; empty if there is no data
  std::size_t stride = 0;  ///< bytes from element to element
  std::size_t count = 0;
  std::uint64_t type = 0;  ///< of the components
  bool normalized = false;
  // Sparse values:
  std::vector<std::uint32_t> replaced;
  std::string_view replacements;  ///< tightly packed
};

bool GltfData::has_bytes(const JsonNode& index) const {
  const auto buffer = element("bufferViews", index)["buffer"].index("buffers", buffers_.size());
  return buffer && !buffers_[*buffer].empty();
}

std::string_view GltfData::decoded(const JsonNode& view, const JsonNode& compressed) const {
  const auto [found, added] = decoded_.try_emplace(view.path());
  if (!added || !status().ok()) {
    return found->second;
  }
  // The extension names the compressed bytes as a buffer view does.
  found->second = decode_meshopt(compressed, part_of_buffer(compressed), meshopt_budget_);
  if (const std::uint64_t length = view["byteLength"].whole(0, 0, std::uint64_t{1} << 40);
      status().ok() && length != found->second.size()) {
    view["byteLength"].fail(
        fmt::format("{} bytes are expected, its compressed data have {}", length, found->second.size()));
  }
  return found->second;
}

std::string_view GltfData::view(const JsonNode& index) const {
  const JsonNode view = element("bufferViews", index);
  const JsonNode compressed = view["extensions"][kMeshopt];
  return compressed.present() && !has_bytes(index) ? decoded(view, compressed) : part_of_buffer(view);
}

std::string_view GltfData::part_of_buffer(const JsonNode& view) const {
  const std::optional<std::size_t> buffer = view["buffer"].index("buffers", buffers_.size());
  const std::uint64_t offset = view["byteOffset"].whole(0, 0, std::uint64_t{1} << 40);
  const std::uint64_t length = view["byteLength"].whole(0, 0, std::uint64_t{1} << 40);
  if (!view.present() || !buffer) {
    view["buffer"].fail("must be given");
    return {};
  }
  const std::string_view bytes = buffers_[*buffer];
  if (offset > bytes.size() || length > bytes.size() - offset) {
    view.fail(
        fmt::format("{} bytes from {} on are more than the {} of buffers[{}]", length, offset, bytes.size(), *buffer));
    return {};
  }
  return bytes.substr(offset, length);
}

/// Finds `count` elements in a buffer view. `at` has their offset in it. With a stride of 0 the view's stride counts,
/// else they are tightly packed.
bool GltfData::find_elements(const JsonNode& at, const JsonNode& view_index, std::size_t count,
                             std::size_t element_bytes, std::size_t stride, Accessor& out) const {
  const std::string_view bytes = view(view_index);
  if (stride == 0) {
    stride = element("bufferViews", view_index)["byteStride"].whole(element_bytes, 1, 255);
  }
  const std::uint64_t offset = at["byteOffset"].whole(0, 0, std::uint64_t{1} << 40);
  const std::uint64_t needed = count == 0 ? 0 : stride * (count - 1) + element_bytes;
  if (stride < element_bytes || offset > bytes.size() || needed > bytes.size() - offset) {
    at.fail(fmt::format("{} elements of {} bytes from {} on do not fit into the {} bytes of its buffer view", count,
                        element_bytes, offset, bytes.size()));
    return false;
  }
  out.bytes = bytes.substr(offset);
  out.stride = stride;
  return true;
}

GltfData::Accessor GltfData::accessor(const JsonNode& index, std::size_t components) const {
  const JsonNode at = element("accessors", index);
  Accessor out;
  out.count = at["count"].whole(0, 1, kMaxCount);
  out.type = at["componentType"].whole(0, kInt8, kFloat);
  out.normalized = at["normalized"].boolean(false);
  const std::size_t size = component_bytes(out.type) * components;
  if (!at.present() || !status().ok()) {
    index.fail("an accessor is expected");
    return {};
  }
  if (size == 0) {
    at["componentType"].fail(fmt::format("5120, 5121, 5122, 5123, 5125 or 5126 is expected, got {}", out.type));
    return {};
  }
  if (const std::string type = at["type"].text(); type != type_name(components)) {
    at["type"].fail(fmt::format("{} is expected here, got \"{}\"", type_name(components), type.substr(0, 40)));
    return {};
  }
  if (const auto decompressed = attributes_.find(index.path()); decompressed != attributes_.end()) {
    out.bytes = decompressed->second;
    out.stride = size;
    if (out.count * size > out.bytes.size()) {
      at["count"].fail(
          fmt::format("{} elements are expected, the compressed data have {}", out.count, out.bytes.size() / size));
      return {};
    }
  } else if (!at["bufferView"].present()) {
    zero_elements_ += out.count;
    if (zero_elements_ > kMaxZeroElements) {
      at["count"].fail(fmt::format("accessors without data have more than {} elements", kMaxZeroElements));
      return {};
    }
  } else if (!find_elements(at, at["bufferView"], out.count, size, 0, out)) {
    return {};
  }
  if (const JsonNode sparse = at["sparse"]; sparse.present()) {
    const std::size_t count = sparse["count"].whole(0, 1, out.count);
    const JsonNode which = sparse["indices"], what = sparse["values"];
    Accessor indices, values;
    const std::uint64_t type = which["componentType"].whole(0, kUint8, kUint32);
    const std::size_t index_bytes = type == kInt16 ? 0 : component_bytes(type);
    if (count == 0 || index_bytes == 0 ||
        !find_elements(which, which["bufferView"], count, index_bytes, index_bytes, indices) ||
        !find_elements(what, what["bufferView"], count, size, size, values)) {
      which["componentType"].fail("5121, 5123 or 5125 is expected");
      return {};
    }
    if (!may_read(index, count * (index_bytes + size))) {
      return {};
    }
    for (std::size_t i = 0; i < count; ++i) {
      const double replaced = component(type, indices.bytes.data() + i * index_bytes, false);
      if (replaced >= static_cast<double>(out.count)) {
        which.fail(fmt::format("{} is beyond the accessor's {} elements", replaced, out.count));
        return {};
      }
      out.replaced.push_back(static_cast<std::uint32_t>(replaced));
    }
    out.replacements = values.bytes;
  }
  return out;
}

std::size_t GltfData::count(const JsonNode& index) const {
  const JsonNode at = element("accessors", index);
  if (!at.present()) {
    index.fail("an accessor is expected");
  }
  return at["count"].whole(0, 1, kMaxCount);
}

template <std::size_t n>
std::vector<std::array<double, n>> GltfData::vectors(const JsonNode& index) const {
  return read<n>(index, accessor(index, n), nullptr);
}

template <std::size_t n>
std::vector<std::array<double, n>> GltfData::vectors(const JsonNode& index,
                                                     std::span<const std::uint32_t> which) const {
  return read<n>(index, accessor(index, n), &which);
}

/// Counts bytes that are read. Reports an error if they are too many.
bool GltfData::may_read(const JsonNode& index, std::uint64_t bytes) const {
  read_bytes_ += bytes;
  const std::uint64_t decoded = (kMaxMeshoptBytes - meshopt_budget_) + (kMaxDracoBytes - draco_budget_);
  const std::uint64_t most = most_shared_bytes_ + kMaxReadings * (buffer_bytes_ + decoded);
  if (read_bytes_ > most) {
    index.fail(fmt::format("the file's accessors share bytes, and would read more than {} of them", human_bytes(most)));
  }
  return status().ok();
}

/// Reads the elements `which`, or all if it is null.
template <std::size_t n>
std::vector<std::array<double, n>> GltfData::read(const JsonNode& index, const Accessor& from,
                                                  const std::span<const std::uint32_t>* which) const {
  const std::size_t size = component_bytes(from.type);
  const std::size_t count = which != nullptr ? which->size() : from.count;
  if (!may_read(index, count * size * n)) {
    return {};
  }
  std::vector<std::array<double, n>> out(count);
  const auto read_one = [&](const char* at, std::array<double, n>& element) {
    for (std::size_t k = 0; k < n; ++k) {
      element[k] = component(from.type, at + k * size, from.normalized);
    }
  };
  if (!from.bytes.empty()) {
    for (std::size_t i = 0; i < out.size(); ++i) {
      const std::size_t element = which != nullptr ? (*which)[i] : i;
      LM_CHECK(element < from.count);
      read_one(from.bytes.data() + element * from.stride, out[i]);
    }
  }
  for (std::size_t i = 0; i < from.replaced.size() && !out.empty(); ++i) {
    std::size_t place = from.replaced[i];
    if (which != nullptr) {
      const auto found = std::ranges::lower_bound(*which, from.replaced[i]);
      if (found == which->end() || *found != from.replaced[i]) {
        continue;
      }
      place = static_cast<std::size_t>(found - which->begin());
    }
    read_one(from.replacements.data() + i * size * n, out[place]);
  }
  return out;
}

template std::vector<std::array<double, 2>> GltfData::vectors(const JsonNode&) const;
template std::vector<std::array<double, 3>> GltfData::vectors(const JsonNode&) const;
template std::vector<std::array<double, 2>> GltfData::vectors(const JsonNode&, std::span<const std::uint32_t>) const;
template std::vector<std::array<double, 4>> GltfData::vectors(const JsonNode&, std::span<const std::uint32_t>) const;
template std::vector<std::array<double, 3>> GltfData::vectors(const JsonNode&, std::span<const std::uint32_t>) const;
template std::vector<std::array<double, 1>> GltfData::vectors(const JsonNode&, std::span<const std::uint32_t>) const;
template std::vector<std::array<double, 16>> GltfData::vectors(const JsonNode&, std::span<const std::uint32_t>) const;

std::vector<std::uint32_t> GltfData::indices(const JsonNode& index) const {
  const JsonNode type = element("accessors", index)["componentType"];
  if (const std::uint64_t got = type.whole(0, 0, kFloat); got != kUint8 && got != kUint16 && got != kUint32) {
    type.fail(fmt::format("5121, 5123 or 5125 is expected for indices, got {}", got));
    return {};
  }
  std::vector<std::uint32_t> out;
  for (const auto& [value] : vectors<1>(index)) {
    out.push_back(static_cast<std::uint32_t>(value));
  }
  return out;
}

template std::vector<std::array<double, 1>> GltfData::vectors(const JsonNode&) const;

}  // namespace lightmill
