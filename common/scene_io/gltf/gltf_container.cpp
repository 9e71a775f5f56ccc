// The container of GltfData, with its buffers and uris.
#include <absl/strings/escaping.h>

#include <nlohmann/json.hpp>
#include <set>

#include "common/base/text.h"
#include "common/scene_io/gltf/gltf_data.h"

namespace lightmill {
namespace {

constexpr std::uint32_t kGlbMagic = 0x46546c67, kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;

std::uint32_t read_u32(std::string_view bytes, std::size_t offset) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

/// The chunks of a GLB file: its JSON, and its binary chunk if there is one.
struct Chunks {
  std::string_view json;
  std::optional<std::string_view> binary;
};

Result<Chunks> read_glb(std::string_view bytes) {
  constexpr std::size_t kHeader = 12, kChunkHeader = 8;
  if (bytes.size() < kHeader + kChunkHeader) {
    return invalid_argument("a GLB file of {} bytes is cut off", bytes.size());
  }
  if (const std::uint32_t version = read_u32(bytes, 4); version != 2) {
    return invalid_argument("GLB version 2 is expected, got {}", version);
  }
  if (const std::uint32_t length = read_u32(bytes, 8); length > bytes.size()) {
    return invalid_argument("the GLB file is cut off: {} bytes of {} are there", bytes.size(), length);
  }
  std::string_view rest = bytes.substr(kHeader, read_u32(bytes, 8) < kHeader ? 0 : read_u32(bytes, 8) - kHeader);
  Chunks chunks;
  for (int i = 0; rest.size() >= kChunkHeader; ++i) {
    const std::uint32_t length = read_u32(rest, 0), type = read_u32(rest, 4);
    rest.remove_prefix(kChunkHeader);
    if (length > rest.size()) {
      return invalid_argument("chunk {} of the GLB file is cut off: {} bytes of {} are there", i, rest.size(), length);
    }
    if (i == 0 && type != kJsonChunk) {
      return invalid_argument("the first chunk of the GLB file is not JSON");
    }
    if (i == 0) {
      chunks.json = rest.substr(0, length);
    } else if (i == 1 && type == kBinaryChunk) {
      chunks.binary = rest.substr(0, length);
    }
    rest.remove_prefix(length);
  }
  if (chunks.json.empty()) {
    return invalid_argument("the GLB file has no JSON");
  }
  return chunks;
}

int hex_digit(char c) {
  return c >= '0' && c <= '9'   ? c - '0'
         : c >= 'a' && c <= 'f' ? c - 'a' + 10
         : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                : -1;
}

/// Decodes %20 and the like in a relative reference (RFC 3986).
std::string decode_percent(std::string_view uri) {
  std::string out;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] == '%' && i + 2 < uri.size() && hex_digit(uri[i + 1]) >= 0 && hex_digit(uri[i + 2]) >= 0) {
      out.push_back(static_cast<char>(hex_digit(uri[i + 1]) * 16 + hex_digit(uri[i + 2])));
      i += 2;
    } else {
      out.push_back(uri[i]);
    }
  }
  return out;
}

}  // namespace

GltfData::GltfData(std::string bytes, std::string file_name, FileSource files, MeshDecoder decode_mesh,
                   std::uint64_t most_shared_bytes)
    : bytes_(std::move(bytes)),
      file_name_(std::move(file_name)),
      files_(std::move(files)),
      decode_mesh_(std::move(decode_mesh)),
      most_shared_bytes_(most_shared_bytes),
      json_(std::make_unique<nlohmann::json>()),
      errors_(file_name_) {}

GltfData::~GltfData() = default;

Result<std::unique_ptr<GltfData>> GltfData::open(std::string bytes, const std::string& file_name, FileSource files,
                                                 MeshDecoder decode_mesh, std::uint64_t most_shared_bytes) {
  std::unique_ptr<GltfData> data(
      new GltfData(std::move(bytes), file_name, std::move(files), std::move(decode_mesh), most_shared_bytes));
  LM_RETURN_IF_ERROR(with_context(data->parse(), file_name));
  const JsonNode asset = data->root()["asset"];
  const std::string version = asset["version"].text();
  if (!asset.present() || !version.starts_with("2.")) {
    asset["version"].fail(fmt::format("glTF 2.0 is expected, got \"{}\"", version));
  }
  if (const JsonNode least = asset["minVersion"]; least.present() && least.text() != "2.0") {
    least.fail(fmt::format("only glTF 2.0 is supported, the file needs \"{}\"", least.text()));
  }
  data->load_buffers();
  LM_RETURN_IF_ERROR(data->status());
  return data;
}

