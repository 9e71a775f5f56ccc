# Compiler flags of every target. The same source gives the same bits in every program. Optimisation levels differ
# (cmake/targets.cmake). This changes no bits, because contraction and fast-math are off.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)

if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()

# No -ffast-math and no contraction: a sample's bits must not depend on how the compiler fuses operations.
add_compile_options(-march=x86-64-v3 -ffp-contract=off -fno-math-errno -Wall -Wextra -Werror)
set(CMAKE_CXX_FLAGS_RELEASE "-O1")  # no -DNDEBUG, because checks stay on
set(CMAKE_CXX_FLAGS_DEBUG "-O1 -g1")
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # Sanitized code compiles in half the time. Without optimisation GCC does not see that a function cannot return after
  # LM_CHECK(false). Release builds have the warning.
  set(CMAKE_CXX_FLAGS_DEBUG "-O0 -g1 -Wno-return-type")
  if(LIGHTMILL_SANITIZE MATCHES "thread")
    set(CMAKE_CXX_FLAGS_DEBUG "-O1 -g1 -Wno-return-type")  # it runs the statistical tests, whose rendering takes minutes
  endif()
  # GCC's garbage collector takes a seventh of the time if its heap starts below a gigabyte.
  add_compile_options(--param=ggc-min-heapsize=1000000)
  # GCC 12 reports false positives from its own headers with these at -O3.
  add_compile_options(-Wno-array-bounds -Wno-stringop-overflow -Wno-maybe-uninitialized -Wno-psabi)
else()
  add_compile_options(-Wthread-safety)
  add_compile_options(-Wno-inconsistent-missing-override)  # a template overrides members of some of its bases
endif()

if(CMAKE_CXX_FLAGS MATCHES "--coverage")
  add_compile_options(-Wno-error)  # counters make GCC warn
endif()

set(LIGHTMILL_SANITIZE "" CACHE STRING "sanitizers to build with, e.g. address,undefined")
if(LIGHTMILL_SANITIZE)
  add_compile_options(-fsanitize=${LIGHTMILL_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${LIGHTMILL_SANITIZE})
  add_compile_definitions(LIGHTMILL_SANITIZED)
  if(LIGHTMILL_SANITIZE MATCHES "address" AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # These checks take a quarter of the compiler's time. The presets ubsan and fuzz have them.
    add_compile_options(-fno-sanitize=null,alignment,object-size)
  endif()
  if(LIGHTMILL_SANITIZE MATCHES "thread" AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    add_compile_options(-Wno-tsan)  # It does not see the fences of Boost.Asio. A mutex guards all data that Asio passes on.
  endif()
endif()

find_program(LIGHTMILL_CCACHE ccache)
if(LIGHTMILL_CCACHE)
  # With the dependencies from the compiler, ccache does not preprocess a file first. It needs the sloppiness for files with
  # precompiled headers. The language of messages does not make another result.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1 CCACHE_DEPEND=1
                                  CCACHE_SLOPPINESS=locale,pch_defines,time_macros
                                  ${LIGHTMILL_CCACHE})
  add_compile_options(-fpch-preprocess)
  if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # ccache compares headers by content. Without this, clang refuses a header whose time differs.
    add_compile_options("SHELL:-Xclang -fno-pch-timestamp")
  endif()
endif()

find_program(LIGHTMILL_MOLD mold)
if(LIGHTMILL_MOLD)
  add_link_options(-fuse-ld=mold)
endif()
