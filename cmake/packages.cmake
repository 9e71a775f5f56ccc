# Every external library, and Python. All are Debian 12 packages, which deploy/setup installs.
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Protobuf MODULE REQUIRED)  # CONFIG mode is broken in Debian 12, and must come before gRPC
find_package(gRPC CONFIG REQUIRED)
# gRPC brings in re2, whose -pthread makes the shared precompiled header unusable.
if(TARGET re2::re2)
  set_target_properties(re2::re2 PROPERTIES INTERFACE_COMPILE_OPTIONS "")
endif()
find_package(absl CONFIG REQUIRED)
find_package(Boost 1.74 REQUIRED)  # Beast and Asio, headers only
find_package(embree 3.13 CONFIG REQUIRED)
find_package(glm CONFIG REQUIRED)
find_package(spdlog CONFIG REQUIRED)
find_package(CLI11 CONFIG REQUIRED)
find_package(nlohmann_json CONFIG REQUIRED)
find_package(meshoptimizer CONFIG REQUIRED)
find_package(draco CONFIG REQUIRED)
find_package(pugixml CONFIG REQUIRED)
find_package(SQLite3 REQUIRED)
pkg_check_modules(LIBPQ REQUIRED IMPORTED_TARGET libpq)
find_package(OpenSSL REQUIRED)
find_package(ZLIB REQUIRED)
pkg_check_modules(OPENEXR REQUIRED IMPORTED_TARGET OpenEXR)  # its CMake config warns about an unused package
set_target_properties(PkgConfig::OPENEXR PROPERTIES INTERFACE_COMPILE_OPTIONS "")  # -pthread makes the shared precompiled header unusable
pkg_check_modules(OIIO REQUIRED IMPORTED_TARGET OpenImageIO)  # its CMake config needs programs that are not used here
set_target_properties(PkgConfig::OIIO PROPERTIES INTERFACE_COMPILE_OPTIONS "")
pkg_check_modules(SECCOMP REQUIRED IMPORTED_TARGET libseccomp)
pkg_check_modules(SPNG REQUIRED IMPORTED_TARGET spng)
pkg_check_modules(XXHASH REQUIRED IMPORTED_TARGET libxxhash)
# Debian's Python, because deploy/setup --tests installs its modules.
find_program(LIGHTMILL_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH)
find_program(LIGHTMILL_PYTHON python3 REQUIRED)
