// Inspection of scene files by a worker, as plain values: the request, and the report on their contents.
#pragma once

#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/ids.h"

namespace lightmill {

using InspectionId = StrongId<struct InspectionTag>;  ///< Unique during the life of a farm.

struct InspectionRequest {
  struct File {
    std::string path;  ///< relative, with '/', as the files name each other
    Sha256 digest;     ///< an asset of the farm
  };
  std::vector<File> files;
  std::vector<std::string> scene;  ///< which of the files are the scene itself
  std::string camera;              ///< empty: the scene's
};

struct Inspection {
  struct Fact {
    std::string what, value;
  };
  struct Verdict {
    std::string method;
    bool admitted = false;  ///< the method finds all light of the scene
    std::string reason;
  };
  std::string scene;           ///< packed, ready for RenderSettings
  std::vector<Sha256> assets;  ///< assets that it names, sorted, each once; the farm has them
  std::vector<std::string> notices;
  std::vector<Fact> facts;
  std::vector<Verdict> methods;
  std::vector<std::string> chosen;  ///< the method that `auto` takes, or its candidates
  std::vector<std::string> cameras;
};

}  // namespace lightmill
