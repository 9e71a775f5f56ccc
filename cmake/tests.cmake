# Declarations of what ctest runs. A *run* is a test program, a share of one, or a script.

# What a run is, and when it runs (CONTRIBUTING.md).
set(LIGHTMILL_LABELS analytic asan atlas deploy e2e fuzz integration lint long release simulation statistical threads unit web)

# lightmill_run(RUN LABELS a b [NEEDS x y] [TIMEOUT s] [ENVIRONMENT V=w ...] COMMAND ...): NEEDS are programs of ours, or files
# in the build folder. test.sh builds them first. Without them the run fails. Exit code 77 counts as skipped.
function(lightmill_run run)
  cmake_parse_arguments(ARG "" "TIMEOUT" "LABELS;NEEDS;ENVIRONMENT;COMMAND" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 600)
  endif()
  foreach(label ${ARG_LABELS})
    if(NOT label IN_LIST LIGHTMILL_LABELS)
      message(FATAL_ERROR "${run}: unknown label ${label}; labels are ${LIGHTMILL_LABELS}")
    endif()
  endforeach()
  if(LIGHTMILL_SANITIZE OR CMAKE_CXX_FLAGS MATCHES "--coverage")
    math(EXPR ARG_TIMEOUT "${ARG_TIMEOUT} * 4")  # rendering is about four times slower
  endif()
  if(CMAKE_CXX_FLAGS MATCHES "--coverage")
    list(APPEND ARG_ENVIRONMENT LIGHTMILL_LEAVE_MS=10000)  # tests/support/process.h
  endif()
  if(LIGHTMILL_SANITIZE MATCHES "thread")
    list(APPEND ARG_ENVIRONMENT "TSAN_OPTIONS=history_size=7 suppressions='${PROJECT_SOURCE_DIR}/tests/thread_sanitizer.supp'")
  endif()
  set(files "")
  foreach(need ${ARG_NEEDS})
    if(TARGET ${need})
      list(APPEND files "$<TARGET_FILE:${need}>")
    else()
      list(APPEND files "${CMAKE_BINARY_DIR}/${need}")
    endif()
  endforeach()
  add_test(NAME ${run} COMMAND ${ARG_COMMAND})
  set_tests_properties(${run} PROPERTIES LABELS "${ARG_LABELS}" REQUIRED_FILES "${files}" TIMEOUT ${ARG_TIMEOUT}
                                         ENVIRONMENT "${ARG_ENVIRONMENT}" SKIP_RETURN_CODE 77)
endfunction()

# lightmill_compile_as_test(TARGET LEVEL): with GoogleTest in the precompiled header, and -O<LEVEL>, or -O0 with asan and ubsan.
function(lightmill_compile_as_test target level)
  if(LIGHTMILL_SANITIZE AND NOT LIGHTMILL_SANITIZE MATCHES "thread")
    set(level 0)
  endif()
  set(pch lightmill_test_pch_${level})
  if(NOT TARGET ${pch})
    lightmill_precompile(${pch} HEADERS <gtest/gtest.h> OPTIONS -O${level} DEPS GTest::gtest)
  endif()
  target_compile_options(${target} PRIVATE -O${level})
  target_precompile_headers(${target} REUSE_FROM ${pch})
endfunction()

# lightmill_read_long_tests(FILE): reads the table of tests that run only with `./test.sh --all`. Sets LONG_<program> to a
# GoogleTest filter.
function(lightmill_read_long_tests file)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  file(STRINGS ${file} rows REGEX "^\\| `[a-z0-9_]+` \\| `[^`]+` \\|")
  foreach(row ${rows})
    string(REGEX REPLACE "^\\| `([a-z0-9_]+)` .*" "\\1" program "${row}")
    string(REGEX REPLACE "^\\| `[a-z0-9_]+` \\| `([^`]+)`.*" "\\1" filter "${row}")
    get_property(filters GLOBAL PROPERTY LONG_${program})
    list(APPEND filters "${filter}")
    list(JOIN filters ":" filters)
    set_property(GLOBAL PROPERTY LONG_${program} "${filters}")
    set_property(GLOBAL APPEND PROPERTY LIGHTMILL_LONG_PROGRAMS ${program})
  endforeach()
endfunction()

