// The fingerprint class that a worker tells the coordinator.
#pragma once

#include <filesystem>
#include <string>

namespace lightmill {

/// A hash of this machine's test render (common/methods/fingerprint.h), and of the fingerprint of its image decoder. So
/// workers of one class render the same bits, also of scenes with images. Without a decoder that works, a worker has a
/// class of those without one, and logs why.
std::string worker_class(const std::filesystem::path& decoder);

}  // namespace lightmill
