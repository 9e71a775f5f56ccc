# The few functions that declare libraries, programs and tests.

# Headers that nearly every file includes, compiled once. They are listed here and not in a file of ours, because the path
# of such a file would become part of what is compiled, and ccache could not share results between checkouts.
set(LIGHTMILL_PCH_HEADERS
  <fmt/format.h> <algorithm> <array> <bit> <chrono> <cmath> <compare> <cstddef> <cstdint> <cstring> <deque>
  <filesystem> <functional> <limits> <map> <memory> <mutex> <numeric> <optional> <set> <span> <string> <string_view>
  <thread> <tuple> <unordered_map> <utility> <variant> <vector>)
add_library(lightmill_pch STATIC ${PROJECT_SOURCE_DIR}/cmake/pch.cpp)
target_precompile_headers(lightmill_pch PRIVATE ${LIGHTMILL_PCH_HEADERS})
target_link_libraries(lightmill_pch PUBLIC fmt::fmt)

# Unity builds: several source files of a target are compiled as one, which halves the time. The files of a target share one
# anonymous namespace then. OFF compiles each file by itself, and finds missing includes.
option(LIGHTMILL_UNITY "compile several source files of a target as one" ON)

# lightmill_unity(TARGET SIZE): compiles the sources of a target in groups of SIZE. A group's file includes its members by
# their paths from the top: CMake's own unity builds have absolute paths, and ccache could not share results between checkouts.
function(lightmill_unity target size)
  get_target_property(sources ${target} SOURCES)
  set_target_properties(${target} PROPERTIES LIGHTMILL_SOURCES "${sources}")
  list(LENGTH sources count)
  if(NOT LIGHTMILL_UNITY OR count EQUAL 1)
    return()
  endif()
  set(units "")
  math(EXPR last "${count} - 1")
  foreach(first RANGE 0 ${last} ${size})
    list(SUBLIST sources ${first} ${size} group)
    set(text "")
    foreach(source ${group})
      cmake_path(ABSOLUTE_PATH source NORMALIZE)
      cmake_path(RELATIVE_PATH source BASE_DIRECTORY ${PROJECT_SOURCE_DIR})
      string(APPEND text "#include \"${source}\"\n")
    endforeach()
    set(unit ${CMAKE_CURRENT_BINARY_DIR}/${target}.unity_${first}.cpp)
    file(CONFIGURE OUTPUT ${unit} CONTENT "${text}" @ONLY)
    list(APPEND units ${unit})
  endforeach()
  set_target_properties(${target} PROPERTIES SOURCES "${units}")
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # It means that each file with the type has another one, which a single unit cannot have.
    target_compile_options(${target} PRIVATE -Wno-subobject-linkage)
  endif()
endfunction()

# Code that runs per ray or per pixel. It copies structs of eight lanes 32 bytes at a time: GCC's default of 16 stalls every
# read of the whole struct.
set(LIGHTMILL_KERNEL_OPTIONS "")
if(CMAKE_BUILD_TYPE STREQUAL "Release")
  list(APPEND LIGHTMILL_KERNEL_OPTIONS -O3)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 12)
  list(APPEND LIGHTMILL_KERNEL_OPTIONS -mmove-max=256 -mstore-max=256)
endif()

# The same headers for kernels, and the intrinsics: a precompiled header serves only what has its options.
add_library(lightmill_kernel_pch STATIC ${PROJECT_SOURCE_DIR}/cmake/pch.cpp)
target_precompile_headers(lightmill_kernel_pch PRIVATE ${LIGHTMILL_PCH_HEADERS} <immintrin.h>)
target_compile_options(lightmill_kernel_pch PRIVATE ${LIGHTMILL_KERNEL_OPTIONS})
target_link_libraries(lightmill_kernel_pch PUBLIC fmt::fmt)

# lightmill_sources(TARGET KIND): how the sources of a target are compiled. KIND is KERNEL, SHELL (reads options and calls
# the rest: it is compiled fast rather than made fast) or empty.
function(lightmill_sources target kind)
  lightmill_unity(${target} 16)
  if(kind STREQUAL "KERNEL")
    target_compile_options(${target} PRIVATE ${LIGHTMILL_KERNEL_OPTIONS})
    target_precompile_headers(${target} REUSE_FROM lightmill_kernel_pch)
  elseif(kind STREQUAL "SHELL")
    target_compile_options(${target} PRIVATE -O1)
  else()
    target_precompile_headers(${target} REUSE_FROM lightmill_pch)
  endif()
endfunction()

# lightmill_library(NAME [KERNEL | SHELL] [SOURCES a.cpp ...] [DEPS lib ...] [PRIVATE_DEPS lib ...]): the static library
# lightmill_NAME; without SOURCES, headers only.
function(lightmill_library name)
  cmake_parse_arguments(ARG "KERNEL;SHELL" "" "SOURCES;DEPS;PRIVATE_DEPS" ${ARGN})
  if(ARG_SOURCES)
    set(kind "")
    if(ARG_KERNEL)
      set(kind KERNEL)
    elseif(ARG_SHELL)
      set(kind SHELL)
    endif()
    add_library(lightmill_${name} STATIC ${ARG_SOURCES})
    target_include_directories(lightmill_${name} PUBLIC ${PROJECT_SOURCE_DIR})
    target_link_libraries(lightmill_${name} PUBLIC ${ARG_DEPS} fmt::fmt PRIVATE ${ARG_PRIVATE_DEPS})
    lightmill_sources(lightmill_${name} "${kind}")
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
  lightmill_sources(${name} SHELL)
