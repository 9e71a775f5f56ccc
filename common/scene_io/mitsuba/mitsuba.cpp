#include "common/scene_io/mitsuba/mitsuba.h"

#include "common/scene/validate/validate.h"
#include "common/scene_io/mitsuba/mitsuba_world.h"

namespace lightmill {

Result<LoadedScene> read_mitsuba(std::string text, const std::string& file_name, FileSource files) {
  constexpr std::uint64_t kMostReadBytes = std::uint64_t{16}
                                           << 30;  // of the files that a scene names, each time it does
  FileSource limited = at_most(kMostReadBytes, std::move(files));
  LM_ASSIGN_OR_RETURN(const MitsubaDocument document, read_mitsuba_xml(std::move(text), file_name, limited));
  FileSource found = [&](const std::string& name) { return find_mitsuba_file(limited, document.folders, name); };
  LM_ASSIGN_OR_RETURN(LoadedScene loaded, MitsubaWorld(found).convert(document.objects.front()));
  if (const Status valid = validate(loaded.scene); !valid.ok()) {
    return with_context(valid, file_name);
  }
  return loaded;
}

}  // namespace lightmill
