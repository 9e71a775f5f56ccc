#include "common/scene_io/file_finder.h"

#include <algorithm>
#include <cctype>

#include "common/base/number_text.h"

namespace lightmill {
namespace fs = std::filesystem;
namespace {

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

}  // namespace

std::optional<std::string> FileFinder::find(const fs::path& folder, const std::string& written) {
  if (files_.is_file(folder / written)) {
    return written;
  }
  std::string slashed = written;
  std::ranges::replace(slashed, '\\', '/');
  fs::path found;
  for (const fs::path& part : fs::path(slashed).lexically_normal()) {
    const std::string name = part == ".." || part == "/" ? part.string() : entry(folder / found, part.string());
    if (name.empty()) {
      found.clear();
      break;
    }
    found /= name;
  }
  if (!found.empty() && files_.is_file(folder / found)) {
    return found.string();
  }
  const std::string last = entry(folder, fs::path(slashed).filename().string());
  return files_.is_file(folder / last) ? std::optional(last) : std::nullopt;
}

std::string FileFinder::entry(const fs::path& folder, const std::string& name) {
  const auto [listed, added] = folders_.try_emplace(folder.string());
  if (added) {
    for (const std::string& one : files_.names(folder)) {
      listed->second.try_emplace(lower(one), one);
    }
  }
  const auto found = listed->second.find(lower(name));
  return found == listed->second.end() ? "" : found->second;
}

FileSource files_below(const fs::path& folder, const SceneFiles& files, std::uint64_t limit_bytes) {
  return [folder, &files, limit_bytes,
          finder = FileFinder(files)](const std::string& written) mutable -> Result<SourceFile> {
    const std::string name = finder.find(folder, written).value_or(written);
    LM_ASSIGN_OR_RETURN(std::string found, files.read(folder / name, limit_bytes));
    return SourceFile{name, std::move(found)};
  };
}

FileSource at_most(std::uint64_t bytes, FileSource files) {
  return [left = bytes, bytes, files = std::move(files)](const std::string& name) mutable -> Result<SourceFile> {
    LM_ASSIGN_OR_RETURN(SourceFile file, files(name));
    if (file.bytes.size() > left) {
      return invalid_argument("{}: the scene reads files with more than {}", name, human_bytes(bytes));
    }
    left -= file.bytes.size();
    return file;
  };
}

}  // namespace lightmill
