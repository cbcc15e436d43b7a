# VIWO_FASTER_COPIES: the program and the plugins in which a run spends its time are compiled once
# more for each of these instruction sets, and installed beside those for any processor. Which of
# them is taken is settled when viwo starts (viwo/plugin_host/installation.hpp).
if(NOT VIWO_FASTER_COPIES)
  return()
endif()
include(ExternalProject)
set(updates visual_features wheel_odometry wheel_parity)
list(TRANSFORM updates PREPEND viwo_update_)
set(plotly ${VIWO_PLOTLY_DIR})
if(NOT plotly)
  set(plotly ${PROJECT_BINARY_DIR}/framework/report/web/node_modules/plotly.js-cartesian-dist-min)
endif()
set(before viwo_plugins)
foreach(instructions ${VIWO_FASTER_COPIES})
  set(copy ${PROJECT_BINARY_DIR}/${instructions})
  ExternalProject_Add(viwo_${instructions}
    DEPENDS viwo ${before}
    SOURCE_DIR ${PROJECT_SOURCE_DIR}
    BINARY_DIR ${copy}
    CMAKE_ARGS
      -DCMAKE_BUILD_TYPE=${CMAKE_BUILD_TYPE} -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER}
      -DCMAKE_CXX_FLAGS=${CMAKE_CXX_FLAGS} -DCMAKE_UNITY_BUILD=${CMAKE_UNITY_BUILD}
      -DVIWO_ARCH=${instructions} -DVIWO_IS_FASTER_COPY=ON -DVIWO_WERROR=${VIWO_WERROR}
      -DVIWO_BUILD_TESTS=OFF -DVIWO_BUILD_BENCHMARKS=OFF -DVIWO_PLOTLY_DIR=${plotly}
    BUILD_COMMAND ${CMAKE_COMMAND} --build ${copy} --target viwo ${updates} viwo_sensor_klt_tracker
    INSTALL_COMMAND ""
    BUILD_ALWAYS ON
    USES_TERMINAL_BUILD ON)
  set(before viwo_${instructions})  # Each takes all processors; one after the other.

  install(PROGRAMS ${copy}/lib/viwo/${instructions}/viwo DESTINATION lib/viwo/${instructions})
  set(plugins ${VIWO_PLUGIN_DIR}/${instructions})
  foreach(update ${updates})
    install(FILES ${copy}/${plugins}/lib${update}.so DESTINATION ${plugins})
  endforeach()
  install(FILES ${copy}/${plugins}/libviwo_sensor_klt_tracker.so DESTINATION ${plugins}
    COMPONENT images)
endforeach()
