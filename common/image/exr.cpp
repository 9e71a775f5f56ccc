#include "common/image/exr.h"

#include <ImfChannelList.h>
#include <ImfChromaticitiesAttribute.h>
#include <ImfDoubleAttribute.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfIntAttribute.h>
#include <ImfMatrixAttribute.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <exception>
#include <optional>
#include <stdexcept>

#include "common/base/check.h"
#include "common/base/text.h"

namespace lightmill {
namespace {

constexpr int kMaxExrSide = 65536;  // pixels
constexpr int kChunkLines = 16;     // of ZIP compression
/// Attributes that OpenEXR writes itself, with values that our pictures always have.
constexpr std::array kOwnAttributes{"pixelAspectRatio", "screenWindowWidth"};
/// So many values are decoded without a check that the file can hold them.
constexpr std::uint64_t kPlausibleValues = std::uint64_t{1} << 22;
constexpr std::uint64_t kMaxCompression = 16384;  // deflate's limit is 1032; wavelets of a black frame exceed it

class MemoryOutput final : public Imf::OStream {
 public:
  MemoryOutput() : Imf::OStream("memory") {}
  void write(const char bytes[], int count) override {
    const auto end = position_ + static_cast<std::size_t>(count);
    if (end > bytes_.size()) {
      bytes_.resize(end);
    }
    std::copy_n(bytes, count, bytes_.begin() + static_cast<std::ptrdiff_t>(position_));
    position_ = end;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
  std::size_t position_ = 0;
};

class MemoryInput final : public Imf::IStream {
 public:
  explicit MemoryInput(ByteView bytes) : Imf::IStream("memory"), bytes_(bytes) {}
  bool read(char out[], int count) override {
    const auto wanted = static_cast<std::size_t>(count);
    if (position_ > bytes_.size() || wanted > bytes_.size() - position_) {
      throw std::runtime_error("the file ends too early");
    }
    std::memcpy(out, bytes_.data() + position_, wanted);
    position_ += wanted;
    return position_ < bytes_.size();
  }
  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override { position_ = position; }

