# What `cmake --install` takes; plugins install themselves in viwo_add_plugin(). COMPONENT is the
# package that a file goes to (viwo_packages.cmake).
#
# Everything below the prefix finds everything else by relative paths, so that an installation can
# be moved: programs their library by $ORIGIN, the program viwo its plugins and templates from the
# folder it is in. That fixes the folder lib, also where CMAKE_INSTALL_LIBDIR would be another.
# The build folder is laid out alike, so they have these paths from the beginning: where CMake has to
# replace them it leaves room by empty entries, which are the current folder.
include(CMakePackageConfigHelpers)

set(viwo_cmake_dir lib/cmake/viwo)
set(viwo_doc_dir share/doc/viwo)
set(viwo_framework ${PROJECT_SOURCE_DIR}/framework)

# The library and what a plugin compiles and links with.
set_target_properties(viwo_api PROPERTIES EXPORT_NAME api INSTALL_RPATH "$ORIGIN"
  BUILD_WITH_INSTALL_RPATH ON SOVERSION ${VIWO_API_VERSION} VERSION ${VIWO_API_VERSION}.${PROJECT_VERSION})
target_compile_features(viwo_api PUBLIC cxx_std_20)
if(VIWO_SANITIZE)
  target_link_options(viwo_api INTERFACE $<INSTALL_INTERFACE:-fsanitize=${VIWO_SANITIZE}>)
endif()
set_target_properties(viwo_math PROPERTIES EXPORT_NAME math)
install(TARGETS viwo_api viwo_math EXPORT viwoTargets
  LIBRARY DESTINATION lib NAMELINK_COMPONENT dev INCLUDES DESTINATION include)
install(DIRECTORY ${viwo_framework}/plugin_api/include/viwo ${viwo_framework}/math/include/viwo
  DESTINATION include COMPONENT dev FILES_MATCHING PATTERN "*.hpp")

# find_package(viwo)
string(REGEX MATCH "^[0-9]+" viwo_compiler ${CMAKE_CXX_COMPILER_VERSION})
string(PREPEND viwo_compiler "${CMAKE_CXX_COMPILER_ID} ")
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/viwoConfig.cmake.in
  ${PROJECT_BINARY_DIR}/cmake/viwoConfig.cmake INSTALL_DESTINATION ${viwo_cmake_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/cmake/viwoConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(EXPORT viwoTargets NAMESPACE viwo:: DESTINATION ${viwo_cmake_dir} COMPONENT dev)
install(FILES ${PROJECT_BINARY_DIR}/cmake/viwoConfig.cmake
              ${PROJECT_BINARY_DIR}/cmake/viwoConfigVersion.cmake
              ${CMAKE_CURRENT_LIST_DIR}/viwo_add_plugin.cmake
  DESTINATION ${viwo_cmake_dir} COMPONENT dev)

# What viwo_add_plugin() runs after each link.
set_target_properties(viwo_seal PROPERTIES EXPORT_NAME seal INSTALL_RPATH "$ORIGIN/../lib"
  BUILD_WITH_INSTALL_RPATH ON)
install(TARGETS viwo_seal EXPORT viwoTargets RUNTIME DESTINATION bin COMPONENT dev)

# Programs
foreach(program viwo viwo_conformance_program)
  if(TARGET ${program})
    set_target_properties(${program} PROPERTIES INSTALL_RPATH "${VIWO_PROGRAM_RPATH}"
      BUILD_WITH_INSTALL_RPATH ON)
    set(component viwo)
    if(NOT program STREQUAL "viwo")
      set(component dev)
    endif()
    install(TARGETS ${program} RUNTIME DESTINATION bin COMPONENT ${component})
  endif()
endforeach()

# What is read by people and by `viwo plugins new`
install(DIRECTORY ${PROJECT_SOURCE_DIR}/configs DESTINATION share/viwo USE_SOURCE_PERMISSIONS)
install(DIRECTORY ${viwo_framework}/templates DESTINATION share/viwo COMPONENT dev)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/NOTICE
  DESTINATION ${viwo_doc_dir})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs ${PROJECT_SOURCE_DIR}/plugins
  DESTINATION ${viwo_doc_dir} FILES_MATCHING PATTERN "*.md"
  PATTERN "images" EXCLUDE PATTERN "tests" EXCLUDE PATTERN "shared" EXCLUDE)

include(viwo_faster_copies)
include(viwo_packages)
