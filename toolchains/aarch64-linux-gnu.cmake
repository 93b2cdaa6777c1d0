# 64-bit ARM Linux from an x86-64 Debian 12: cmake --preset aarch64, or -DCMAKE_TOOLCHAIN_FILE=toolchains/this file.
# Compiler and emulator are the host's packages, libraries those of Debian arm64 under BURIN_SYSROOT, where
# toolchains/sysroot.sh puts them; ./dev cross aarch64 does both.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(triple aarch64-linux-gnu)
set(CMAKE_C_COMPILER ${triple}-gcc)
set(CMAKE_CXX_COMPILER ${triple}-g++)

set(BURIN_SYSROOT ${CMAKE_CURRENT_LIST_DIR}/../build/sysroot/aarch64 CACHE PATH "Libraries and headers of the target")
cmake_path(ABSOLUTE_PATH BURIN_SYSROOT NORMALIZE OUTPUT_VARIABLE CMAKE_SYSROOT)
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES BURIN_SYSROOT)
set(CMAKE_LIBRARY_ARCHITECTURE ${triple})

# Nothing of the host but programs.
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
foreach(kind LIBRARY INCLUDE PACKAGE)
  set(CMAKE_FIND_ROOT_PATH_MODE_${kind} ONLY)
endforeach()

# pkg-config too, else it finds this machine's.
set(ENV{PKG_CONFIG_LIBDIR} ${CMAKE_SYSROOT}/usr/lib/${triple}/pkgconfig:${CMAKE_SYSROOT}/usr/share/pkgconfig)
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${CMAKE_SYSROOT})

# Tests run through it. QEMU_CPU chooses the model: cortex-a53, cortex-a72 (NEON), max (SVE2 too).
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64 -L ${CMAKE_SYSROOT})
