# viwo_add_plugin(KIND NAME SOURCES a.cpp ... [LINKS target ...])
# A plugin library libviwo_KIND_NAME.so. The flags that must agree with the host come from viwo::api;
# hidden visibility and no GNU-unique symbols keep plugins apart and unloadable; undefined symbols are
# found at link time instead of at load time. The target viwo_plugins builds all of them.
set(VIWO_PLUGIN_OUTPUT_DIR ${PROJECT_BINARY_DIR}/lib/viwo/plugins/v1)

function(viwo_add_plugin kind name)
  cmake_parse_arguments(ARG "" "OUTPUT_DIR" "SOURCES;LINKS" ${ARGN})
  if(NOT ARG_OUTPUT_DIR)
    set(ARG_OUTPUT_DIR ${VIWO_PLUGIN_OUTPUT_DIR})
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
  set_target_properties(${target} PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${ARG_OUTPUT_DIR})
  set_property(GLOBAL APPEND PROPERTY VIWO_PLUGIN_TARGETS ${target})
  if(NOT TARGET viwo_plugins)
    add_custom_target(viwo_plugins)
  endif()
  add_dependencies(viwo_plugins ${target})
endfunction()
