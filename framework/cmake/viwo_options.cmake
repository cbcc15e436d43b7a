# Options of the build; what must be the same in host and plugins goes through viwo_api's interface.
option(VIWO_BUILD_TESTS "Build the tests" ON)
option(VIWO_BUILD_BENCHMARKS "Build the benchmarks (needs Google Benchmark)" ON)
option(VIWO_WERROR "Warnings are errors" OFF)
set(VIWO_ARCH "native" CACHE STRING
    "Instruction set of host and plugins, as for -march (native, x86-64-v3, ...); empty: the compiler's default, for packages")
set(VIWO_FASTER_COPIES "" CACHE STRING
    "Instruction sets (x86-64-v3;x86-64-v4) that program and plugins are built for once more, taken where the processor has them; for packages")
option(VIWO_IS_FASTER_COPY "This build is one of those" OFF)
set(VIWO_SANITIZE "" CACHE STRING "Sanitizers, as for -fsanitize: address,undefined or thread")

option(VIWO_FUZZ "Build what libFuzzer runs (clang; preset fuzz)" OFF)

set(VIWO_ABI_FLAGS "")
if(VIWO_ARCH)
  list(APPEND VIWO_ABI_FLAGS -march=${VIWO_ARCH})
endif()
if(NOT CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
  set(VIWO_FASTER_COPIES "")
endif()
set(VIWO_PROGRAM_DIR bin)
set(VIWO_PROGRAM_RPATH "$ORIGIN/../lib")
if(VIWO_IS_FASTER_COPY)
  set(VIWO_PROGRAM_DIR lib/viwo/${VIWO_ARCH})
  set(VIWO_PROGRAM_RPATH "$ORIGIN/../..")
endif()
if(VIWO_FASTER_COPIES OR VIWO_IS_FASTER_COPY)
  # The same matrices in memory for all that is compiled for any processor and for more instructions.
  list(APPEND VIWO_ABI_FLAGS -DEIGEN_MAX_ALIGN_BYTES=32 -DEIGEN_MAX_STATIC_ALIGN_BYTES=32)
endif()
if(VIWO_SANITIZE)
  list(APPEND VIWO_ABI_FLAGS -fsanitize=${VIWO_SANITIZE} -fno-sanitize-recover=all
       -fno-omit-frame-pointer)
  if(VIWO_SANITIZE STREQUAL "address,undefined" AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # A branch at each member of each object, and half of the compiler's time: a null pointer is
    # found by `address`, too, and alignment by clang's build (preset fuzz).
    list(APPEND VIWO_ABI_FLAGS -fno-sanitize=null,alignment)
  endif()
  add_link_options(-fsanitize=${VIWO_SANITIZE})
endif()

# What is linked and not used is not loaded.
add_link_options(-Wl,--as-needed)

# GCC 12 warns falsely: about its own AVX-512 headers when Eigen is inlined, and about std::string
# (bug 105651). Plugins of others get these, too (viwo_add_plugin.cmake).
set(VIWO_NO_FALSE_WARNINGS
    $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>
    $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds>
    $<$<CXX_COMPILER_ID:GNU>:-Wno-stringop-overread>
    $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>
    $<$<CXX_COMPILER_ID:GNU>:-Wno-uninitialized>)
if(NOT CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
  # How GCC before 10.1 passed arguments on arm64, told at length for each that Boost passes so.
  list(APPEND VIWO_NO_FALSE_WARNINGS $<$<CXX_COMPILER_ID:GNU>:-Wno-psabi>)
endif()
if(VIWO_SANITIZE STREQUAL "thread")
  # Of the fences of Boost.Asio.
  list(APPEND VIWO_NO_FALSE_WARNINGS $<$<CXX_COMPILER_ID:GNU>:-Wno-tsan>)
endif()
set(VIWO_WARNINGS -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual
    ${VIWO_NO_FALSE_WARNINGS})
if(VIWO_WERROR)
  list(APPEND VIWO_WARNINGS -Werror)
endif()

find_program(VIWO_CCACHE ccache)
if(VIWO_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${VIWO_CCACHE})
endif()

# The version of the plugin API names the folder of the plugins and the library that they link.
set(build_record ${PROJECT_SOURCE_DIR}/framework/plugin_api/include/viwo/api/build_record.hpp)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${build_record})
file(STRINGS ${build_record} VIWO_API_VERSION REGEX "^inline constexpr int kApiVersion = [0-9]+;$")
string(REGEX MATCH "[0-9]+" VIWO_API_VERSION "${VIWO_API_VERSION}")
if(NOT VIWO_API_VERSION)
  message(FATAL_ERROR "kApiVersion not found in ${build_record}")
endif()
