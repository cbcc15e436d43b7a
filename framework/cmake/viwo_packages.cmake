# Debian packages: scripts/make_packages.sh, or by hand the preset package and then cpack in
# build-package. docs/packages.md says which is for what.
#
# A package is an install component. Which one a file belongs to is said where it is installed:
# COMPONENT, or CMAKE_INSTALL_DEFAULT_COMPONENT_NAME in the folder of a plugin. What decides is what a
# file links: the package viwo has nothing of ROS, of DDS, of a toolkit or of image files
# (tests/packages checks it).
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME viwo)
set(CPACK_PACKAGE_VENDOR "the viwo authors")
# Who publishes packages gives a name and an address: cpack -D CPACK_PACKAGE_CONTACT="A <a@b.c>"
set(CPACK_PACKAGE_CONTACT "the viwo authors")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL viwo images show ros dev)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_PROJECT_CONFIG_FILE ${CMAKE_CURRENT_LIST_DIR}/viwo_cpack_config.cmake)
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_CURRENT_LIST_DIR}/viwo_cpack_documents.cmake)
set(CPACK_VIWO_ARCH "${VIWO_ARCH}")
set(CPACK_VIWO_SOURCE ${PROJECT_SOURCE_DIR})
set(CPACK_VIWO_BUILD ${PROJECT_BINARY_DIR})

# 0.1.0-1~deb12: a package of the next release of Debian takes the place of this one.
set(system "")
foreach(key ID VERSION_ID)
  set(line "")
  if(EXISTS /etc/os-release)
    file(STRINGS /etc/os-release line REGEX "^${key}=")
  endif()
  string(REGEX REPLACE "^${key}=|\"" "" line "${line}")
  string(APPEND system "${line}")
endforeach()
string(REPLACE "debian" "deb" system "${system}")
set(CPACK_DEBIAN_PACKAGE_RELEASE "1~${system}")
set(version "${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/lib)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

# viwo_describe_package(COMPONENT SUMMARY LINE...)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # CPack would put it before each SUMMARY
function(viwo_describe_package component summary)
  string(TOUPPER ${component} upper)
  string(JOIN "\n" text ${ARGN})
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${summary}\n${text}" PARENT_SCOPE)
  if(NOT component STREQUAL "viwo")
    set(CPACK_DEBIAN_${upper}_PACKAGE_DEPENDS "viwo (= ${version})" PARENT_SCOPE)
  endif()
endfunction()

viwo_describe_package(viwo "visual-inertial-wheel odometry: program and plugins"
  "Fuses IMU, cameras and wheels in a filter, calibrates the wheels while it runs,"
  "and compares kinematic models side by side. Kinematic models, sensors and"
  "filter updates are plugins. This package has the program, all kinematic models"
  "and updates, simulators and readers of logs. Nothing of it links ROS or DDS.")
set(CPACK_DEBIAN_VIWO_PACKAGE_NAME viwo)
set(CPACK_DEBIAN_VIWO_PACKAGE_RECOMMENDS "viwo-images (= ${version})")
set(CPACK_DEBIAN_VIWO_PACKAGE_SUGGESTS "viwo-dev, viwo-ros, viwo-show, gnuplot-nox")
file(WRITE ${PROJECT_BINARY_DIR}/cmake/debian/triggers "activate-noawait ldconfig\n")
file(WRITE ${PROJECT_BINARY_DIR}/cmake/debian/shlibs
  "libviwo_api ${VIWO_API_VERSION} viwo (= ${version})\n")
set(CPACK_DEBIAN_VIWO_PACKAGE_CONTROL_EXTRA ${PROJECT_BINARY_DIR}/cmake/debian/triggers
  ${PROJECT_BINARY_DIR}/cmake/debian/shlibs)

viwo_describe_package(images "visual-inertial-wheel odometry: images from files"
  "Plugins of viwo that read image files and track points in images: asl_images,"
  "kaist_urban, klt_tracker. They link the image codecs of OpenCV.")

viwo_describe_package(show "visual-inertial-wheel odometry: window and video file"
  "What the options --show and --video of viwo run need, and the plugin that reads"
  "images out of films, video: a toolkit and the codecs, which a robot does without.")

viwo_describe_package(ros "visual-inertial-wheel odometry: bags and live topics of ROS"
  "Plugins of viwo that read bags of ROS 1 and ROS 2 and take part in a running"
  "system, by roscpp or by DDS: ros1_bag, ros1_topics, ros2_bag, ros2_topics. The"
  "tool viwo_bag writes bags. An installation of ROS 2 is not needed.")
set(CPACK_DEBIAN_ROS_PACKAGE_RECOMMENDS "viwo-images (= ${version})")

viwo_describe_package(dev "visual-inertial-wheel odometry: SDK of the plugins"
  "Headers, CMake package, templates of viwo plugins new, viwo_seal and"
  "viwo_conformance: what building a plugin takes. The compiler must be the one"
  "that viwo was built with.")
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
string(APPEND CPACK_DEBIAN_DEV_PACKAGE_DEPENDS ", libeigen3-dev (>= 3.4)")
set(CPACK_DEBIAN_DEV_PACKAGE_RECOMMENDS "cmake (>= 3.22), g++")
include(CPack)