endfunction()

# Test sources are compiled with -O1 and have GoogleTest in their precompiled header. Not every build has tests.
function(lightmill_test_pch)
  if(TARGET lightmill_test_pch)
    return()
  endif()
  add_library(lightmill_test_pch STATIC ${PROJECT_SOURCE_DIR}/cmake/pch.cpp)
  target_precompile_headers(lightmill_test_pch PRIVATE ${LIGHTMILL_PCH_HEADERS} <gtest/gtest.h>)
  target_compile_options(lightmill_test_pch PRIVATE -O1)
  target_link_libraries(lightmill_test_pch PUBLIC fmt::fmt GTest::gtest)
endfunction()

# The table of the tests that run only with `./test.sh --all`: sets LONG_<program> to a GoogleTest filter.
function(lightmill_read_long_tests file)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  file(STRINGS ${file} rows REGEX "^\\| `[a-z_]+` \\| `[^`]+` \\|")
  foreach(row ${rows})
    string(REGEX REPLACE "^\\| `([a-z_]+)` .*" "\\1" program "${row}")
    string(REGEX REPLACE "^\\| `[a-z_]+` \\| `([^`]+)`.*" "\\1" filter "${row}")
    get_property(filters GLOBAL PROPERTY LONG_${program})
    list(APPEND filters "${filter}")
    list(JOIN filters ":" filters)
    set_property(GLOBAL PROPERTY LONG_${program} "${filters}")
  endforeach()
endfunction()

# lightmill_test(NAME LABELS a b [SHARDS n] [TIMEOUT s] SOURCES ... DEPS ...): a GoogleTest program. ctest runs it once, or
# as n processes that share its tests. The tests that the table of long tests names are one more run, NAME.long, with the
# label long. Each run writes reports/RUN.xml.
function(lightmill_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT;SHARDS" "LABELS;SOURCES;DEPS" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 600)
  endif()
  if(NOT ARG_SHARDS)
    set(ARG_SHARDS 1)
  endif()
  if(LIGHTMILL_SANITIZE OR CMAKE_CXX_FLAGS MATCHES "--coverage")
    math(EXPR ARG_TIMEOUT "${ARG_TIMEOUT} * 4")  # rendering is as many times slower
  endif()
  lightmill_test_pch()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_DEPS} lightmill_test_places GTest::gtest GTest::gtest_main)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_compile_options(${name} PRIVATE -O1)
  target_precompile_headers(${name} REUSE_FROM lightmill_test_pch)
  lightmill_unity(${name} 8)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  set_property(GLOBAL APPEND PROPERTY LIGHTMILL_TEST_PROGRAMS ${name})
  set_property(TARGET ${name} PROPERTY LIGHTMILL_LABELS "${ARG_LABELS}")
  get_property(long GLOBAL PROPERTY LONG_${name})
  foreach(shard RANGE 1 ${ARG_SHARDS})
    set(run ${name})
    if(ARG_SHARDS GREATER 1)
      set(run ${name}.${shard})
    endif()
    math(EXPR index "${shard} - 1")
    lightmill_test_run(${run} ${name} ${ARG_TIMEOUT} "${ARG_LABELS}" "GTEST_FILTER=-${long}"
                       "GTEST_TOTAL_SHARDS=${ARG_SHARDS};GTEST_SHARD_INDEX=${index}")
  endforeach()
  if(long)
    lightmill_test_run(${name}.long ${name} ${ARG_TIMEOUT} "${ARG_LABELS};long" "GTEST_FILTER=${long}" "")
  endif()
endfunction()

# lightmill_test_run(RUN PROGRAM TIMEOUT LABELS FILTER ENVIRONMENT): one run of a test program. It holds two of the slots
# that `ctest -j` has if it computes, and one if it waits for real processes.
function(lightmill_test_run run program timeout labels filter environment)
  set(processors 2)
  if("integration" IN_LIST labels)
    set(processors 1)
  endif()
  list(APPEND environment "${filter}" "GTEST_OUTPUT=xml:${CMAKE_BINARY_DIR}/reports/${run}.xml")
  if(LIGHTMILL_SANITIZE MATCHES "thread")
    list(APPEND environment "TSAN_OPTIONS=suppressions=${PROJECT_SOURCE_DIR}/tests/thread_sanitizer.supp")
  endif()
  set(cost 0)
  if("integration" IN_LIST labels)
    set(cost 100)  # those that wait begin first, and others compute beside them
  endif()
  add_test(NAME ${run} COMMAND ${program})
  set_tests_properties(${run} PROPERTIES LABELS "${labels}" TIMEOUT ${timeout} PROCESSORS ${processors} COST ${cost}
                                         ENVIRONMENT "${environment}")
endfunction()
