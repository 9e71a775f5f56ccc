// The fingerprint class that a worker tells the coordinator.
#pragma once

#include <filesystem>
#include <string>

namespace lightmill {

/// A hash of this machine's test render (common/methods/fingerprint.h) and of its image decoder's fingerprint. So
/// workers of one class render the same bits, also of scenes with images. Workers whose decoder does not work have
/// classes of their own. The log has the reason.
std::string worker_class(const std::filesystem::path& decoder);

}  // namespace lightmill