 private:
  ByteView bytes_;
  std::size_t position_ = 0;
};

Imath::Box2i to_box(const ImageWindow& window) {
  return {{window.x, window.y}, {window.x + window.width - 1, window.y + window.height - 1}};
}

Result<ImageWindow> to_window(const Imath::Box2i& box, std::string_view what) {
  const std::int64_t width = std::int64_t{box.max.x} - box.min.x + 1;
  const std::int64_t height = std::int64_t{box.max.y} - box.min.y + 1;
  if (width < 1 || height < 1 || width > kMaxExrSide || height > kMaxExrSide) {
    return invalid_argument("the {} window must be 1 to {} pixels on a side, got {}x{}", what, kMaxExrSide, width,
                            height);
  }
  return ImageWindow{box.min.x, box.min.y, static_cast<int>(width), static_cast<int>(height)};
}

void insert_attribute(Imf::Header& header, const std::string& name, const ImageAttribute& attribute) {
  if (const auto* text = std::get_if<std::string>(&attribute)) {
    header.insert(name, Imf::StringAttribute(*text));
  } else if (const auto* integer = std::get_if<int>(&attribute)) {
    header.insert(name, Imf::IntAttribute(*integer));
  } else if (const auto* single = std::get_if<float>(&attribute)) {
    header.insert(name, Imf::FloatAttribute(*single));
  } else if (const auto* matrix = std::get_if<ImageMatrix>(&attribute)) {
    Imath::M44f rows;
    std::copy(matrix->begin(), matrix->end(), rows.getValue());
    header.insert(name, Imf::M44fAttribute(rows));
  } else {
    header.insert(name, Imf::DoubleAttribute(std::get<double>(attribute)));
  }
}

std::map<std::string, ImageAttribute> read_attributes(const Imf::Header& header) {
  std::map<std::string, ImageAttribute> attributes;
  for (auto it = header.begin(); it != header.end(); ++it) {
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&it.attribute())) {
      attributes[it.name()] = text->value();
    } else if (const auto* integer = dynamic_cast<const Imf::IntAttribute*>(&it.attribute())) {
      attributes[it.name()] = integer->value();
    } else if (const auto* single = dynamic_cast<const Imf::FloatAttribute*>(&it.attribute())) {
      attributes[it.name()] = single->value();
    } else if (const auto* number = dynamic_cast<const Imf::DoubleAttribute*>(&it.attribute())) {
      attributes[it.name()] = number->value();
    } else if (const auto* rows = dynamic_cast<const Imf::M44fAttribute*>(&it.attribute())) {
      ImageMatrix matrix;
      std::copy_n(rows->value().getValue(), matrix.size(), matrix.begin());
      attributes[it.name()] = matrix;
    }
  }
  return attributes;
}

/// A slice of planar 4-byte values. OpenEXR addresses pixels by absolute coordinates.
Imf::Slice planar_slice(Imf::PixelType type, const void* values, const ImageWindow& data) {
  return Imf::Slice::Make(type, values, Imath::V2i{data.x, data.y}, data.width, data.height, sizeof(float),
                          sizeof(float) * static_cast<std::size_t>(data.width));
}

Status check_plausible(const Image& image, std::size_t channels, std::size_t file_bytes) {
  const std::uint64_t values = static_cast<std::uint64_t>(image.data.pixel_count()) * channels;
  if (values > kPlausibleValues && values * sizeof(float) > file_bytes * kMaxCompression) {
    return invalid_argument("{} bytes cannot hold the {} values that the header promises", file_bytes, values);
  }
  return ok_status();
}

Result<Image> read_image(ByteView bytes) {
  MemoryInput stream(bytes);
  Imf::InputFile file(stream, 0);
  const Imf::Header& header = file.header();
  Image image;
  LM_ASSIGN_OR_RETURN(image.display, to_window(header.displayWindow(), "display"));
  LM_ASSIGN_OR_RETURN(image.data, to_window(header.dataWindow(), "data"));
  std::size_t count = 0;
  for (auto it = header.channels().begin(); it != header.channels().end(); ++it, ++count) {
    if (it.channel().xSampling != 1 || it.channel().ySampling != 1) {
      return invalid_argument("channel {} is subsampled. Only full resolution is read", it.name());
    }
  }
  LM_RETURN_IF_ERROR(check_plausible(image, count, bytes.size()));
  image.attributes = read_attributes(header);
  if (Imf::hasChromaticities(header)) {
    const Imf::Chromaticities& xy = Imf::chromaticities(header);
    const auto pair = [](const Imath::V2f& v) { return std::array<double, 2>{v.x, v.y}; };
    image.primaries = {pair(xy.red), pair(xy.green), pair(xy.blue), pair(xy.white)};
  }
  Imf::FrameBuffer frame;
  image.channels.reserve(count);
  for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
    const auto pixels = static_cast<std::size_t>(image.data.pixel_count());
    ImageChannel& channel = image.channels.emplace_back();
    channel.name = it.name();
    if (it.channel().type == Imf::UINT) {
      const auto& values = channel.values.emplace<std::vector<std::uint32_t>>(pixels);
      frame.insert(it.name(), planar_slice(Imf::UINT, values.data(), image.data));
    } else {
      const auto& values = channel.values.emplace<std::vector<float>>(pixels);
      frame.insert(it.name(), planar_slice(Imf::FLOAT, values.data(), image.data));
    }
  }
  file.setFrameBuffer(frame);
  file.readPixels(header.dataWindow().min.y, header.dataWindow().max.y);
  return image;
}

}  // namespace

Result<std::string> encode_exr(const Image& image) {
  const auto pixels = static_cast<std::size_t>(image.data.pixel_count());
  LM_CHECK(pixels > 0 && image.display.pixel_count() > 0);
  try {
    Imf::Header header(to_box(image.display), to_box(image.data));
    header.compression() = Imf::ZIP_COMPRESSION;
    Imf::addChromaticities(header, Imf::Chromaticities());  // the default is Rec. 709
    for (const auto& [name, attribute] : image.attributes) {
      insert_attribute(header, name, attribute);
    }
    Imf::FrameBuffer frame;
    for (const ImageChannel& channel : image.channels) {
      std::visit(
          [&](const auto& values) {
            using Value = typename std::decay_t<decltype(values)>::value_type;
            constexpr auto type = std::is_same_v<Value, float> ? Imf::FLOAT : Imf::UINT;
            LM_CHECK(values.size() == pixels, "channel {}: {} values for {} pixels", channel.name, values.size(),
                     pixels);
            header.channels().insert(channel.name, Imf::Channel(type));
            frame.insert(channel.name, planar_slice(type, values.data(), image.data));
          },
          channel.values);
    }
    MemoryOutput stream;
    {
      Imf::OutputFile file(stream, header, 0);  // its destructor writes the line table
      file.setFrameBuffer(frame);
      file.writePixels(image.data.height);
    }
    return stream.take();
  } catch (const std::exception& error) {
    return internal_error("cannot encode EXR: {}", error.what());
  }
}

