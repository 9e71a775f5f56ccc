# The few functions that declare libraries, programs and tests.

# Headers that nearly every file wants, compiled once for all targets (they all have the same flags). Named here, not in a
# file of ours, whose path would be in what is compiled: so ccache finds it, and all that has it, from other checkouts.
set(LIGHTMILL_PCH_HEADERS
  <fmt/format.h> <algorithm> <array> <bit> <chrono> <cmath> <compare> <cstddef> <cstdint> <cstring> <deque>
  <filesystem> <functional> <limits> <map> <memory> <mutex> <numeric> <optional> <set> <span> <string> <string_view>
  <thread> <tuple> <unordered_map> <utility> <variant> <vector>)
add_library(lightmill_pch STATIC ${PROJECT_SOURCE_DIR}/cmake/pch.cpp)
target_precompile_headers(lightmill_pch PRIVATE ${LIGHTMILL_PCH_HEADERS})
target_link_libraries(lightmill_pch PUBLIC fmt::fmt)

# Libraries of what runs for every ray copy structs of eight lanes 32 bytes at a time. GCC's default of 16 makes whoever
# reads the whole wait. A flag must be the precompiled header's too, hence another one.
add_library(lightmill_kernel_pch STATIC ${PROJECT_SOURCE_DIR}/cmake/pch.cpp)
target_precompile_headers(lightmill_kernel_pch PRIVATE ${LIGHTMILL_PCH_HEADERS})
target_link_libraries(lightmill_kernel_pch PUBLIC fmt::fmt)
set(LIGHTMILL_KERNEL_OPTIONS "")
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 12)
  set(LIGHTMILL_KERNEL_OPTIONS -mmove-max=256 -mstore-max=256)
endif()
target_compile_options(lightmill_kernel_pch PRIVATE ${LIGHTMILL_KERNEL_OPTIONS})

# lightmill_library(NAME [KERNEL] [SOURCES a.cpp ...] [DEPS lib ...]): the static library lightmill_NAME; without SOURCES,
# headers only. KERNEL: of what runs for every ray.
function(lightmill_library name)
  cmake_parse_arguments(ARG "KERNEL" "" "SOURCES;DEPS;PRIVATE_DEPS" ${ARGN})
  if(ARG_SOURCES)
    add_library(lightmill_${name} STATIC ${ARG_SOURCES})
    target_include_directories(lightmill_${name} PUBLIC ${PROJECT_SOURCE_DIR})
    target_link_libraries(lightmill_${name} PUBLIC ${ARG_DEPS} fmt::fmt PRIVATE ${ARG_PRIVATE_DEPS})
    if(ARG_KERNEL)
      target_compile_options(lightmill_${name} PRIVATE ${LIGHTMILL_KERNEL_OPTIONS})
      target_precompile_headers(lightmill_${name} REUSE_FROM lightmill_kernel_pch)
    else()
      target_precompile_headers(lightmill_${name} REUSE_FROM lightmill_pch)
    endif()
  else()
    add_library(lightmill_${name} INTERFACE)
    target_include_directories(lightmill_${name} INTERFACE ${PROJECT_SOURCE_DIR})
    target_link_libraries(lightmill_${name} INTERFACE ${ARG_DEPS} fmt::fmt)
  endif()
endfunction()

# lightmill_program(NAME SOURCES ... DEPS ...): the program NAME in bin/.
function(lightmill_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_DEPS})
  target_precompile_headers(${name} REUSE_FROM lightmill_pch)
endfunction()

# lightmill_test(NAME [WHOLE] LABELS a b SOURCES ... DEPS ...): a GoogleTest program; each of its tests is one ctest with the
# labels (as one, a+b, which expressions for either find: what discovers tests takes no two). WHOLE: all of them together
# are one, because they share something that takes long to start.
function(lightmill_test name)
  cmake_parse_arguments(ARG "WHOLE" "TIMEOUT" "LABELS;SOURCES;DEPS" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  if(LIGHTMILL_SANITIZE MATCHES "thread")
    math(EXPR ARG_TIMEOUT "${ARG_TIMEOUT} * 8")  # as many times slower as it makes what renders
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_DEPS} GTest::gtest GTest::gtest_main)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_precompile_headers(${name} REUSE_FROM lightmill_pch)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  target_compile_definitions(${name} PRIVATE LIGHTMILL_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
                                             LIGHTMILL_BINARY_DIR="${CMAKE_BINARY_DIR}")
  set_property(GLOBAL APPEND PROPERTY LIGHTMILL_TEST_PROGRAMS ${name})
  set_property(TARGET ${name} PROPERTY LIGHTMILL_LABELS "${ARG_LABELS}")
  set(environment "")
  if(LIGHTMILL_SANITIZE MATCHES "thread")
    set(environment ENVIRONMENT "TSAN_OPTIONS=suppressions=${PROJECT_SOURCE_DIR}/tests/thread_sanitizer.supp")
  endif()
  if(ARG_WHOLE)
    add_test(NAME ${name} COMMAND ${name})
    set_tests_properties(${name} PROPERTIES LABELS "${ARG_LABELS}" TIMEOUT ${ARG_TIMEOUT} ${environment})
    return()
  endif()
  string(JOIN "+" labels ${ARG_LABELS})
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST PROPERTIES LABELS "${labels}" TIMEOUT ${ARG_TIMEOUT} ${environment})
endfunction()
