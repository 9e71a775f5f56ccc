# The few functions that declare libraries, programs and tests.

# Headers that nearly every file includes, compiled once. A header file of ours would put its path into the precompiled header,
# and ccache could not share results between checkouts.
set(LIGHTMILL_PCH_HEADERS
  <absl/status/statusor.h> <fmt/format.h> <algorithm> <array> <bit> <chrono> <cmath> <compare> <cstddef> <cstdint> <cstring> <deque>
  <filesystem> <functional> <limits> <map> <memory> <mutex> <numeric> <optional> <set> <span> <string> <string_view>
  <thread> <tuple> <unordered_map> <utility> <variant> <vector>)

# lightmill_precompile(NAME [HEADERS <h> ...] [OPTIONS -O1 ...] [DEPS lib ...]): the static library NAME. It precompiles these headers
# and HEADERS for targets with the same options.
function(lightmill_precompile name)
  cmake_parse_arguments(ARG "" "" "HEADERS;OPTIONS;DEPS" ${ARGN})
  add_library(${name} STATIC ${PROJECT_SOURCE_DIR}/cmake/pch.cpp)
  target_precompile_headers(${name} PRIVATE ${LIGHTMILL_PCH_HEADERS} ${ARG_HEADERS})
  target_compile_options(${name} PRIVATE ${ARG_OPTIONS})
  target_link_libraries(${name} PUBLIC fmt::fmt ${ARG_DEPS})
endfunction()

lightmill_precompile(lightmill_pch)

# Unity builds compile several source files of a target as one. This halves the time. The files of a target then share one
# anonymous namespace. OFF compiles each file alone, and finds missing includes.
option(LIGHTMILL_UNITY "compile several source files of a target as one" ON)

# lightmill_unity(TARGET SIZE): compiles the sources of a target in groups of SIZE. The file of a group includes its members by
# relative paths. CMake's own unity builds use absolute paths, and ccache could not share results between checkouts.
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
    # The warning is about types that differ between files, but a unit is one file.
    target_compile_options(${target} PRIVATE -Wno-subobject-linkage)
  endif()
endfunction()

# Code that runs per ray or per pixel. It copies structs of eight lanes in moves of 32 bytes. GCC's default of 16 bytes stalls
# every read of the whole struct.
set(LIGHTMILL_KERNEL_OPTIONS "")
if(CMAKE_BUILD_TYPE STREQUAL "Release")
  list(APPEND LIGHTMILL_KERNEL_OPTIONS -O3)
elseif(LIGHTMILL_SANITIZE MATCHES "thread")
  list(APPEND LIGHTMILL_KERNEL_OPTIONS -O2)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 12)
  list(APPEND LIGHTMILL_KERNEL_OPTIONS -mmove-max=256 -mstore-max=256)
endif()

lightmill_precompile(lightmill_kernel_pch HEADERS <immintrin.h> OPTIONS ${LIGHTMILL_KERNEL_OPTIONS})

# Code that simulations run for minutes. Without optimisation the address sanitizer slows it 30 times.
set(LIGHTMILL_SIMULATED_OPTIONS -O1)
if(CMAKE_BUILD_TYPE STREQUAL "Release")
  set(LIGHTMILL_SIMULATED_OPTIONS -O2)
endif()

lightmill_precompile(lightmill_simulated_pch OPTIONS ${LIGHTMILL_SIMULATED_OPTIONS})

# lightmill_sources(TARGET [KERNEL | SIMULATED]): sets how the sources of a target are compiled.
function(lightmill_sources target)
  set(kind "${ARGN}")
  lightmill_unity(${target} 24)
  if(kind STREQUAL "KERNEL")
    target_compile_options(${target} PRIVATE ${LIGHTMILL_KERNEL_OPTIONS})
    target_precompile_headers(${target} REUSE_FROM lightmill_kernel_pch)
  elseif(kind STREQUAL "SIMULATED")
    target_compile_options(${target} PRIVATE ${LIGHTMILL_SIMULATED_OPTIONS})
    target_precompile_headers(${target} REUSE_FROM lightmill_simulated_pch)
  else()
    target_precompile_headers(${target} REUSE_FROM lightmill_pch)
  endif()
endfunction()

# lightmill_library(NAME [KERNEL | SIMULATED] [SOURCES a.cpp ...] [DEPS lib ...] [PRIVATE_DEPS lib ...]): the static library
# lightmill_NAME. Without SOURCES it has only headers.
function(lightmill_library name)
  cmake_parse_arguments(ARG "KERNEL;SIMULATED" "" "SOURCES;DEPS;PRIVATE_DEPS" ${ARGN})
  if(ARG_SOURCES)
    set(kind "")
    if(ARG_KERNEL)
      set(kind KERNEL)
    elseif(ARG_SIMULATED)
      set(kind SIMULATED)
    endif()
    add_library(lightmill_${name} STATIC ${ARG_SOURCES})
    target_include_directories(lightmill_${name} PUBLIC ${PROJECT_SOURCE_DIR})
    target_link_libraries(lightmill_${name} PUBLIC ${ARG_DEPS} fmt::fmt PRIVATE ${ARG_PRIVATE_DEPS})
    lightmill_sources(lightmill_${name} ${kind})
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
  lightmill_sources(${name})
endfunction()
