# Compile options every target of this repository shares. burin_options is linked privately; it is never installed.
if(PROJECT_IS_TOP_LEVEL AND NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()
if(PROJECT_IS_TOP_LEVEL AND NOT DEFINED CMAKE_CXX_COMPILER_LAUNCHER)
  find_program(BURIN_CCACHE ccache)
  if(BURIN_CCACHE)
    set(CMAKE_C_COMPILER_LAUNCHER ${BURIN_CCACHE})
    set(CMAKE_CXX_COMPILER_LAUNCHER ${BURIN_CCACHE})
  endif()
endif()
# Precompiled headers of large libraries halve a first build. ccache keeps nothing that is compiled with them, so where
# it serves they are off, unless the environment (.ci/run) says otherwise.
set(precompile ON)
if(CMAKE_CXX_COMPILER_LAUNCHER)
  set(precompile OFF)
endif()
if(DEFINED ENV{BURIN_PRECOMPILE})
  set(precompile $ENV{BURIN_PRECOMPILE})
endif()
set(BURIN_PRECOMPILE ${precompile} CACHE BOOL "Precompile the headers of large libraries")
# What is not hot compiles in half the time so.
if(BURIN_SANITIZE OR BURIN_FUZZ)
  set(BURIN_COLD_CODE -O0)
else()
  set(BURIN_COLD_CODE $<$<CONFIG:Release>:-O1>)
endif()
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_C_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)

add_library(burin_options INTERFACE)
target_compile_features(burin_options INTERFACE cxx_std_20 c_std_99)
target_compile_options(burin_options INTERFACE
  -Wall -Wextra -Wshadow -Wpointer-arith -Wcast-align -Wvla
  $<$<COMPILE_LANGUAGE:CXX>:-Wnon-virtual-dtor -Woverloaded-virtual>
  $<$<BOOL:${BURIN_WERROR}>:-Werror>
  # Contraction into fused multiply-adds is the one value-changing transform compilers do by default; without it
  # every target computes the same bits (design, promise 3).
  -ffp-contract=off)
if(CMAKE_SIZEOF_VOID_P EQUAL 4)
  # Else offsets in files have 32 bits there, and a store ends at 2 GiB.
  target_compile_definitions(burin_options INTERFACE _FILE_OFFSET_BITS=64)
endif()
if(BURIN_SANITIZE)
  # vptr checks look for run-time types, which the runtime has none of; those of null take a quarter of the time to
  # compile, and a null that is used ends the program anyway.
  target_compile_options(burin_options INTERFACE -fsanitize=${BURIN_SANITIZE} -fno-sanitize=vptr,null -fno-omit-frame-pointer -fno-sanitize-recover=all
    # GCC says of itself that sanitizers give this warning false positives (here: inside <regex> and <functional>).
    $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  target_link_options(burin_options INTERFACE -fsanitize=${BURIN_SANITIZE})
endif()
if(BURIN_FUZZ)
  target_compile_options(burin_options INTERFACE -fsanitize=fuzzer-no-link)
  target_link_options(burin_options INTERFACE -fsanitize=fuzzer-no-link)
endif()

# A C program that links the static form needs the C++ library by name; no C linker adds it.
set(BURIN_CXX_LIBRARIES)
foreach(library IN LISTS CMAKE_CXX_IMPLICIT_LINK_LIBRARIES)
  if(library MATCHES "^(stdc\\+\\+|c\\+\\+|m)$" AND NOT library IN_LIST BURIN_CXX_LIBRARIES)
    list(APPEND BURIN_CXX_LIBRARIES ${library})
  endif()
endforeach()

# The runtime neither throws nor asks for types at run time; tools may, since their libraries do.
add_library(burin_runtime_options INTERFACE)
target_link_libraries(burin_runtime_options INTERFACE burin_options)
target_compile_options(burin_runtime_options INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-fno-exceptions -fno-rtti>)
