# What `cmake --install` and `cpack` take; plugins install themselves in viwo_add_plugin().
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
  LIBRARY DESTINATION lib INCLUDES DESTINATION include)
install(DIRECTORY ${viwo_framework}/plugin_api/include/viwo ${viwo_framework}/math/include/viwo
  DESTINATION include FILES_MATCHING PATTERN "*.hpp")

# find_package(viwo)
string(REGEX MATCH "^[0-9]+" viwo_compiler ${CMAKE_CXX_COMPILER_VERSION})
string(PREPEND viwo_compiler "${CMAKE_CXX_COMPILER_ID} ")
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/viwoConfig.cmake.in
  ${PROJECT_BINARY_DIR}/cmake/viwoConfig.cmake INSTALL_DESTINATION ${viwo_cmake_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/cmake/viwoConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(EXPORT viwoTargets NAMESPACE viwo:: DESTINATION ${viwo_cmake_dir})
install(FILES ${PROJECT_BINARY_DIR}/cmake/viwoConfig.cmake
              ${PROJECT_BINARY_DIR}/cmake/viwoConfigVersion.cmake
              ${CMAKE_CURRENT_LIST_DIR}/viwo_add_plugin.cmake
  DESTINATION ${viwo_cmake_dir})

# What viwo_add_plugin() runs after each link.
set_target_properties(viwo_seal PROPERTIES EXPORT_NAME seal INSTALL_RPATH "$ORIGIN/../lib"
  BUILD_WITH_INSTALL_RPATH ON)
install(TARGETS viwo_seal EXPORT viwoTargets RUNTIME DESTINATION bin)

# Programs
foreach(program viwo viwo_conformance_program)
  if(TARGET ${program})
    set_target_properties(${program} PROPERTIES INSTALL_RPATH "$ORIGIN/../lib"
      BUILD_WITH_INSTALL_RPATH ON)
    install(TARGETS ${program} RUNTIME DESTINATION bin)
  endif()
endforeach()

# What is read by people and by `viwo plugins new`
install(DIRECTORY ${PROJECT_SOURCE_DIR}/configs DESTINATION share/viwo)
install(DIRECTORY ${viwo_framework}/templates DESTINATION share/viwo)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/NOTICE
  DESTINATION ${viwo_doc_dir})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs ${PROJECT_SOURCE_DIR}/plugins
  DESTINATION ${viwo_doc_dir} FILES_MATCHING PATTERN "*.md"
  PATTERN "images" EXCLUDE PATTERN "tests" EXCLUDE PATTERN "shared" EXCLUDE)

# Debian package: cmake --preset package && cmake --build --preset package, then cpack in build-package
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME viwo)
set(CPACK_PACKAGE_VENDOR "the viwo authors")
set(CPACK_PACKAGE_CONTACT "the viwo authors")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}: program, plugins, SDK")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_PROJECT_CONFIG_FILE ${CMAKE_CURRENT_LIST_DIR}/viwo_cpack_config.cmake)
set(CPACK_VIWO_ARCH "${VIWO_ARCH}")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/lib)
# Building plugins; the program alone does without.
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "libeigen3-dev (>= 3.4), cmake (>= 3.22), g++")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "gnuplot-nox")
include(CPack)