Result<Image> decode_exr(ByteView bytes) {
  LM_RETURN_IF_ERROR(exr_header_end(bytes).status());
  try {
    return read_image(bytes);
  } catch (const std::exception& error) {
    // The library's name of its input means nothing to users.
    constexpr std::string_view kName = "image file \"memory\"";
    std::string what = library_text(error.what());
    for (std::size_t at = what.find(kName); at != std::string::npos; at = what.find(kName)) {
      what.replace(at, kName.size(), "it");
    }
    return invalid_argument("not a readable EXR file: {}", what);
  }
}

Status check_exr_form(ByteView bytes, Image image) {
  for (const char* const name : kOwnAttributes) {
    image.attributes.erase(name);
  }
  LM_ASSIGN_OR_RETURN(const std::string expected, encode_exr(image));
  LM_ASSIGN_OR_RETURN(const std::size_t table, exr_header_end(as_byte_view(expected)));
  if (bytes.size() < table || std::memcmp(bytes.data(), expected.data(), table) != 0) {
    return data_loss(
        "its header is not as Lightmill writes it: chromaticities, pixel aspect or other attributes were changed");
  }
  const auto chunks = static_cast<std::size_t>((image.data.height + kChunkLines - 1) / kChunkLines);
  std::uint64_t at = table + sizeof(std::uint64_t) * chunks;
  for (std::size_t i = 0; i < chunks; ++i) {
    const auto offset = number_at<std::uint64_t>(bytes, table + sizeof(std::uint64_t) * i);
    const auto line = number_at<std::int32_t>(bytes, at);
    const auto size = number_at<std::int32_t>(bytes, at + sizeof(std::int32_t));
    if (offset != at || line != image.data.y + kChunkLines * static_cast<int>(i) || !size || *size < 0) {
      return data_loss("its lines do not follow each other as Lightmill writes them");
    }
    at += 2 * sizeof(std::int32_t) + static_cast<std::uint64_t>(*size);
  }
  return at == bytes.size() ? ok_status() : data_loss("it has {} bytes after its last line", bytes.size() - at);
}

namespace {

constexpr std::size_t kFirstAttribute = 8;  // after the magic number and the version

}  // namespace

bool is_exr(ByteView bytes) {
  constexpr std::array<unsigned char, 4> kMagic{0x76, 0x2f, 0x31, 0x01};
  return bytes.size() >= kMagic.size() && std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) == 0;
}

// Magic number and version, then attributes (name, type, both zero-terminated, size, value), then a zero.
Result<std::size_t> exr_header_end(ByteView bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.size() < kFirstAttribute || !is_exr(bytes)) {
    return invalid_argument("not a readable EXR file: its first bytes are not those of EXR");
  }
  const bool several_parts = (static_cast<unsigned char>(text[5]) & 0x10) != 0;
  std::size_t at = kFirstAttribute;
  for (bool first_of_part = true; at < text.size();) {
    if (text[at] == '\0') {  // end of a part's header; an empty header ends the list of parts
      if (!several_parts || first_of_part) {
        return at + 1;
      }
      ++at;
      first_of_part = true;
      continue;
    }
    first_of_part = false;
    const std::size_t name_end = text.find('\0', at);
    const std::size_t type_end = name_end == text.npos ? text.npos : text.find('\0', name_end + 1);
    std::int32_t size = -1;
    if (type_end != text.npos && text.size() - type_end > sizeof(size)) {
      std::memcpy(&size, text.data() + type_end + 1, sizeof(size));
    }
    if (size < 0 || static_cast<std::size_t>(size) > text.size() - type_end - 1 - sizeof(size)) {
      return invalid_argument("not a readable EXR file: the attribute at byte {} does not lie within its {} bytes", at,
                              text.size());
    }
    at = type_end + 1 + sizeof(size) + static_cast<std::size_t>(size);
  }
  return invalid_argument("not a readable EXR file: its header has no end");
}

}  // namespace lightmill
