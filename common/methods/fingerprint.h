// The fingerprint class: which workers give the same bits.
#pragma once

#include <string>

namespace lightmill {

/// The class of this machine: a hash of a built-in test render. It covers a large smooth mesh, coplanar ties, every
/// BSDF, every kind of light, every filter and every method; two machines with the same class render the same bits as
/// far as that shows. Takes some 0.3 s of one core.
std::string fingerprint_class();

}  // namespace lightmill
