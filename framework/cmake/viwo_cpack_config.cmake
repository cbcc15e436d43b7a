# Read by cpack before it packs.
if(CPACK_VIWO_ARCH STREQUAL "native")
  message(FATAL_ERROR "this build is for the processor of this machine (VIWO_ARCH=native): a "
                      "package of it would fail on others. Build with cmake --preset package")
endif()
