# viwo_add_module(NAME SOURCES a.cpp ... LINKS target ...)
# A module of the framework: static library viwo_NAME (alias viwo::NAME) with its headers in include/.
# Without sources it is header-only.
function(viwo_add_module name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINKS;PRIVATE_LINKS" ${ARGN})
  set(target viwo_${name})
  if(ARG_SOURCES)
    add_library(${target} STATIC ${ARG_SOURCES})
    target_include_directories(${target}
      PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>)
    target_compile_options(${target} PRIVATE ${VIWO_WARNINGS})
    target_link_libraries(${target} PUBLIC ${ARG_LINKS} PRIVATE ${ARG_PRIVATE_LINKS})
  else()
    add_library(${target} INTERFACE)
    target_include_directories(${target}
      INTERFACE $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>)
    target_link_libraries(${target} INTERFACE ${ARG_LINKS})
  endif()
  add_library(viwo::${name} ALIAS ${target})
endfunction()

# viwo_for_plugins(TARGET): a library that plugins link. What they carry of it must stay their own.
function(viwo_for_plugins target)
  target_compile_options(${target} PRIVATE -fvisibility=hidden -fvisibility-inlines-hidden
    $<$<CXX_COMPILER_ID:GNU>:-fno-gnu-unique>)
endfunction()

# viwo_timeout(VARIABLE SECONDS): how long a test may take. With a sanitizer, 24 times as long: what
# is instrumented was up to twenty times as slow. (Tests that say nothing have the 1500 s of ctest, and
# the 7200 s of the presets of sanitizers.)
function(viwo_timeout variable seconds)
  if(VIWO_SANITIZE)
    math(EXPR seconds "24 * ${seconds}")
  endif()
  set(${variable} ${seconds} PARENT_SCOPE)
endfunction()

# viwo_add_test(NAME [WHOLE] SOURCES a.cpp ... LINKS target ... LABELS label DEPENDS target ...
#               ENVIRONMENT VARIABLE=value)
# A GoogleTest executable, each of its tests known to ctest, in a process of its own; with WHOLE all of
# them are one, which share what is expensive. Temporary files are the program's own. Plugins of this
# build are found through VIWO_TEST_PLUGIN_DIR, real recordings through VIWO_TEST_SHARED_DIR (which
# may not exist).
function(viwo_add_test name)
  if(NOT VIWO_BUILD_TESTS)
    return()
  endif()
  cmake_parse_arguments(ARG "WHOLE" "TIMEOUT;LABELS;ENVIRONMENT" "SOURCES;LINKS;DEPENDS" ${ARGN})
  if(NOT ARG_LABELS)
    set(ARG_LABELS unit)
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  viwo_timeout(ARG_TIMEOUT ${ARG_TIMEOUT})
  add_executable(${name} ${ARG_SOURCES})
  # What is tested is optimised; of the tests themselves a third of the compiler's time is saved.
  target_compile_options(${name} PRIVATE ${VIWO_WARNINGS} $<$<CONFIG:Release>:-O1>)
  target_compile_definitions(${name} PRIVATE
    VIWO_TEST_PLUGIN_DIR="${VIWO_PLUGIN_OUTPUT_DIR}"
    VIWO_TEST_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
    VIWO_TEST_BINARY_DIR="${PROJECT_BINARY_DIR}"
    VIWO_TEST_SHARED_DIR="${PROJECT_SOURCE_DIR}/../shared")
  target_link_libraries(${name} PRIVATE ${ARG_LINKS} viwo_test_folder GTest::gtest_main GTest::gmock)
  if(ARG_DEPENDS)
    add_dependencies(${name} ${ARG_DEPENDS})
  endif()
  set(properties LABELS ${ARG_LABELS} TIMEOUT ${ARG_TIMEOUT})
  if(ARG_ENVIRONMENT)
    list(APPEND properties ENVIRONMENT ${ARG_ENVIRONMENT})
  endif()
  if(ARG_WHOLE)
    add_test(NAME ${name} COMMAND ${name})
    set_tests_properties(${name} PROPERTIES ${properties})
    return()
  endif()
  gtest_discover_tests(${name} TEST_PREFIX ${name}. DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60
    PROPERTIES ${properties})
endfunction()