std::vector<std::string> GltfData::extensions() const {
  std::set<std::string> names;
  std::vector<const nlohmann::json*> waiting{json_.get()};
  while (!waiting.empty()) {
    const nlohmann::json& value = *waiting.back();
    waiting.pop_back();
    if (value.is_array()) {
      for (const nlohmann::json& element : value) {
        waiting.push_back(&element);
      }
    } else if (value.is_object()) {
      for (const auto& [key, member] : value.items()) {
        if (key == "extensions" && member.is_object()) {
          for (const auto& [name, extension] : member.items()) {
            names.insert(name);
          }
        }
        if (key != "extras" && !(key == "textures" && &value == json_.get())) {
          waiting.push_back(&member);
        }
      }
    }
  }
  return {names.begin(), names.end()};
}

Status GltfData::parse() {
  std::string_view text = bytes_;
  if (bytes_.size() >= 4 && read_u32(bytes_, 0) == kGlbMagic) {
    LM_ASSIGN_OR_RETURN(const Chunks chunks, read_glb(bytes_));
    text = chunks.json;
    has_binary_chunk_ = chunks.binary.has_value();
    binary_chunk_ = chunks.binary.value_or(std::string_view());
  }
  try {
    *json_ = nlohmann::json::parse(text);
  } catch (const nlohmann::json::exception& error) {
    const JsonFault fault = json_fault(error.what());
    return invalid_argument("{} is wrong{}{}, so the file is damaged: export it again: {}",
                            text.data() == bytes_.data() ? "its JSON" : "the JSON within it",
                            fault.place.empty() ? "" : " at ", fault.place, fault.what);
  }
  if (!json_->is_object()) {
    return invalid_argument("a JSON object is expected");
  }
  return ok_status();
}

JsonNode GltfData::root() const {
  return {json_.get(), "", errors_};
}

Status GltfData::status() const {
  return with_context(errors_.status(), file_name_);
}

JsonNode GltfData::element(std::string_view what, const JsonNode& index) const {
  const JsonNode list = root()[what];
  const std::optional<std::size_t> found = index.index(what, list.size());
  return found ? list.at(*found) : JsonNode(nullptr, index.path(), errors_);
}

void GltfData::load_buffers() {
  const JsonNode list = root()["buffers"];
  owned_.reserve(list.size());                   // views of its strings are stored
  std::map<std::string, std::string_view> read;  // by uri
  for (std::size_t i = 0; i < list.size() && status().ok(); ++i) {
    const JsonNode buffer = list.at(i);
    const std::uint64_t length = buffer["byteLength"].whole(0, 1, std::uint64_t{1} << 40);
    std::string_view bytes;
    if (!buffer["uri"].present() && (buffer["extensions"][kMeshopt]["fallback"].boolean(false) ||
                                     buffer["extensions"]["KHR_meshopt_compression"]["fallback"].boolean(false))) {
      buffers_.emplace_back();
      continue;
    }
    if (buffer["uri"].present()) {
      std::string name = buffer["uri"].text();
      const auto [known, added] = read.try_emplace(name.starts_with("data:") ? buffer.path() : std::move(name));
      if (added) {
        Result<std::string> got = uri_bytes(buffer["uri"]);
        if (!got.ok()) {
          buffer["uri"].fail(message_of(got.status()));
        }
        owned_.push_back(std::move(got).value_or(""));
        known->second = owned_.back();
        buffer_bytes_ += owned_.back().size();
      }
      bytes = known->second;
    } else if (i == 0 && has_binary_chunk_) {
      bytes = binary_chunk_;
      buffer_bytes_ += bytes.size();
    } else {
      buffer["uri"].fail("must be given, as the file has no binary chunk for it");
    }
    if (bytes.size() < length) {
      buffer["byteLength"].fail(fmt::format("{} bytes are expected, {} are there", length, bytes.size()));
    }
    buffers_.push_back(bytes.substr(0, length));
  }
}

Result<std::string> GltfData::uri_bytes(const JsonNode& node) const {
  const std::string uri = node.text();
  if (uri.starts_with("data:")) {
    const std::size_t comma = uri.find(',');
    const bool base64 = comma != std::string::npos && std::string_view(uri).substr(0, comma).ends_with(";base64");
    std::string bytes;
    if (!base64 || !absl::Base64Unescape(absl::string_view(uri).substr(comma + 1), &bytes)) {
      const Status wrong = invalid_argument("a data URI with base64 is expected");
      node.fail(message_of(wrong));
      return wrong;
    }
    return bytes;
  }
  if (uri.empty() || uri.find("://") != std::string::npos) {
    const Status wrong = invalid_argument("a file or a data URI is expected, got \"{}\"", uri.substr(0, 100));
    node.fail(message_of(wrong));
    return wrong;
  }
  const std::string name = decode_percent(uri);
  Result<SourceFile> file = files_(name);
  if (!file.ok()) {
    if (file.status().code() != StatusCode::kNotFound) {
      node.fail(message_of(file.status()));
    }
    return file.status();
  }
  if (file->name != name) {
    node.fault(fmt::format("there is no file {}", utf8_text(name)), "instead, " + utf8_text(file->name) + " is read");
  }
  return std::move(file->bytes);
}

}  // namespace lightmill
