# Run by cpack when the files of all packages are in place, stripped, and not yet packed.
find_program(python python3 REQUIRED)
foreach(component ${CPACK_COMPONENTS_ALL})
  set(package viwo-${component})
  if(component STREQUAL "viwo")
    set(package viwo)
  endif()
  execute_process(
    COMMAND ${python} -B ${CPACK_VIWO_SOURCE}/scripts/package_documents.py ${package}
            ${CPACK_PACKAGE_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}
            ${CPACK_TEMPORARY_DIRECTORY}/${component} ${CPACK_VIWO_BUILD}
            ${CPACK_PACKAGE_CONTACT}
    RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "package_documents.py failed for ${package}")
  endif()
endforeach()
