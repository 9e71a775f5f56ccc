// Fingerprint class: workers of one class render the same bits.
#pragma once

#include <string>

namespace lightmill {

/// This machine's class: a hash of a built-in test render. It covers a large smooth mesh, coplanar ties, every BSDF,
/// every kind of light, every filter and every method. Takes about 0.3 s of one core.
std::string fingerprint_class();

}  // namespace lightmill
