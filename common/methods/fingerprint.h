// Fingerprint of this machine's renderer. worker/render/worker_class.h derives the class of a worker from it.
#pragma once

#include <string>

namespace lightmill {

/// A hash of a built-in test render. It covers a large smooth mesh, coplanar ties, every BSDF, every kind of light,
/// every filter and every method. Takes about 0.15 s of one core.
std::string fingerprint_class();

}  // namespace lightmill
