// A constant that says whether this build has sanitizers. Their runtimes need more memory and system calls.
#pragma once

namespace lightmill {

// The build defines it, because GCC has no macro for the sanitizer of undefined behaviour.
#ifdef LIGHTMILL_SANITIZED
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace lightmill
