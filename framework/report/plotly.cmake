# Sets plotly_js, plotly_dir, plotly_version and web.
#
# The plot library comes from npm at the version that web/package-lock.json pins. It is fetched once
# per build folder and compiled into the library: a report needs neither network nor other files.
# Where the script is already in place neither npm nor a network is needed to build, either.
set(VIWO_PLOTLY_DIR "" CACHE PATH
    "Folder of the npm package plotly.js-cartesian-dist-min that is already here; empty: npm fetches it")
set(web ${CMAKE_CURRENT_LIST_DIR}/web)
set(npm_dir ${CMAKE_CURRENT_BINARY_DIR}/web)
set(plotly_dir ${npm_dir}/node_modules/plotly.js-cartesian-dist-min)
if(VIWO_PLOTLY_DIR)
  set(plotly_dir ${VIWO_PLOTLY_DIR})
endif()
set(plotly_js ${plotly_dir}/plotly-cartesian.min.js)

set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${web}/package.json)
file(READ ${web}/package.json package_json)
string(JSON plotly_version GET ${package_json} dependencies plotly.js-cartesian-dist-min)

set(plotly_found "nothing")
if(EXISTS ${plotly_js} AND EXISTS ${plotly_dir}/LICENSE AND EXISTS ${plotly_dir}/package.json)
  file(READ ${plotly_dir}/package.json found_json)
  string(JSON plotly_found GET ${found_json} version)
endif()
if(NOT plotly_found STREQUAL plotly_version)
  if(VIWO_PLOTLY_DIR)
    message(FATAL_ERROR "VIWO_PLOTLY_DIR: ${plotly_found} of plotly.js-cartesian-dist-min in "
                        "${plotly_dir}, but ${plotly_version} is wanted")
  endif()
  find_program(VIWO_NPM npm)
  if(NOT VIWO_NPM)
    message(FATAL_ERROR "npm is needed to fetch the plot library of the reports. "
                        "Run ./demo.sh, which installs all dependencies, or: apt-get install npm. "
                        "Without npm: -DVIWO_PLOTLY_DIR=, a folder that has its ${plotly_version}")
  endif()
  # npm restores the old time stamps of the package; without the touch it would be fetched every time.
  add_custom_command(
    OUTPUT ${plotly_js} ${plotly_dir}/LICENSE
    COMMAND ${CMAKE_COMMAND} -E make_directory ${npm_dir}
    COMMAND ${CMAKE_COMMAND} -E copy ${web}/package.json ${web}/package-lock.json ${npm_dir}
    COMMAND ${CMAKE_COMMAND} -E chdir ${npm_dir}
            ${VIWO_NPM} ci --ignore-scripts --no-audit --no-fund --loglevel=error
    COMMAND ${CMAKE_COMMAND} -E touch ${plotly_js} ${plotly_dir}/LICENSE
    DEPENDS ${web}/package.json ${web}/package-lock.json
    COMMENT "Fetching Plotly.js ${plotly_version} with npm"
    VERBATIM)
endif()