# lightmill_test(NAME LABELS a b [COMPUTES] [SHARDS n] [TIMEOUT s] SOURCES ... DEPS ... [NEEDS program ...]): a GoogleTest program
# and its runs. It starts the programs that it NEEDS. COMPUTES: the code of the tests takes seconds, so it is optimised. Tests with
# many samples do.
function(lightmill_test name)
  cmake_parse_arguments(ARG "COMPUTES" "TIMEOUT;SHARDS" "LABELS;SOURCES;DEPS;NEEDS" ${ARGN})
  if(ARG_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "${name}: unexpected ${ARG_UNPARSED_ARGUMENTS}")
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_DEPS} lightmill_test_paths GTest::gtest GTest::gtest_main)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  if(ARG_NEEDS)
    add_dependencies(${name} ${ARG_NEEDS})
  endif()
  set(level 0)
  if(ARG_COMPUTES OR ARG_LABELS MATCHES "analytic|atlas|statistical|simulation")
    set(level 1)
  endif()
  lightmill_compile_as_test(${name} ${level})
  lightmill_unity(${name} 16)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  lightmill_test_runs(${name} "${ARG_SHARDS}" "${ARG_TIMEOUT}" ${ARG_LABELS})
endfunction()

# lightmill_test_runs(PROGRAM SHARDS TIMEOUT LABEL...): ctest runs a program once, or as several processes that share its tests.
# Tests in the table of long tests are another run, PROGRAM.long, with the label long.
function(lightmill_test_runs program shards timeout)
  set_property(GLOBAL APPEND PROPERTY LIGHTMILL_TEST_PROGRAMS ${program})
  get_property(long GLOBAL PROPERTY LONG_${program})
  if(NOT shards)
    set(shards 1)
  endif()
  foreach(shard RANGE 1 ${shards})
    set(run ${program})
    if(shards GREATER 1)
      set(run ${program}.${shard})
    endif()
    math(EXPR index "${shard} - 1")
    lightmill_test_run(${run} "-${long}" LABELS ${ARGN} NEEDS ${program} TIMEOUT ${timeout}
                       ENVIRONMENT GTEST_TOTAL_SHARDS=${shards} GTEST_SHARD_INDEX=${index} COMMAND ${program})
  endforeach()
  if(long)
    lightmill_test_run(${program}.long "${long}" LABELS ${ARGN} long NEEDS ${program} TIMEOUT ${timeout} COMMAND ${program})
  endif()
endfunction()

# lightmill_test_run(RUN FILTER ...): a run of a test program, which writes reports/RUN.xml. Runs that compute take a core each
# (tests/runner/results.py). Runs that wait for processes fill the rest. ctest begins with the highest COST: long computations
# first, then the others by their measured times.
function(lightmill_test_run run filter)
  lightmill_run(${run} ${ARGN})
  if("integration" IN_LIST ARGN)
    set_tests_properties(${run} PROPERTIES COST 100)
  else()
    set_tests_properties(${run} PROPERTIES RESOURCE_GROUPS cores:1)
    if(NOT "unit" IN_LIST ARGN AND NOT "fuzz" IN_LIST ARGN)
      set_tests_properties(${run} PROPERTIES COST 1000)
    endif()
  endif()
  set_property(TEST ${run} APPEND PROPERTY ENVIRONMENT GTEST_FILTER=${filter}
                                                       GTEST_OUTPUT=xml:${CMAKE_BINARY_DIR}/reports/${run}.xml)
endfunction()

# lightmill_write_test_programs(): writes each program and its source files, for test.sh.
function(lightmill_write_test_programs)
  get_property(programs GLOBAL PROPERTY LIGHTMILL_TEST_PROGRAMS)
  set(lines "")
  foreach(program ${programs})
    get_target_property(sources ${program} LIGHTMILL_SOURCES)
    get_target_property(folder ${program} SOURCE_DIR)
    string(APPEND lines "${program}")
    foreach(source ${sources})
      if(source MATCHES "_test\\.cpp$|conformance\\.cpp$")
        cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY ${folder} NORMALIZE)
        string(APPEND lines "\t${source}")
      endif()
    endforeach()
    string(APPEND lines "\n")
  endforeach()
  file(WRITE ${CMAKE_BINARY_DIR}/test_programs.txt "${lines}")
endfunction()
