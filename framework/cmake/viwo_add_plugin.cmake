# viwo_add_plugin(KIND NAME SOURCES a.cpp ... [LINKS target ...] [OUTPUT_DIR dir])
# A plugin library libviwo_KIND_NAME.so; KIND: kinematics, sensor or update. The same in viwo's own
# build and, after find_package(viwo), in anybody's.
#
# The flags that must agree with the host come from viwo::api; hidden visibility and no GNU-unique
# symbols keep plugins apart and unloadable; undefined symbols are found at link time instead of at
# load time. Plugins are written to lib/viwo/plugins/v<api> of the build folder and installed to the
# same place below the prefix; the target viwo_plugins builds all of them. One with an OUTPUT_DIR is
# for tests: neither installed nor built by viwo_plugins.
set(VIWO_PLUGIN_DIR lib/viwo/plugins/v${VIWO_API_VERSION})
set(VIWO_PLUGIN_RPATH "$ORIGIN/../../..")
if(VIWO_IS_FASTER_COPY)
  string(APPEND VIWO_PLUGIN_DIR /${VIWO_ARCH})
  string(APPEND VIWO_PLUGIN_RPATH /..)
endif()
set(VIWO_PLUGIN_OUTPUT_DIR ${PROJECT_BINARY_DIR}/${VIWO_PLUGIN_DIR})

function(viwo_add_plugin kind name)
  cmake_parse_arguments(ARG "" "OUTPUT_DIR" "SOURCES;LINKS" ${ARGN})
  if(NOT kind MATCHES "^(kinematics|sensor|update)$")
    message(FATAL_ERROR "viwo_add_plugin(${kind} ${name}): the kind is kinematics, sensor or update")
  endif()
  set(target viwo_${kind}_${name})
  add_library(${target} MODULE ${ARG_SOURCES})
  target_link_libraries(${target} PRIVATE viwo::api ${ARG_LINKS})
  target_compile_options(${target} PRIVATE ${VIWO_WARNINGS}
    -fvisibility=hidden -fvisibility-inlines-hidden
    $<$<CXX_COMPILER_ID:GNU>:-fno-gnu-unique>)
  if(NOT VIWO_SANITIZE)
    target_link_options(${target} PRIVATE -Wl,-z,defs)
  endif()
  add_custom_command(TARGET ${target} POST_BUILD COMMAND viwo::seal $<TARGET_FILE:${target}>
    VERBATIM)
  if(ARG_OUTPUT_DIR)
    set_target_properties(${target} PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${ARG_OUTPUT_DIR})
    return()
  endif()
  # The library is in lib, three folders up, wherever the prefix is moved; in the build folder, too.
  set_target_properties(${target} PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${VIWO_PLUGIN_OUTPUT_DIR}
    INSTALL_RPATH "${VIWO_PLUGIN_RPATH}" BUILD_WITH_INSTALL_RPATH ON)
  install(TARGETS ${target} LIBRARY DESTINATION ${VIWO_PLUGIN_DIR})
  if(NOT TARGET viwo_plugins)
    add_custom_target(viwo_plugins)
  endif()
  add_dependencies(viwo_plugins ${target})
endfunction()
