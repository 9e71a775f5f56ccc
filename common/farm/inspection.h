// Scene files that a worker is asked to read, and what it finds: as plain values.
#pragma once

#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/ids.h"

namespace lightmill {

using InspectionId = StrongId<struct InspectionTag>;  ///< Unique in the life of a farm.

struct InspectionRequest {
  struct File {
    std::string path;  ///< as the files name each other: relative, with '/'
    Sha256 digest;     ///< of an asset that the farm has
  };
  std::vector<File> files;
  std::vector<std::string> scene;  ///< of these, the scene itself
  std::string camera;              ///< empty: the scene's
};

struct Inspection {
  struct Fact {
    std::string what, value;
  };
  struct Verdict {
    std::string method;
    bool admitted = false;  ///< it finds all of the light
    std::string reason;
  };
  std::string scene;           ///< packed, ready for RenderSettings
  std::vector<Sha256> assets;  ///< that it names, sorted, each once; the farm has them
  std::vector<std::string> notices;
  std::vector<Fact> facts;
  std::vector<Verdict> methods;
  std::vector<std::string> chosen;  ///< what auto takes, or chooses among
  std::vector<std::string> cameras;
};

}  // namespace lightmill
