# cmake -DFORM=static|shared -DSOURCE=.. -DWORK=.. -DVERSION=.. -DGENERATOR=.. -DC_COMPILER=.. -DCXX_COMPILER=.. -DNM=..
#       [-DLAUNCHER=ccache] -P check.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/symbols.cmake)

function(run what)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${FORM}: ${what} failed (${result}): ${command}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

set(compilers -DCMAKE_C_COMPILER=${C_COMPILER} -DCMAKE_CXX_COMPILER=${CXX_COMPILER} 
  # Files, symbols and linking are looked at, not speed; -O0 compiles in a third of the time.
  -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS_RELEASE=-O0)
set(shared OFF)
if(FORM STREQUAL "shared")
  set(shared ON)
endif()

# 1. Install into a prefix, then move it: the package must not depend on where it was built for.
set(build ${WORK}/build)
file(REMOVE_RECURSE ${WORK}/first ${WORK}/prefix ${WORK}/cmake ${WORK}/pkgconfig ${WORK}/subdirectory)
run("configure" ${CMAKE_COMMAND} -G ${GENERATOR} -S ${SOURCE} -B ${build} ${compilers} -DBUILD_SHARED_LIBS=${shared}
    -DCMAKE_C_COMPILER_LAUNCHER=${LAUNCHER} -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}
    -DBURIN_TOOLS=OFF -DBURIN_TESTS=OFF -DBURIN_BENCH=OFF)
run("build" ${CMAKE_COMMAND} --build ${build} --parallel 2)
run("install" ${CMAKE_COMMAND} --install ${build} --prefix ${WORK}/first)
file(RENAME ${WORK}/first ${WORK}/prefix)
set(prefix ${WORK}/prefix)

# 2. What was installed: every public header and nothing else of ours, the licence, one library.
file(GLOB wanted RELATIVE ${SOURCE}/include ${SOURCE}/include/burin/*.h ${SOURCE}/include/burin/*.hpp)
file(GLOB_RECURSE headers RELATIVE ${prefix}/include ${prefix}/include/*)
list(SORT wanted)
list(SORT headers)
if(NOT headers STREQUAL wanted OR headers STREQUAL "")
  message(FATAL_ERROR "${FORM}: installed headers are '${headers}', expected '${wanted}'")
endif()
file(GLOB_RECURSE licence ${prefix}/share/*LICENSE)
if(licence STREQUAL "")
  message(FATAL_ERROR "${FORM}: the licence was not installed")
endif()
file(GLOB_RECURSE library ${prefix}/libburin.a ${prefix}/libburin.so)
list(LENGTH library count)
if(NOT count EQUAL 1)
  message(FATAL_ERROR "${FORM}: expected one library, found '${library}'")
endif()
file(GLOB_RECURSE texts ${prefix}/*.cmake ${prefix}/*.pc)
foreach(text IN LISTS texts)
  file(READ ${text} content)
  string(FIND "${content}" "${WORK}" at)
  if(NOT at EQUAL -1)
    message(FATAL_ERROR "${FORM}: ${text} holds the path it was built in")
  endif()
endforeach()

# 3. The symbols of the shared form.
if(shared)
  check_symbols(${library} ${SOURCE}/include/burin/burin.h)
  string(REPLACE libburin.so libburin_capture.so capture_library ${library})
  check_symbols(${capture_library} ${SOURCE}/include/burin/capture.h)
endif()

# 4. The three ways to use it, each from a C99 and a C++17 program with warnings as errors.
function(use way)
  run("${way}: build" ${CMAKE_COMMAND} --build ${WORK}/${way})
  run("${way}: run" ${WORK}/${way}/consumer ${VERSION})
  run("${way}: run C++" ${WORK}/${way}/consumer_cpp ${VERSION})
endfunction()

set(consumer ${SOURCE}/tests/install/consumer)
run("cmake: configure" ${CMAKE_COMMAND} -G ${GENERATOR} -S ${consumer} -B ${WORK}/cmake ${compilers}
    -DCMAKE_PREFIX_PATH=${prefix} -DWANTED=${VERSION})
use(cmake)
run("cmake: run capture" ${WORK}/cmake/consumer_capture)
run("subdirectory: configure" ${CMAKE_COMMAND} -G ${GENERATOR} -S ${consumer} -B ${WORK}/subdirectory ${compilers}
    -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER} -DBUILD_SHARED_LIBS=${shared} -DSUBDIRECTORY=${SOURCE})
use(subdirectory)

find_program(pkg_config NAMES pkg-config pkgconf REQUIRED)
file(GLOB_RECURSE pc ${prefix}/burin.pc)
cmake_path(GET pc PARENT_PATH pc_dir)
set(ENV{PKG_CONFIG_PATH} ${pc_dir})
run("pkg-config: version" ${pkg_config} --exact-version=${VERSION} burin)
run("pkg-config: flags" ${pkg_config} --cflags --libs burin)
separate_arguments(flags UNIX_COMMAND "${output}")
cmake_path(GET library PARENT_PATH library_dir)
file(MAKE_DIRECTORY ${WORK}/pkgconfig)
run("pkg-config: build" ${C_COMPILER} -std=c99 -Wall -Wextra -Werror -pedantic ${consumer}/consumer.c
    -o ${WORK}/pkgconfig/consumer ${flags} -Wl,-rpath,${library_dir})
run("pkg-config: run" ${WORK}/pkgconfig/consumer ${VERSION})
run("pkg-config: capture's flags" ${pkg_config} --cflags --libs burin_capture)
separate_arguments(capture_flags UNIX_COMMAND "${output}")
run("pkg-config: build capture" ${C_COMPILER} -std=c99 -Wall -Wextra -Werror -pedantic ${consumer}/consumer_capture.c
    -o ${WORK}/pkgconfig/consumer_capture ${capture_flags} -Wl,-rpath,${library_dir})
run("pkg-config: run capture" ${WORK}/pkgconfig/consumer_capture)
run("pkg-config: build C++" ${CXX_COMPILER} -std=c++17 -Wall -Wextra -Werror -pedantic ${consumer}/consumer.cpp
    -o ${WORK}/pkgconfig/consumer_cpp ${flags} -Wl,-rpath,${library_dir})
run("pkg-config: run C++" ${WORK}/pkgconfig/consumer_cpp ${VERSION})
