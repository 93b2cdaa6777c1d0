# cmake -DSOURCE=.. -DWORK=.. -DGENERATOR=.. -DC_COMPILER=.. -DCXX_COMPILER=.. -DREADELF=.. -DNM=.. -DSTRIP=..
#       [-DTOOLCHAIN=..] [-DLIMIT_KIB=400] [-DSCALAR_ONLY=ON] [-DLAUNCHER=ccache] -P check.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/../install/symbols.cmake)

function(run what)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${what} failed (${result}): ${command}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

if(TOOLCHAIN)
  set(compilers -DCMAKE_TOOLCHAIN_FILE=${TOOLCHAIN})
else()
  set(compilers -DCMAKE_C_COMPILER=${C_COMPILER} -DCMAKE_CXX_COMPILER=${CXX_COMPILER})
endif()
# What the tools need is forbidden, so that a dependency that slips into the runtime fails here and not on a board.
set(forbidden)
foreach(package PNG JPEG ZLIB CLI11 nlohmann_json TinyGLTF Eigen3 GTest)
  list(APPEND forbidden -DCMAKE_DISABLE_FIND_PACKAGE_${package}=ON)
endforeach()
run("configure" ${CMAKE_COMMAND} -G ${GENERATOR} -S ${SOURCE} -B ${WORK} ${compilers} ${forbidden}
    -DCMAKE_BUILD_TYPE=Release -DCMAKE_C_COMPILER_LAUNCHER=${LAUNCHER} -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}
    -DBUILD_SHARED_LIBS=ON -DBURIN_SCALAR_ONLY=${SCALAR_ONLY} -DBURIN_TOOLS=OFF -DBURIN_TESTS=OFF -DBURIN_BENCH=OFF
    -DBURIN_CAPTURE=OFF)
run("build" ${CMAKE_COMMAND} --build ${WORK} --parallel 2)
file(GLOB_RECURSE library ${WORK}/libburin.so)
file(REAL_PATH ${library} library)

check_symbols(${library} ${SOURCE}/include/burin/burin.h)

# libm and the loader are parts of libc, libgcc_s is the part of libstdc++ that a compiler brings.
run("readelf" ${READELF} -d ${library})
string(REGEX MATCHALL "\\(NEEDED\\)[^\n]*\\[[^]\n]*\\]" lines "${output}")
set(needed)
foreach(line IN LISTS lines)
  string(REGEX REPLACE ".*\\[([^]]*)\\]" "\\1" name "${line}")
  if(NOT name MATCHES "^(libc|libm|libstdc\\+\\+|libgcc_s|libhwy|ld-linux[a-z0-9-]*)\\.so(\\.[0-9]+)?$")
    message(FATAL_ERROR "${library} needs ${name}; the runtime may need libc, libstdc++ and Highway alone")
  endif()
  list(APPEND needed ${name})
endforeach()
if(NOT needed)
  message(FATAL_ERROR "${READELF} -d ${library} names no library; mend this test")
endif()

run("strip" ${STRIP} -o ${WORK}/libburin.stripped.so ${library})
file(SIZE ${WORK}/libburin.stripped.so bytes)
math(EXPR kib "(${bytes} + 1023) / 1024")
list(JOIN needed " " needed)
message(STATUS "runtime-only libburin.so: ${bytes} bytes stripped (${kib} KiB), needs ${needed}")
if(LIMIT_KIB AND kib GREATER LIMIT_KIB)
  message(FATAL_ERROR "${kib} KiB stripped; the README promises at most ${LIMIT_KIB} KiB")
endif()
