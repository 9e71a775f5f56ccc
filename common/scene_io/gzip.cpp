#include "common/scene_io/gzip.h"

#include <zlib.h>

#include <algorithm>

#include "common/base/number_text.h"
#include "common/base/text.h"

namespace lightmill {
namespace {

constexpr std::size_t kPart = 1 << 20;

struct Inflater {
  Inflater() { ok = inflateInit2(&stream, 15 + 16) == Z_OK; }  // the largest window, with a gzip header
  ~Inflater() { inflateEnd(&stream); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  z_stream stream{};
  bool ok = false;
};

}  // namespace

Result<std::string> gunzip(std::string_view bytes, const std::string& file_name, std::uint64_t limit_bytes) {
  const auto broken = [&] { return invalid_argument("{}: cannot be unpacked", utf8_text(file_name)); };
  Inflater in;
  std::string out, part(kPart, '\0');
  bool ended = false;
  while (in.ok && !(ended && in.stream.avail_in == 0 && bytes.empty())) {
    if (in.stream.avail_in == 0) {
      const std::string_view next = bytes.substr(0, kPart);
      in.stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(next.data()));
      in.stream.avail_in = static_cast<uInt>(next.size());
      bytes.remove_prefix(next.size());
    }
    if (ended && inflateReset(&in.stream) != Z_OK) {  // another member follows
      return broken();
    }
    in.stream.next_out = reinterpret_cast<Bytef*>(part.data());
    in.stream.avail_out = static_cast<uInt>(part.size());
    const int result = inflate(&in.stream, Z_NO_FLUSH);
    ended = result == Z_STREAM_END;
    in.ok = ended || result == Z_OK;  // Z_BUF_ERROR: the file ends early
    const std::size_t made = part.size() - in.stream.avail_out;
    if (made > limit_bytes - out.size()) {
      return invalid_argument("{}: unpacks to more than {}", utf8_text(file_name), human_bytes(limit_bytes));
    }
    out.append(part, 0, made);
  }
  return in.ok ? Result<std::string>(std::move(out)) : broken();
}

FileSource unpacked(std::uint64_t bytes, FileSource files) {
  return [left = bytes, files = std::move(files)](const std::string& name) mutable -> Result<SourceFile> {
    LM_ASSIGN_OR_RETURN(SourceFile file, files(name));
    if (name.ends_with(".gz")) {
      LM_ASSIGN_OR_RETURN(file.bytes, gunzip(file.bytes, file.name, left));
      left -= file.bytes.size();
    }
    return file;
  };
}

}  // namespace lightmill
